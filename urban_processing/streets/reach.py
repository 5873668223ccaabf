"""Reaching a group of parcels by the access that costs least with all that it brings along."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urban_processing.streets.access import MISSED, Access, find_accesses
from urban_processing.streets.connect import lay_access
from urban_processing.streets.state import StreetState

LAST_RESORT = 40
"""Number of accesses tried where none of the best can be connected and closed."""


def reach_group(
    state: StreetState, group: Sequence[int], distance: Sequence[float], *, keep_ends: bool
) -> float:
    """Lay accesses until all parcels of a group are reached, or no access can be laid.

    Returns
    -------
    float
        Cost of the new streets; infinite where a parcel stays unreached.
    """
    total = 0.0
    while True:
        group = [f for f in group if not state.is_reached(f)]
        if not group:
            return total
        cost, streets = math.inf, list[int]()
        for count in (state.rules.look_ahead, LAST_RESORT):
            accesses = find_accesses(state, group, distance, keep_ends=keep_ends, count=count)
            cost, streets = _cheapest(state, group, accesses, keep_ends=keep_ends)
            if cost < state.unclosed_cost:
                break
        total += cost
        if not streets:
            return math.inf
        for i in streets:
            state.add(i)
        state.part_has_streets[state.part[group[0]]] = True


def _cheapest(
    state: StreetState, group: Sequence[int], accesses: list[Access], *, keep_ends: bool
) -> tuple[float, list[int]]:
    """Cost and chains of the best access with its connection; simulated and taken back."""
    best: list[int] = []
    best_cost = math.inf
    for access in accesses:
        mark = len(state.journal)
        cost = lay_access(state, access.chains, keep_ends=keep_ends, bound=best_cost)
        if cost < best_cost:
            cost += MISSED * sum(not state.is_reached(f) for f in group)
        if cost < best_cost:
            best_cost = cost
            best = state.journal[mark:]
        state.undo(mark)
    return best_cost, best
