"""Where lines run along one another, measured on the lines themselves."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Segments:
    """Straight segments of lines: `start` and `end` are (n, 2), `line` says whose they are."""

    start: FloatArray
    end: FloatArray
    line: IntArray

    @property
    def length(self) -> FloatArray:
        """(n,) length in metres."""
        return np.asarray(np.hypot(*(self.end - self.start).T))


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Pairs of segments that run along one another, from share `low` to `high` of the first."""

    first: IntArray
    second: IntArray
    low: FloatArray
    high: FloatArray


def segments_of(geometries: npt.NDArray[np.object_]) -> Segments:
    """Segments of lines, or of the rings of polygons, holes included."""
    parts, part_of = shapely.get_parts(geometries, return_index=True)
    rings, ring_of = shapely.get_rings(parts, return_index=True)
    is_line = shapely.get_dimensions(parts) == 1
    lines = np.concatenate([parts[is_line], rings])
    owner = np.concatenate([part_of[is_line], part_of[ring_of]])
    xy, line = shapely.get_coordinates(lines, return_index=True)
    within = np.flatnonzero((line[1:] == line[:-1]) & (xy[1:] != xy[:-1]).any(axis=1))
    return Segments(xy[within], xy[within + 1], owner[line[within]])


def unmatched_segments(polygons: npt.NDArray[np.object_]) -> Segments:
    """Segments of the rings of polygons that no other polygon has in the opposite direction.

    Of polygons that share their vertices where they meet, and do not overlap, those are left
    that bound all of them together.
    """
    segments = segments_of(np.asarray(shapely.orient_polygons(polygons), dtype=object))
    ends = np.concatenate([segments.start, segments.end]) + 0.0  # no negative zeros
    _, place = np.unique(ends[:, 0] + 1j * ends[:, 1], return_inverse=True)
    start, end = place.reshape(2, -1)
    low, high = np.minimum(start, end), np.maximum(start, end)
    _, edge = np.unique(low * (place.max(initial=0) + 1) + high, return_inverse=True)
    balance = np.bincount(edge, weights=np.where(start < end, 1.0, -1.0))
    left = (balance[edge] != 0) | (np.bincount(edge)[edge] > 2)
    return Segments(segments.start[left], segments.end[left], segments.line[left])


def find_overlaps(first: Segments, second: Segments, tolerance: float) -> Overlaps:
    """All pairs that lie within `tolerance` metres of one another along a length."""
    tree = shapely.STRtree(_lines(second))
    i, j = tree.query(_lines(first), predicate="dwithin", distance=tolerance)
    d = first.end[i] - first.start[i]
    length = np.hypot(d[:, 0], d[:, 1])
    d = d / length[:, None]
    along_a, off_a = _relative(second.start[j] - first.start[i], d)
    along_b, off_b = _relative(second.end[j] - first.start[i], d)
    low = np.clip(np.minimum(along_a, along_b), 0.0, length)
    high = np.clip(np.maximum(along_a, along_b), 0.0, length)
    run = along_b - along_a
    slope = (off_b - off_a) / np.where(run == 0.0, 1.0, run)
    far = np.maximum(
        np.abs(off_a + slope * (low - along_a)), np.abs(off_a + slope * (high - along_a))
    )
    on = (high - low > tolerance) & (far <= tolerance)
    return Overlaps(i[on], j[on], low[on] / length[on], high[on] / length[on])


def covered_share(overlaps: Overlaps, n: int) -> FloatArray:
    """(n,) share of each first segment that some second one runs along."""
    order = np.lexsort((overlaps.low, overlaps.first))
    # intervals of different segments are set apart, so that one running maximum does for all
    shift = 2.0 * overlaps.first[order]
    low, high = shift + overlaps.low[order], shift + overlaps.high[order]
    reached = np.append(-1.0, np.maximum.accumulate(high)[:-1]) if len(high) else high
    new = np.maximum(0.0, high - np.maximum(low, reached))
    share = np.bincount(overlaps.first[order], weights=new, minlength=n)
    return np.asarray(share, dtype=np.float64)


def _lines(segments: Segments) -> npt.NDArray[np.object_]:
    ends = np.stack([segments.start, segments.end], axis=1)
    return np.asarray(shapely.linestrings(ends), dtype=object)


def _relative(offset: FloatArray, direction: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Distance along and to the left of a direction."""
    along = offset[:, 0] * direction[:, 0] + offset[:, 1] * direction[:, 1]
    left = direction[:, 0] * offset[:, 1] - direction[:, 1] * offset[:, 0]
    return along, left
