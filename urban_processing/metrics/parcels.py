"""Measures of single parcels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.access_rule import reached_frontage
from urban_processing.fabric.model import ParcelRings
from urban_processing.fabric.of_layout import layout_rings, street_rings
from urban_processing.layout import Layout
from urban_processing.mesh.corners import (
    interior_angles,
    polygon_irregularity,
    reported_polygons,
    ring_neighbours,
)
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.thinness import inscribed_thinness

OPPOSITE_DEG = 135.0
"""Sides are opposite where their outward normals make a larger angle."""

UNDESIRABLE_ANGLE_DEG = 15.0
UNDESIRABLE_AREA_RATIO = 1.2
"""Parcels above one of these are undesirable (Yang 2013, section 7)."""


@dataclass(frozen=True, eq=False)
class ParcelMeasures:
    """Measures of F parcels; angles in degrees, lengths in metres.

    Parameters
    ----------
    area
        (F,) area to the centreline of streets, m².
    corners, corner_offsets, corner_xy
        Ragged corners of the reported approximate polygons as vertices of the parcels' rings,
        and their coordinates.
    corner_angle
        (C,) interior angle at each corner.
    sides
        (F,) number of sides of the reported polygon.
    irregularity
        (F,) Chen 2024, Eq. 1.
    frontage
        (F,) length of the boundary on street edges.
    width, depth
        (F,) extent of the parcel along and across its *street side*: of the sides of the
        reported polygon the one with the longest frontage. NaN without frontage.
    thinness
        (F,) diameter of the largest inscribed circle over √area, within about 1 %.
    angle_deviation
        (F,) mean of abs(interior angle - 90°) over the corners (Yang 2013, p_angle).
    area_ratio
        (F,) area of the minimum rotated rectangle over the parcel's (Yang 2013, p_area).
    rim
        (F,) parcels with an edge on the land's rim or on a hole.
    reached
        (F,) parcels whose frontage is at least `reached_frontage`.
    through
        (F,) through lots: two opposite sides have at least `reached_frontage` each.
    """

    area: FloatArray
    corners: IntArray
    corner_offsets: IntArray
    corner_xy: FloatArray
    corner_angle: FloatArray
    sides: IntArray
    irregularity: FloatArray
    frontage: FloatArray
    width: FloatArray
    depth: FloatArray
    thinness: FloatArray
    angle_deviation: FloatArray
    area_ratio: FloatArray
    rim: BoolArray
    reached: BoolArray
    through: BoolArray

    @property
    def undesirable(self) -> BoolArray:
        """(F,) parcels that Yang 2013 calls undesirable."""
        return np.asarray(
            (self.angle_deviation > UNDESIRABLE_ANGLE_DEG)
            | (self.area_ratio > UNDESIRABLE_AREA_RATIO)
        )


def measure_parcels(layout: Layout) -> ParcelMeasures:
    """Measure every parcel of a layout."""
    return measure_rings(layout_rings(layout))


def measure_rings(rings: ParcelRings) -> ParcelMeasures:
    """Measure parcels; nothing is looped over in Python."""
    side = _sides(rings.xy, rings.offsets, rings.on_street)
    angle = np.degrees(interior_angles(side.corner_xy, side.corner_offsets))
    deviation = np.add.reduceat(np.abs(angle - 90.0), side.corner_offsets[:-1])
    count = np.diff(side.corner_offsets)
    width, depth = _extents(rings.xy, rings.offsets, side)
    enough = reached_frontage(rings.area)
    boxes = shapely.minimum_rotated_rectangle(rings.polygons)
    return ParcelMeasures(
        area=rings.area,
        corners=side.corners,
        corner_offsets=side.corner_offsets,
        corner_xy=side.corner_xy,
        corner_angle=angle,
        sides=count,
        irregularity=polygon_irregularity(side.corner_xy, side.corner_offsets),
        frontage=rings.frontage,
        width=width,
        depth=depth,
        thinness=inscribed_thinness(rings.polygons, rings.area),
        angle_deviation=deviation / count,
        area_ratio=shapely.area(boxes) / rings.area,
        rim=rings.rim,
        reached=rings.frontage >= enough,
        through=_through_lots(side, enough),
    )


def box_sides(polygons: npt.NDArray[np.object_]) -> FloatArray:
    """Return the (n, 2) shorter and longer sides of the smallest rotated rectangles around."""
    boxes = shapely.minimum_rotated_rectangle(polygons)
    corners = shapely.get_coordinates(boxes).reshape(-1, 5, 2)[:, :3]
    sides = np.hypot(*np.moveaxis(np.diff(corners, axis=1), 2, 0))
    return np.asarray(np.sort(sides, axis=1))


def width_and_depth(layout: Layout) -> tuple[FloatArray, FloatArray]:
    """Width and depth of every parcel, as `ParcelMeasures` has them, without the rest of it."""
    xy, offsets, on_street = street_rings(layout)
    return _extents(xy, offsets, _sides(xy, offsets, on_street))


@dataclass(frozen=True, eq=False)
class _Sides:
    """Sides of the reported polygons, each with its frontage; C corners."""

    corners: IntArray
    corner_offsets: IntArray
    corner_xy: FloatArray
    frontage: FloatArray


def _sides(xy: FloatArray, offsets: IntArray, on_street: FloatArray) -> _Sides:
    corners, corner_offsets = reported_polygons(xy, offsets)
    frontage = _frontage_of_sides(on_street, offsets, corners, corner_offsets)
    return _Sides(corners, corner_offsets, xy[corners], frontage)


def _frontage_of_sides(
    on_street: FloatArray, offsets: IntArray, corners: IntArray, corner_offsets: IntArray
) -> FloatArray:
    """(C,) street length along the side that each corner of a reported polygon begins."""
    at = np.searchsorted(corners, np.arange(len(on_street)), side="right") - 1
    size = np.diff(offsets)
    before_first = at < np.repeat(corner_offsets[:-1], size)
    at = np.where(before_first, np.repeat(corner_offsets[1:] - 1, size), at)
    length = np.bincount(at, weights=on_street, minlength=len(corners))
    return np.asarray(length, dtype=np.float64)


def _extents(xy: FloatArray, offsets: IntArray, sides: _Sides) -> tuple[FloatArray, FloatArray]:
    """Extents along and across the side with the longest frontage."""
    corner_xy, corner_offsets, side_frontage = sides.corner_xy, sides.corner_offsets, sides.frontage
    _, after = ring_neighbours(corner_offsets)
    longest = np.maximum.reduceat(side_frontage, corner_offsets[:-1])
    hit = np.flatnonzero(side_frontage == np.repeat(longest, np.diff(corner_offsets)))
    _, first = np.unique(np.searchsorted(corner_offsets, hit, side="right"), return_index=True)
    side = hit[first]
    direction = corner_xy[after[side]] - corner_xy[side]
    direction = direction / np.hypot(direction[:, 0], direction[:, 1])[:, None]
    d = np.repeat(direction, np.diff(offsets), axis=0)
    local = xy - np.repeat(xy[offsets[:-1]], np.diff(offsets), axis=0)
    along = local[:, 0] * d[:, 0] + local[:, 1] * d[:, 1]
    across = local[:, 1] * d[:, 0] - local[:, 0] * d[:, 1]
    has = longest > 0.0
    return (
        np.where(has, _extent(along, offsets), np.nan),
        np.where(has, _extent(across, offsets), np.nan),
    )


def _extent(values: FloatArray, offsets: IntArray) -> FloatArray:
    starts = offsets[:-1]
    return np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts)


def _through_lots(sides: _Sides, enough: FloatArray) -> BoolArray:
    """(F,) whether two sides that face opposite ways and do not touch have frontage."""
    corner_xy, corner_offsets, side_frontage = sides.corner_xy, sides.corner_offsets, sides.frontage
    _, after = ring_neighbours(corner_offsets)
    size = np.diff(corner_offsets)
    parcel = np.repeat(np.arange(len(size)), size)
    d = corner_xy[after] - corner_xy
    z = d[:, 0] + 1j * d[:, 1]
    fronting = np.flatnonzero(side_frontage >= enough[parcel])
    owner = parcel[fronting]
    beyond = np.searchsorted(owner, owner, side="right") - np.arange(len(owner)) - 1
    i = np.repeat(np.arange(len(owner)), beyond)
    j = i + 1 + np.arange(len(i)) - np.repeat(np.cumsum(beyond) - beyond, beyond)
    a, b = fronting[i], fronting[j]
    turned = np.abs(np.degrees(np.angle(z[b] * np.conj(z[a]))))
    touching = (after[a] == b) | (after[b] == a)
    out = np.zeros(len(size), dtype=bool)
    out[parcel[a[(turned > OPPOSITE_DEG) & ~touching]]] = True
    return out
