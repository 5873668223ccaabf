"""Slices: strips into parcels by lines cast from the street (Vanegas 2012, section 4.2.3)."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from itertools import accumulate, pairwise
from statistics import NormalDist

from urban_processing.parcelling.bays import Bay, Hit, bays_of
from urban_processing.parcelling.sheet import Sheet
from urban_processing.parcelling.strips import Strip

SPREAD = 1.0 / 3.0
"""Standard deviation of widths over the mean width where ω is 1. The paper prints σ² = 3ω, in
m², which has another meaning for each mean width."""

MARGIN = 1.1
"""Parcels are meant to be this much above the smallest area, and below the largest, so that a
line that is moved a little does not break a bound."""

_NORMAL = NormalDist()


@dataclass(frozen=True)
class Bounds:
    """Bounds of the parcels of one block, lengths in metres and areas in m²."""

    min_area: float
    max_area: float
    min_width: float
    max_width: float
    irregularity: float
    snap: float

    @property
    def mean_width(self) -> float:
        """Width aimed at."""
        return 0.5 * (self.min_width + self.max_width)


@dataclass(frozen=True)
class Cut:
    """A line from a point of the front, at length ``s`` along it, to a point of the back.

    ``place`` and ``share`` say where the point lies on the front: on which of its edges and where
    there.
    """

    s: float
    place: int
    share: float
    hit: Hit


@dataclass(frozen=True)
class Lot:
    """A part of a strip between two lines.

    Parameters
    ----------
    front
        Vertices along the street.
    begin, end
        Edge of the back and vertex where its part of the back begins and ends.
    """

    front: list[int]
    begin: tuple[int, int]
    end: tuple[int, int]


class Slicer:
    """Divides one strip into parcels."""

    def __init__(self, sheet: Sheet, strip: Strip, bounds: Bounds) -> None:
        self.sheet, self.strip, self.bounds = sheet, strip, bounds
        self.bays = bays_of(sheet, strip)
        self.starts = [bay.start for bay in self.bays]
        front, back = strip.front, strip.back
        self.s = [0.0, *accumulate(sheet.distance(u, v) for u, v in pairwise(front))]
        self.x0, self.y0 = sheet.x[front[0]], sheet.y[front[0]]
        self.front_sum = [0.0, *accumulate(self._cross(u, v) for u, v in pairwise(front))]
        sums = [0.0, *accumulate(self._cross(u, v) for u, v in pairwise(reversed(back)))]
        self.back_sum = [-value for value in reversed(sums)]
        self.area = 0.5 * (self.front_sum[-1] + self.back_sum[0])

    def _cross(self, u: int, v: int) -> float:
        x, y = self.sheet.x, self.sheet.y
        return (x[u] - self.x0) * (y[v] - self.y0) - (x[v] - self.x0) * (y[u] - self.y0)

    @property
    def length(self) -> float:
        """Length of the front."""
        return self.s[-1]

    def bay_at(self, s: float) -> Bay:
        """Return the bay at a length along the front."""
        return self.bays[max(bisect.bisect_right(self.starts, s) - 1, 0)]

    def cut(self, s: float, hit: Hit) -> Cut:
        """Return the line from a length along the front to a point of the back."""
        place = min(max(bisect.bisect_right(self.s, s) - 1, 0), len(self.s) - 2)
        return Cut(s, place, (s - self.s[place]) / (self.s[place + 1] - self.s[place]), hit)

    def area_before(self, cut: Cut) -> float:
        """Area of the strip on the side of a line where the front begins."""
        sheet = self.sheet
        u, v = self.strip.front[cut.place], self.strip.front[cut.place + 1]
        ux, uy = sheet.x[u] - self.x0, sheet.y[u] - self.y0
        px = ux + cut.share * (sheet.x[v] - self.x0 - ux)
        py = uy + cut.share * (sheet.y[v] - self.y0 - uy)
        qx, qy = cut.hit.x - self.x0, cut.hit.y - self.y0
        k = min(math.floor(cut.hit.at) + 1, len(self.strip.back) - 1)
        w = self.strip.back[k]
        wx, wy = sheet.x[w] - self.x0, sheet.y[w] - self.y0
        total = self.front_sum[cut.place] + ux * py - px * uy
        total += px * qy - qx * py + qx * wy - wx * qy + self.back_sum[k]
        return 0.5 * total

    def measure(self) -> tuple[list[float], list[float], list[float]]:
        """Lengths along the front, area and number of parcels up to each."""
        step = 0.5 * self.bounds.min_width
        spots: list[float] = []
        for bay in self.bays:
            count = max(math.ceil(bay.length / step), 1)
            spots += [bay.start + bay.length * k / count for k in range(count)]
        total = self.s[-1]
        spots[0] = min(1e-3, 1e-3 * total)
        spots.append(total - spots[0])
        areas = [self.area_before(self.cut(s, self._cast(s))) for s in spots]
        areas = list(accumulate(areas, max))
        b = self.bounds
        numbers = [0.0]
        for (s, t), (low, high) in zip(pairwise(spots), pairwise(areas), strict=True):
            numbers.append(numbers[-1] + (t - s) / self._width(t - s, high - low))
        first, last = max(areas[0], 0.0), max(self.area - areas[-1], 0.0)
        mean = max(b.min_area, self.area / max(numbers[-1], 1.0)) * MARGIN
        numbers = [number + first / mean for number in numbers]
        return (
            [0.0, *spots, total],
            [0.0, *areas, self.area],
            [0.0, *numbers, numbers[-1] + last / mean],
        )

    def _width(self, length: float, area: float) -> float:
        """Width of parcels aimed at where so much front has so much area behind it."""
        b = self.bounds
        depth = max(area, 1e-9) / length
        width = min(b.mean_width, b.max_area / MARGIN / depth)
        return max(width, b.min_width, b.min_area * MARGIN / depth)

    def _cast(self, s: float) -> Hit:
        bay = self.bay_at(s)
        return bay.cast(s - bay.start)

    def number(self, spots: list[float], areas: list[float], numbers: list[float]) -> int:
        """Return how many parcels the strip becomes."""
        b = self.bounds
        most = least = 0.0
        for (s, t), (low, high) in zip(pairwise(spots), pairwise(areas), strict=True):
            most += min((t - s) / b.min_width, (high - low) / b.min_area)
            least += max((t - s) / b.max_width, (high - low) / b.max_area)
        count = max(math.floor(numbers[-1] + 0.5), math.ceil(least - 1e-6))
        return max(min(count, math.floor(most + 1e-6), math.floor(self.area / b.min_area)), 1)

    def cuts(self, draws: list[float]) -> list[Cut]:
        """Return the lines, in the order of the front."""
        spots, areas, numbers = self.measure()
        count = self.number(spots, areas, numbers)
        tries = [(1.0, True), (1.0, False), (0.5, True), (0.0, True), (0.0, False)]
        if self.bounds.irregularity == 0.0:
            tries = tries[-2:]
        while count > 1:
            for most in (self.bounds.max_area, math.inf):
                for spread, snap in tries:
                    shares = self._shares(draws[:count], spread)
                    ends = [_interpolated(a * numbers[-1], numbers, spots) for a in shares[:-1]]
                    cuts = self._lines(ends, snap=snap)
                    if self._within_bounds(cuts, most):
                        return cuts
            count -= 1
        return []

    def _shares(self, draws: list[float], spread: float) -> list[float]:
        """Share of the whole at which each parcel ends: normally distributed widths."""
        b = self.bounds
        deviation = SPREAD * b.irregularity * spread
        low, high = b.min_width / b.mean_width, b.max_width / b.mean_width
        widths = [
            min(max(1.0 + deviation * _NORMAL.inv_cdf(min(max(u, 1e-9), 1 - 1e-9)), low), high)
            for u in draws
        ]
        total = sum(widths)
        return [at / total for at in accumulate(widths)]

    def _lines(self, ends: list[float], *, snap: bool) -> list[Cut]:
        cuts = []
        for s in ends:
            s, hit = self._snapped(s) if snap else (s, self._cast(s))
            cuts.append(self.cut(s, hit))
        return cuts

    def _snapped(self, s: float) -> tuple[float, Hit]:
        """Move a line to a vertex of the front, or to where another row's line ends."""
        snap = self.bounds.snap
        k = bisect.bisect(self.s, s)
        near = min((self.s[j] for j in (k - 1, k) if 0 < j < len(self.s) - 1), default=math.inf,
                   key=lambda at: abs(at - s))
        if abs(near - s) <= snap:
            return near, self._cast(near)
        bay = self.bay_at(s)
        hit = bay.cast(s - bay.start)
        back, sheet = self.strip.back, self.sheet
        edge = min(math.floor(hit.at), len(back) - 2)
        u, v = back[edge], back[edge + 1]
        best: tuple[float, float, Hit] | None = None
        for share, vertex in [(0.0, u), *sheet.between(u, v), (1.0, v)]:
            x, y = sheet.x[vertex], sheet.y[vertex]
            if abs(x - hit.x) + abs(y - hit.y) > 2.0 * snap:
                continue
            origin = bay.origin((x - bay.x) * bay.dx + (y - bay.y) * bay.dy)
            if origin is None:
                continue
            gap = abs(origin + bay.start - s)
            if gap <= snap and (best is None or gap < best[0]):
                best = (gap, origin + bay.start, Hit(edge + share, x, y))
        return (s, hit) if best is None else best[1:]

    def _within_bounds(self, cuts: list[Cut], max_area: float) -> bool:
        b = self.bounds
        s = [0.0, *(cut.s for cut in cuts), self.s[-1]]
        areas = [0.0, *(self.area_before(cut) for cut in cuts), self.area]
        backs = [cut.hit.at for cut in cuts]
        return (
            all(t - s >= 0.98 * b.min_width for s, t in pairwise(s))
            and all(b.min_area <= high - low <= max_area for low, high in pairwise(areas))
            and all(later <= before + 1e-9 for before, later in pairwise(backs))
        )

    def lots(self, cuts: list[Cut]) -> list[Lot]:
        """Add the ends of the lines to the sheet; return the parts of the strip between them."""
        sheet, strip = self.sheet, self.strip
        back, front = strip.back, strip.front
        last = len(back) - 1
        lots = []
        start, place = front[0], 0
        end = (last, back[last])
        for cut in cuts:
            if cut.share * (self.s[cut.place + 1] - self.s[cut.place]) < 1e-6:
                vertex, passed = front[cut.place], cut.place
            elif (1.0 - cut.share) * (self.s[cut.place + 1] - self.s[cut.place]) < 1e-6:
                vertex, passed = front[cut.place + 1], cut.place + 1
            else:
                u, v = front[cut.place], front[cut.place + 1]
                vertex = sheet.add_on(u, v, cut.share)
                passed = cut.place + 1
            edge = min(math.floor(cut.hit.at), last - 1)
            rear = sheet.insert(back[edge], back[edge + 1], cut.hit.at - edge)
            begin = (edge + 1, rear) if rear == back[edge + 1] else (edge, rear)
            chain = [start, *front[place + 1 : passed], vertex]
            lots.append(Lot(chain, begin, end))
            start, end = vertex, begin
            place = passed if vertex == front[passed] else passed - 1
        lots.append(Lot([start, *front[place + 1 :]], (0, back[0]), end))
        return lots


def rings_of_lots(sheet: Sheet, strip: Strip, lots: list[Lot]) -> list[list[int]]:
    """Rings of the parts of a strip, with all points that were added on its back."""
    back = strip.back
    spots: list[tuple[int, int]] = []
    for k, (u, v) in enumerate(pairwise(back)):
        spots.append((k, u))
        spots += [(k, point) for _, point in sheet.between(u, v)]
    spots.append((len(back) - 1, back[-1]))
    place = {spot: k for k, spot in enumerate(spots)}
    rings = []
    for lot in lots:
        ring = list(lot.front)
        for _, vertex in spots[place[lot.begin] : place[lot.end] + 1]:
            if vertex != ring[-1]:
                ring.append(vertex)
        if ring[-1] == ring[0]:
            ring.pop()
        rings.append(ring)
    return rings


def _interpolated(value: float, values: list[float], spots: list[float]) -> float:
    k = min(max(bisect.bisect_right(values, value) - 1, 0), len(values) - 2)
    rise = values[k + 1] - values[k]
    share = (value - values[k]) / rise if rise > 0.0 else 0.0
    return spots[k] + min(share, 1.0) * (spots[k + 1] - spots[k])
