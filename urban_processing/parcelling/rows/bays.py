"""Bays: where a line cast from a strip's front at a right angle meets its back."""

from __future__ import annotations

import bisect
import math
from itertools import accumulate, pairwise
from typing import NamedTuple

from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.strips import Guide, Strip

TINY = 1e-6

STEEP = 0.05
"""A part of the back that leans by less from a line, along it, is met at its nearer end."""


class Hit(NamedTuple):
    """Where a line from the front meets the back.

    Parameters
    ----------
    at
        Position along the back; a whole number is a vertex.
    x, y
        Coordinates.
    """

    at: float
    x: float
    y: float


class Bay:
    """A straight run of a strip's front, and the part of the back that lies behind it.

    Lines are cast at right angles to the run. Beside a bend, where they would cross those of the
    next bay or leave a wedge between, they are fanned: over twice the width of the wedge their
    ends are moved evenly, so that the line at the bend itself ends where the arc of the skeleton
    from there does (Vanegas 2012, section 4.2.3: rays stay within their face of the skeleton).

    Parameters
    ----------
    start
        Length of the front up to the run.
    first, last
        Places of its ends in the front.
    guides
        Guides of bends of the front that lines are fanned beside.
    """

    def __init__(
        self,
        sheet: Sheet,
        strip: Strip,
        guides: dict[int, Guide],
        *,
        start: float,
        first: int,
        last: int,
    ) -> None:
        u, v = strip.front[first], strip.front[last]
        self.start, self.first, self.last = start, first, last
        self.x, self.y = sheet.x[u], sheet.y[u]
        ex, ey = sheet.x[v] - self.x, sheet.y[v] - self.y
        self.length = math.hypot(ex, ey)
        self.dx, self.dy = ex / self.length, ey / self.length
        begin = guides.get(v) if last < len(strip.front) - 1 else None
        end = guides.get(u) if first > 0 else None
        self._window(sheet, strip, begin=begin, end=end)
        self._knots(begin is not None, end is not None)

    def _window(
        self,
        sheet: Sheet,
        strip: Strip,
        *,
        begin: Guide | None,
        end: Guide | None,
    ) -> None:
        n = len(strip.back) - 1
        low = begin[0] if begin is not None else 0.0
        high = max(end[0] if end is not None else float(n), low)
        spots = [] if begin is None else [begin]
        spots += [
            (float(k), sheet.x[strip.back[k]], sheet.y[strip.back[k]])
            for k in range(math.floor(low) + (begin is not None), math.ceil(high))
        ]
        corner = strip.back[n]
        spots.append(end if end is not None else (float(n), sheet.x[corner], sheet.y[corner]))
        self.at = [spot[0] for spot in spots]
        self.t, self.h = [], []
        for _, px, py in spots:
            px, py = px - self.x, py - self.y
            self.t.append(px * self.dx + py * self.dy)
            self.h.append(py * self.dx - px * self.dy)
        self.falling = all(b <= a for a, b in pairwise(self.t))
        self.negative = [-t for t in self.t] if self.falling else []

    def _knots(self, right: bool, left: bool) -> None:
        """Where along the run ends of lines are moved, and where to."""
        length = self.length
        t0 = self.t[-1] if left else 0.0
        t1 = self.t[0] if right else length
        if t0 > t1:
            t0 = t1 = 0.5 * (t0 + t1)
        zone0, zone1 = 2.0 * abs(t0), 2.0 * abs(length - t1)
        if zone0 + zone1 > length or max(t0, length - t1) > 0.5 * length:
            self.knots = [(0.0, t0), (length, t1)]
            return
        self.knots = [(0.0, t0)]
        if zone0 > TINY:
            self.knots.append((zone0, zone0))
        if zone1 > TINY and length - zone1 > self.knots[-1][0] + TINY:
            self.knots.append((length - zone1, length - zone1))
        if self.knots[-1][0] < length - TINY:
            self.knots.append((length, t1))

    def target(self, s: float) -> float:
        """Where along the run a line from ``s`` ends."""
        for (s0, t0), (s1, t1) in pairwise(self.knots):
            if s <= s1:
                return t0 + (s - s0) * (t1 - t0) / (s1 - s0)
        return self.knots[-1][1]

    def origin(self, t: float) -> float | None:
        """Where along the run the line begins that ends at ``t``; None if there is none."""
        for (s0, t0), (s1, t1) in pairwise(self.knots):
            if t0 <= t <= t1 and t1 > t0:
                return s0 + (t - t0) * (s1 - s0) / (t1 - t0)
        return None

    def cast(self, s: float) -> Hit:
        """Return where the line from ``s`` along the run meets the back first."""
        return self.reach(self.target(s))

    def reach(self, t: float) -> Hit:
        """Return where the line at right angles to the run at ``t`` meets the back first."""
        spots = self.t
        best: tuple[float, int, float] | None = None
        last = len(spots) - 1
        if self.falling:
            k = bisect.bisect_left(self.negative, -t)
            steps = range(max(k - 1, 0), min(k + 1, last))
        else:
            steps = range(last)
        for k in steps:
            a, b = spots[k], spots[k + 1]
            if not (min(a, b) <= t <= max(a, b)):
                continue
            rise = self.h[k + 1] - self.h[k]
            if b - a > STEEP * abs(rise):
                continue  # seen from behind: the other side of an arc that is open
            if a - b > STEEP * abs(rise):
                share = (t - a) / (b - a)
            else:
                share = 0.0 if (rise > 0.0) == (self.h[k] > TINY) else 1.0
            h = self.h[k] + share * rise
            if h > TINY and (best is None or h < best[0]):
                best = (h, k, share)
        if best is None:
            k = min(range(last + 1), key=lambda j: abs(spots[j] - t))
            return self._hit(self.at[k], spots[k], self.h[k])
        h, k, share = best
        at = self.at[k] + share * (self.at[k + 1] - self.at[k])
        return self._hit(at, spots[k] + share * (spots[k + 1] - spots[k]), h)

    def _hit(self, at: float, t: float, h: float) -> Hit:
        return Hit(at, self.x + t * self.dx - h * self.dy, self.y + t * self.dy + h * self.dx)


def bays_of(sheet: Sheet, strip: Strip, *, reach: float) -> list[Bay]:
    """Divide the front of a strip where it bends.

    Bends within ``reach`` of its ends are taken for parts of a rounded corner, where no lines
    are fanned: those of the straight run beside it stay at right angles.
    """
    front = strip.front
    ends = [k for k, v in enumerate(front) if k and v in strip.corners]
    if not ends or ends[-1] != len(front) - 1:
        ends.append(len(front) - 1)
    guides = _guides(sheet, strip, reach if front[0] != front[-1] else 0.0)
    bays = []
    first, start = 0, 0.0
    for last in ends:
        bay = Bay(sheet, strip, guides, start=start, first=first, last=last)
        bays.append(bay)
        first, start = last, start + bay.length
    return bays


def _guides(sheet: Sheet, strip: Strip, reach: float) -> dict[int, Guide]:
    """Guides away from the ends; one that is lacking, or crosses others, is the one before it."""
    front = strip.front
    along = [0.0, *accumulate(sheet.distance(u, v) for u, v in pairwise(front))]
    limit, mark = float(len(strip.back) - 1), None
    guides = {}
    for k in range(1, len(front) - 1):
        vertex = front[k]
        if vertex not in strip.corners or min(along[k], along[-1] - along[k]) < reach:
            continue
        guide = strip.guides.get(vertex)
        if guide is not None and guide[0] <= limit:
            limit, mark = guide[0], guide
        if mark is not None:
            guides[vertex] = mark
    return guides
