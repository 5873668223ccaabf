"""The vertices of one block while it is divided, and the points added on its edges."""

from __future__ import annotations

import bisect
import math
from collections.abc import Iterable, Sequence
from itertools import pairwise

import shapely

from urban_processing.mesh.planar import FloatArray
from urban_processing.mesh.touches import loops_of
from urban_processing.site import FINE_GRID

SAME = 0.05
"""Points of an edge that lie nearer to each other, in metres, are one."""


class Sheet:
    """Vertices of a block, by number, and points inserted on edges that two faces share.

    The first ``n_contour`` vertices are those of the contour; added ones lie on `FINE_GRID`.

    Parameters
    ----------
    xy
        (V, 2) vertices: the contour, then others.
    height
        (V,) distance of each from the contour.
    following
        Next vertex of the contour after each of its vertices, as in `Skeleton`: where its rings
        touch, each corner of the land has a vertex of its own.
    place
        First vertex at the place of each vertex of the contour; by default each is alone.
    """

    def __init__(
        self,
        xy: FloatArray,
        height: FloatArray,
        following: Sequence[int],
        *,
        place: Sequence[int] | None = None,
    ) -> None:
        n_contour = len(following)
        place = range(n_contour) if place is None else place
        self.x: list[float] = xy[:n_contour, 0].tolist()
        self.y: list[float] = xy[:n_contour, 1].tolist()
        self.x += [to_grid(value) for value in xy[n_contour:, 0].tolist()]
        self.y += [to_grid(value) for value in xy[n_contour:, 1].tolist()]
        self.height: list[float] = height.tolist()
        self.n_contour = n_contour
        self.following = following
        self.place = [*place, *range(n_contour, len(xy))]
        self.touches = len(set(place)) < n_contour
        """Whether rings of the contour touch."""
        self.contour_edge: dict[int, int] = {}
        """Vertices added on the contour, and the vertex that begins their edge."""
        self._points: dict[tuple[int, int], list[tuple[float, int]]] = {}

    def add(self, x: float, y: float, height: float = 0.0) -> int:
        """Add a vertex and return its number."""
        self.x.append(to_grid(x))
        self.y.append(to_grid(y))
        self.height.append(height)
        self.place.append(len(self.place))
        return len(self.x) - 1

    def add_between(self, u: int, v: int, share: float) -> int:
        """Add a vertex at a share of the way from ``u`` to ``v``."""
        x, y, height = self.x, self.y, self.height
        return self.add(
            x[u] + share * (x[v] - x[u]),
            y[u] + share * (y[v] - y[u]),
            height[u] + share * (height[v] - height[u]),
        )

    def distance(self, u: int, v: int) -> float:
        """Distance of two vertices."""
        return math.hypot(self.x[v] - self.x[u], self.y[v] - self.y[u])

    def edge_of(self, u: int) -> int:
        """Return the vertex that begins the edge of the contour which begins at or holds ``u``."""
        return self.contour_edge.get(u, u)

    def contour_side(self, u: int, v: int) -> int:
        """Return the edge of the contour that an edge of a ring is part of; -1 if of none."""
        edge = self.edge_of(u)
        if edge < self.n_contour and (
            self.contour_edge.get(v) == edge or self.place[self.following[edge]] == self.place[v]
        ):
            return edge
        return -1

    def add_on(self, u: int, v: int, share: float) -> int:
        """Add a vertex on an edge of a ring, which may be a part of the contour."""
        vertex = self.add_between(u, v, share)
        side = max(self.contour_side(u, v), self.contour_side(v, u))
        if side >= 0:
            self.contour_edge[vertex] = side
            self.height[vertex] = 0.0
        return vertex

    def insert(self, u: int, v: int, share: float) -> int:
        """Return the vertex at a share of the edge from ``u`` to ``v``, added if need be."""
        if u > v:
            u, v, share = v, u, 1.0 - share
        length = self.distance(u, v)
        if share * length < SAME:
            return u
        if (1.0 - share) * length < SAME:
            return v
        points = self._points.setdefault((u, v), [])
        at = bisect.bisect(points, (share, -1))
        for near in (at - 1, at):
            if 0 <= near < len(points) and abs(points[near][0] - share) * length < SAME:
                return points[near][1]
        vertex = self.add_on(u, v, share)
        points.insert(at, (share, vertex))
        return vertex

    def between(self, u: int, v: int) -> list[tuple[float, int]]:
        """Return shares and numbers of the points inserted on an edge, from ``u`` to ``v``."""
        if u < v:
            return self._points.get((u, v), [])
        return [(1.0 - share, at) for share, at in reversed(self._points.get((v, u), []))]

    def within(self, u: int, v: int) -> list[int]:
        """Return the numbers of all points inserted on an edge, and on parts of it."""
        points = [point for _, point in self.between(u, v)]
        if not points:
            return []
        found = self.within(u, points[0])
        for a, b in zip(points, [*points[1:], v], strict=True):
            found += [a, *self.within(a, b)]
        return found

    def contains(self, shell: Sequence[int], ring: Sequence[int]) -> bool:
        """Whether a ring lies within another that it does not cross."""
        x, y, place = self.x, self.y, self.place
        own = {place[v] for v in shell}
        spots = [((x[u] + x[v]) / 2, (y[u] + y[v]) / 2) for u, v in pairwise(ring)]
        spots = [(x[v], y[v]) for v in ring if place[v] not in own] + spots
        px, py = spots[0]
        inside = False
        u = shell[-1]
        for v in shell:
            if (y[u] > py) != (y[v] > py) and x[u] + (py - y[u]) * (x[v] - x[u]) / (
                y[v] - y[u]
            ) > px:
                inside = not inside
            u = v
        return inside

    def leftmost(self, before: int, u: int, ends: Sequence[int]) -> int:
        """Return the end towards which the way from ``before`` turns left the most at ``u``."""
        x, y = self.x, self.y
        ax, ay = x[u] - x[before], y[u] - y[before]

        def turn(v: int) -> float:
            bx, by = x[v] - x[u], y[v] - y[u]
            return math.atan2(ax * by - ay * bx, ax * bx + ay * by)

        return max(ends, key=turn)

    def is_sound(self, rings: Sequence[Sequence[int]]) -> bool:
        """Whether rings, the shell first, make a valid polygon."""
        shell, *holes = ([(self.x[v], self.y[v]) for v in ring] for ring in self.parted(rings))
        return bool(shapely.is_valid(shapely.Polygon(shell, holes)))

    def parted(self, rings: Sequence[Sequence[int]]) -> list[list[int]]:
        """Take the rings of a face apart where they come to a place again; the shell first.

        A ring that goes around a hole of the contour which touches another of its rings does so.
        """
        if not self.touches:
            return [list(ring) for ring in rings]
        loops = [loop for ring in rings for loop in loops_of(ring, self.place)]
        shell = max(range(len(loops)), key=lambda k: self.area(loops[k]))
        return [loops[shell], *loops[:shell], *loops[shell + 1 :]]

    def area(self, ring: Sequence[int]) -> float:
        """Signed area of a ring."""
        x, y = self.x, self.y
        x0, y0 = x[ring[0]], y[ring[0]]
        total = 0.0
        px, py = 0.0, 0.0
        for v in ring:
            qx, qy = x[v] - x0, y[v] - y0
            total += px * qy - qx * py
            px, py = qx, qy
        return 0.5 * total

    def length(self, chain: Iterable[int]) -> float:
        """Length of a chain of vertices."""
        return sum(self.distance(u, v) for u, v in pairwise(chain))


def to_grid(value: float) -> float:
    """Round a coordinate to `FINE_GRID`."""
    return round(value / FINE_GRID) * FINE_GRID
