"""Junction-weighted shortest paths in the corner graph (Chen 2024, section 4.2, step 3)."""

from __future__ import annotations

import math
from collections.abc import Container, Iterable
from heapq import heapify, heappop, heappush

from urban_processing.streets.state import StreetState

JOIN_COST = 0.5
"""Cost of a new T-junction, and of a bend where a dead end is met sideways, in turns."""

JOG_COST = 1.0
"""Cost of a junction within `JOG_DISTANCE` of another on the same street, in turns."""

JOG_DISTANCE = 0.6
"""Distance of junctions in parcel sides below which streets across look like a jog."""

SPREAD = 1.5
EXTRA = 3.0
"""Alternative paths cost at most `SPREAD` times the best plus `EXTRA` parcel sides."""


def join_cost(state: StreetState, chain: int) -> float:
    """Cost of the junction that arises where `chain` reaches a street.

    Nothing where it continues a street that ends there, across a street or at a dead end.
    """
    street = state.street
    for j in state.ahead[chain]:
        if street[j]:
            return 0.0
    node = state.end[chain]
    cost = JOIN_COST
    if state.degree[node] == 2 and state.rules.look_ahead > 1:
        for j in state.out[node]:
            if street[j] and state.size[j] < JOG_DISTANCE and state.degree[state.end[j]] > 2:
                cost += JOG_COST
                break
    return cost * state.turn_cost


def find_paths(
    state: StreetState,
    starts: Iterable[tuple[float, int]],
    blocked: Container[int],
    *,
    count: int = 1,
    bound: float = math.inf,
) -> list[tuple[float, list[int]]]:
    """Find the cheapest paths from chains to the street network.

    Dijkstra's algorithm on the directed chains, so that each turn is charged exactly where
    it is made. Of paths that cost the same, that of the lower chains comes first.

    Parameters
    ----------
    state
        The streets so far.
    starts
        (cost of beginning with it, directed chain that is no street).
    blocked
        Nodes that the path must neither join nor cross.
    count
        Number of paths wanted, each to another node of the network.
    bound
        Paths that cost as much are not looked for.

    Returns
    -------
    list of (float, list of int)
        Cost and chains of each path, cheapest first; empty where there is none.
    """
    end, size, degree = state.end, state.size, state.degree
    ahead, aside, turn = state.ahead, state.aside, state.turn_cost
    heap: list[tuple[float, int, int]] = []
    for cost, i in starts:
        v = end[i]
        if v not in blocked:
            extra = join_cost(state, i) if degree[v] else 0.0
            heap.append((cost + size[i] + extra, i, -1))
    heapify(heap)
    parent: dict[int, int] = {}
    found: dict[int, tuple[float, list[int]]] = {}
    while heap:
        cost, i, came = heappop(heap)
        if i in parent:
            continue
        if cost >= bound:
            break
        parent[i] = came
        v = end[i]
        if degree[v]:
            if v not in found:
                found[v] = (cost, _trace(parent, i))
                if len(found) == count:
                    break
                bound = min(bound, SPREAD * cost + EXTRA)
            continue
        for j in ahead[i]:
            w = end[j]
            if j not in parent and w not in blocked:
                extra = join_cost(state, j) if degree[w] else 0.0
                heappush(heap, (cost + size[j] + extra, j, i))
        cost += turn
        for j in aside[i]:
            w = end[j]
            if j not in parent and w not in blocked:
                extra = join_cost(state, j) if degree[w] else 0.0
                heappush(heap, (cost + size[j] + extra, j, i))
    return list(found.values())


def _trace(parent: dict[int, int], last: int) -> list[int]:
    path = [last]
    while parent[path[-1]] != -1:
        path.append(parent[path[-1]])
    path.reverse()
    return path
