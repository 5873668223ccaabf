"""Points of a block before an edit and the same points after it."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.spatial import cKDTree

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.persistence.motion import Motion, Shapes

MAX_LANDMARKS = 48
"""More corners than that are thinned to the most spread ones."""

_DIFFERENT = 0.5
"""Corners that lie farther apart than this after the best rotation, relative to √area, are not
the same ones, even where there are as many."""

_NEAR = 0.3
"""Corners of contours with other numbers of corners are the same within this, relative to √area."""

_TURN = 0.3
"""Two corners that turn by 90° more or less count as this far apart, relative to √area."""

_FLAT = 0.02
"""Landmarks whose spread across is less than this share of that along lie on one line."""

_TURN_SCALE = 0.5 * np.pi

Landmarks = tuple[FloatArray, FloatArray]
"""(K, 2) points before, and the (K, 2) same points after."""


def landmarks_of(old: Shapes, new: Shapes, motion: Motion) -> Landmarks:
    """Find the points that positions before and after an edit are compared by.

    The paper takes the vertices of the block, of which it asks that number and order stay the
    same (Vanegas 2012, section 5.2). Here:

    1. One block before and after with the same number of corners: all of them, from that
       starting corner on for which they lie nearest to each other once centroid and size are
       taken off. So another starting vertex changes nothing. Collinear vertices are no corners.
    2. Other numbers of corners, or several blocks (split, merged): corners that are each
       other's nearest after the motion of the layout, and near enough, in place and in how the
       contour turns there. Corners without counterpart are ignored, as the paper does with
       collinear ones.
    3. Fewer than three such corners, or all on a line: the four corners of the extent before
       and after, along the main axes of the blocks before: position by the best alignment.

    Parameters
    ----------
    old, new
        The blocks that belong together, one or more each.
    motion
        How the layout was moved.
    """
    before = [motion.points(corners) for corners in old.corners]
    size = float(np.sqrt(min(old.area.sum() * motion.scale**2, new.area.sum())))
    found = _one_to_one(before, new.corners)
    if found is None:
        found = _nearest_corners(before, new.corners, size)
    if not _spans(found[0]) or not _spans(found[1]):
        return _extents(np.vstack(before), np.vstack(new.corners))
    return _thinned(found)


def _one_to_one(before: list[FloatArray], after: list[FloatArray]) -> Landmarks | None:
    """Return all corners of one contour and of another with as many, best rotated."""
    if len(before) != 1 or len(after) != 1 or len(before[0]) != len(after[0]):
        return None
    a, b = _centred(before[0]), _centred(after[0])
    n = len(a)
    turned = (np.arange(n)[:, None] + np.arange(n)) % n
    apart = ((a[None] - b[turned]) ** 2).sum(axis=2)
    best = turned[int(np.argmin(np.round(apart.sum(axis=1), 9)))]
    if np.sqrt(((a - b[best]) ** 2).sum(axis=1).max()) > _DIFFERENT:
        return None
    return before[0], after[0][best]


def _centred(ring: FloatArray) -> FloatArray:
    """Corners about the centroid, in units of √area."""
    polygon = shapely.Polygon(ring)
    return np.asarray((ring - np.ravel(polygon.centroid.coords)) / np.sqrt(polygon.area))


def _nearest_corners(before: list[FloatArray], after: list[FloatArray], size: float) -> Landmarks:
    """Corners that are each other's nearest, in place or once centroid and size are taken off."""
    here = _mutual(_described(before, size), _described(after, size))
    a, b = np.vstack(before), np.vstack(after)
    if len(before) == len(after) == 1:
        centred = [_centred(before[0])], [_centred(after[0])]
        there = _mutual(_described(centred[0], 1.0), _described(centred[1], 1.0))
        here = max(here, there, key=lambda pairs: len(pairs[0]))
    return a[here[0]], b[here[1]]


def _described(contours: list[FloatArray], size: float) -> FloatArray:
    """(n, 3) place of corners in units of `size`, and how much the contour turns there."""
    rows = []
    for ring in contours:
        ahead = np.roll(ring, -1, axis=0) - ring
        behind = ring - np.roll(ring, 1, axis=0)
        cross = behind[:, 0] * ahead[:, 1] - behind[:, 1] * ahead[:, 0]
        turn = np.arctan2(cross, (behind * ahead).sum(axis=1))
        rows.append(np.column_stack([ring / size, turn * (_TURN / _TURN_SCALE)]))
    return np.vstack(rows)


def _mutual(a: FloatArray, b: FloatArray) -> tuple[IntArray, IntArray]:
    """Rows of points that are each other's nearest, and near enough."""
    distance, rows_b = cKDTree(b).query(a)
    to_a, to_b = np.asarray(cKDTree(a).query(b)[1]), np.asarray(rows_b, dtype=np.int64)
    rows = np.arange(len(a))
    mutual = (to_a[to_b] == rows) & (distance <= _NEAR)
    return rows[mutual], to_b[mutual]


def _spans(points: FloatArray) -> bool:
    """Whether points are three or more, and not all on one line."""
    if len(points) < 3:
        return False
    spread = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    return bool(spread[1] > _FLAT * spread[0])


def _extents(a: FloatArray, b: FloatArray) -> Landmarks:
    """Corners of the boxes around points, both along the axes of the tightest box of the first."""
    axes = _tightest_axes(a)
    out = []
    for points in (a, b):
        low, high = (points @ axes.T).min(axis=0), (points @ axes.T).max(axis=0)
        corner = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        out.append(corner @ axes)
    return out[0], out[1]


def _tightest_axes(points: FloatArray) -> FloatArray:
    """(2, 2) unit vectors of the box of least area; it has a side on an edge of the hull.

    The oriented envelope of GEOS is another one from another starting vertex.
    """
    hull = shapely.get_coordinates(
        shapely.normalize(shapely.convex_hull(shapely.multipoints(points)))
    )
    edge = np.diff(hull, axis=0)
    along = edge / np.hypot(*edge.T)[:, None]
    axes = np.stack([along, np.column_stack([-along[:, 1], along[:, 0]])], axis=1)
    extent = np.ptp(np.einsum("eij,pj->eip", axes, hull), axis=2)
    return np.asarray(axes[int(np.argmin(np.round(extent.prod(axis=1), 6)))])


def _thinned(found: Landmarks) -> Landmarks:
    """Leave the most spread landmarks where there are very many."""
    before, after = found
    if len(before) <= MAX_LANDMARKS:
        return found
    distance = np.hypot(*(before - before.mean(axis=0)).T)
    chosen = [int(np.argmax(np.round(distance, 6)))]
    reach = np.full(len(before), np.inf)
    for _ in range(MAX_LANDMARKS - 1):
        reach = np.minimum(reach, np.hypot(*(before - before[chosen[-1]]).T))
        chosen.append(int(np.argmax(np.round(reach, 6))))
    rows = np.sort(chosen)
    return before[rows], after[rows]
