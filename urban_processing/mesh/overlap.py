"""Where lines run along one another, measured on the lines themselves."""

from __future__ import annotations

from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray


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
    """Pairs of segments that run along one another, from share `low` to `high` of the first.

    `aside` and `far` are how far the second lies to the left of the first halfway between these,
    and the largest distance to either side, in metres across the first; `angle` is that between
    them in degrees, 0 to 90.
    """

    first: IntArray
    second: IntArray
    low: FloatArray
    high: FloatArray
    aside: FloatArray
    far: FloatArray
    angle: FloatArray

    def take(self, rows: IntArray | BoolArray) -> Overlaps:
        """Return some of the pairs."""
        return Overlaps(*(getattr(self, field.name)[rows] for field in fields(self)))


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


def find_overlaps(
    first: Segments,
    second: Segments,
    tolerance: float | FloatArray,
    *,
    clipped: bool = False,
    least: float | None = None,
) -> Overlaps:
    """All pairs that lie within a tolerance of one another along a length, sorted.

    Parameters
    ----------
    first, second
        Segments.
    tolerance
        Metres across the first segment, one for all or one for each second segment.
    clipped
        Whether of two segments that are further apart at one end the rest is taken; else they
        are no pair.
    least
        Metres that they run along one another at least; by default the tolerance.
    """
    within = np.broadcast_to(np.asarray(tolerance, dtype=np.float64), len(second.line))
    j, i = shapely.STRtree(_lines(first)).query(
        _lines(second), predicate="dwithin", distance=within
    )
    order = np.lexsort((j, i))
    i, j = i[order], j[order]
    limit = within[j]
    d = first.end[i] - first.start[i]
    length = np.hypot(d[:, 0], d[:, 1])
    d = d / length[:, None]
    along_a, off_a = _relative(second.start[j] - first.start[i], d)
    along_b, off_b = _relative(second.end[j] - first.start[i], d)
    low = np.clip(np.minimum(along_a, along_b), 0.0, length)
    high = np.clip(np.maximum(along_a, along_b), 0.0, length)
    run = along_b - along_a
    slope = (off_b - off_a) / np.where(run == 0.0, 1.0, run)
    if clipped:
        low, high = _clipped(low, high, off_a - slope * along_a, slope, limit)
    ends = [off_a + slope * (at - along_a) for at in (low, high)]
    far = np.maximum(np.abs(ends[0]), np.abs(ends[1]))
    on = high - low > (limit if least is None else least)
    if not clipped:
        on &= far <= limit
    found = Overlaps(
        i,
        j,
        low / length,
        high / length,
        (ends[0] + ends[1]) / 2,
        far,
        np.degrees(np.arctan2(np.abs(off_b - off_a), np.abs(run))),
    )
    return found.take(on)


def _clipped(
    low: FloatArray, high: FloatArray, at_start: FloatArray, slope: FloatArray, limit: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """What is left of stretches where ``at_start + slope * along`` is within a limit."""
    level = slope == 0.0
    divisor = np.where(level, 1.0, slope)
    bounds = (-limit - at_start) / divisor, (limit - at_start) / divisor
    inside = np.abs(at_start) <= limit
    begin = np.where(level, np.where(inside, low, high), np.minimum(*bounds))
    end = np.where(level, high, np.maximum(*bounds))
    return np.maximum(low, begin), np.minimum(high, end)


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
