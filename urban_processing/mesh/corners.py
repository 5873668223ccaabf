"""Approximate polygons of parcels, their angles and their irregularity (Chen 2024, Eq. 1).

Many polygons are handled at once as ragged arrays: ``xy`` holds the vertices of all rings one
after the other (not closed), ring ``i`` being ``xy[offsets[i]:offsets[i + 1]]``.
"""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.mesh.straight import STRAIGHT_DEG

STRAIGHT_ANGLE = np.radians(STRAIGHT_DEG)
"""Two edges whose included angle is larger count as collinear (Chen 2024, section 3)."""

SIMPLIFY_SHARE = 0.02
"""Tolerance of the simplification of a reported polygon, relative to √area."""

IRREGULAR = 0.1
"""Parcels with a larger irregularity are called irregular (Chen 2024, Fig. 17)."""

IRREGULARITY_WEIGHTS = (0.75, 0.25)
"""γ1 (angles) and γ2 (side lengths) of Chen 2024, Eq. 1."""


def ring_neighbours(offsets: IntArray) -> tuple[IntArray, IntArray]:
    """Index of the vertex before and after each vertex of ragged rings."""
    n = int(offsets[-1])
    before, after = np.arange(-1, n - 1), np.arange(1, n + 1)
    before[offsets[:-1]] = offsets[1:] - 1
    after[offsets[1:] - 1] = offsets[:-1]
    return before, after


def ring_areas(xy: FloatArray, offsets: IntArray) -> FloatArray:
    """Signed area of each ring in m², positive where it runs counter-clockwise."""
    _, after = ring_neighbours(offsets)
    local = xy - np.repeat(xy[offsets[:-1]], np.diff(offsets), axis=0)
    cross = local[:, 0] * local[after, 1] - local[:, 1] * local[after, 0]
    return 0.5 * np.add.reduceat(cross, offsets[:-1])


def interior_angles(xy: FloatArray, offsets: IntArray) -> FloatArray:
    """Interior angle in radians (0 to 2π) at each vertex of counter-clockwise rings."""
    before, after = ring_neighbours(offsets)
    z = xy[:, 0] + 1j * xy[:, 1]
    return np.asarray(np.pi - np.angle((z[after] - z) * np.conj(z - z[before])))


def polygon_irregularity(
    xy: FloatArray,
    offsets: IntArray,
    gamma: tuple[float, float] = IRREGULARITY_WEIGHTS,
) -> FloatArray:
    """Irregularity I of counter-clockwise polygons without collinear vertices.

    Chen 2024, Eq. 1: the variance of the interior angles (radians) and the variance of the
    side lengths over their squared mean, weighted by `gamma`. 0 for a square.
    """
    _, after = ring_neighbours(offsets)
    side = np.hypot(*(xy[after] - xy).T)
    mean_side = _ragged_mean(side, offsets)
    by_angle = _ragged_variance(interior_angles(xy, offsets), offsets)
    by_side = _ragged_variance(side, offsets) / mean_side**2
    return np.asarray(gamma[0] * by_angle + gamma[1] * by_side)


def side_irregularity(aspect: FloatArray) -> FloatArray:
    """Second term of Eq. 1 for rectangles, from their long over short side."""
    return np.asarray(IRREGULARITY_WEIGHTS[1] * ((aspect - 1.0) / (aspect + 1.0)) ** 2)


def mean_side_length(xy: FloatArray, offsets: IntArray) -> FloatArray:
    """Mean side length of each polygon in metres."""
    _, after = ring_neighbours(offsets)
    return _ragged_mean(np.hypot(*(xy[after] - xy).T), offsets)


def reported_polygons(xy: FloatArray, offsets: IntArray) -> tuple[IntArray, IntArray]:
    """Corners of the approximate polygons that reports and scores are based on.

    Each ring is simplified (Douglas–Peucker, `SIMPLIFY_SHARE` of √area, from its sharpest
    vertex); then the vertex with the largest included angle is deleted while that angle is
    above `STRAIGHT_ANGLE` and more than three remain.

    Returns
    -------
    corners, corner_offsets
        Ragged indices into `xy`, in ring order.
    """
    kept = simplified_vertices(xy, offsets, SIMPLIFY_SHARE)
    return thin_corners(xy, kept, np.searchsorted(kept, offsets))


def reported_corners(mesh: PlanarMesh, faces: IntArray | None = None) -> tuple[IntArray, IntArray]:
    """Corners of the `reported_polygons` of faces, by default all, as ragged mesh vertices."""
    half_edges, offsets = mesh.face_rings(faces)
    vertex = mesh.origin[half_edges]
    corners, corner_offsets = reported_polygons(mesh.xy[vertex], offsets)
    return vertex[corners], corner_offsets


def thin_corners(
    xy: FloatArray,
    corners: IntArray,
    corner_offsets: IntArray,
    keep: BoolArray | None = None,
) -> tuple[IntArray, IntArray]:
    """Delete the straightest corner again and again while it is straighter than 135°.

    Parameters
    ----------
    xy, corners, corner_offsets
        Ragged corners as indices into `xy`.
    keep
        Corners (aligned with `corners`) that are never deleted, such as those the user gave.
    """
    protected = np.zeros(len(corners), dtype=bool) if keep is None else keep.copy()
    done_corners = [np.empty(0, dtype=np.int64)] * (len(corner_offsets) - 1)
    polygon = np.arange(len(corner_offsets) - 1)
    while len(polygon):
        included = np.abs(np.pi - np.abs(interior_angles(xy[corners], corner_offsets) - np.pi))
        included[protected] = -1.0
        straightest = np.maximum.reduceat(included, corner_offsets[:-1])
        count = np.diff(corner_offsets)
        thin = (straightest > STRAIGHT_ANGLE) & (count > 3)
        for i in np.flatnonzero(~thin):
            done_corners[polygon[i]] = corners[corner_offsets[i] : corner_offsets[i + 1]]
        active = np.repeat(thin, count)
        drop = _first_equal(included, np.repeat(straightest, count), corner_offsets) & active
        left = active & ~drop
        corners, protected = corners[left], protected[left]
        corner_offsets = np.append(0, np.cumsum(count[thin] - 1))
        polygon = polygon[thin]
    sizes = np.array([len(c) for c in done_corners], dtype=np.int64)
    return np.concatenate(done_corners), np.append(0, np.cumsum(sizes))


def _first_equal(values: FloatArray, wanted: FloatArray, offsets: IntArray) -> BoolArray:
    """Mark the first vertex of each ring whose value is the wanted one."""
    hit = np.flatnonzero(values == wanted)
    ring = np.searchsorted(offsets, hit, side="right") - 1
    first = hit[np.flatnonzero(np.diff(ring, prepend=-1))]
    out = np.zeros(len(values), dtype=bool)
    out[first] = True
    return out


def simplified_vertices(xy: FloatArray, offsets: IntArray, share: float) -> IntArray:
    """Sorted indices of the vertices that Douglas–Peucker keeps, at least three for each ring.

    The tolerance is `share` of √area; each ring is simplified from its sharpest vertex.
    """
    tolerance = share * np.sqrt(np.abs(ring_areas(xy, offsets)))
    start = sharpest_vertex(xy, offsets)
    count = np.diff(offsets)
    # closed rings, rotated to begin and end at their sharpest vertex
    step = np.arange(int((count + 1).sum())) - np.repeat(
        np.append(0, np.cumsum(count + 1))[:-1], count + 1
    )
    turned = np.repeat(start - offsets[:-1], count + 1) + step
    index = np.repeat(offsets[:-1], count + 1) + turned % np.repeat(count, count + 1)
    ring = np.repeat(np.arange(len(count)), count + 1)
    # each point carries its index as height, so that those that are left can be told
    lines = shapely.linestrings(np.column_stack([xy[index], index]), indices=ring)
    simple = shapely.simplify(lines, tolerance, preserve_topology=False)
    mask = np.zeros(len(xy), dtype=bool)
    mask[shapely.get_coordinates(simple, include_z=True)[:, 2].astype(np.int64)] = True
    few = np.flatnonzero(np.add.reduceat(mask, offsets[:-1], dtype=np.int64) < 3)
    for i in few:
        mask[offsets[i] : offsets[i + 1]] |= _three_corners(xy[offsets[i] : offsets[i + 1]])
    return np.flatnonzero(mask)


def _three_corners(xy: FloatArray) -> BoolArray:
    """Three far-apart vertices of a ring that all but collapses to a line."""
    a = 0
    b = int(np.argmax(np.hypot(*(xy - xy[a]).T)))
    d = xy[b] - xy[a]
    off = np.abs((xy[:, 0] - xy[a, 0]) * d[1] - (xy[:, 1] - xy[a, 1]) * d[0])
    off[[a, b]] = -1.0
    mask = np.zeros(len(xy), dtype=bool)
    mask[[a, b, int(np.argmax(off))]] = True
    return mask


def sharpest_vertex(xy: FloatArray, offsets: IntArray) -> IntArray:
    """Index of the vertex with the smallest included angle of each ring."""
    turn = np.abs(interior_angles(xy, offsets) - np.pi)
    turn = np.asarray(np.round(turn, 9), dtype=np.float64)
    top = np.maximum.reduceat(turn, offsets[:-1])
    return np.flatnonzero(_first_equal(turn, np.repeat(top, np.diff(offsets)), offsets))


def _ragged_mean(values: FloatArray, offsets: IntArray) -> FloatArray:
    return np.asarray(np.add.reduceat(values, offsets[:-1]) / np.diff(offsets))


def _ragged_variance(values: FloatArray, offsets: IntArray) -> FloatArray:
    centred = values - np.repeat(_ragged_mean(values, offsets), np.diff(offsets))
    return _ragged_mean(centred * centred, offsets)
