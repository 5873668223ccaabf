"""Smallest boxes around many polygons at once, aligned with one of their edges."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.rings import Rings, ranges, starts

EQUAL_AREA = 1e-3
"""Boxes whose areas differ by less than this share count as equally large."""

EQUAL_SIDES = 1e-6
"""Sides of boxes that differ by less than this share count as equally long."""

MANY_VERTICES = 24
"""From so many vertices on the box is that of the convex hull, which is the same."""

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
        across = np.column_stack([-self.axis[:, 1], self.axis[:, 0]])
        return Boxes(
            centre=self.centre,
            axis=np.where(rows[:, None], _upward(across), self.axis),
            length=np.where(rows, self.width, self.length),
            width=np.where(rows, self.length, self.width),
        )


def smallest_boxes(rings: Rings, xy: FloatArray) -> Boxes:
    """Return the box of smallest area around each face (Vanegas 2012, section 4.3).

    The smallest box lies along an edge of the convex hull. Among boxes of equal area
    (`EQUAL_AREA`) the longest is taken, among those of equal sides the one whose direction
    comes first from the x-axis on: a triangle stands on its longest side, and which vertex a
    ring begins with does not matter. The axis lies along the longer side; where both are equal
    along the side that comes first from the x-axis on.
    """
    corners, first = _outlines(rings, xy)
    origin = corners[first[:-1]]
    corners = corners - np.repeat(origin, np.diff(first), axis=0)
    found = _best_directions(corners, first)
    centre = found.centre
    long = found.length >= found.width * (1.0 - EQUAL_SIDES)
    turned = Boxes(centre, found.axis, found.length, found.width).turned(~long)
    return Boxes(centre + origin, turned.axis, turned.length, turned.width)


def _outlines(rings: Rings, xy: FloatArray) -> tuple[FloatArray, IntArray]:
    """Vertices of the shells, or of their convex hulls where they are many, and their starts."""
    shell = rings.face_rings[:-1]
    size = rings.size[shell]
    first = rings.offsets[shell]
    if (size <= MANY_VERTICES).all():
        return xy[rings.vertex[ranges(first, size)]], starts(size)
    many = np.flatnonzero(size > MANY_VERTICES)
    points = xy[rings.vertex[ranges(first[many], size[many])]]
    of = np.repeat(np.arange(len(many)), size[many])
    hulls = shapely.convex_hull(shapely.multipoints(shapely.points(points), indices=of))
    hull_xy, hull = shapely.get_coordinates(shapely.get_exterior_ring(hulls), return_index=True)
    hull_xy, hull = hull_xy[np.diff(hull, append=-1) == 0], hull[np.diff(hull, append=-1) == 0]
    hull_size = np.bincount(hull, minlength=len(many))
    pool = np.concatenate([xy[rings.vertex], hull_xy])
    size, first = size.copy(), first.copy()
    size[many] = hull_size
    first[many] = len(rings.vertex) + starts(hull_size)[:-1]
    return pool[ranges(first, size)], starts(size)


def _best_directions(corners: FloatArray, first: IntArray) -> Boxes:
    """Box of each outline, with its axis in the first quadrant; centres are relative."""
    size = np.diff(first)
    axis, usable = _edge_directions(corners, first)
    outline = np.repeat(np.arange(len(size)), size)
    # every direction of an outline with every one of its corners
    each = size[outline]
    row = ranges(first[:-1][outline], each)
    x, y = corners[:, 0][row], corners[:, 1][row]
    cos, sin = np.repeat(axis[:, 0], each), np.repeat(axis[:, 1], each)
    along, across = x * cos + y * sin, y * cos - x * sin
    group = starts(each)[:-1]
    low, high = np.minimum.reduceat(along, group), np.maximum.reduceat(along, group)
    left, right = np.minimum.reduceat(across, group), np.maximum.reduceat(across, group)
    length, width = high - low, right - left
    best = _choose(length, width, np.where(usable, _turn(axis), np.inf), first)
    u, v = 0.5 * (low + high)[best], 0.5 * (left + right)[best]
    chosen = axis[best]
    centre = np.column_stack(
        [u * chosen[:, 0] - v * chosen[:, 1], u * chosen[:, 1] + v * chosen[:, 0]]
    )
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


def _upward(axis: FloatArray) -> FloatArray:
    return np.where((axis @ UPWARD < 0.0)[:, None], -axis, axis)
