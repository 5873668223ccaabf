"""Where parcels lie beside each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.blocks.edges import ALIGNED_DEG
from urban_processing.blocks.model import BlockRings
from urban_processing.mesh.overlap import Overlaps, Segments, find_overlaps
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import GRID

PARCEL_GAP = 0.5
"""Parcels no further apart than so many metres touch."""

LEAST_SHARED = 0.5
"""Neighbours touch along more than so many metres."""

PARALLEL_DEG, LEAST_RUN = 5.0, 12.0
"""Lines that lie on each other make at most this angle, or do so for so many times the distance
between them: at sharp corners others are as near, over a short length."""


@dataclass(frozen=True, eq=False)
class Stretches:
    """Pieces of boundary edges, from share `low` to `high`."""

    edge: IntArray
    low: FloatArray
    high: FloatArray


@dataclass(frozen=True, eq=False)
class Touching(Stretches):
    """Pieces of boundary edges along which the parcel `other` lies."""

    other: IntArray


def boundary_segments(rings: BlockRings) -> Segments:
    """(N,) the edges of the rings of parcels; the parcel is on their left."""
    return Segments(rings.xy, rings.xy[rings.following], rings.edge_block)


def touching_parcels(boundary: Segments) -> Touching:
    """Where parcels touch, but for gaps of `PARCEL_GAP`."""
    found = find_overlaps(boundary, boundary, PARCEL_GAP, clipped=True, least=GRID)
    owner, other = boundary.line[found.first], boundary.line[found.second]
    kept = (owner != other) & runs_along(found, boundary)
    found = found.take(kept)
    return Touching(found.first, found.low, found.high, other[kept])


def count_neighbours(
    touching: Touching, boundary: Segments, streets: Stretches, *, n_parcels: int
) -> IntArray:
    """(F,) number of parcels that each shares a line of its boundary with.

    They touch along more than `LEAST_SHARED` metres that are not `streets`, none of which meet.
    """
    n = n_parcels
    kept = _outside(touching, streets)
    owner = boundary.line[touching.edge]
    pair = owner * np.int64(n) + touching.other
    found, index = np.unique(pair, return_inverse=True)
    length = np.bincount(
        index.ravel(), weights=kept * boundary.length[touching.edge], minlength=len(found)
    )
    long = found[np.round(length, 6) > LEAST_SHARED]
    both = np.unique(np.concatenate([long, (long % n) * n + long // n]))
    return np.bincount(both // n, minlength=n)


def _outside(stretches: Stretches, others: Stretches) -> FloatArray:
    """Share of its edge that is left of each stretch by others, none of which meet."""
    order = np.lexsort((others.low, others.edge))
    at = 2.0 * others.edge[order]
    starts, ends = at + others.low[order], at + others.high[order]
    covered = np.append(0.0, np.cumsum(ends - starts))

    def before(place: FloatArray) -> FloatArray:
        if not len(starts):
            return np.zeros(len(place))
        k = np.searchsorted(starts, place, side="right")
        over = np.where(k > 0, np.maximum(ends[np.maximum(k - 1, 0)] - place, 0.0), 0.0)
        return covered[k] - over

    base, low, high = 2.0 * stretches.edge, stretches.low, stretches.high
    return np.asarray((high - low) - (before(base + high) - before(base + low)))


def runs_along(along: Overlaps, first: Segments) -> BoolArray:
    """Pairs that run along each other, and do not only part at a sharp corner."""
    length = (along.high - along.low) * first.length[along.first]
    parallel = (along.angle <= PARALLEL_DEG) | (length >= LEAST_RUN * along.far)
    return np.asarray((along.angle <= ALIGNED_DEG) & parallel)
