"""Values of edits as people and files give them, checked and brought into one form."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from typing import Any, TypeVar

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.params.optimize import LARGEST_SNAP

WIDEST_STREET = 1000.0
"""No right-of-way is wider than this, in metres."""

LONGEST_USE = 100
"""Letters that the name of a land use has at most."""

LARGEST = 1e9
"""No distance on the map is as large, in metres."""

MIN_RING = 3
"""Places that a ring has at least."""

V = TypeVar("V")
Place = tuple[float, float]
Rings = tuple[tuple[Place, ...], ...]
"""The shell of a polygon, and its holes."""


def whole(value: Any) -> int:
    """A whole number."""
    if isinstance(value, bool) or not isinstance(value, int | np.integer):
        raise EditError(f"must be a whole number; it is {value!r}.")
    return int(value)


def number_or_none(value: Any) -> float | None:
    """A number of metres, not negative, or nothing."""
    return None if value is None else number(value)


def number(value: Any) -> float:
    """A number of metres, not negative."""
    known = isinstance(value, int | float | np.number) and not isinstance(value, bool)
    if not known or not 0 <= value <= LARGEST:
        raise EditError(f"must be a number of metres, 0 or more; it is {value!r}.")
    return float(value)


def tolerance(value: Any) -> float:
    """A number of metres within which edited layers are fitted together."""
    metres = number(value)
    if metres > LARGEST_SNAP:
        raise EditError(f"must be at most {LARGEST_SNAP:g} m; it is {metres:g}.")
    return metres


def street_width(value: Any) -> float | None:
    """Width of a right-of-way in metres, or nothing."""
    width = number_or_none(value)
    if width is not None and width > WIDEST_STREET:
        raise EditError(f"must be at most {WIDEST_STREET:g} m; it is {width:g}.")
    return width


def land_use(value: Any) -> str:
    """A land use: one short line."""
    use = text(value).strip()
    if not use:
        raise EditError("must name a use, such as park; it is empty.")
    if len(use) > LONGEST_USE or not use.isprintable():
        raise EditError(f"must be one line of at most {LONGEST_USE} letters.")
    return use


def land_use_or_none(value: Any) -> str | None:
    """A land use, or nothing."""
    return None if value is None else land_use(value)


def named(what: str, reader: Callable[[Any], V], value: Any) -> V:
    """Read a value; what is wrong with it is said with its name."""
    try:
        return reader(value)
    except EditError as error:
        raise EditError(f"{what} {problem}" for problem in error.problems) from error


def text(value: Any) -> str:
    """A text."""
    if not isinstance(value, str):
        raise EditError(f"must be a text; it is {value!r}.")
    return value


def flag(value: Any) -> bool:
    """True or false."""
    if not isinstance(value, bool | np.bool_):
        raise EditError(f"must be true or false; it is {value!r}.")
    return bool(value)


def place(value: Any) -> Place:
    """Two coordinates."""
    xy = _coordinates(value)
    if xy.shape != (2,):
        raise EditError(f"must be two coordinates, x and y; it is {value!r}.")
    return float(xy[0]), float(xy[1])


def points(value: Any) -> tuple[Place, ...]:
    """A line: two points or more, or a geometry that has them."""
    xy = _coordinates(value)
    if xy.ndim != 2 or xy.shape[1] != 2 or len(xy) < 2:
        raise EditError("must be a line of at least two points, each with x and y.")
    return tuple((float(x), float(y)) for x, y in xy)


def lines(value: Any) -> tuple[tuple[Place, ...], ...]:
    """Several lines, of which those in parts are several."""
    return tuple(points(part) for each in _several(value) for part in _parts(each))


def polygons(value: Any) -> tuple[Rings, ...]:
    """Several polygons: their rings, or geometries."""
    return tuple(_rings(part) for each in _several(value) for part in _parts(each))


def _rings(value: Any) -> Rings:
    if isinstance(value, shapely.Polygon):
        value = [value.exterior, *value.interiors]
    rings = tuple(points(ring) for ring in _several(value))
    if not rings or any(len(ring) < MIN_RING for ring in rings):
        raise EditError("must be polygons: rings of at least three places each.")
    return rings


def _parts(value: Any) -> list[Any]:
    if not isinstance(value, shapely.Geometry):
        return [value]
    return [part for part in shapely.get_parts(shapely.force_2d(value)) if not part.is_empty]


def _several(value: Any) -> Iterable[Any]:
    value = getattr(value, "geometry", value)  # a GeoDataFrame is that of its geometries
    if isinstance(value, str | bytes) or not isinstance(value, Iterable):
        raise EditError(f"must be a list; it is {value!r}.")
    return value


def parcel(value: Any) -> int | Place:
    """The number of a parcel, or a place in it."""
    if isinstance(value, bool | str) or value is None:
        raise EditError(f"must be the number of a parcel or a place in it; it is {value!r}.")
    return whole(value) if isinstance(value, int | np.integer) else place(value)


def parcels(value: Any) -> tuple[int | Place, ...]:
    """Several parcels."""
    if isinstance(value, str) or not isinstance(value, Sequence | np.ndarray):
        raise EditError(f"must be a list of parcels; it is {value!r}.")
    return tuple(parcel(each) for each in value)


def _coordinates(value: Any) -> np.ndarray:
    """(2,) coordinates of a place, or (n, 2) of a line; heights of geometries are left out."""
    if isinstance(value, shapely.Geometry):
        if value.geom_type not in ("Point", "LineString", "LinearRing"):
            raise EditError(f"must be a place or a line; it is a {value.geom_type}.")
        xy = shapely.get_coordinates(value)
        return np.asarray(xy[0] if value.geom_type == "Point" and len(xy) else xy)
    try:
        xy = np.asarray(list(value), dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        xy = np.full(1, math.nan)
    if not (np.abs(xy) <= LARGEST).all():  # nor are they where they are no numbers
        raise EditError("must be coordinates of the map, in numbers.")
    return np.asarray(xy)
