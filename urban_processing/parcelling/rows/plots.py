"""The parcels of one block as rings that share vertices, to be united and divided."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from urban_processing.hashing import child
from urban_processing.parcelling.rows.sheet import Sheet


@dataclass(frozen=True)
class Place:
    """A point of a ring: on which edge, and at which share of it."""

    edge: int
    share: float


class Plots:
    """The parcels of one block while they are tidied; they share vertices by number.

    Parameters
    ----------
    sheet
        Their vertices.
    polygons
        Rings of each parcel: its shell, counter-clockwise, and holes, if any.
    lineage
        Seed of each.
    access
        Whether each edge of the contour is a street side.
    """

    def __init__(
        self,
        sheet: Sheet,
        polygons: Sequence[list[list[int]]],
        lineage: Sequence[int],
        *,
        access: Sequence[bool],
    ) -> None:
        self.sheet, self.access = sheet, access
        self.rings: dict[int, list[int]] = {}
        self.holes: dict[int, list[list[int]]] = {}
        self.area: dict[int, float] = {}
        self.lineage: dict[int, int] = {}
        self.level: dict[int, int] = {}
        self.left_of: dict[tuple[int, int], int] = {}
        for (ring, *holes), seed in zip(polygons, lineage, strict=True):
            self._put(ring, seed, 1, holes=holes)

    def _put(
        self, ring: list[int], lineage: int, level: int, *, holes: Sequence[list[int]] = ()
    ) -> None:
        number = len(self.area)
        self.rings[number] = ring
        self.holes[number] = list(holes)
        self.lineage[number] = lineage
        self.level[number] = level
        self.area[number] = sum(self.sheet.area(part) for part in (ring, *holes))
        for part in (ring, *holes):
            for edge in edges_of(part):
                self.left_of[edge] = number

    def _take(self, number: int) -> list[int]:
        ring = self.rings.pop(number)
        for part in (ring, *self.holes[number]):
            for edge in edges_of(part):
                del self.left_of[edge]
        return ring

    def front(self, number: int) -> float:
        """Length of a parcel's street sides."""
        sheet = self.sheet
        total = 0.0
        for u, v in edges_of(self.rings[number]):
            side = sheet.contour_side(u, v)
            if side >= 0 and self.access[side]:
                total += sheet.distance(u, v)
        return total

    def borders(self, number: int) -> dict[int, float]:
        """Length of the border with each neighbour."""
        borders: dict[int, float] = {}
        for u, v in edges_of(self.rings[number]):
            other = self.left_of.get((v, u))
            if other is not None and other != number:
                borders[other] = borders.get(other, 0.0) + self.sheet.distance(u, v)
        return borders

    def united(self, number: int, other: int) -> list[int] | None:
        """Return the ring of two parcels together; None if they share no one unbroken border."""
        a, b = self.rings[number], self.rings[other]
        shared = [self.left_of.get((v, u)) == other for u, v in edges_of(a)]
        starts = [k for k in range(len(a)) if shared[k] and not shared[k - 1]]
        if len(starts) != 1:
            return None
        start = starts[0]
        count = 0
        while shared[(start + count) % len(a)]:
            count += 1
        first = a[(start + count) % len(a)]
        rest = [a[(start + count + k) % len(a)] for k in range(len(a) - count + 1)]
        if rest[-1] not in b or first not in b:
            return None
        at = b.index(rest[-1])
        ahead = []
        while True:
            at = (at + 1) % len(b)
            if b[at] == first:
                break
            ahead.append(b[at])
        if len(ahead) != len(b) - count - 1:
            return None
        return rest + ahead

    def unite(self, number: int, other: int, ring: list[int]) -> None:
        """Put the union of two parcels in their place; it is the second one, grown."""
        self._take(number)
        self._take(other)
        level = max(self.level[number], self.level[other])
        holes = self.holes[number] + self.holes[other]
        self._put(ring, self.lineage[other], level, holes=holes)

    def divide(self, number: int, p: Place, q: Place) -> None:
        """Divide a parcel by the line between two places of its ring."""
        ring = self.rings[number]
        # the later one first, so that places before it stay as they are
        later, earlier = (q, p) if p.edge + p.share < q.edge + q.share else (p, q)
        u, v = self._vertex(number, later), self._vertex(number, earlier)
        ring = self._take(number)
        i, j = sorted((ring.index(u), ring.index(v)))
        seed, level = self.lineage[number], self.level[number] + 1
        self._put(ring[i : j + 1], child(seed, 0), level)
        self._put(ring[j:] + ring[: i + 1], child(seed, 1), level)

    def _vertex(self, number: int, place: Place) -> int:
        """Return the vertex at a place of a ring, added to the parcels on both sides if need be."""
        ring = self.rings[number]
        u, v = ring[place.edge], ring[(place.edge + 1) % len(ring)]
        vertex = self.sheet.insert(u, v, place.share)
        if vertex in (u, v):
            return vertex
        for a, b in ((u, v), (v, u)):
            owner = self.left_of.pop((a, b), None)
            if owner is not None:
                parts = (self.rings[owner], *self.holes[owner])
                part = next(part for part in parts if (a, b) in edges_of(part))
                part.insert(part.index(a) + 1, vertex)
                self.left_of[a, vertex] = self.left_of[vertex, b] = owner
        return vertex

    def fronts(self, number: int) -> list[list[int]]:
        """Runs of edges of a parcel's ring along streets, by their places in the ring."""
        edges = edges_of(self.rings[number])
        sides = [self.sheet.contour_side(u, v) for u, v in edges]
        street = [side >= 0 and self.access[side] for side in sides]
        n = len(edges)
        runs = []
        for k in range(n):
            if street[k] and not street[k - 1]:
                run = [k]
                while street[(run[-1] + 1) % n]:
                    run.append((run[-1] + 1) % n)
                runs.append(run)
        return runs

    def line_from(
        self, number: int, front: Sequence[int], along: float
    ) -> tuple[Place, Place | None]:
        """Cast a line from a length along a front to the other side of the parcel.

        It stands at a right angle to the chord of the front around its origin.
        """
        sheet, ring = self.sheet, self.rings[number]
        x, y = sheet.x, sheet.y
        n = len(ring)
        edge, share = front[-1], 1.0
        left = along
        for k in front:
            length = sheet.distance(ring[k], ring[(k + 1) % n])
            if left < length:
                edge, share = k, left / length
                break
            left -= length
        u, v = ring[edge], ring[(edge + 1) % n]
        px, py = x[u] + share * (x[v] - x[u]), y[u] + share * (y[v] - y[u])
        nx, ny = y[u] - y[v], x[v] - x[u]
        size = math.hypot(nx, ny)
        hit = self._first_hit(ring, edge, p=(px, py), d=(nx / size, ny / size))
        return Place(edge, share), hit

    def _first_hit(
        self, ring: Sequence[int], own: int, *, p: tuple[float, float], d: tuple[float, float]
    ) -> Place | None:
        x, y = self.sheet.x, self.sheet.y
        (px, py), (dx, dy) = p, d
        best: tuple[float, Place] | None = None
        for k, (u, v) in enumerate(edges_of(ring)):
            if k == own:
                continue
            ax, ay = x[u] - px, y[u] - py
            bx, by = x[v] - px, y[v] - py
            su, sv = dx * ay - dy * ax, dx * by - dy * bx
            if (su > 0.0) == (sv > 0.0):
                continue
            share = su / (su - sv)
            far = (ax + share * (bx - ax)) * dx + (ay + share * (by - ay)) * dy
            if far > 1e-6 and (best is None or far < best[0]):
                best = (far, Place(k, share))
        return None if best is None else best[1]

    def area_between(self, number: int, p: Place, q: Place) -> float:
        """Area of a parcel on the side of a line from ``p`` to ``q`` that follows ``p``."""
        x, y = self.sheet.x, self.sheet.y
        ring = self.rings[number]
        n = len(ring)

        def spot(place: Place) -> tuple[float, float]:
            u, v = ring[place.edge], ring[(place.edge + 1) % n]
            return x[u] + place.share * (x[v] - x[u]), y[u] + place.share * (y[v] - y[u])

        count = (q.edge - p.edge) % n
        steps = [ring[(p.edge + 1 + k) % n] for k in range(count)]
        spots = [spot(p), *((x[v], y[v]) for v in steps), spot(q)]
        x0, y0 = spots[0]
        return 0.5 * sum(
            (ax - x0) * (by - y0) - (bx - x0) * (ay - y0) for (ax, ay), (bx, by) in pairwise(spots)
        )

    def compactness(self, ring: Sequence[int]) -> float:
        """Area of a ring over that of its convex hull, times 4√A over the hull's perimeter."""
        hull = _hull([(self.sheet.x[v], self.sheet.y[v]) for v in ring])
        area = perimeter = 0.0
        for (ax, ay), (bx, by) in pairwise([*hull, hull[0]]):
            area += (ax - hull[0][0]) * (by - hull[0][1]) - (bx - hull[0][0]) * (ay - hull[0][1])
            perimeter += math.hypot(bx - ax, by - ay)
        own = self.sheet.area(ring)
        return own / max(0.5 * area, 1e-12) * 4.0 * math.sqrt(max(own, 0.0)) / perimeter


def edges_of(ring: Sequence[int]) -> list[tuple[int, int]]:
    """Directed edges of a ring."""
    return [*pairwise(ring), (ring[-1], ring[0])]


def _hull(points: list[tuple[float, float]]) -> list[tuple[float, float]]:
    """Convex hull, counter-clockwise (Andrew 1979)."""
    points = sorted(points)
    chains = []
    for way in (points, points[::-1]):
        chain: list[tuple[float, float]] = []
        for x, y in way:
            while len(chain) > 1:
                (ax, ay), (bx, by) = chain[-2], chain[-1]
                if (bx - ax) * (y - ay) - (by - ay) * (x - ax) > 0.0:
                    break
                chain.pop()
            chain.append((x, y))
        chains += chain[:-1]
    return chains
