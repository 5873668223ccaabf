"""Ways of OpenStreetMap that are streets for vehicles, and which these are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.intake.osm_lines import HIGHWAY
from urban_processing.intake.street_lines import LANES, OFF_GROUND
from urban_processing.street_rules import CLASS_WIDTHS, FOOTPATHS, NO_STREETS, StreetClass

NAME, WIDTH = "name", "width"

KEPT_TAGS: tuple[str, ...] = (HIGHWAY, NAME, LANES, WIDTH, *OFF_GROUND)
"""Tags of a street that are handed on."""

TAGS: tuple[str, ...] = (
    *KEPT_TAGS,
    "area",
    "access",
    "motor_vehicle",
    "motorcar",
    "service",
)
"""Tags of a way that are read."""

SERVICE_CLASSES: frozenset[str] = frozenset({"service", "track"})
"""Classes of ways that serve single buildings or fields: streets only where one asks for them."""

MOTORWAYS: frozenset[str] = frozenset({"motorway", "motorway_link"})
"""Classes that run apart from all others, above or below them."""

CLASSES: tuple[str, ...] = tuple(
    name
    for name in CLASS_WIDTHS
    if name not in FOOTPATHS | NO_STREETS | {"pedestrian"} | set(StreetClass)
)
"""Values of ``highway`` that are streets for vehicles, from the highest class to the lowest."""

_BARRED: Mapping[str, frozenset[str]] = {
    "area": frozenset({"yes"}),
    "access": frozenset({"private"}),
    "motor_vehicle": frozenset({"no"}),
    "motorcar": frozenset({"no"}),
    "service": frozenset({"emergency_access", "parking", "parking_aisle", "private"}),
}
"""Values that tell that a way is no public street for cars: those of OSMnx's networks to drive."""


@dataclass(frozen=True, eq=False)
class OsmWays:
    """Ways with a ``highway``.

    Parameters
    ----------
    lines
        (n,) LineStrings in degrees of longitude and latitude (WGS 84).
    tags
        (n,) values of each of `TAGS` by name, empty where there is none.
    broken
        How many ways name nodes that the file lacks; they end before the gap and go on after it.
    """

    lines: npt.NDArray[np.object_]
    tags: Mapping[str, npt.NDArray[np.object_]]
    broken: int = 0

    def __len__(self) -> int:
        """Return the number of lines."""
        return len(self.lines)

    def take(self, rows: npt.NDArray[np.bool_] | npt.NDArray[np.int64]) -> OsmWays:
        """Return some of the ways."""
        tags = {name: values[rows] for name, values in self.tags.items()}
        return OsmWays(self.lines[rows], tags, self.broken)

    def near(self, bounds: tuple[float, float, float, float]) -> OsmWays:
        """Return the ways whose own bounds meet some bounds (west, south, east, north)."""
        west, south, east, north = shapely.bounds(self.lines).reshape(-1, 4).T
        meets = (east >= bounds[0]) & (west <= bounds[2])
        meets &= (north >= bounds[1]) & (south <= bounds[3])
        return self.take(meets)

    @property
    def bounds(self) -> tuple[float, float, float, float]:
        """West, south, east and north in degrees."""
        west, south, east, north = shapely.total_bounds(self.lines).tolist()
        return west, south, east, north


def ways_of(
    lines: Sequence[shapely.LineString], tags: Sequence[Mapping[str, Any]], broken: int = 0
) -> OsmWays:
    """Return ways from one line and one mapping of tags each."""
    known = {name: objects([values.get(name) or "" for values in tags]) for name in TAGS}
    return OsmWays(objects(lines), known, broken)


def objects(items: Sequence[Any]) -> npt.NDArray[np.object_]:
    """Return an array of things as they are, whatever numpy would make of them."""
    out = np.empty(len(items), dtype=object)
    out[:] = items
    return out


def are_streets(ways: OsmWays, *, service: bool) -> npt.NDArray[np.bool_]:
    """(n,) whether ways are streets for vehicles.

    They are the classes of `CLASSES`, less areas and what is private or closed to cars, which
    OSMnx's networks to drive leave out, too.

    Parameters
    ----------
    ways
        Any ways.
    service
        Whether service ways and tracks count.
    """
    known = [name for name in CLASSES if service or name not in SERVICE_CLASSES]
    out = np.isin(ways.tags[HIGHWAY].astype(str), known)
    for tag, values in _BARRED.items():
        out &= ~np.isin(ways.tags[tag].astype(str), sorted(values))
    return out


def overpass_filter(*, service: bool) -> str:
    """Return the filter of `are_streets` as OpenStreetMap's Overpass servers understand it."""
    known = [name for name in CLASSES if service or name not in SERVICE_CLASSES]
    barred = (f'["{tag}"!~"^({"|".join(sorted(v))})$"]' for tag, v in _BARRED.items())
    return f'["{HIGHWAY}"~"^({"|".join(known)})$"]' + "".join(barred)
