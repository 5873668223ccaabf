"""Classes of streets, how wide each is, and how rights-of-way are laid out."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Self


class StreetClass(enum.StrEnum):
    """Class of a network edge, from the highest to the lowest."""

    RIM = "rim"
    FIXED = "fixed"
    COLLECTOR = "collector"
    LOCAL = "local"
    CUL_DE_SAC = "cul_de_sac"


@dataclass(frozen=True, kw_only=True)
class StreetRules:
    """What a layout's streets are to be, besides where they run; lengths in metres.

    Parameters
    ----------
    rim, fixed, collector, local, cul_de_sac
        Nominal width of the right-of-way of each `StreetClass`, from side to side. Streets on
        the rim of the land take only their inner half from it.
    corner_radius
        Radius that rounds the corners of blocks at junctions.
    turning_radius
        Radius of the turning heads at dead ends; 0 for none.
    laid_out
        Whether rights-of-way are cut out of the parcels.
    net_min_area
        Whether the smallest parcel allowed is a net area, less right-of-way.
    """

    rim: float = 16.0
    fixed: float = 16.0
    collector: float = 16.0
    local: float = 12.0
    cul_de_sac: float = 10.0
    corner_radius: float = 6.0
    turning_radius: float = 9.0
    laid_out: bool = False
    net_min_area: bool = False

    @property
    def width_m(self) -> Mapping[str, float]:
        """Nominal width by class."""
        return MappingProxyType({c.value: float(getattr(self, c.value)) for c in StreetClass})

    def as_dict(self) -> dict[str, Any]:
        """Return the rules as plain JSON types."""
        return dataclasses.asdict(self)

    @classmethod
    def from_dict(cls, values: Mapping[str, Any]) -> Self:
        """Return the rules that `as_dict` gave; what is not there is as by default."""
        known = {field.name for field in dataclasses.fields(cls)}
        return cls(**{name: value for name, value in values.items() if name in known})


CLASS_WIDTHS: Mapping[str, float] = MappingProxyType(
    {
        "motorway": 40.0,
        "trunk": 32.0,
        "primary": 24.0,
        "secondary": 20.0,
        "tertiary": 16.0,
        "motorway_link": 12.0,
        "trunk_link": 12.0,
        "primary_link": 12.0,
        "secondary_link": 12.0,
        "tertiary_link": 12.0,
        "busway": 12.0,
        **StreetRules().width_m,
        "unclassified": 12.0,
        "residential": 12.0,
        "road": 12.0,
        "living_street": 9.0,
        "service": 8.0,
        "track": 6.0,
        "pedestrian": 8.0,
        "cycleway": 4.0,
        "bridleway": 4.0,
        "footway": 3.0,
        "path": 3.0,
        "steps": 3.0,
    }
)
"""Width in metres of the right-of-way by class, from the highest class to the lowest: those of
layouts and the values of OpenStreetMap's ``highway``."""

FOOTPATHS: frozenset[str] = frozenset({"cycleway", "bridleway", "footway", "path", "steps"})
"""Classes that no vehicle uses: no parcel is reached by them alone."""

NO_STREETS: frozenset[str] = frozenset(
    {
        "abandoned", "bus_guideway", "bus_stop", "construction", "corridor", "crossing",
        "disused", "elevator", "emergency_bay", "escape", "planned", "platform", "proposed",
        "raceway", "razed", "rest_area", "services", "street_lamp",
    }
)  # fmt: skip
"""Values of ``highway`` that are no streets."""

OSM_KEYS: tuple[str, ...] = (
    "aerialway",
    "barrier",
    "man_made",
    "other_tags",
    "power",
    "railway",
    "waterway",
)
"""Columns that tell that a layer has all lines of OpenStreetMap: other things that lines are, and
what GDAL calls the rest of their tags."""

VERGES = 6.0
"""Metres that pavements and verges add to the carriageway of OpenStreetMap's ``width``."""

LANE_WIDTH = 3.25
"""Metres of carriageway that one of OpenStreetMap's ``lanes`` takes."""

LEAST_LANE = 2.75
"""Metres of carriageway that a lane has at least: two cars pass each other on 5.5 m (RASt 06)."""

LEAST_CARRIAGEWAY = 2.0
"""Metres that are left at least between the verges of a street, or it has none."""


@dataclass(frozen=True, kw_only=True)
class Traffic:
    """What a value of OpenStreetMap's ``highway`` means for traffic in a built-up area.

    Parameters
    ----------
    speed
        Speed in km/h: the limit, or on footpaths that of those who use them.
    lanes
        Lanes that such a street has at most, both directions together.
    priority
        Who gives way at a junction: the lower number does.
    users
        Whom a way is for, in the words of SUMO; empty for a street that all may use.
    """

    speed: float
    lanes: int = 2
    priority: int = 1
    users: str = ""


_WALKING, _CYCLING = "pedestrian", "pedestrian bicycle"

TRAFFIC: Mapping[str, Traffic] = MappingProxyType(
    {
        "motorway": Traffic(speed=100, lanes=4, priority=14),
        "trunk": Traffic(speed=80, lanes=4, priority=13),
        "primary": Traffic(speed=50, lanes=4, priority=12),
        "secondary": Traffic(speed=50, priority=11),
        "tertiary": Traffic(speed=50, priority=10),
        "motorway_link": Traffic(speed=60, priority=9),
        "trunk_link": Traffic(speed=60, priority=8),
        "primary_link": Traffic(speed=50, priority=7),
        "secondary_link": Traffic(speed=50, priority=6),
        "tertiary_link": Traffic(speed=50, priority=5),
        "busway": Traffic(speed=50, users="bus"),
        "unclassified": Traffic(speed=50, priority=4),
        "residential": Traffic(speed=30, priority=3),
        "road": Traffic(speed=50, priority=3),
        "living_street": Traffic(speed=20, priority=2),
        "service": Traffic(speed=20),
        "track": Traffic(speed=20),
        "pedestrian": Traffic(speed=5, users=_CYCLING),
        "cycleway": Traffic(speed=20, users=_CYCLING),
        "bridleway": Traffic(speed=10, users=_WALKING),
        "footway": Traffic(speed=5, users=_WALKING),
        "path": Traffic(speed=5, users=_CYCLING),
        "steps": Traffic(speed=5, users=_WALKING),
    }
)
"""Traffic by value of ``highway``. Speeds: 50 km/h is the general limit in built-up areas in most
countries; 30 km/h is what the Stockholm Declaration on road safety (2020, resolution 11) asks for
where people live. Priorities are those of SUMO's own table for OpenStreetMap."""

HIGHWAYS: Mapping[str, str] = MappingProxyType(
    {
        StreetClass.RIM.value: "unclassified",
        StreetClass.FIXED.value: "unclassified",
        StreetClass.COLLECTOR.value: "tertiary",
        StreetClass.LOCAL.value: "residential",
        StreetClass.CUL_DE_SAC.value: "residential",
        **{value: value for value in TRAFFIC},
    }
)
"""Value of ``highway`` by class of a street: those of layouts, and those that are such values."""

ANY_HIGHWAY = "unclassified"
"""Value of ``highway`` of a street of any other class."""

OWN_TAGS = "urban_processing:"
"""What the keys of tags begin with that are this library's, not OpenStreetMap's."""
