"""Connecting accesses and loose networks to the network of their part."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from urban_processing.streets.blocks import layout_cost
from urban_processing.streets.ends import close_end
from urban_processing.streets.paths import find_paths, join_cost
from urban_processing.streets.state import StreetState


def lay_access(
    state: StreetState, chains: Sequence[int], *, keep_ends: bool, bound: float = math.inf
) -> float:
    """Make an access street, connect it with the network and close its ends.

    Parameters
    ----------
    state
        The streets so far; it is changed.
    chains
        Chains of the access, in order.
    keep_ends
        Whether dead ends stay.
    bound
        Cost from which on the result does not matter: infinity is returned early.

    Returns
    -------
    float
        Cost of all that was added; infinite where the access could not be connected.
    """
    nodes = [state.start[chains[0]]] + [state.end[i] for i in chains]
    has_network = state.part_has_streets[state.part_of(chains[0])]
    touches = any(state.degree[v] for v in nodes)
    mark = len(state.journal)
    cost = _cost_of(state, chains)
    for i in chains:
        state.add(i)
    if has_network and not touches and keep_ends:
        way = path_to_network(state, chains, bound=bound - cost)
        if way is None:
            return math.inf
        cost += _add(state, way)
    elif not keep_ends:
        connected = touches or not has_network
        for node in (nodes[0], nodes[-1]):
            if state.degree[node] == 1:
                way = close_end(state, node)
                if way is None:
                    cost += state.unclosed_cost
                else:
                    connected = True
                    cost += _add(state, way)
        if cost >= bound:
            return math.inf
        if not connected:
            way = path_to_network(state, chains, bound=bound - cost)
            if way is None:
                return math.inf
            cost += _add(state, way)
    return cost + layout_cost(state, state.journal[mark:])


def _add(state: StreetState, way: tuple[float, list[int]]) -> float:
    for i in way[1]:
        state.add(i)
    return way[0]


def _cost_of(state: StreetState, chains: Sequence[int]) -> float:
    """Length and turns of an access, and the junctions of its ends that lie on streets."""
    cost = sum(state.size[i] for i in chains)
    for before, after in pairwise(chains):
        if after not in state.ahead[before]:
            cost += state.turn_cost
    for last in (chains[-1], chains[0] ^ 1):
        if state.degree[state.end[last]]:
            cost += join_cost(state, last)
    return cost


def path_to_network(
    state: StreetState, chains: Sequence[int], *, bound: float = math.inf
) -> tuple[float, list[int]] | None:
    """Find the cheapest way from an access to the rest of the network of its part.

    Going straight on from an end of the access is free; a turn there, or a branch on the
    way, costs a turn.
    """
    nodes = [state.start[chains[0]]] + [state.end[i] for i in chains]
    blocked = set(nodes)
    straight = set(state.ahead[chains[-1]]) | set(state.ahead[chains[0] ^ 1])
    starts = [
        (0.0 if i in straight else state.turn_cost, i)
        for v in sorted(blocked)
        for i in state.out[v]
        if state.usable[i] and not state.street[i]
    ]
    paths = find_paths(state, starts, blocked, bound=bound)
    return paths[0] if paths else None


def join_components(state: StreetState) -> None:
    """Connect the street components of each part, as far as there is a way."""
    n_components, label = state.network_components()
    parts: dict[int, int] = {}
    for node in np.flatnonzero(label >= 0).tolist():
        parts.setdefault(int(label[node]), state.part_of(state.out[node][0]))
    if n_components == len(set(parts.values())):
        return
    members = np.bincount(label[label >= 0], minlength=n_components)
    largest: dict[int, int] = {}
    for component in np.argsort(-members, kind="stable").tolist():
        largest.setdefault(parts[component], component)
    for component in np.argsort(members, kind="stable").tolist():
        if component != largest[parts[component]]:
            _join(state, np.flatnonzero(label == component).tolist())


def _join(state: StreetState, nodes: list[int]) -> None:
    own = set(nodes)
    starts = []
    for v in nodes:
        into = [i ^ 1 for i in state.out[v] if state.street[i]]
        straight = set(state.ahead[into[0]]) if len(into) == 1 else set()
        starts += [
            (0.0 if i in straight else state.turn_cost, i)
            for i in state.out[v]
            if state.usable[i] and not state.street[i]
        ]
    for _, path in find_paths(state, starts, own):
        for i in path:
            state.add(i)
