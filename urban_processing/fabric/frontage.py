"""Which pieces of parcel boundaries are on streets."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.fabric.touching import PARCEL_GAP, Touching, runs_along
from urban_processing.mesh.overlap import Overlaps, Segments, find_overlaps
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import GRID

Geometries = npt.NDArray[np.object_]

ALONG_DEG = 50.0
"""A boundary on a street makes at most this angle with its centreline: cut-off corners of 45°
are on one of their streets."""

ROUNDED_DIGITS = 3
"""Streets as far away, to this many digits of a metre, are as near."""

SIGHT_STEP = 4.0
"""Whether a parcel stands before another is looked at every so many metres."""

_ROUNDING = 1e-9
"""Shares that are nearer are one."""

_CLEARANCE = 0.05
"""Lines of sight begin so many metres off the boundary."""

_SEEN_THROUGH = 2 * PARCEL_GAP
"""A parcel that a line of sight crosses over a shorter length, in metres, is not in its way."""


@dataclass(frozen=True, eq=False)
class StreetSegments:
    """T street segments as frontage needs them.

    Parameters
    ----------
    segments
        Their ends.
    width
        (T,) width of the right-of-way.
    dead_end, dead_end_segment
        (D, 2) places where streets end, and the segment of each.
    """

    segments: Segments
    width: FloatArray
    dead_end: FloatArray
    dead_end_segment: IntArray


@dataclass(frozen=True, eq=False)
class StreetPieces:
    """A pieces of boundary edges on streets.

    Parameters
    ----------
    edge
        (A,) boundary edge.
    low, high
        (A,) from which share of the edge to which.
    segment, share
        (A,) street segment, and the share of it at the place opposite the middle of the piece.
    on_centreline
        (A,) whether the piece lies on the centreline, not beside the right-of-way.
    """

    edge: IntArray
    low: FloatArray
    high: FloatArray
    segment: IntArray
    share: FloatArray
    on_centreline: BoolArray

    def take(self, rows: IntArray | BoolArray) -> StreetPieces:
        """Return some of the pieces."""
        return StreetPieces(*(getattr(self, field.name)[rows] for field in fields(self)))


def pieces_on_streets(
    boundary: Segments,
    parcels: Geometries,
    streets: StreetSegments,
    touching: Touching,
    *,
    snap: float,
    reach: float,
) -> StreetPieces:
    """Find the pieces of the boundaries of parcels that are on streets.

    A piece is on a street if the centreline runs along it within `snap` metres, as in parcels to
    the centreline; or if nothing lies along it and the centreline runs beside it, outside its
    parcel, no further away than half the width and `reach`, at an angle of at most `ALONG_DEG`,
    with no parcel between. Around the end of a street the angle does not matter. Of several
    streets the nearest counts.

    Parameters
    ----------
    boundary
        (N,) edges of parcels, these on their left; `line` is the parcel.
    parcels
        (F,) their polygons.
    streets
        Streets.
    touching
        Where parcels touch.
    snap, reach
        Metres.
    """
    along = find_overlaps(boundary, streets.segments, snap, clipped=True, least=GRID)
    along = along.take(runs_along(along, boundary))
    free = _free(boundary, touching)
    beside = find_overlaps(
        boundary, streets.segments, streets.width / 2 + reach, clipped=True, least=GRID
    )
    beside = beside.take((beside.angle <= ALONG_DEG) & (beside.aside < 0) & free.any[beside.first])
    ends = _around_ends(boundary, streets, reach, free)
    candidates = _joined(along, beside, ends)
    cells = _cells(boundary, candidates, free)
    found = _nearest(cells, candidates, boundary, parcels, streets)
    return _merged(found)


@dataclass(frozen=True, eq=False)
class _Free:
    """Stretches of edges, from share `low` to `high`, along which no other parcel lies.

    `any` (N,) says which edges have one.
    """

    edge: IntArray
    low: FloatArray
    high: FloatArray
    any: BoolArray


def _free(boundary: Segments, touching: Touching) -> _Free:
    n = len(boundary.line)
    edge = np.concatenate([touching.edge, np.arange(n), np.arange(n)])
    low = np.concatenate([touching.low, np.zeros(n), np.ones(n)])
    high = np.concatenate([touching.high, np.zeros(n), np.ones(n)])
    order = np.lexsort((high, low, edge))
    edge, low, high = edge[order], low[order], high[order]
    reached = np.maximum.accumulate(2.0 * edge + high) - 2.0 * edge
    begin, end = reached[:-1], low[1:]
    same = edge[1:] == edge[:-1]
    length = (end - begin) * boundary.length[edge[:-1]]
    whole = (begin <= 0.0) & (end >= 1.0)
    kept = same & (length > GRID) & (whole | (length >= PARCEL_GAP))
    found = np.zeros(n, dtype=bool)
    found[edge[:-1][kept]] = True
    return _Free(edge[:-1][kept], begin[kept], end[kept], found)


@dataclass(frozen=True, eq=False)
class _Candidates:
    """Stretches of edges that a street segment runs along, beside or ends at."""

    edge: IntArray
    low: FloatArray
    high: FloatArray
    segment: IntArray
    on_centreline: BoolArray


def _joined(along: Overlaps, beside: Overlaps, ends: _Candidates) -> _Candidates:
    n, m, k = len(along.first), len(beside.first), len(ends.edge)
    return _Candidates(
        np.concatenate([along.first, beside.first, ends.edge]),
        np.concatenate([along.low, beside.low, ends.low]),
        np.concatenate([along.high, beside.high, ends.high]),
        np.concatenate([along.second, beside.second, ends.segment]),
        np.arange(n + m + k) < n,
    )


def _around_ends(
    boundary: Segments, streets: StreetSegments, reach: float, free: _Free
) -> _Candidates:
    """Stretches of free edges within reach of the ends of streets, these on their right."""
    rows = np.flatnonzero(free.any)
    within = streets.width[streets.dead_end_segment] / 2 + reach
    lines = shapely.linestrings(np.stack([boundary.start[rows], boundary.end[rows]], axis=1))
    end, at = shapely.STRtree(lines).query(
        shapely.points(streets.dead_end), predicate="dwithin", distance=within
    )
    edge = rows[at]
    length = boundary.length[edge]
    unit = (boundary.end[edge] - boundary.start[edge]) / length[:, None]
    offset = streets.dead_end[end] - boundary.start[edge]
    middle = (offset * unit).sum(axis=1)
    aside = unit[:, 0] * offset[:, 1] - unit[:, 1] * offset[:, 0]
    half = np.sqrt(np.maximum(within[end] ** 2 - aside**2, 0.0))
    low, high = np.clip((middle - half) / length, 0, 1), np.clip((middle + half) / length, 0, 1)
    kept = (aside < 0) & ((high - low) * length > GRID)
    return _Candidates(
        edge[kept],
        low[kept],
        high[kept],
        streets.dead_end_segment[end[kept]],
        np.zeros(int(kept.sum()), dtype=bool),
    )


@dataclass(frozen=True, eq=False)
class _Cells:
    """Stretches of edges over which the candidates are the same, free ones in short steps."""

    edge: IntArray
    low: FloatArray
    high: FloatArray
    free: BoolArray


def _cells(boundary: Segments, candidates: _Candidates, free: _Free) -> _Cells:
    edge = np.concatenate([candidates.edge, candidates.edge, free.edge, free.edge])
    at = np.concatenate([candidates.low, candidates.high, free.low, free.high])
    order = np.lexsort((at, edge))
    edge, at = edge[order], at[order]
    length = np.diff(at) * boundary.length[edge[:-1]] if len(edge) else np.empty(0)
    cell = np.flatnonzero((edge[1:] == edge[:-1]) & (length > GRID))
    middle = 2.0 * edge[cell] + (at[cell] + at[cell + 1]) / 2
    k = np.searchsorted(2.0 * free.edge + free.low, middle, side="right") - 1
    ends = np.append(2.0 * free.edge + free.high, -1.0)
    is_free = (k >= 0) & (middle <= ends[k])
    steps = np.where(is_free, np.ceil(length[cell] / SIGHT_STEP), 1.0).astype(np.int64)
    of = np.repeat(np.arange(len(cell)), steps)
    step = np.arange(len(of)) - np.repeat(np.cumsum(steps) - steps, steps)
    low, size = at[cell][of], (at[cell + 1] - at[cell])[of]
    begin, end = low + size * (step / steps[of]), low + size * ((step + 1) / steps[of])
    return _Cells(edge[cell][of], begin, end, is_free[of])


def _nearest(
    cells: _Cells,
    candidates: _Candidates,
    boundary: Segments,
    parcels: Geometries,
    streets: StreetSegments,
) -> StreetPieces:
    """The nearest street of each stretch that has one in sight."""
    middles = 2.0 * cells.edge + (cells.low + cells.high) / 2
    first = np.searchsorted(middles, 2.0 * candidates.edge + candidates.low)
    last = np.searchsorted(middles, 2.0 * candidates.edge + candidates.high)
    count = last - first
    candidate = np.repeat(np.arange(len(first)), count)
    cell = np.arange(len(candidate)) + np.repeat(first - np.cumsum(count) + count, count)
    usable = cells.free[cell] | candidates.on_centreline[candidate]
    cell, candidate = cell[usable], candidate[usable]
    edge, share = cells.edge[cell], ((cells.low + cells.high) / 2)[cell]
    place = boundary.start[edge] + share[:, None] * (boundary.end[edge] - boundary.start[edge])
    segment, on = candidates.segment[candidate], candidates.on_centreline[candidate]
    a, b = streets.segments.start[segment], streets.segments.end[segment]
    d = b - a
    foot_share = np.clip(((place - a) * d).sum(axis=1) / (d**2).sum(axis=1), 0.0, 1.0)
    foot = a + foot_share[:, None] * d
    seen = on.copy()
    seen[~on] = _in_sight(place[~on], foot[~on], parcels)
    away = np.round(np.hypot(*(foot - place).T), ROUNDED_DIGITS)
    order = np.lexsort((segment, away, ~on, cell))
    order = order[seen[order]]
    _, at = np.unique(cell[order], return_index=True)
    best = order[at]
    chosen = cell[best]
    return StreetPieces(
        cells.edge[chosen],
        cells.low[chosen],
        cells.high[chosen],
        segment[best],
        foot_share[best],
        on[best],
    )


def _in_sight(place: FloatArray, foot: FloatArray, parcels: Geometries) -> BoolArray:
    """(n,) whether no parcel lies between places and the streets opposite them."""
    way = foot - place
    length = np.hypot(way[:, 0], way[:, 1])
    start = place + way * np.minimum(_CLEARANCE / np.maximum(length, GRID), 1.0)[:, None]
    lines = shapely.linestrings(np.stack([start, foot], axis=1))
    line, parcel = shapely.STRtree(parcels).query(lines, predicate="intersects")
    crossed = shapely.length(shapely.intersection(lines[line], parcels[parcel]))
    out = np.ones(len(place), dtype=bool)
    out[line[crossed > _SEEN_THROUGH]] = False
    return out


def _merged(pieces: StreetPieces) -> StreetPieces:
    """Pieces of one edge that follow each other along the same street segment, as one."""
    if not len(pieces.edge):
        return pieces
    new = np.ones(len(pieces.edge), dtype=bool)
    new[1:] = (
        (pieces.edge[1:] != pieces.edge[:-1])
        | (pieces.segment[1:] != pieces.segment[:-1])
        | (pieces.on_centreline[1:] != pieces.on_centreline[:-1])
        | (pieces.low[1:] > pieces.high[:-1] + _ROUNDING)
    )
    first = np.flatnonzero(new)
    size = pieces.high - pieces.low
    weight = np.add.reduceat(size, first)
    share = np.add.reduceat(size * pieces.share, first) / weight
    last = np.append(first[1:], len(new)) - 1
    return StreetPieces(
        pieces.edge[first],
        pieces.low[first],
        pieces.high[last],
        pieces.segment[first],
        share,
        pieces.on_centreline[first],
    )
