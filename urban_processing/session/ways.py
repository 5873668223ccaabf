"""Ways of streets along parcel boundaries."""

from __future__ import annotations

import heapq
import itertools
import math
from collections.abc import Callable, Iterable

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import EdgeKind, Layout, Steering
from urban_processing.mesh.planar import FloatArray, IntArray

ROUNDING = 6
"""Digits after the point of costs in metres: what costs the same compares equal."""

TURN_SHARE = 0.5
"""A right-angled turn costs as much as so many mean parcel sides."""

AVOIDED = 3.0
"""How many times as long edges count on which a planner wants no street."""

STRAY = 2.0
"""How many times as long edges count further that are as far off a drawn line
as is allowed."""


def cheapest(
    starts: Iterable[tuple[float, int]],
    following: Callable[[int], Iterable[tuple[float, int]]],
    is_goal: Callable[[int], bool],
    *,
    ahead: Callable[[int], float] = lambda _: 0.0,
) -> list[int] | None:
    """Return the cheapest way through a graph, or None where there is none.

    Parameters
    ----------
    starts
        Costs of the things to begin with.
    following
        What can follow a thing, and what that costs.
    is_goal
        Whether the way may end with a thing.
    ahead
        The least that the rest of the way may cost from a thing on (A*).
    """
    cost: dict[int, float] = {}
    came: dict[int, int] = {}
    queue: list[tuple[float, int]] = []
    for value, thing in starts:
        cost[thing] = round(value, ROUNDING)
        heapq.heappush(queue, (cost[thing] + ahead(thing), thing))
    done: set[int] = set()
    while queue:
        _, thing = heapq.heappop(queue)
        if thing in done:
            continue
        done.add(thing)
        if is_goal(thing):
            way = [thing]
            while way[-1] in came:
                way.append(came[way[-1]])
            return way[::-1]
        for value, other in following(thing):
            total = round(cost[thing] + value, ROUNDING)
            if other not in done and total < cost.get(other, math.inf):
                cost[other] = total
                came[other] = thing
                heapq.heappush(queue, (total + ahead(other), other))
    return None


def way_between(layout: Layout, start: int, stop: int, costs: dict[int, float]) -> list[int] | None:
    """Edges of the cheapest way between two vertices, over edges whose costs are given."""
    mesh = layout.mesh
    out: dict[int, list[tuple[float, int]]] = {}
    for edge, cost in costs.items():
        a, b = mesh.origin[2 * edge : 2 * edge + 2].tolist()
        out.setdefault(a, []).append((cost, 2 * edge))
        out.setdefault(b, []).append((cost, 2 * edge + 1))
    target = mesh.target

    def following(h: int) -> list[tuple[float, int]]:
        return out.get(int(target[h]), [])

    if start == stop:
        return []
    way = cheapest(out.get(start, []), following, lambda h: int(target[h]) == stop)
    return None if way is None else [h >> 1 for h in way]


def way_along_corners(layout: Layout, places: FloatArray, *, reach: float) -> IntArray:
    """Edges of the shortest way along boundaries from one parcel corner to the next.

    A turn costs some length, so that the way does not zigzag. Shores of lakes and rims without
    street are not followed.

    Parameters
    ----------
    layout
        The layout.
    places
        (n, 2) places of the corners, in local coordinates.
    reach
        Distance in metres within which there must be a corner.

    Raises
    ------
    EditError
        If a place has no corner near, all have the same, or no way leads to the next.
    """
    nodes = _corners_near(layout, places, reach)
    nodes = [node for k, node in enumerate(nodes) if k == 0 or node != nodes[k - 1]]
    if len(nodes) < 2:
        raise EditError("The points are all at one parcel corner: give corners to lead between.")
    search = _CornerSearch(layout)
    chains: list[int] = []
    for a, b in itertools.pairwise(nodes):
        chains += search.way(a, b)
    return np.unique(layout.corner_graph.edges_of(chains))


def _corners_near(layout: Layout, places: FloatArray, reach: float) -> list[int]:
    """The node of the corner graph that is nearest to each place."""
    xy = layout.mesh.xy[layout.corner_graph.node_vertex]
    away = places[:, None] - xy[None]
    off = np.round(np.hypot(away[..., 0], away[..., 1]), 9)
    far = np.flatnonzero(off.min(axis=1) > reach)
    if len(far):
        raise EditError(
            f"No parcel corner lies within {reach:,.1f} m of point {k + 1} of the line."
            for k in far.tolist()
        )
    return [int(np.lexsort((xy[:, 1], xy[:, 0], row))[0]) for row in off]


class _CornerSearch:
    """Shortest ways on the corner graph of one layout."""

    def __init__(self, layout: Layout) -> None:
        graph = layout.corner_graph
        self.layout = layout
        usable = (layout.chain_kind == EdgeKind.INTERIOR) | layout.chain_street
        avoided = layout.steered(Steering.NO_STREET)[graph.first_edge()]
        self.usable: list[bool] = usable.tolist()
        self.cost: list[float] = np.where(avoided, AVOIDED * graph.length, graph.length).tolist()
        self.start: list[int] = graph.start.tolist()
        self.end: list[int] = graph.end.tolist()
        self.leaving: list[complex] = graph.leaving.tolist()
        self.arriving: list[complex] = graph.arriving.tolist()
        self.out: list[int] = graph.out.tolist()
        self.out_offsets: list[int] = graph.out_offsets.tolist()
        xy = layout.mesh.xy[graph.node_vertex]
        self.z: list[complex] = (xy[:, 0] + 1j * xy[:, 1]).tolist()
        self.turn = TURN_SHARE * math.sqrt(float(layout.mesh.face_area.mean()))

    def way(self, start: int, stop: int) -> list[int]:
        """Chains from one corner to another."""
        way = cheapest(
            [(self.cost[i], i) for i in self._leaving(start)],
            self._following,
            lambda i: self.end[i] == stop,
            ahead=lambda i: abs(self.z[self.end[i]] - self.z[stop]),
        )
        if way is None:
            raise EditError(
                "No way along parcel boundaries leads from one point of the line to the next: "
                "a street runs neither along a lake nor along a rim without street."
            )
        return way

    def _leaving(self, node: int) -> list[int]:
        out = self.out[self.out_offsets[node] : self.out_offsets[node + 1]]
        return [i for i in out if self.usable[i]]

    def _following(self, chain: int) -> list[tuple[float, int]]:
        back = self.arriving[chain].conjugate()
        return [
            (self.cost[i] + self.turn * (1.0 - (self.leaving[i] * back).real), i)
            for i in self._leaving(self.end[chain])
            if i != chain ^ 1
        ]


def costs_near(
    layout: Layout, line: FloatArray, reach: float, barred: IntArray
) -> dict[int, float]:
    """Costs of the edges near a line, those on it the least.

    Parameters
    ----------
    layout
        The layout.
    line
        (n, 2) vertices of the line.
    reach
        Distance in metres within which both ends and the middle of near edges are.
    barred
        Edges that are not to be followed.
    """
    mesh = layout.mesh
    low, high = line.min(axis=0) - reach, line.max(axis=0) + reach
    ends = mesh.xy[mesh.origin.reshape(-1, 2)]
    near = np.asarray(((ends >= low) & (ends <= high)).all(axis=(1, 2)))
    near[barred] = False
    edges = np.flatnonzero(near)
    places = np.stack([ends[edges, 0], ends[edges].mean(axis=1), ends[edges, 1]], axis=1)
    off = shapely.distance(shapely.points(places), shapely.LineString(line))
    stray = 1.0 + STRAY * off.mean(axis=1) / reach
    cost = mesh.edge_length[edges] * stray
    kept = (off <= reach).all(axis=1)
    return dict(zip(edges[kept].tolist(), cost[kept].tolist(), strict=True))
