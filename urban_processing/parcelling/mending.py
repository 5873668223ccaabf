"""From α-strips to β-strips: no diagonal ends, no strips too shallow or too small for a row."""

from __future__ import annotations

import math
from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import pairwise

from urban_processing.parcelling.sheet import Sheet
from urban_processing.parcelling.strips import Strip

SHARP = 0.5
"""Sine of half the angle of a corner from which the strips along it are rows back to back."""


@dataclass(frozen=True)
class Needs:
    """What strips of one block must hold; lengths in metres, area in m².

    Parameters
    ----------
    area
        Smallest area of a parcel.
    depth
        Depth that a parcel of the largest width needs.
    mean_depth
        Depth that a parcel of mean width needs.
    front
        Shortest front of a strip.
    by_length
        Whether the longer street wins a corner, not the wider one.
    reach
        Length over which bends of the contour are measured.
    snap
        Distance within which a cut goes through a vertex.
    """

    area: float
    depth: float
    mean_depth: float
    front: float
    by_length: bool
    reach: float
    snap: float


def beta_strips(
    sheet: Sheet, strips: list[Strip], needs: Needs, patio: Set[tuple[int, int]]
) -> tuple[list[Strip], list[Strip]]:
    """Make β-strips of α-strips (Vanegas 2012, sections 4.2.2 and 4.2.3).

    Strips too shallow for a parcel of the largest width are united with the one behind them, so
    that a block too shallow for two rows gets one; diagonal ends are mended; then strips too
    small for a parcel, and those without a street, go to the strip with which they share the
    longest border.

    Parameters
    ----------
    sheet
        The vertices.
    strips
        α-strips.
    needs
        What a strip must hold.
    patio
        Directed edges of patios.

    Returns
    -------
    strips
        β-strips, all of them on streets.
    left
        Strips without a street that have a longer border with a patio than with any of these.
    """
    strips = _unite(sheet, strips, needs, shallow=True, patio=patio)
    for strip in strips:
        for other in strips:
            if strip is not other and strip.front[-1] == other.front[0]:
                _mend(sheet, strip, other, needs)
    strips, left = _give_rims(sheet, [s for s in strips if len(s.ring) > 2], patio)
    return _unite(sheet, strips, needs, shallow=False, patio=frozenset()), left


def _rank(strip: Strip, needs: Needs, *, widths: bool) -> tuple[bool, float, float]:
    """Sort key of strips: the one with the larger key wins a corner."""
    width = strip.street.width if widths and not needs.by_length else 0.0
    return (not strip.street.rim, round(width, 6), round(strip.street.length, 6))


def _wins(strip: Strip, other: Strip, needs: Needs) -> bool:
    """T(v): whether a strip wins over another; a tie goes to the first (Vanegas 2012, 4.2.2)."""
    known = not math.isnan(strip.street.width + other.street.width)
    return _rank(strip, needs, widths=known) >= _rank(other, needs, widths=known)


def _mend(sheet: Sheet, before: Strip, after: Strip, needs: Needs) -> None:
    """Give the near-triangle beside the diagonal of two strips to one of them."""
    a, b = before.street.sides[-1], after.street.sides[0]
    if a.dx * b.dy - a.dy * b.dx <= 0.0 or (before.street.rim and after.street.rim):
        return
    if len(before.front) < 2 or len(after.front) < 2:
        return
    shared = 0
    most = min(len(before.back), len(after.back)) - 1
    while shared < most and before.back[shared + 1] == after.back[-2 - shared]:
        shared += 1
    if shared == 0:
        return
    top = max(range(1, shared + 1), key=lambda k: (round(sheet.height[before.back[k]], 6), -k))
    top = _lowered(sheet, before, after, top, needs)
    win = _wins(before, after, needs)
    foot = _foot(sheet, after if win else before, before.back[top], needs)
    if foot is None:
        return
    segment, share = foot
    if win:
        _pass_to_previous(sheet, before, after, top, segment, share)
    else:
        _pass_to_next(sheet, before, after, top, segment, share)


def _lowered(sheet: Sheet, before: Strip, after: Strip, top: int, needs: Needs) -> int:
    """End a sharp corner where two rows begin to be deep enough; return where it ends."""
    chain = before.back
    height = sheet.height
    far = sheet.distance(chain[0], chain[top])
    limit = needs.mean_depth
    if height[chain[top]] <= limit * 1.2 or height[chain[top]] > SHARP * far:
        return top
    k = next(k for k in range(1, top + 1) if height[chain[k]] > limit)
    u, v = chain[k - 1], chain[k]
    vertex = sheet.add_between(u, v, (limit - height[u]) / (height[v] - height[u]))
    before.splice(sheet, k - 1, k, [vertex])
    n = len(after.back)
    after.splice(sheet, n - 1 - k, n - k, [vertex])
    return k


def _foot(sheet: Sheet, strip: Strip, apex: int, needs: Needs) -> tuple[int, float] | None:
    """Nearest point of a strip's front that can be seen from a vertex of its back.

    Returned is the segment of the front and the share of its length.
    """
    x, y = sheet.x, sheet.y
    px, py = x[apex], y[apex]
    spots = []
    for k, (u, v) in enumerate(pairwise(strip.front)):
        ex, ey = x[v] - x[u], y[v] - y[u]
        share = ((px - x[u]) * ex + (py - y[u]) * ey) / (ex * ex + ey * ey)
        share = min(max(share, 0.0), 1.0)
        gap = math.hypot(x[u] + share * ex - px, y[u] + share * ey - py)
        spots.append((round(gap, 7), k, share))
    ring = strip.ring
    at = ring.index(apex)
    beside = (ring[at - 1], ring[(at + 1) % len(ring)])
    for gap, k, exact in sorted(spots):
        share = exact
        u, v = strip.front[k], strip.front[k + 1]
        length = sheet.distance(u, v)
        near = min(needs.snap, 0.05 * gap, 0.4 * length)
        share = 0.0 if share * length < near else 1.0 if (1.0 - share) * length < near else share
        qx, qy = x[u] + share * (x[v] - x[u]), y[u] + share * (y[v] - y[u])
        if gap <= 1e-6:
            continue
        end = u if share <= 0.0 else v if share >= 1.0 else -1
        if end in beside or sees(sheet, ring, (px, py), (qx, qy)):
            return k, share
    return None


def sees(sheet: Sheet, ring: Sequence[int], p: tuple[float, float], q: tuple[float, float]) -> bool:
    """Whether the line between two points of a ring's boundary runs within the ring."""
    (px, py), (qx, qy) = p, q
    dx, dy = qx - px, qy - py
    length = math.hypot(dx, dy)
    tolerance = 1e-6 * length
    mx, my = px + 0.5 * dx, py + 0.5 * dy
    inside = False
    u = ring[-1]
    ux, uy = sheet.x[u], sheet.y[u]
    su = (ux - px) * dy - (uy - py) * dx
    for v in ring:
        vx, vy = sheet.x[v], sheet.y[v]
        sv = (vx - px) * dy - (vy - py) * dx
        if (su > tolerance and sv < -tolerance) or (su < -tolerance and sv > tolerance):
            share = su / (su - sv)
            at = (ux + share * (vx - ux) - px) * dx + (uy + share * (vy - uy) - py) * dy
            if 1e-6 * length < at / length < length - 1e-6 * length:
                return False
        if (uy > my) != (vy > my) and ux + (my - uy) * (vx - ux) / (vy - uy) > mx:
            inside = not inside
        ux, uy, su = vx, vy, sv
    return inside


def _cut_front(sheet: Sheet, strip: Strip, segment: int, share: float) -> tuple[int, int]:
    """Make the foot of a cut a vertex of the front; return the vertex and its place there."""
    u, v = strip.front[segment], strip.front[segment + 1]
    if share <= 0.0:
        return u, segment
    if share >= 1.0:
        return v, segment + 1
    vertex = sheet.add_on(u, v, share)
    strip.front.insert(segment + 1, vertex)
    return vertex, segment + 1


def _pass_to_previous(
    sheet: Sheet, winner: Strip, loser: Strip, top: int, segment: int, share: float
) -> None:
    vertex, place = _cut_front(sheet, loser, segment, share)
    moved = loser.front[: place + 1]
    winner.splice(sheet, 0, top, moved[1:])
    winner.back[0] = moved[0]
    loser.front = loser.front[place:]
    loser.back.append(vertex)
    n = len(loser.back)
    _cut_back(sheet, loser, n - 2 - top, n - 1)


def _pass_to_next(
    sheet: Sheet, loser: Strip, winner: Strip, top: int, segment: int, share: float
) -> None:
    vertex, place = _cut_front(sheet, loser, segment, share)
    moved = loser.front[place:]
    n = len(winner.back)
    winner.splice(sheet, n - 1 - top, n - 1, moved[:-1])
    loser.front = loser.front[: place + 1]
    loser.back.insert(0, vertex)
    for key, (at, x, y) in loser.guides.items():
        loser.guides[key] = (at + 1.0, x, y)
    _cut_back(sheet, loser, 0, top + 1)


def _cut_back(sheet: Sheet, strip: Strip, start: int, stop: int) -> None:
    """Leave out what lies between two vertices of the back, and guides of a front that is gone."""
    kept = set(strip.front[1:-1])
    strip.guides = {v: guide for v, guide in strip.guides.items() if v in kept}
    strip.splice(sheet, start, stop, [])


def _give_rims(
    sheet: Sheet, strips: Sequence[Strip], patio: Set[tuple[int, int]]
) -> tuple[list[Strip], list[Strip]]:
    """Give what has no street to the strips on streets, each to its longest border.

    In each round borders are those before the round, so that none collects all around a hole.
    """
    streets = [strip for strip in strips if not strip.street.rim]
    rims = [strip for strip in strips if strip.street.rim]
    while True:
        hosts = [_host(sheet, rim, streets, patio) for rim in rims]
        given = [
            host is not None and _absorb(sheet, host, rim)
            for rim, host in zip(rims, hosts, strict=True)
        ]
        if not any(given):
            return streets, rims
        rims = [rim for rim, gone in zip(rims, given, strict=True) if not gone]


def _unite(
    sheet: Sheet,
    strips: Sequence[Strip],
    needs: Needs,
    *,
    shallow: bool,
    patio: Set[tuple[int, int]],
) -> list[Strip]:
    """Unite strips that cannot stand alone with others, the weakest first."""
    strips = list(strips)
    barred: set[int] = set()
    while len(strips) > 1:
        weak = [
            s
            for s in strips
            if id(s) not in barred and (_shallow if shallow else _unfit)(sheet, s, needs)
        ]
        if not weak:
            break
        strip = min(weak, key=lambda s: (*_rank(s, needs, widths=False), -s.rank))
        host = _host(sheet, strip, strips, patio)
        if host is None or not _absorb(sheet, host, strip):
            barred.add(id(strip))
            continue
        strips.remove(strip)
        barred.clear()
    return strips


def _shallow(sheet: Sheet, strip: Strip, needs: Needs) -> bool:
    deepest = max(sheet.height[v] for v in strip.back)
    return not strip.street.rim and deepest < needs.depth


def _unfit(sheet: Sheet, strip: Strip, needs: Needs) -> bool:
    return (
        len(strip.front) < 2
        or sheet.length(strip.front) < needs.front
        or sheet.area(strip.ring) < needs.area
    )


def _host(
    sheet: Sheet,
    strip: Strip,
    strips: Sequence[Strip],
    patio: Set[tuple[int, int]] = frozenset(),
) -> Strip | None:
    """Return the strip that shares the longest border; None if that is the one with a patio."""
    ring = strip.ring
    edges = set(zip(ring[1:] + ring[:1], ring, strict=True))
    longest = (sum(sheet.distance(u, v) for u, v in edges & patio), 0)
    host = None
    for other in strips:
        if other is strip:
            continue
        border = sum(sheet.distance(u, v) for u, v in pairwise(other.back) if (u, v) in edges)
        key = (round(border, 6), -other.rank)
        if border > 0.0 and key > longest:
            longest, host = key, other
    return host


def _absorb(sheet: Sheet, host: Strip, strip: Strip) -> bool:
    """Unite a strip with another along the longest unbroken border of the two."""
    ring = strip.ring
    place = {edge: k for k, edge in enumerate(zip(ring[1:] + ring[:1], ring, strict=True))}
    runs: list[tuple[float, int, int]] = []
    start = -1
    for k, (u, v) in enumerate(pairwise(host.back)):
        at = place.get((u, v))
        if at is None:
            start = -1
            continue
        if start >= 0 and place[host.back[k - 1], u] == (at + 1) % len(ring):
            runs[-1] = (runs[-1][0] + sheet.distance(u, v), start, k + 1)
        else:
            start = k
            runs.append((sheet.distance(u, v), start, k + 1))
    if not runs:
        return False
    _, start, stop = max(runs, key=lambda run: (round(run[0], 6), -run[1]))
    first = (place[host.back[start], host.back[start + 1]] + 1) % len(ring)
    count = len(ring) - (stop - start) - 1
    host.splice(sheet, start, stop, [ring[(first + 1 + k) % len(ring)] for k in range(count)])
    _trim(sheet, host, start + count + 1)
    _trim(sheet, host, start)
    return True


def _trim(sheet: Sheet, strip: Strip, at: int) -> None:
    """Take away spurs of the back at a place: arcs with the strip on both sides."""
    while 0 < at < len(strip.back) - 1 and strip.back[at - 1] == strip.back[at + 1]:
        strip.splice(sheet, at - 1, at + 1, [])
        del strip.back[at]
        strip.guides = {v: (p - 1 if p >= at else p, x, y) for v, (p, x, y) in strip.guides.items()}
        at -= 1
