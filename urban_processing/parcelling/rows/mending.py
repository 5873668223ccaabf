"""From α-strips to β-strips: no diagonal ends, no strips too shallow or too small for a row."""

from __future__ import annotations

import math
from collections.abc import Set
from itertools import pairwise

from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.sight import sees
from urban_processing.parcelling.rows.strips import Strip
from urban_processing.parcelling.rows.uniting import Needs, give_rims, rank_of, unite

SHARP = 0.5
"""Sine of half the angle of a corner from which the strips along it are rows back to back."""


def beta_strips(
    sheet: Sheet, strips: list[Strip], *, needs: Needs, patio: Set[tuple[int, int]]
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
    strips = unite(sheet, strips, needs, shallow=True, patio=patio)
    for strip in strips:
        for other in strips:
            if strip is not other and strip.front[-1] == other.front[0]:
                _mend(sheet, strip, other, needs=needs)
    strips, left = give_rims(sheet, [s for s in strips if len(s.ring) > 2], patio)
    return unite(sheet, strips, needs, shallow=False, patio=frozenset()), left


def _wins(strip: Strip, other: Strip, needs: Needs) -> bool:
    """T(v): whether a strip wins over another; a tie goes to the first (Vanegas 2012, 4.2.2)."""
    known = not math.isnan(strip.street.width + other.street.width)
    return rank_of(strip, needs, widths=known) >= rank_of(other, needs, widths=known)


def _mend(sheet: Sheet, before: Strip, after: Strip, *, needs: Needs) -> None:
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
    top = _lowered(sheet, before, after, top=top, limit=needs.mean_depth)
    win = _wins(before, after, needs)
    foot = _foot(sheet, after if win else before, before.back[top], snap=needs.snap)
    if foot is None:
        return
    if win:
        _pass_to_previous(sheet, before, after, top=top, foot=foot)
    else:
        _pass_to_next(sheet, before, after, top=top, foot=foot)


def _lowered(sheet: Sheet, before: Strip, after: Strip, *, top: int, limit: float) -> int:
    """End a sharp corner where two rows begin to be deep enough; return where it ends."""
    chain = before.back
    height = sheet.height
    far = sheet.distance(chain[0], chain[top])
    if height[chain[top]] <= limit * 1.2 or height[chain[top]] > SHARP * far:
        return top
    k = next(k for k in range(1, top + 1) if height[chain[k]] > limit)
    u, v = chain[k - 1], chain[k]
    vertex = sheet.add_between(u, v, (limit - height[u]) / (height[v] - height[u]))
    before.splice(sheet, (k - 1, k), [vertex])
    n = len(after.back)
    after.splice(sheet, (n - 1 - k, n - k), [vertex])
    return k


def _foot(sheet: Sheet, strip: Strip, apex: int, *, snap: float) -> tuple[int, float] | None:
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
        near = min(snap, 0.05 * gap, 0.4 * length)
        share = 0.0 if share * length < near else 1.0 if (1.0 - share) * length < near else share
        qx, qy = x[u] + share * (x[v] - x[u]), y[u] + share * (y[v] - y[u])
        if gap <= 1e-6:
            continue
        end = u if share <= 0.0 else v if share >= 1.0 else -1
        if end in beside or sees(sheet, ring, p=(px, py), q=(qx, qy)):
            return k, share
    return None


def _cut_front(sheet: Sheet, strip: Strip, foot: tuple[int, float]) -> tuple[int, int]:
    """Make the foot of a cut a vertex of the front; return the vertex and its place there."""
    segment, share = foot
    u, v = strip.front[segment], strip.front[segment + 1]
    if share <= 0.0:
        return u, segment
    if share >= 1.0:
        return v, segment + 1
    vertex = sheet.add_on(u, v, share)
    strip.front.insert(segment + 1, vertex)
    return vertex, segment + 1


def _pass_to_previous(
    sheet: Sheet, winner: Strip, loser: Strip, *, top: int, foot: tuple[int, float]
) -> None:
    vertex, place = _cut_front(sheet, loser, foot)
    moved = loser.front[: place + 1]
    winner.splice(sheet, (0, top), moved[1:])
    winner.back[0] = moved[0]
    loser.front = loser.front[place:]
    loser.back.append(vertex)
    n = len(loser.back)
    _cut_back(sheet, loser, (n - 2 - top, n - 1))


def _pass_to_next(
    sheet: Sheet, loser: Strip, winner: Strip, *, top: int, foot: tuple[int, float]
) -> None:
    vertex, place = _cut_front(sheet, loser, foot)
    moved = loser.front[place:]
    n = len(winner.back)
    winner.splice(sheet, (n - 1 - top, n - 1), moved[:-1])
    loser.front = loser.front[: place + 1]
    loser.back.insert(0, vertex)
    for key, (at, x, y) in loser.guides.items():
        loser.guides[key] = (at + 1.0, x, y)
    _cut_back(sheet, loser, (0, top + 1))


def _cut_back(sheet: Sheet, strip: Strip, section: tuple[int, int]) -> None:
    """Leave out what lies between two vertices of the back, and guides of a front that is gone."""
    kept = set(strip.front[1:-1])
    strip.guides = {v: guide for v, guide in strip.guides.items() if v in kept}
    strip.splice(sheet, section, [])
