"""Strips that cannot stand alone, united with others."""

from __future__ import annotations

from collections.abc import Sequence, Set
from dataclasses import dataclass
from itertools import pairwise

from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.strips import Strip


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


def rank_of(strip: Strip, needs: Needs, *, widths: bool) -> tuple[bool, float, float]:
    """Sort key of strips: the one with the larger key wins a corner."""
    width = strip.street.width if widths and not needs.by_length else 0.0
    return (not strip.street.rim, round(width, 6), round(strip.street.length, 6))


def give_rims(
    sheet: Sheet, strips: Sequence[Strip], patio: Set[tuple[int, int]]
) -> tuple[list[Strip], list[Strip]]:
    """Give what has no street to the strips on streets, each to its longest border.

    In each round borders are those before the round, so that none collects all around a hole.
    """
    streets = [strip for strip in strips if not strip.street.rim]
    rims = [strip for strip in strips if strip.street.rim]
    while True:
        hosts = [_host(sheet, rim, streets, patio=patio) for rim in rims]
        given = [
            host is not None and _absorb(sheet, host, rim)
            for rim, host in zip(rims, hosts, strict=True)
        ]
        if not any(given):
            return streets, rims
        rims = [rim for rim, gone in zip(rims, given, strict=True) if not gone]


def unite(
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
        strip = min(weak, key=lambda s: (*rank_of(s, needs, widths=False), -s.rank))
        # what has no street is given to the streets, not they to it
        hosts = [s for s in strips if not s.street.rim or strip.street.rim]
        host = _host(sheet, strip, hosts, patio=patio)
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
    *,
    patio: Set[tuple[int, int]],
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
    host.splice(sheet, (start, stop), [ring[(first + 1 + k) % len(ring)] for k in range(count)])
    _trim(sheet, host, start + count + 1)
    _trim(sheet, host, start)
    return True


def _trim(sheet: Sheet, strip: Strip, at: int) -> None:
    """Take away spurs of the back at a place: arcs with the strip on both sides."""
    while 0 < at < len(strip.back) - 1 and strip.back[at - 1] == strip.back[at + 1]:
        strip.splice(sheet, (at - 1, at + 1), [])
        del strip.back[at]
        strip.guides = {v: (p - 1 if p >= at else p, x, y) for v, (p, x, y) in strip.guides.items()}
        at -= 1
