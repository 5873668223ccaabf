"""Smallest boxes around many polygons at once, aligned with one of their edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.rings import Rings, changes, ranges, starts

EQUAL_AREA = 1e-3
"""Boxes whose areas differ by less than this share count as equally large."""

EQUAL_SIDES = 1e-6
"""Sides of boxes that differ by less than this share count as equally long."""

MANY_VERTICES = 24
"""From so many vertices on extents are those of the convex hull, which are the same."""

LEAST_EDGE = 1e-5
"""Edges shorter than this, in metres, have no direction."""

UPWARD = np.array([0.515038, 0.857167])
"""Of the two directions of an axis the one along this is taken, 59° from the x-axis: blocks
that lie along the axes of the map are far from where an axis turns over."""


@dataclass(frozen=True, eq=False)
class Boxes:
    """K boxes.

    Parameters
    ----------
    centre
        (K, 2) middle of the box.
    axis
        (K, 2) direction of the side `length`, a unit vector along `UPWARD`.
    length, width
        (K,) sides in metres, along `axis` and across it.
    """

    centre: FloatArray
    axis: FloatArray
    length: FloatArray
    width: FloatArray

    def take(self, rows: IntArray) -> Boxes:
        """Return some of the boxes."""
        return Boxes(self.centre[rows], self.axis[rows], self.length[rows], self.width[rows])

    def turned(self, rows: BoolArray) -> Boxes:
        """Return the boxes, in `rows` with their axis along the other side."""
        across = np.empty_like(self.axis)
        across[:, 0], across[:, 1] = -self.axis[:, 1], self.axis[:, 0]
        across[across @ UPWARD < 0.0] *= -1.0
        return Boxes(
            centre=self.centre,
            axis=np.where(rows[:, None], across, self.axis),
            length=np.where(rows, self.width, self.length),
            width=np.where(rows, self.length, self.width),
        )


def smallest_boxes(rings: Rings, xy: FloatArray) -> Boxes:
    """Return the box of smallest area around each face (Vanegas 2012, section 4.3).

    Boxes lie along an edge of the face. Among those of equal area
    (`EQUAL_AREA`) the longest is taken, among those of equal sides the one whose direction
    comes first from the x-axis on: a triangle stands on its longest side, and which vertex a
    ring begins with does not matter. The axis lies along the longer side; where both are equal
    along the side that comes first from the x-axis on.
    """
    shell = rings.face_rings[:-1]
    size = rings.size[shell]
    edges = xy[rings.vertex[ranges(rings.offsets[shell], size)]]
    first = starts(size)
    origin = edges[first[:-1]]
    edges -= origin.repeat(size, axis=0)
    found = _best_directions(edges, first, _outlines(edges, first))
    turned = found.turned(found.length < found.width * (1.0 - EQUAL_SIDES))
    return Boxes(turned.centre + origin, turned.axis, turned.length, turned.width)


def _outlines(corners: FloatArray, first: IntArray) -> tuple[FloatArray, IntArray]:
    """Corners of the rings, or of their convex hulls where they are many, and their starts."""
    size = first[1:] - first[:-1]
    many = (size > MANY_VERTICES).nonzero()[0]
    if not len(many):
        return corners, first
    points = corners[ranges(first[many], size[many])]
    of = np.repeat(np.arange(len(many)), size[many])
    hulls = shapely.convex_hull(shapely.multipoints(shapely.points(points), indices=of))
    hull_xy, hull = shapely.get_coordinates(shapely.get_exterior_ring(hulls), return_index=True)
    kept = ~changes(hull)  # the closing point is there twice
    hull_xy, hull_size = hull_xy[kept], np.bincount(hull[kept], minlength=len(many))
    size, begin = size.copy(), first[:-1].copy()
    size[many] = hull_size
    begin[many] = len(corners) + starts(hull_size)[:-1]
    return np.concatenate([corners, hull_xy])[ranges(begin, size)], starts(size)


def _best_directions(
    edges: FloatArray, first: IntArray, outline: tuple[FloatArray, IntArray]
) -> Boxes:
    """Box of each ring along one of its edges, with its axis in the first quadrant."""
    axis, usable = _edge_directions(edges, first)
    ring = np.arange(len(first) - 1).repeat(first[1:] - first[:-1])
    # every direction of a ring with every corner of its outline
    corners, begin = outline
    each = (begin[1:] - begin[:-1])[ring]
    row = ranges(begin[:-1][ring], each)
    x, y = corners[:, 0][row], corners[:, 1][row]
    cos, sin = axis[:, 0].repeat(each), axis[:, 1].repeat(each)
    along, across = x * cos + y * sin, y * cos - x * sin
    group = starts(each)[:-1]
    low, high = np.minimum.reduceat(along, group), np.maximum.reduceat(along, group)
    left, right = np.minimum.reduceat(across, group), np.maximum.reduceat(across, group)
    length, width = high - low, right - left
    best = _choose(length, width, np.where(usable, _turn(axis), np.inf), first)
    u, v = 0.5 * (low + high)[best], 0.5 * (left + right)[best]
    chosen = axis[best]
    centre = np.empty_like(chosen)
    centre[:, 0] = u * chosen[:, 0] - v * chosen[:, 1]
    centre[:, 1] = u * chosen[:, 1] + v * chosen[:, 0]
    return Boxes(centre, chosen, length[best], width[best])


def _edge_directions(corners: FloatArray, first: IntArray) -> tuple[FloatArray, BoolArray]:
    """Directions of all edges, turned by right angles into [0°, 90°), and which have one."""
    after = np.arange(1, len(corners) + 1)
    after[first[1:] - 1] = first[:-1]
    edge = corners[after] - corners
    span = np.sqrt(edge[:, 0] ** 2 + edge[:, 1] ** 2)
    usable = span > LEAST_EDGE
    edge /= np.where(usable, span, 1.0)[:, None]
    x, y = edge[:, 0], edge[:, 1]
    even = x * y > 0.0
    even |= y == 0.0
    cos = np.where(even, np.abs(x), np.abs(y))
    sin = np.where(even, np.abs(y), np.abs(x))
    return np.column_stack([cos, sin]), usable


def _turn(axis: FloatArray) -> FloatArray:
    """Number that grows with the angle of directions in the first quadrant."""
    return np.asarray(np.round(axis[:, 1] / (axis[:, 0] + axis[:, 1] + 1e-300), 9))


def _choose(length: FloatArray, width: FloatArray, turn: FloatArray, first: IntArray) -> IntArray:
    """Row of the best direction of each outline; no direction has an infinite `turn`."""
    group, size = first[:-1], np.diff(first)
    usable = np.isfinite(turn)
    area = np.where(usable, length * width, np.inf)
    least = np.repeat(np.minimum.reduceat(area, group), size)
    equal = area <= least * (1.0 + EQUAL_AREA)
    longer = np.where(equal, np.maximum(length, width), -np.inf)
    longest = np.repeat(np.maximum.reduceat(longer, group), size)
    equal &= longer >= longest * (1.0 - EQUAL_SIDES)
    rank = np.where(equal, turn, np.inf)
    equal &= rank <= np.repeat(np.minimum.reduceat(rank, group), size)
    places = np.where(equal, np.arange(len(turn)), len(turn))
    return np.asarray(np.minimum(np.minimum.reduceat(places, group), len(turn) - 1))
