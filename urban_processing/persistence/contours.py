"""Contours of blocks less the vertices that are no corners."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.blocks.model import BlockRings
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

_STEPS = 1024
"""Deviations are compared in this fraction of the tolerance, so that rounding decides nothing."""


def corners_of(
    rings: BlockRings, tolerance: npt.ArrayLike, *, kept: BoolArray | None = None
) -> IntArray:
    """Return the vertices of rings that are not collinear with their neighbours.

    A new street that meets an edge of a block from outside adds such a vertex, which the
    matching of parcels ignores (Vanegas 2012, section 5.2). They are taken away in rounds: in
    each those that lie nearer to the line between their neighbours than the neighbours to
    theirs, so that a gentle curve keeps its shape and the answer does not depend on where a
    ring starts. A ring keeps three vertices.

    Parameters
    ----------
    rings
        Rings as arrays, N vertices.
    tolerance
        How far a collinear vertex may lie from the line between its neighbours, in metres; a
        number or (N,).
    kept
        (N,) vertices that stay whatever their place, by default none.

    Returns
    -------
    IntArray
        Rows of the corners, rising.
    """
    n = len(rings.xy)
    limit = np.broadcast_to(np.asarray(tolerance, dtype=np.float64), n)
    free = np.ones(n, dtype=bool) if kept is None else ~kept
    stays = np.ones(n, dtype=bool)
    ring = rings.edge_ring
    active = np.arange(n)
    while len(active):
        gone = _least_bent(rings.xy, active, ring[active], limit, free)
        stays[gone] = False
        concerned = np.zeros(len(rings.block), dtype=bool)
        concerned[ring[gone]] = True
        active = active[concerned[ring[active]] & stays[active]]
    return np.flatnonzero(stays)


def ring_neighbours(ring: IntArray) -> tuple[IntArray, IntArray]:
    """(n,) places before and after each vertex in its ring; rings stand one after the other."""
    first = np.flatnonzero(np.diff(ring, prepend=-1) != 0)
    last = np.append(first[1:], len(ring))[: len(first)] - 1
    before, after = np.arange(len(ring)) - 1, np.arange(len(ring)) + 1
    before[first], after[last] = last, first
    return before, after


def _least_bent(
    xy: FloatArray, active: IntArray, ring: IntArray, limit: FloatArray, free: BoolArray
) -> IntArray:
    """Those of the vertices `active` that are the most collinear of their neighbourhood."""
    before, after = ring_neighbours(ring)
    count = np.bincount(ring, minlength=ring[-1] + 1)[ring]
    place = xy[active]
    bend = _distance_to_segment(place, place[before], place[after])
    loose = np.flatnonzero((bend <= limit[active]) & free[active] & (count > 3))
    rank = np.full(len(active), len(active))
    steps = np.round(bend[loose] / np.maximum(limit[active[loose]], 1e-300) * _STEPS)
    rank[loose[np.lexsort((place[loose, 1], place[loose, 0], steps))]] = np.arange(len(loose))
    least = loose[(rank[loose] < rank[before[loose]]) & (rank[loose] < rank[after[loose]])]
    # of a ring of four no two opposite vertices go at once
    few = least[count[least] - np.bincount(ring[least], minlength=ring[-1] + 1)[ring[least]] < 3]
    _, one = np.unique(ring[few[np.argsort(rank[few])]], return_index=True)
    spared = np.setdiff1d(few, few[np.argsort(rank[few])][one])
    return np.asarray(active[np.setdiff1d(least, spared)])


def _distance_to_segment(point: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """(n,) distance of points from segments; a spike is far from the line it returns to."""
    along = end - start
    length2 = np.maximum((along**2).sum(axis=1), 1e-300)
    t = np.clip(((point - start) * along).sum(axis=1) / length2, 0.0, 1.0)
    return np.asarray(np.hypot(*(point - start - t[:, None] * along).T))
