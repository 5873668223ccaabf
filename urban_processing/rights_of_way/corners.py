"""Corners of blocks at junctions, rounded by arcs that are tangent to both kerbs."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

BEND_DEG = 20.0
"""Kerbs that bend by more have a corner; while they bend by less they count as straight."""

SEGMENT_DEG = 90.0 / 8
"""Angle of one segment of an arc, as in buffers of eight segments to the quarter."""

SHARE = 0.5
"""Share of the kerb between two corners that each of them may take."""

FURTHEST = 24
"""Number of vertices that are followed along a kerb."""

LEAST_RADIUS = 0.05
"""Arcs of a smaller radius, as a share of the one asked for, are left out."""


@dataclass(frozen=True, eq=False)
class Fillets:
    """Rounded corners of street surfaces; K of them.

    Parameters
    ----------
    owner
        (K,) index of the surface that each belongs to.
    corner
        (K, 2) where the corner was.
    arcs
        (K,) lines, from kerb to kerb.
    wedges
        (K,) polygons between arc and corner.
    """

    owner: IntArray
    corner: FloatArray
    arcs: npt.NDArray[np.object_]
    wedges: npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class _Kerbs:
    """Rings of vertices with the surface on the left."""

    xy: FloatArray
    owner: IntArray
    following: IntArray
    previous: IntArray
    turn: FloatArray
    """(n,) angle in degrees by which a ring turns left at a vertex."""
    corner: BoolArray
    """(n,) whether the surface has a re-entrant corner at a vertex."""


def round_corners(surfaces: npt.NDArray[np.object_], radius: float) -> Fillets:
    """Round the re-entrant corners of street surfaces: the corners of blocks.

    A corner between two straight kerbs that meet at an angle θ gets a circular arc of `radius`
    and gives ``radius² · (cot(θ/2) - (π - θ)/2)`` to the street; at a right angle
    ``(1 - π/4) · radius²``. Where a kerb is too short for that, or bends, the arc is smaller
    or no circle, but tangent to both kerbs.

    Parameters
    ----------
    surfaces
        Polygons or multipolygons; None for none.
    radius
        In metres; 0 leaves the corners as they are.

    Returns
    -------
    Fillets
        In the order of the surfaces and their vertices.
    """
    kerbs = _kerbs(surfaces)
    at = np.flatnonzero(kerbs.corner)
    turn = np.radians(-kerbs.turn[at])
    reach = np.where(at >= 0, radius * np.tan(turn / 2), 0.0)
    free = np.minimum(
        _free(kerbs, at, kerbs.following, reach), _free(kerbs, at, kerbs.previous, reach)
    )
    reach = np.minimum(reach, free)
    kept = (radius > 0) & (reach > LEAST_RADIUS * radius * np.tan(turn / 2))
    at, reach = at[kept], reach[kept]
    if not len(at):
        return Fillets(at, np.empty((0, 2)), *np.empty((2, 0), dtype=object))
    before, into = _point_along(kerbs, at, kerbs.previous, reach)
    after, out_of = _point_along(kerbs, at, kerbs.following, reach)
    arcs, wedges = _drawn(kerbs.xy[at], before, -into, after, out_of)
    return Fillets(kerbs.owner[at], kerbs.xy[at], arcs, wedges)


def _kerbs(surfaces: npt.NDArray[np.object_]) -> _Kerbs:
    parts, surface = shapely.get_parts(surfaces, return_index=True)
    rings, part = shapely.get_rings(shapely.orient_polygons(parts), return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    kept = np.diff(ring, append=-1) == 0  # the last vertex of a ring repeats the first
    xy, ring = xy[kept], ring[kept]
    n = len(xy)
    start = np.flatnonzero(np.diff(ring, prepend=-1))
    end = np.flatnonzero(np.diff(ring, append=-1))
    following, previous = np.arange(n) + 1, np.arange(n) - 1
    following[end], previous[start] = start, end
    z = xy[:, 0] + 1j * xy[:, 1]
    turn = np.degrees(np.angle((z[following] - z) * np.conj(z - z[previous])))
    return _Kerbs(xy, surface[part[ring]], following, previous, turn, turn < -BEND_DEG)


def _free(kerbs: _Kerbs, at: IntArray, step: IntArray, wanted: FloatArray) -> FloatArray:
    """Length of kerb beside each corner that its arc may take, no further than wanted."""
    length, bend = np.zeros(len(at)), np.zeros(len(at))
    here = at.copy()
    walking = np.arange(len(at))
    for _ in range(FURTHEST):
        if not len(walking):
            break
        there = step[here[walking]]
        length[walking] += np.hypot(*(kerbs.xy[there] - kerbs.xy[here[walking]]).T)
        bend[walking] += np.abs(kerbs.turn[there])
        here[walking] = there
        at_corner = kerbs.corner[there]
        length[walking[at_corner]] *= SHARE
        walking = walking[
            ~at_corner & (bend[walking] <= BEND_DEG) & (length[walking] < wanted[walking])
        ]
    return length


def _point_along(
    kerbs: _Kerbs, at: IntArray, step: IntArray, distance: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Points at a distance along the kerb from each corner, and the unit directions there."""
    here, left = at.copy(), distance.copy()
    for _ in range(FURTHEST):
        there = step[here]
        length = np.hypot(*(kerbs.xy[there] - kerbs.xy[here]).T)
        further = left > length
        if not further.any():
            break
        left = np.where(further, left - length, left)
        here = np.where(further, there, here)
    edge = kerbs.xy[step[here]] - kerbs.xy[here]
    length = np.hypot(*edge.T)
    direction = edge / length[:, None]
    return kerbs.xy[here] + np.minimum(left, length)[:, None] * direction, direction


def _drawn(
    corner: FloatArray, a: FloatArray, into: FloatArray, b: FloatArray, out_of: FloatArray
) -> tuple[npt.NDArray[np.object_], npt.NDArray[np.object_]]:
    """Arcs from `a` to `b` as rational quadratic curves: circles where both reaches are equal."""
    control = _crossing(corner, a, into, b, out_of)
    u, v = control - a, b - control
    angle = np.arccos(np.clip((u * v).sum(axis=1) / _norm(u) / _norm(v), -1.0, 1.0))
    n = np.maximum(np.ceil(np.degrees(angle) / SEGMENT_DEG).astype(np.int64), 2)
    of = np.repeat(np.arange(len(n)), n + 1)
    t = (np.arange(len(of)) - np.repeat(np.cumsum(n + 1) - n - 1, n + 1)) / n[of]
    weights = np.stack([(1 - t) ** 2, 2 * np.cos(angle[of] / 2) * t * (1 - t), t**2])
    places = np.stack([a[of], control[of], b[of]])
    xy = (weights[:, :, None] * places).sum(axis=0) / weights.sum(axis=0)[:, None]
    xy[t == 0], xy[t == 1] = a, b
    arcs = shapely.linestrings(xy, indices=of)
    last = np.cumsum(n + 1)
    ring = np.insert(xy, last, corner, axis=0)
    wedges = shapely.polygons(shapely.linearrings(ring, indices=np.insert(of, last, of[last - 1])))
    return np.asarray(arcs, dtype=object), np.asarray(wedges, dtype=object)


def _crossing(
    corner: FloatArray, a: FloatArray, into: FloatArray, b: FloatArray, out_of: FloatArray
) -> FloatArray:
    """Where the tangents at both ends meet; the corner where they do not meet between them."""
    cross = into[:, 0] * out_of[:, 1] - into[:, 1] * out_of[:, 0]
    steep = np.abs(cross) > 0.1
    safe = np.where(steep, cross, 1.0)
    d = b - a
    s = (d[:, 0] * out_of[:, 1] - d[:, 1] * out_of[:, 0]) / safe
    t = -(into[:, 0] * d[:, 1] - into[:, 1] * d[:, 0]) / safe
    meet = steep & (s > 0) & (t > 0)
    return np.where(meet[:, None], a + s[:, None] * into, corner)


def _norm(v: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(np.hypot(v[:, 0], v[:, 1]), np.finfo(float).tiny))
