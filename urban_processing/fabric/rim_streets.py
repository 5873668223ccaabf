"""Streets along the rim of the land, laid on it: stretches of the rim, and what they replace."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.edges import ALIGNED_DEG
from urban_processing.blocks.model import BlockRings, rings_of
from urban_processing.blocks.noding import NODE_GRID, Centrelines
from urban_processing.mesh.overlap import Overlaps, Segments, find_overlaps
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import snap_to_grid

Geometries = npt.NDArray[np.object_]

NEAR_SHARE = 0.25
"""A street runs along the rim where that is nearer than this share of its width: nearer to the
centreline than to the kerb."""

LEAST_RUN = 6.0
"""Streets that run along the rim for less than so many times their distance cross it."""

LARGEST_GAP = 4.0
"""Gaps between stretches of rim street of so many tolerances, as at corners, are closed."""


@dataclass(frozen=True, eq=False)
class RimStreets:
    """Streets in the land and on its rim.

    Parameters
    ----------
    land
        (L,) the land, with vertices where rim streets begin and end.
    inner, inner_line
        (S, 2, 2) segments of the other streets, and the line of each. Those that met a street
        which is now on the rim meet it there.
    rim, rim_line
        (R, 2, 2) segments of the rims, and the line of the street along each, -1 for none.
    """

    land: Geometries
    inner: FloatArray
    inner_line: IntArray
    rim: FloatArray
    rim_line: IntArray


def rim_streets(
    work: Centrelines, width: FloatArray, land: Geometries, *, snap: float
) -> RimStreets:
    """Lay the streets that run along the rim of the land on it.

    Parameters
    ----------
    work
        Noded segments of streets.
    width
        (S,) width of each.
    land
        (L,) polygons.
    snap
        Metres: a street runs along the rim where it is no further away than this or `NEAR_SHARE`
        of its width, and one beside the land where its right-of-way comes as near as this.
    """
    rings = rings_of(land)
    near = np.maximum(snap, NEAR_SHARE * width)
    found = _along_rim(work, width, near, rings, land, snap)
    runs, found = _runs(found, rings, near)
    removed = _removed(found, work, rings)
    bits, line, ends = _without(work, removed)
    rim, rim_line, outlines = _cut_rim(rings, runs, work, removed, land)
    inner = _attached(bits, ends, rim[rim_line >= 0], rim, snap)
    tolerance = LARGEST_GAP * near.max(initial=snap)
    stays = np.hypot(*(inner[:, 1] - inner[:, 0]).T) > NODE_GRID
    if removed is not None:
        # at corners of the rim, between two stretches that are on it
        between = _is_in(bits[:, 0], ends) & _is_in(bits[:, 1], ends)
        stays &= ~(between & (np.hypot(*(bits[:, 1] - bits[:, 0]).T) <= tolerance))
    return RimStreets(outlines, inner[stays], line[stays], rim, rim_line)


@dataclass(frozen=True, eq=False)
class _Stretches:
    """Stretches of S street segments from one place to another that are now on the rim."""

    segment: IntArray
    low: FloatArray
    high: FloatArray


def _along_rim(
    work: Centrelines,
    width: FloatArray,
    near: FloatArray,
    rings: BlockRings,
    land: Geometries,
    snap: float,
) -> Overlaps:
    """Pairs of a rim segment and a street segment along it."""
    streets = Segments(work.segments[:, 0], work.segments[:, 1], work.line)
    rim = Segments(rings.xy, rings.xy[rings.following], rings.edge_ring)
    found = find_overlaps(rim, streets, np.maximum(near, width / 2 + snap), clipped=True, least=0.0)
    found = found.take(found.angle <= ALIGNED_DEG)
    if not len(found.first):
        return found
    share = ((found.low + found.high) / 2)[:, None]
    a, b = rim.start[found.first], rim.end[found.first]
    unit = (b - a) / np.hypot(*(b - a).T)[:, None]
    # opposite the middle of the stretch, on the street
    place = a + share * (b - a) + found.aside[:, None] * np.column_stack([-unit[:, 1], unit[:, 0]])
    ground = shapely.union_all(land)
    shapely.prepare(ground)
    inside = shapely.intersects_xy(ground, *place.T)
    return found.take((found.far <= near[found.second]) | ~inside)


def _positions(found: Overlaps, rings: BlockRings) -> tuple[IntArray, FloatArray, FloatArray]:
    """Ring of each pair, and where along it, in metres, it begins and ends."""
    length, before = _lengths(rings)
    start = before[found.first]
    along = length[found.first]
    return rings.edge_ring[found.first], start + found.low * along, start + found.high * along


def _lengths(rings: BlockRings) -> tuple[FloatArray, FloatArray]:
    """(N,) lengths of the edges of rings, and metres from the start of the ring to each."""
    length = np.hypot(*(rings.xy[rings.following] - rings.xy).T)
    total = np.append(0.0, np.cumsum(length))[:-1]
    return length, total - total[rings.offsets[:-1]][rings.edge_ring]


def _runs(
    found: Overlaps, rings: BlockRings, near: FloatArray
) -> tuple[list[tuple[int, float, float]], Overlaps]:
    """Stretches (ring, from, to) of rim street that are long enough, and the pairs in them.

    A run over the start of its ring is two.
    """
    ring, low, high = _positions(found, rings)
    gap = LARGEST_GAP * near[found.second]
    runs: list[tuple[int, float, float]] = []
    kept = np.zeros(len(ring), dtype=bool)
    around = np.bincount(rings.edge_ring, weights=_lengths(rings)[0], minlength=len(rings.block))
    for r in np.unique(ring).tolist():
        rows = np.flatnonzero(ring == r)
        rows = rows[np.lexsort((high[rows], low[rows]))]
        whole = float(around[r])
        groups = _grouped(rows, low, high, gap)
        closes = float(low[groups[0][0]]) + whole - float(high[groups[-1]].max())
        if len(groups) > 1 and closes <= gap[groups[0][0]]:
            groups = [*groups[1:-1], np.concatenate([groups[-1], groups[0]])]
        for group in groups:
            first, last = float(low[group[0]]), float(high[group].max())
            over = group[low[group] < first]  # beyond the start of the ring
            end = float(high[over].max()) if len(over) else 0.0
            length = whole - first + end if len(over) else last - first
            if length < LEAST_RUN * found.far[group].max():
                continue
            kept[group] = True
            if len(over):
                runs += [(r, first, whole), (r, 0.0, end)]
            elif len(groups) == 1 and closes <= gap[group[0]]:
                runs.append((r, 0.0, whole))
            else:
                runs.append((r, first, last))
    return runs, found.take(kept)


def _grouped(rows: IntArray, low: FloatArray, high: FloatArray, gap: FloatArray) -> list[IntArray]:
    """Rows in order, split where the next begins more than a gap after all before it."""
    reached = np.maximum.accumulate(high[rows])
    new = np.flatnonzero(low[rows[1:]] > reached[:-1] + gap[rows[1:]]) + 1
    return np.split(rows, new)


def _removed(found: Overlaps, work: Centrelines, rings: BlockRings) -> _Stretches | None:
    """The stretches of streets that run along the rim."""
    if not len(found.first):
        return None
    a, b = rings.xy[found.first], rings.xy[rings.following[found.first]]
    p, q = work.segments[found.second, 0], work.segments[found.second, 1]
    d = q - p
    squared = (d**2).sum(axis=1)
    unit = (b - a) / np.hypot(*(b - a).T)[:, None]
    # across the rim, as the pairs were found
    divisor = (d * unit).sum(axis=1)
    ends = [
        (((a + share[:, None] * (b - a)) - p) * unit).sum(axis=1) / divisor
        for share in (found.low, found.high)
    ]
    slack = NODE_GRID / np.sqrt(squared)
    low, high = np.minimum(*ends), np.maximum(*ends)
    low, high = np.where(low <= slack, 0.0, low), np.where(high >= 1.0 - slack, 1.0, high)
    return _Stretches(found.second, np.clip(low, 0, 1), np.clip(high, 0, 1))


def _without(
    work: Centrelines, removed: _Stretches | None
) -> tuple[FloatArray, IntArray, FloatArray]:
    """What is left of the segments, the line of each piece, and where stretches ended."""
    if removed is None:
        return work.segments, work.line, np.empty((0, 2))
    touched = np.unique(removed.segment)
    order = np.lexsort((removed.high, removed.low, removed.segment))
    groups = np.split(order, np.searchsorted(removed.segment[order], touched)[1:])
    pieces, line, ends = [], [], []
    for s, group in zip(touched.tolist(), groups, strict=True):
        p, q = work.segments[s]
        reached = 0.0
        spans = [(removed.low[i], removed.high[i]) for i in group.tolist()]
        for low, high in [*spans, (1.0, 1.0)]:
            if low > reached:
                pieces.append([_at(p, q, reached), _at(p, q, low)])
                line.append(work.line[s])
            reached = max(reached, high)
        for low, high in spans:
            ends += [_at(p, q, low), _at(p, q, high)]
    untouched = np.setdiff1d(np.arange(len(work.line)), touched)
    left = np.array(pieces).reshape(-1, 2, 2)
    return (
        np.concatenate([work.segments[untouched], left]),
        np.concatenate([work.line[untouched], np.array(line, dtype=np.int64)]),
        np.array(ends).reshape(-1, 2),
    )


def _at(p: FloatArray, q: FloatArray, share: float) -> FloatArray:
    """A place on a segment; its ends exactly."""
    if share in (0.0, 1.0):
        return q if share else p
    return snap_to_grid(p + share * (q - p))


def _is_in(places: FloatArray, known: FloatArray) -> BoolArray:
    """(n,) which places are exactly one of some others."""
    both = np.concatenate([places, known]) + 0.0
    _, index = np.unique(both, axis=0, return_inverse=True)
    index = index.ravel()
    return np.isin(index[: len(places)], index[len(places) :])


def _cut_rim(
    rings: BlockRings,
    runs: list[tuple[int, float, float]],
    work: Centrelines,
    removed: _Stretches | None,
    land: Geometries,
) -> tuple[FloatArray, IntArray, Geometries]:
    """Segments of the rims with the line of the street along each, and the land that they bound."""
    length, before = _lengths(rings)
    segments, line, outlines = [], [], []
    for r in range(len(rings.block)):
        rows = np.arange(rings.offsets[r], rings.offsets[r + 1])
        corners = before[rows]
        whole = float(length[rows].sum())
        own = np.array([run[1:] for run in runs if run[0] == r]).reshape(-1, 2)
        cuts = own[(own > NODE_GRID) & (own < whole - NODE_GRID)]
        at, first = np.unique(np.round(np.append(corners, cuts), 6), return_index=True)
        edge = np.searchsorted(corners, np.append(corners, cuts)[first], side="right") - 1
        off = np.append(corners, cuts)[first] - corners[edge]
        a, b = rings.xy[rows[edge]], rings.xy[rings.following[rows[edge]]]
        xy = np.where(
            off[:, None] > 0, snap_to_grid(a + (off / length[rows[edge]])[:, None] * (b - a)), a
        )
        middle = (at + np.append(at[1:], whole)) / 2
        street = ((own[:, :1] <= middle) & (middle <= own[:, 1:])).any(axis=0)
        segments.append(np.stack([xy, np.roll(xy, -1, axis=0)], axis=1))
        line.append(street)
        outlines.append(shapely.LinearRing(xy))
    rim, is_street = np.concatenate(segments), np.concatenate(line)
    shells = np.flatnonzero(rings.is_shell)
    polygons = np.empty(len(land), dtype=object)
    for k, (begin, end) in enumerate(
        zip(shells.tolist(), [*shells[1:].tolist(), len(outlines)], strict=True)
    ):
        polygons[k] = shapely.Polygon(outlines[begin], outlines[begin + 1 : end])
    return rim, _nearest_line(rim, is_street, work, removed), polygons


def _nearest_line(
    rim: FloatArray, is_street: BoolArray, work: Centrelines, removed: _Stretches | None
) -> IntArray:
    """(R,) line of the street along each segment of the rims, -1 for none."""
    out = np.full(len(rim), -1)
    rows = np.flatnonzero(is_street)
    if removed is None or not len(rows):
        return out
    segments = np.unique(removed.segment)
    near, at = shapely.STRtree(shapely.linestrings(work.segments[segments])).query_nearest(
        shapely.points(rim[rows].mean(axis=1)), all_matches=True
    )
    line = work.line[segments[at]]
    order = np.lexsort((line, near))
    _, first = np.unique(near[order], return_index=True)
    out[rows] = line[order[first]]
    return out


def _attached(
    bits: FloatArray, ends: FloatArray, run: FloatArray, rim: FloatArray, snap: float
) -> FloatArray:
    """Move ends of streets that met one on the rim onto it, and dead ends that miss the rim."""
    out = bits.copy()
    places = bits.reshape(-1, 2)
    if not len(places):
        return out
    _, node, times = np.unique(places + 0.0, axis=0, return_inverse=True, return_counts=True)
    meets = _is_in(places, ends) if len(run) else np.zeros(len(places), dtype=bool)
    dead = times[node.ravel()] == 1
    moved = out.reshape(-1, 2)
    for rows, target, reach in (
        (np.flatnonzero(meets), run, np.inf),
        (np.flatnonzero(dead & ~meets), rim, snap),
    ):
        if not len(rows):
            continue
        lines = shapely.multilinestrings(list(target))
        points = shapely.points(places[rows])
        shapely.prepare(lines)
        close = shapely.dwithin(lines, points, reach) if np.isfinite(reach) else rows >= 0
        feet = shapely.get_coordinates(shapely.shortest_line(points[close], lines))
        moved[rows[close]] = snap_to_grid(feet.reshape(-1, 2, 2)[:, 1])
    return out
