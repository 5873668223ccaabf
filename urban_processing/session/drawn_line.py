"""A line that somebody drew, measured along its length, and how it lies to boundaries."""

from __future__ import annotations

import bisect
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.mesh.planar import FloatArray, IntArray

SAME_PLACE = 1e-6
"""Places within so many metres of each other are one: coordinates are kept to the micrometre."""

PARALLEL = 1e-12
"""Sine of the smallest angle at which two segments are said to cross."""

AT_END = 1e-9
"""A crossing within this share of a segment beyond its end is still one."""


@dataclass(frozen=True, eq=False)
class DrawnLine:
    """A line of n vertices that does not cross itself; `s` is the length along it in metres.

    Parameters
    ----------
    xy
        (n, 2) vertices in local coordinates, no two following ones at the same place.
    """

    xy: FloatArray

    @cached_property
    def s(self) -> FloatArray:
        """(n,) length along the line up to each vertex."""
        return np.append(0.0, np.cumsum(np.hypot(*np.diff(self.xy, axis=0).T)))

    @property
    def length(self) -> float:
        """Length in metres."""
        return float(self.s[-1])

    def at(self, s: float) -> FloatArray:
        """(2,) the place at a length along the line; beyond its ends, straight on."""
        lengths = self._lengths
        k = min(max(bisect.bisect_right(lengths, s) - 1, 0), len(lengths) - 2)
        a, b = self.xy[k], self.xy[k + 1]
        return np.asarray(a + (s - lengths[k]) / (lengths[k + 1] - lengths[k]) * (b - a))

    @cached_property
    def _lengths(self) -> list[float]:
        return [float(s) for s in self.s]

    def between(self, start: float, stop: float) -> FloatArray:
        """(m, 2) vertices strictly between two lengths along the line."""
        return self.xy[(self.s > start + SAME_PLACE) & (self.s < stop - SAME_PLACE)]

    def near(self, segments: FloatArray, distance: float) -> FloatArray:
        """(k, 2) runs of the line, from length to length, within a distance of some segments.

        Parameters
        ----------
        segments
            (S, 2, 2) ends of segments.
        distance
            Metres.
        """
        row, other = self._boxes_meet(segments, distance)
        if not len(row):
            return np.empty((0, 2))
        a = self.xy[row]
        step = np.diff(self.s)[row]
        along = (self.xy[row + 1] - a) / step[:, None]
        first, last = _within(a, along, segments[other, 0], segments[other, 1], distance)
        first, last = np.maximum(first, 0.0), np.minimum(last, step)
        met = first <= last
        return _merged(np.column_stack([first, last])[met] + self.s[row[met], None])

    def crossings(self, segments: FloatArray, *, beyond: float) -> tuple[FloatArray, IntArray]:
        """Lengths along the line, in order, at which it crosses segments; and which segment.

        Both ends are prolonged straight by `beyond` metres; lengths there are negative, or more
        than that of the line.
        """
        xy, s = self.xy.copy(), self.s.copy()
        xy[0], xy[-1] = self.at(-beyond), self.at(self.length + beyond)
        s[0], s[-1] = -beyond, self.length + beyond
        row, other = self._boxes_meet(segments, beyond)
        a, d = xy[row], xy[row + 1] - xy[row]
        u = segments[other, 0]
        e = segments[other, 1] - u
        across = _cross(d, e)
        slant = np.abs(across) > PARALLEL * np.hypot(*d.T) * np.hypot(*e.T)
        a, d, u, e, across = (v[slant] for v in (a, d, u, e, across))
        row, other = row[slant], other[slant]
        t, w = _cross(u - a, e) / across, _cross(u - a, d) / across
        met = (np.minimum(t, w) >= -AT_END) & (np.maximum(t, w) <= 1.0 + AT_END)
        row, other = row[met], other[met]
        found = s[row] + np.clip(t[met], 0.0, 1.0) * (s[row + 1] - s[row])
        order = np.argsort(found, kind="stable")
        return found[order], other[order]

    def _boxes_meet(self, segments: FloatArray, distance: float) -> tuple[IntArray, IntArray]:
        """Pairs of a piece of the line and a segment whose boxes are within a distance."""
        low = np.minimum(self.xy[:-1], self.xy[1:]) - distance
        high = np.maximum(self.xy[:-1], self.xy[1:]) + distance
        u, v = segments.min(axis=1), segments.max(axis=1)
        meets = (low[:, None] <= v[None]).all(axis=2) & (high[:, None] >= u[None]).all(axis=2)
        row, other = np.nonzero(meets)
        return row, other


def as_line(line: object, *, tolerance: float = 0.0) -> DrawnLine:
    """Check a line (n, 2) that was drawn, and thin it within a tolerance in metres.

    Raises
    ------
    EditError
        If it is no line, has no length, or crosses itself.
    """
    xy = as_points(line)
    xy = xy[np.hypot(*np.diff(xy, axis=0, prepend=xy[:1] - 1.0).T) > SAME_PLACE]
    if len(xy) < 2:
        raise EditError("The line has no length: draw it from one place to another.")
    drawn = shapely.LineString(xy)
    if not drawn.is_simple:
        raise EditError("The line crosses itself: draw one that does not.")
    thinned = shapely.get_coordinates(shapely.simplify(drawn, tolerance))
    return DrawnLine(thinned)


def as_points(line: object) -> FloatArray:
    """(n, 2) two points or more that were drawn; `EditError` where they are none."""
    try:
        xy = np.array(line, dtype=np.float64)
    except (TypeError, ValueError):
        xy = np.empty(0)
    if xy.ndim != 2 or xy.shape[1] != 2:
        raise EditError("A line must be a list of points, each with two coordinates, x and y.")
    if not np.isfinite(xy).all():
        raise EditError("A point of the line has a coordinate that is no finite number.")
    if len(xy) < 2:
        raise EditError("A line must have two points or more.")
    return xy


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0])


def _within(
    a: FloatArray, along: FloatArray, u: FloatArray, v: FloatArray, distance: float
) -> tuple[FloatArray, FloatArray]:
    """From where to where points that go from `a` along unit vectors are within a distance of uv.

    The places within a distance of a segment are convex: two discs and the box between them.
    """
    runs = [_within_disc(a, along, centre, distance) for centre in (u, v)]
    edge = v - u
    size = np.maximum(np.hypot(*edge.T), 1e-300)
    unit = edge / size[:, None]
    off, ahead = _cross(unit, a - u), ((a - u) * unit).sum(axis=1)
    runs.append(
        _overlap(
            _between(off, _cross(unit, along), -distance, distance),
            _between(ahead, (along * unit).sum(axis=1), 0.0, size),
        )
    )
    first = np.min([np.where(p <= q, p, np.inf) for p, q in runs], axis=0)
    last = np.max([np.where(p <= q, q, -np.inf) for p, q in runs], axis=0)
    return first, last


def _within_disc(
    a: FloatArray, along: FloatArray, centre: FloatArray, radius: float
) -> tuple[FloatArray, FloatArray]:
    middle = ((centre - a) * along).sum(axis=1)
    off = _cross(along, centre - a)
    half = np.sqrt(np.maximum(radius**2 - off**2, 0.0))
    missed = np.abs(off) > radius
    return np.where(missed, np.inf, middle - half), np.where(missed, -np.inf, middle + half)


def _between(
    value: FloatArray, slope: FloatArray, low: FloatArray | float, high: FloatArray | float
) -> tuple[FloatArray, FloatArray]:
    """Where a linear function is between two bounds."""
    flat = np.abs(slope) < PARALLEL
    safe = np.where(flat, 1.0, slope)
    p, q = (low - value) / safe, (high - value) / safe
    inside = (value >= low) & (value <= high)
    first = np.where(flat, np.where(inside, -np.inf, np.inf), np.minimum(p, q))
    last = np.where(flat, np.where(inside, np.inf, -np.inf), np.maximum(p, q))
    return first, last


def _overlap(
    one: tuple[FloatArray, FloatArray], other: tuple[FloatArray, FloatArray]
) -> tuple[FloatArray, FloatArray]:
    return np.maximum(one[0], other[0]), np.minimum(one[1], other[1])


def _merged(runs: FloatArray) -> FloatArray:
    """Join runs that overlap or touch, in order."""
    if not len(runs):
        return runs
    runs = runs[np.argsort(runs[:, 0], kind="stable")]
    reach = np.maximum.accumulate(runs[:, 1])
    begins = np.append(True, runs[1:, 0] > reach[:-1] + SAME_PLACE)
    at = np.flatnonzero(begins)
    return np.column_stack([runs[at, 0], reach[np.append(at[1:], len(runs)) - 1]])
