"""The one declaration of the tags in files of OpenStreetMap; the documentation reads it, too."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Generic, TypeVar

from urban_processing.layout import PARCEL_USE
from urban_processing.network_files.markup import plain_text
from urban_processing.network_files.streets import Street
from urban_processing.street_rules import OWN_TAGS

T = TypeVar("T")

LONGEST = 255
"""Characters that OpenStreetMap allows in a value."""

LAND_USES: frozenset[str] = frozenset(
    {
        "allotments", "brownfield", "cemetery", "commercial", "construction", "education",
        "farmland", "farmyard", "flowerbed", "forest", "garages", "grass", "greenfield",
        "greenhouse_horticulture", "industrial", "institutional", "landfill", "meadow",
        "military", "orchard", "plant_nursery", "quarry", "railway", "recreation_ground",
        "religious", "residential", "retail", "village_green", "vineyard",
    }
)  # fmt: skip
"""Values of ``landuse`` that are in wide use."""


@dataclass(frozen=True)
class Parcel:
    """A parcel: its number and its use."""

    parcel_id: int
    land_use: str


@dataclass(frozen=True)
class DeadEnd:
    """A street end inside the land: the diameter of its turning head in metres, None for none."""

    turning_head: float | None


@dataclass(frozen=True)
class Tag(Generic[T]):
    """A tag: its key, its value for an object (None for no such tag), and what it means."""

    key: str
    value: Callable[[T], str | None]
    meaning: str


STREET_TAGS: tuple[Tag[Street], ...] = (
    Tag("highway", lambda s: s.highway, "Class of the street, by the table of classes."),
    Tag(
        "width",
        lambda s: _number(s.carriageway),
        "Width of the carriageway in metres: that of the right-of-way less verges and pavements.",
    ),
    Tag("lanes", lambda s: _number(s.lanes), "Lanes of both directions together."),
    Tag(
        "maxspeed",
        lambda s: None if s.traffic.users else _number(s.traffic.speed),
        "Speed limit in km/h, by the table of classes; none on footpaths.",
    ),
    Tag("oneway", lambda _: "no", "Always no: streets are for both directions."),
    Tag(f"{OWN_TAGS}class", lambda s: s.street_class, "Class in the layer of streets."),
    Tag(f"{OWN_TAGS}width_m", lambda s: _number(s.width), "Width of the right-of-way in metres."),
    Tag(f"{OWN_TAGS}edge_id", lambda s: str(s.edge_id), "Number of the network edge."),
    Tag(f"{OWN_TAGS}street_id", lambda s: str(s.street_id), "Number of the street."),
)

DEAD_END_TAGS: tuple[Tag[DeadEnd], ...] = (
    Tag("noexit", lambda _: "yes", "The street ends here."),
    Tag(
        "highway",
        lambda end: None if end.turning_head is None else "turning_circle",
        "turning_circle where rights-of-way have a turning head.",
    ),
    Tag("diameter", lambda end: _number(end.turning_head), "Diameter of the turning head."),
)

PARCEL_TAGS: tuple[Tag[Parcel], ...] = (
    Tag("boundary", lambda _: "lot", "Always lot: land of one owner."),
    Tag("ref", lambda p: str(p.parcel_id), "Number of the parcel."),
    Tag(
        "landuse",
        lambda p: p.land_use if p.land_use in LAND_USES else None,
        "Use of the parcel, where it is one that OpenStreetMap knows.",
    ),
    Tag(
        f"{OWN_TAGS}land_use",
        lambda p: None if p.land_use == PARCEL_USE else p.land_use,
        f"Use of the parcel, unless it is {PARCEL_USE}.",
    ),
)


def tags_of(item: T, declared: Sequence[Tag[T]]) -> list[tuple[str, str]]:
    """Return the keys and values of an object, as a file may hold them."""
    values = [(tag.key, tag.value(item)) for tag in declared]
    return [(key, plain_text(value)[:LONGEST]) for key, value in values if value]


def _number(value: float | None) -> str | None:
    return None if value is None else f"{value:.10g}"
