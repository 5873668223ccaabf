"""Slices: strips into parcels by lines cast from the street (Vanegas 2012, section 4.2.3)."""

from __future__ import annotations

import bisect
import math
from dataclasses import dataclass
from functools import partial
from itertools import accumulate, pairwise
from typing import NamedTuple

from urban_processing.mesh.touches import loops_of
from urban_processing.parcelling.rows.bays import Bay, Hit, bays_of
from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.sight import sees
from urban_processing.parcelling.rows.spacing import CLEARANCE, END, Bounds, Profile, shares_of
from urban_processing.parcelling.rows.strips import Strip

STEP = 0.5
"""Distance of the places where the depth of a strip is measured, over the smallest width."""

CLOSE = 0.1
"""Lines that end this near to a vertex of the back, in metres, end there."""

TRIES = ((1.0, True, CLEARANCE), (1.0, False, CLEARANCE), (0.0, False, 1.05))
"""Shares of ω, whether lines are moved to vertices, and margins over the smallest area, in the
order in which they are tried."""


class Cut(NamedTuple):
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
        self.ring = strip.ring
        self.bays: list[Bay] = []
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
        return self.bays[max(bisect.bisect_right(self.bays, s, key=_start) - 1, 0)]

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

    def profile(self) -> Profile:
        """Area behind the front up to each length of it."""
        step = STEP * self.bounds.min_width
        end = 0.5 * END * self.length
        spots: list[float] = []
        for bay in self.bays:
            count = max(math.ceil(bay.length / step), 1)
            spots += [bay.start + bay.length * k / count for k in range(count)]
        spots[0] = end
        spots.append(self.length - end)
        areas = [self.area_before(self.cut(s, self._cast(s))) for s in spots]
        areas = [min(area, self.area) for area in accumulate(areas, max, initial=0.0)]
        return Profile([0.0, *spots, self.length], [*areas, self.area], self.bounds)

    def _cast(self, s: float) -> Hit:
        bay = self.bay_at(s)
        return self._joined(bay.cast(s - bay.start))

    def _joined(self, hit: Hit) -> Hit:
        """Take a vertex of the back that is very close instead."""
        edge = min(math.floor(hit.at), len(self.strip.back) - 2)
        sheet = self.sheet
        for k in (edge, edge + 1):
            v = self.strip.back[k]
            if math.hypot(sheet.x[v] - hit.x, sheet.y[v] - hit.y) < CLOSE:
                return Hit(float(k), sheet.x[v], sheet.y[v])
        return hit

    def cuts(self, draws: list[float]) -> list[Cut]:
        """Return the lines, in the order of the front.

        Parameters
        ----------
        draws
            Numbers in [0, 1), as many as there can be parcels.
        """
        self.bays = bays_of(self.sheet, self.strip, reach=self.bounds.min_width)
        cuts, aim = self._cuts(draws)
        if len(cuts) + 1 < aim:
            straight, self.bays = self.bays, bays_of(self.sheet, self.strip, reach=0.0)
            fanned, _ = self._cuts(draws)
            if len(fanned) > len(cuts):
                return fanned
            self.bays = straight
        return cuts

    def _cuts(self, draws: list[float]) -> tuple[list[Cut], int]:
        """Return lines, and how many parcels were aimed at."""
        profile = self.profile()
        aim = profile.number()
        for count in range(aim, 1, -1):
            cuts: list[Cut] = []
            for irregularity, snap, margin in TRIES:
                shares = shares_of(
                    draws[:count], irregularity * self.bounds.irregularity, self.bounds
                )
                hits: dict[float, Hit] = {}
                ends = profile.ends(
                    shares, partial(self._moved, hits) if snap else _unmoved, margin=margin
                )
                if ends is None:
                    continue
                cuts = [self.cut(s, hits.get(s) or self._cast(s)) for s in ends]
                if len(self._kept(cuts)) == len(cuts):
                    return [cut for cut in cuts if self._clear(cut)], aim
            if cuts:
                return [cut for cut in self._kept(cuts) if self._clear(cut)], aim
        return [], aim

    def _moved(self, hits: dict[float, Hit], s: float) -> float:
        """Move a line to a vertex of the front, or to where another row's line ends."""
        s, hit = self._snapped(s)
        hits[s] = hit
        return s

    def _snapped(self, s: float) -> tuple[float, Hit]:
        snap = max(self.bounds.snap, CLOSE)
        k = bisect.bisect(self.s, s)
        near = min(
            (self.s[j] for j in (k - 1, k) if 0 < j < len(self.s) - 1),
            default=math.inf,
            key=lambda at: abs(at - s),
        )
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
            if math.hypot(x - hit.x, y - hit.y) > 2.0 * snap:
                continue
            t = (x - bay.x) * bay.dx + (y - bay.y) * bay.dy
            origin = bay.origin(t)
            if origin is None:
                continue
            gap = abs(origin + bay.start - s)
            if gap > snap or (best is not None and gap >= best[0]):
                continue
            seen = bay.reach(t)
            if abs(seen.x - x) + abs(seen.y - y) < 1e-3:
                best = (gap, origin + bay.start, Hit(edge + share, x, y))
        return (s, self._joined(hit)) if best is None else best[1:]

    def _kept(self, cuts: list[Cut]) -> list[Cut]:
        """Leave out lines that cross one before, or leave too small a parcel."""
        least = self.bounds.min_area
        kept: list[Cut] = []
        areas = [0.0]
        for cut in cuts:
            area = self.area_before(cut)
            if area - areas[-1] >= least and (not kept or cut.hit.at <= kept[-1].hit.at + 1e-9):
                kept.append(cut)
                areas.append(area)
        while kept and self.area - areas[-1] < least:
            kept.pop()
            areas.pop()
        return kept

    def _clear(self, cut: Cut) -> bool:
        """Whether a line runs within the strip."""
        bay = self.bay_at(cut.s)
        px, py = bay.x + (cut.s - bay.start) * bay.dx, bay.y + (cut.s - bay.start) * bay.dy
        return sees(self.sheet, self.ring, p=(px, py), q=(cut.hit.x, cut.hit.y))

    def lots(self, cuts: list[Cut]) -> list[Lot]:
        """Add the ends of the lines to the sheet; return the parts of the strip between them."""
        sheet, strip = self.sheet, self.strip
        back, front = strip.back, strip.front
        last = len(back) - 1
        lots = []
        start, place = front[0], 0
        end = (last, back[last])
        for cut in cuts:
            u, v = front[cut.place], front[cut.place + 1]
            vertex = sheet.insert(u, v, cut.share)
            passed = cut.place if vertex == u else cut.place + 1
            edge = min(math.floor(cut.hit.at), last - 1)
            rear = sheet.insert(back[edge], back[edge + 1], cut.hit.at - edge)
            begin = (edge + 1, rear) if rear == back[edge + 1] else (edge, rear)
            chain = [start, *front[place + 1 : passed], vertex]
            lots.append(Lot(chain, begin, end))
            start, end = vertex, begin
            place = passed if vertex == front[passed] else passed - 1
        lots.append(Lot([start, *front[place + 1 :]], (0, back[0]), end))
        return lots


def rings_of_lots(sheet: Sheet, strip: Strip, lots: list[Lot]) -> list[list[list[list[int]]]]:
    """Polygons of each part of a strip, with all points that were added on its back.

    A part is more than one polygon where it touches itself at a vertex. Each has its shell first,
    then holes: what a part surrounds alone.
    """
    back = strip.back
    spots: list[tuple[int, int]] = []
    for k, (u, v) in enumerate(pairwise(back)):
        spots.append((k, u))
        spots += [(k, point) for _, point in sheet.between(u, v)]
    spots.append((len(back) - 1, back[-1]))
    place = {spot: k for k, spot in enumerate(spots)}
    rings = (
        lot.front + [v for _, v in spots[place[lot.begin] : place[lot.end] + 1]] for lot in lots
    )
    own = range(len(sheet.x))
    return [_polygons(sheet, loops_of(ring, own)) for ring in rings]


def _polygons(sheet: Sheet, loops: list[list[int]]) -> list[list[list[int]]]:
    if len(loops) == 1:
        return [loops]
    polygons = [[loop] for loop in loops if sheet.area(loop) > 0.0]
    for loop in loops:
        if sheet.area(loop) < 0.0:
            around = [p for p in polygons if sheet.contains(p[0], loop)]
            min(around or polygons, key=lambda p: sheet.area(p[0])).append(loop)
    return polygons


def _start(bay: Bay) -> float:
    return bay.start


def _unmoved(s: float) -> float:
    return s
