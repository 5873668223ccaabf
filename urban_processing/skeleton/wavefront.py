"""The wavefront that shrinks from a contour, and the arcs that its vertices trace.

All that happens at one place at one time is one event (Kelly and Wonka 2011, section 4): chains
of the wavefront that come there together are joined anew around the place. So simultaneous
events, which regular shapes have many of, need no perturbation and give one node.
"""

from __future__ import annotations

import heapq
import math
from dataclasses import dataclass, field

from urban_processing.skeleton.contour import Contour

PARALLEL = 1e-10
"""Sine of the angle of two edges that face each other below which they meet all at once."""
NEARLY_PARALLEL = 1e-4
"""Sine above which the gap of edges that face each other is never less than the tolerance."""
WELL_CROSSED = 1e-2
"""Sine of the angle above which the crossing of two lines says where a vertex is."""
JUMP, COLLAPSE, SPLIT = 0, 1, 2


class Unresolved(Exception):
    """The wavefront cannot be followed with this tolerance."""


@dataclass
class Arcs:
    """What vertices of the wavefront traced; nodes from M on are inner ones.

    Parameters
    ----------
    x, y, t
        (V,) place and time of each node; the first M are the corners of the contour.
    start, end
        (A,) nodes of each arc.
    left, right
        (A,) merged edges whose faces lie to the left and right of it.
    """

    x: list[float]
    y: list[float]
    t: list[float]
    start: list[int] = field(default_factory=list)
    end: list[int] = field(default_factory=list)
    left: list[int] = field(default_factory=list)
    right: list[int] = field(default_factory=list)


def propagate(contour: Contour, tolerance: float) -> Arcs:
    """Shrink a contour until nothing is left of it.

    Parameters
    ----------
    contour
        The merged edges.
    tolerance
        Distance in metres within which things happen at the same place.

    Raises
    ------
    Unresolved
        Events contradict each other.
    """
    front = _Wavefront(contour, tolerance)
    front.run()
    return front.arcs


class _Wavefront:
    """Vertices of the wavefront; vertex v is at ``base + t * speed`` at time t."""

    def __init__(self, contour: Contour, tolerance: float) -> None:
        m = len(contour)
        self.contour = contour
        self.tolerance = tolerance
        self.slack = 4e-15 * contour.size
        self.latest = 0.75 * contour.size
        self.arcs = Arcs(list(contour.x), list(contour.y), [0.0] * m)
        self.bx: list[float] = []
        self.by: list[float] = []
        self.vx: list[float] = []
        self.vy: list[float] = []
        self.left: list[int] = []
        self.right: list[int] = []
        self.node: list[int] = []
        self.jumps: list[bool] = []
        self.reflex: list[bool] = []
        self.next: list[int] = list(contour.following)
        self.prev: list[int] = list(contour.previous)
        self.alive: dict[int, None] = {}
        self.pieces: list[dict[int, None]] = [{} for _ in range(m)]
        self.splits: dict[int, list[tuple[float, int]]] = {}
        self.heap: list[tuple[float, int, int, int]] = []
        for e in range(m):
            self._place(contour.previous[e], e, e)
        for v in range(m):
            self._await(v, 0.0)
            self._await_collapse(v, 0.0)

    def run(self) -> None:
        """Let events happen in the order of time."""
        now = 0.0
        heap = self.heap
        budget = 40 * len(self.contour) + 200
        while self.alive:
            if not heap or budget < 0:
                raise Unresolved
            t, kind, v, other = heapq.heappop(heap)
            if v not in self.alive:
                continue
            if t < now:
                t = now
            if kind == COLLAPSE:
                if self.next[v] != other or other not in self.alive:
                    continue
                happened = self._collapse(v, other, t)
            elif kind == SPLIT:
                happened = self._split(v, other, t)
            else:
                happened = self._jump(v, t)
            if happened:
                now = t
                budget -= 1

    def _place(self, left: int, right: int, node: int) -> int:
        """Add a vertex between two edges that starts from a node."""
        c, arcs = self.contour, self.arcs
        ldx, ldy, rdx, rdy = c.dx[left], c.dy[left], c.dx[right], c.dy[right]
        det = ldx * rdy - ldy * rdx
        dot = ldx * rdx + ldy * rdy
        x, y, t = arcs.x[node], arcs.y[node], arcs.t[node]
        jumps = dot < 0 and abs(det) < PARALLEL
        if jumps:
            vx = vy = 0.0
        elif dot > 0:
            vx, vy = -(ldy + rdy) / (1 + dot), (ldx + rdx) / (1 + dot)
        else:
            vx, vy = (rdx - ldx) / det, (rdy - ldy) / det
        if abs(det) > WELL_CROSSED:
            bx = (c.c[left] * rdx - c.c[right] * ldx) / det
            by = (c.c[left] * rdy - c.c[right] * ldy) / det
        else:
            bx, by = x - vx * t, y - vy * t
        v = len(self.bx)
        self.bx.append(bx)
        self.by.append(by)
        self.vx.append(vx)
        self.vy.append(vy)
        self.left.append(left)
        self.right.append(right)
        self.node.append(node)
        self.jumps.append(jumps)
        self.reflex.append(det < -1e-13 and not jumps)
        self.alive[v] = None
        self.pieces[right][v] = None
        return v

    def _await(self, v: int, now: float) -> None:
        """Queue what a new vertex may run into."""
        if self.jumps[v]:
            heapq.heappush(self.heap, (now, JUMP, v, -1))
        elif self.reflex[v]:
            self.splits[v] = self._hits(v, now)
            self._await_split(v)

    def _await_collapse(self, v: int, now: float) -> None:
        """Queue the end of the piece of wavefront from a vertex to the next."""
        w, e = self.next[v], self.right[v]
        if self.jumps[v] or self.jumps[w]:
            return
        dx, dy = self.contour.dx[e], self.contour.dy[e]
        rate = (self.vx[w] - self.vx[v]) * dx + (self.vy[w] - self.vy[v]) * dy
        if rate >= -1e-15:
            return
        t = -((self.bx[w] - self.bx[v]) * dx + (self.by[w] - self.by[v]) * dy) / rate
        if t < self.latest:
            heapq.heappush(self.heap, (max(t, now), COLLAPSE, v, w))

    def _hits(self, v: int, now: float) -> list[tuple[float, int]]:
        """Return when a reflex vertex meets the line of each edge, the first meeting last."""
        c = self.contour
        bx, by, vx, vy = self.bx[v], self.by[v], self.vx[v], self.vy[v]
        left, right, pieces = self.left[v], self.right[v], self.pieces
        since, latest = now - self.tolerance, self.latest
        hits = []
        for e, (dx, dy, ce) in enumerate(zip(c.dx, c.dy, c.c, strict=True)):
            closing = 1.0 + dy * vx - dx * vy
            if closing > 1e-12 and e != left and e != right and pieces[e]:
                t = (dx * by - dy * bx - ce) / closing
                if since <= t < latest:
                    hits.append((t if t > now else now, e))
        hits.sort(reverse=True)
        return hits

    def _await_split(self, v: int) -> None:
        """Queue the next meeting of a reflex vertex with a line."""
        if self.splits[v]:
            t, e = self.splits[v].pop()
            heapq.heappush(self.heap, (t, SPLIT, v, e))

    def _collapse(self, v: int, w: int, t: float) -> bool:
        """Let a piece of the wavefront vanish."""
        # the slower vertex knows better where it is
        if self._speed(v) > self._speed(w):
            v = w
        return self._meet(self.bx[v] + self.vx[v] * t, self.by[v] + self.vy[v] * t, t)

    def _split(self, v: int, e: int, t: float) -> bool:
        """Let a reflex vertex run into a piece of an edge, if one is where it meets the line."""
        x, y = self.bx[v] + self.vx[v] * t, self.by[v] + self.vy[v] * t
        reach = self.tolerance + self._speed(v) * self.slack
        dx, dy = self.contour.dx[e], self.contour.dy[e]
        for u in self.pieces[e]:
            w = self.next[u]
            if self._along(u, x, y, t, dx, dy) >= -reach - self._speed(u) * self.slack and (
                self._along(w, x, y, t, dx, dy) <= reach + self._speed(w) * self.slack
            ):
                if self._meet(x, y, t):
                    if v in self.alive:
                        raise Unresolved
                    return True
                break
        self._await_split(v)
        return False

    def _along(self, v: int, x: float, y: float, t: float, dx: float, dy: float) -> float:
        """Return how far in a direction a place lies from a vertex."""
        return (x - self.bx[v] - self.vx[v] * t) * dx + (y - self.by[v] - self.vy[v] * t) * dy

    def _speed(self, v: int) -> float:
        """Return the larger component of a vertex's speed."""
        return max(abs(self.vx[v]), abs(self.vy[v]))

    def _jump(self, v: int, t: float) -> bool:
        """Let two edges that face each other meet along the shorter of their pieces."""
        c = self.contour
        dx, dy = c.dx[self.right[v]], c.dy[self.right[v]]
        x, y = self.bx[v], self.by[v]
        u, w = self.prev[v], self.next[v]
        back, ahead = -self._along(u, x, y, t, dx, dy), -self._along(w, x, y, t, dx, dy)
        if min(back, ahead) < -self.tolerance:
            raise Unresolved
        near = w if ahead <= back else u
        along = min(back, ahead)
        # the offset lines know the place across, the nearer vertex the one along
        self.bx[v], self.by[v] = x + along * dx, y + along * dy
        px, py = self.bx[near] + self.vx[near] * t, self.by[near] + self.vy[near] * t
        if math.hypot(px - self.bx[v], py - self.by[v]) > 4 * self.tolerance:
            raise Unresolved
        self.bx[v], self.by[v] = px, py
        if not self._meet(px, py, t):
            raise Unresolved
        return True

    def _meet(self, x: float, y: float, t: float) -> bool:
        """Join anew all chains of the wavefront that are at a place; False if there is but one."""
        here, hit = self._gather(x, y, t)
        heads = [v for v in here if self.prev[v] not in here]
        if len(here) < 2 and len(heads) + len(hit) < 2:
            return False
        if len(heads) == len(here) and not hit and len({self._start(v) for v in here}) == 1:
            return False  # they part here
        node = len(self.arcs.x)
        self.arcs.x.append(x)
        self.arcs.y.append(y)
        self.arcs.t.append(t)
        # a chain: the edges and vertices before and after it
        chains = [self._chain(v, here) for v in heads]
        chains += [(self.right[u], self.right[u], u, self.next[u]) for u in hit]
        for v in here:
            self._end(v, node)
        if len(chains) > 2:
            chains = self._sorted(chains)
        new = []
        for k, chain in enumerate(chains):
            before = chains[k - 1]
            new.append(self._join(chain[0], before[1], chain[2], before[3], node))
        for v in new:
            self._await(v, t)
        for v in new:
            self._await_collapse(v, t)
            if self.prev[v] not in new:
                self._await_collapse(self.prev[v], t)
        return True

    def _start(self, v: int) -> tuple[float, float]:
        """Return where a vertex started from."""
        node = self.node[v]
        return self.arcs.x[node], self.arcs.y[node]

    def _gather(self, x: float, y: float, t: float) -> tuple[dict[int, None], list[int]]:
        """Return vertices at a place, and those before pieces that pass through it."""
        c, tolerance, slack = self.contour, self.tolerance, self.slack
        bx, by, vx, vy, right = self.bx, self.by, self.vx, self.vy, self.right
        here: dict[int, None] = {}
        touched = []
        for v in self.alive:
            e = right[v]
            sx, sy = vx[v], vy[v]
            near = tolerance + slack * (abs(sx) + abs(sy))
            if abs(bx[v] + sx * t - x) <= near and abs(by[v] + sy * t - y) <= near:
                here[v] = None
            elif abs(c.dx[e] * y - c.dy[e] * x - c.c[e] - t) <= tolerance:
                touched.append(v)
        hit = []
        for v in touched:
            w = self.next[v]
            if w not in here:
                dx, dy = c.dx[right[v]], c.dy[right[v]]
                if self._along(v, x, y, t, dx, dy) > 0 > self._along(w, x, y, t, dx, dy):
                    hit.append(v)
        return here, hit

    def _chain(self, v: int, here: dict[int, None]) -> tuple[int, int, int, int]:
        """Return edges and vertices before and after a chain of vertices that begins with v."""
        first = last = v
        while self.next[last] in here:
            last = self.next[last]
        return self.left[first], self.right[last], self.prev[first], self.next[last]

    def _end(self, v: int, node: int) -> None:
        """End a vertex at a node."""
        del self.alive[v]
        del self.pieces[self.right[v]][v]
        self.splits.pop(v, None)
        arcs = self.arcs
        arcs.start.append(self.node[v])
        arcs.end.append(node)
        arcs.left.append(self.left[v])
        arcs.right.append(self.right[v])

    def _sorted(self, chains: list[tuple[int, int, int, int]]) -> list[tuple[int, int, int, int]]:
        """Return chains counter-clockwise around their place; their swept sectors are disjoint."""
        c = self.contour
        turned = [
            (
                math.atan2(-c.dy[a], -c.dx[a]),
                math.atan2(c.dy[b], c.dx[b]),
                (a, b, u, w),
            )
            for a, b, u, w in chains
        ]
        turned.sort(key=lambda item: item[0])
        for k, (start, stop, _) in enumerate(turned):
            after = (turned[(k + 1) % len(turned)][0] - start) % (2 * math.pi)
            if (stop - start) % (2 * math.pi) > after + NEARLY_PARALLEL:
                raise Unresolved
        return [item[2] for item in turned]

    def _join(self, left: int, right: int, u: int, w: int, node: int) -> int:
        """Join the wavefront before u and after w by a vertex at a node."""
        if left == right:
            raise Unresolved
        v = self._place(left, right, node)
        self.next.append(w)
        self.prev.append(u)
        self.next[u] = v
        self.prev[w] = v
        if self._closed(v, u, w, node):
            self.bx[v], self.by[v] = self.arcs.x[node], self.arcs.y[node]
            self.vx[v] = self.vy[v] = 0.0
            self.jumps[v], self.reflex[v] = True, False
        return v

    def _closed(self, v: int, u: int, w: int, node: int) -> bool:
        """Tell whether nothing is left between two edges that face each other at a vertex."""
        c, arcs = self.contour, self.arcs
        a, b = self.left[v], self.right[v]
        det = abs(c.dx[a] * c.dy[b] - c.dy[a] * c.dx[b])
        if det > NEARLY_PARALLEL or c.dx[a] * c.dx[b] + c.dy[a] * c.dy[b] > 0:
            return False
        x, y, t = arcs.x[node], arcs.y[node], arcs.t[node]
        back = -self._along(u, x, y, t, c.dx[b], c.dy[b])
        ahead = -self._along(w, x, y, t, c.dx[b], c.dy[b])
        return 0 < min(back, ahead) < self.tolerance / max(det, PARALLEL)
