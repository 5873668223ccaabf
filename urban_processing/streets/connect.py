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
    """Connect the street components of each part, as far as there is a way.

    The smallest is joined first, so that each way is as short as can be.
    """
    stuck: set[int] = set()
    while True:
        loose = _loose_components(state)
        nodes = next((c for c in loose if c[0] not in stuck), None)
        if nodes is None:
            return
        if not _join(state, nodes):
            stuck.add(nodes[0])


def _loose_components(state: StreetState) -> list[list[int]]:
    """Nodes of all street components but the largest of each part, the smallest first."""
    n_components, label = state.network_components()
    used = np.flatnonzero(label >= 0)
    _, first = np.unique(label[used], return_index=True)
    part = [state.part_of(state.out[used[i]][0]) for i in first.tolist()]
    if n_components == len(set(part)):
        return []
    members = np.bincount(label[used], minlength=n_components)
    order = np.argsort(members, kind="stable").tolist()
    largest = {part[component]: component for component in order}
    return [
        np.flatnonzero(label == component).tolist()
        for component in order
        if component != largest[part[component]]
    ]


def _join(state: StreetState, nodes: list[int]) -> bool:
    """Lead a component to another one; whether there is a way."""
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
    paths = find_paths(state, starts, own)
    for _, path in paths:
        for i in path:
            state.add(i)
    return bool(paths)


def join_entries(state: StreetState) -> None:
    """Lead a street from each entry to the network of its part, as far as there is a way."""
    for node, is_entry in enumerate(state.entry):
        if not is_entry or state.degree[node]:
            continue
        starts = [(0.0, i) for i in state.out[node] if state.usable[i]]
        for _, path in find_paths(state, starts, {node}):
            for i in path:
                state.add(i)
