"""The land that a layout is made on: polygons in a projected frame, ready for the engine."""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely

DEGREE_DIGITS = 9
"""Digits after the point of degrees in files: 0.1 mm, so that neighbours still fit together."""

GRID = 2.0**-20
"""Spacing in metres of the grid that all coordinates are kept on, relative to a whole-metre
origin, so that shifting to map coordinates and back loses nothing."""

FINE_GRID = 2.0**-28
"""Spacing in metres of the grid that points added by subdivision are kept on. On the grid of all
other coordinates, 256 times as coarse, a point on the edge of a block would lie so far beside
it that areas of a small block's parcels no longer add up to 1e-9 of its own. Coordinates on
it, too, are shifted to the map and back without loss."""

AREA_ROUNDING = 1e-9
"""Share by which rounding may take an area below the smallest one allowed."""

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Frame:
    """Where the engine's local coordinates lie on the map.

    Parameters
    ----------
    crs
        The projected, metric CRS as text (authority code such as ``EPSG:32630``, or WKT).
    origin
        Whole metres in that CRS; map = local + origin.
    """

    crs: str = ""
    origin: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class Issue:
    """Something that could not be done, or that the user should know, at a place.

    `geometry` is in the frame's local coordinates; `parcel_id` is empty where no single
    parcel is meant.
    """

    code: str
    message: str
    part: int | None = None
    parcel_id: int | None = None
    value: float | None = None
    limit: float | None = None
    geometry: shapely.Geometry | None = None


@dataclass(frozen=True)
class FixedStreet:
    """A street that the user gives: its line in local metres, and what is known of it.

    `street_class` is empty and `width` NaN where the user says nothing.
    """

    line: shapely.LineString
    street_class: str = ""
    width: float = math.nan


@dataclass(frozen=True)
class LockedLand:
    """Land that stays one parcel, such as an estate that is there already."""

    polygon: shapely.Polygon
    land_use: str = "locked"


@dataclass(frozen=True)
class Site:
    """The land, validated and in local metres.

    Parameters
    ----------
    parts
        Valid polygons (shell counter-clockwise, holes clockwise, on the 2^-20 m grid) that
        do not overlap, largest first; part `i` of a layout is ``parts[i]``.
    frame
        The map frame of the local coordinates.
    corners
        (k, 2) local coordinates of corners given by the user for a freeform land; empty
        where corners are to be found by the engine.
    rim_is_street
        Whether the outer rings are streets (Chen 2024, section 3: the default).
    input_parts
        The polygons as given, before repair and simplification, in local coordinates.
    issues
        What reading and repairing the boundary has to say.
    input_sha256
        Hash of the input, for provenance.
    obstacles
        Valid polygons that no cut and no street crosses: they are no land.
    locked
        Land that is not cut.
    fixed_streets
        Streets that belong to the network from the start.
    rim_lines
        Lines along the outer rings that say which part of the rim is street, or is not.
    entries
        (k, 2) places on the rim where the network meets the outside.
    """

    parts: tuple[shapely.Polygon, ...]
    frame: Frame = Frame()
    corners: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    rim_is_street: bool = True
    input_parts: tuple[shapely.Polygon, ...] = ()
    issues: tuple[Issue, ...] = ()
    input_sha256: str = ""
    obstacles: tuple[shapely.Polygon, ...] = ()
    locked: tuple[LockedLand, ...] = ()
    fixed_streets: tuple[FixedStreet, ...] = ()
    rim_lines: tuple[shapely.LineString, ...] = ()
    entries: FloatArray = field(default_factory=lambda: np.empty((0, 2)))

    @property
    def area(self) -> float:
        """Area of the land in m²."""
        return float(sum(p.area for p in self.parts))


def snap_to_grid(xy: npt.ArrayLike) -> FloatArray:
    """Round local coordinates to the 2^-20 m grid."""
    return np.round(np.asarray(xy, dtype=np.float64) / GRID) * GRID
