"""Dead ends: closing them to loops, or pruning them (Chen 2024, section 4.2, step 4)."""

from __future__ import annotations

import math

from urban_processing.mesh.planar import OUTSIDE
from urban_processing.streets.blocks import layout_cost
from urban_processing.streets.paths import find_paths
from urban_processing.streets.state import StreetState

ALTERNATIVES = 4
"""Number of ways of closing a dead end that are compared by the blocks they make."""


def street_into(state: StreetState, node: int) -> int:
    """Return the one street chain that reaches a dead end."""
    return next(i for i in state.out[node] if state.street[i]) ^ 1


def tail_of(state: StreetState, node: int) -> list[int]:
    """Nodes from a dead end back to the first junction or other end, both included."""
    nodes = [node]
    chain = street_into(state, node) ^ 1
    while True:
        v = state.end[chain]
        nodes.append(v)
        if state.degree[v] != 2 or v == node:
            return nodes
        chain = next(i for i in state.out[v] if state.street[i] and i != chain ^ 1)


def close_end(
    state: StreetState, node: int, *, bound: float = math.inf
) -> tuple[float, list[int]] | None:
    """Find the street that best leads a dead end on into the network.

    Its own tail is no target, so that no street turns back into itself.

    Returns
    -------
    (float, list of int) or None
        Cost without that of blocks, and the chains; None where there is no way, or none that
        costs less than `bound`.
    """
    into = street_into(state, node)
    starts = [(0.0, i) for i in state.ahead[into]]
    starts += [(state.turn_cost, i) for i in state.aside[into]]
    blocked = set(tail_of(state, node))
    count = 1 if state.rules.small_block == 0.0 else ALTERNATIVES
    paths = find_paths(state, starts, blocked, count=count, bound=bound)
    if len(paths) <= 1:
        return paths[0] if paths else None
    best = None
    best_cost = math.inf
    mark = len(state.journal)
    for cost, path in paths:
        if cost >= best_cost:
            break
        for i in path:
            state.add(i)
        total = cost + layout_cost(state, path)
        state.undo(mark)
        if total < best_cost:
            best_cost, best = total, (cost, path)
    return best


def dead_ends(state: StreetState) -> list[int]:
    """Nodes with a single street, without entries and the ends of streets that the user gave."""
    return [
        v
        for v, d in enumerate(state.degree)
        if d == 1 and not state.entry[v] and not state.fixed[street_into(state, v)]
    ]


def close_ends(state: StreetState) -> None:
    """Lead all dead ends on into the network, as far as there is a way."""
    for node in dead_ends(state):
        if state.degree[node] == 1:
            way = close_end(state, node)
            if way is not None:
                for i in way[1]:
                    state.add(i)


def retract_ends(state: StreetState) -> None:
    """Take back dead ends that cannot be led on, whether or not a parcel needs them.

    Its parcels get another access then. Land whose rim is not all street keeps them: streets
    may well end there.
    """
    for node in dead_ends(state):
        retract_end(state, node)


def retract_end(state: StreetState, node: int) -> list[int]:
    """Take back one dead end as far as `retract_ends` does; return its chains."""
    removed = []
    while state.degree[node] == 1 and not state.entry[node]:
        chain = street_into(state, node)
        if not state.removable[chain] or not state.part_has_street_rim[state.part_of(chain)]:
            break
        state.remove(chain)
        removed.append(chain)
        node = state.start[chain]
    return removed


def prune_tails(state: StreetState) -> None:
    """Take back dead ends as long as all parcels beside them stay reached."""
    open_ = dead_ends(state)
    while open_:
        node = open_.pop()
        if state.degree[node] != 1 or state.entry[node]:
            continue
        chain = street_into(state, node)
        if state.removable[chain] and is_spare(state, [chain]):
            state.remove(chain)
            open_.append(state.start[chain])


def is_spare(state: StreetState, chains: list[int]) -> bool:
    """Whether all parcels stay reached without these street chains."""
    left: dict[int, float] = {}
    for chain in chains:
        for f in (state.face[chain], state.face[chain ^ 1]):
            if f != OUTSIDE:
                left[f] = left.get(f, state.frontage[f]) - state.length[chain]
    return all(frontage >= state.need[f] for f, frontage in left.items())
