"""Street generation on one level of the hierarchy (Chen 2024, section 4.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams
from urban_processing.streets.access import MISSED, Access, find_accesses
from urban_processing.streets.connect import join_components, lay_access
from urban_processing.streets.ends import close_ends, prune_tails, retract_ends
from urban_processing.streets.groups import group_parcels, unreached_parcels
from urban_processing.streets.split import split_blocks
from urban_processing.streets.state import StreetState


def extend_streets(
    layout: Layout, params: CogenerateParams, *, level: int, keep_ends: bool
) -> Layout:
    """Add the streets that make every parcel of a level reached.

    Groups of unreachable parcels get an I- or L-shaped street along their boundaries, which
    a junction-weighted shortest path connects with the network of their part of the land;
    unless `keep_ends`, its dead ends are led on into the network as well (Chen 2024,
    section 4.2, steps 1 to 4). In a part without streets the first access becomes the
    network. Of several accesses the one is laid that costs least together with all that it
    brings along, blocks of few parcels included.

    Parcels that no street can reach without running along a rim that is no street stay
    unreached: further cuts may open a way on a later level.

    Parameters
    ----------
    layout
        A layout whose parcels have just been cut.
    params
        Weights of street length and junctions, and the preset's rules.
    level
        Level of the hierarchy; recorded for the new street edges.
    keep_ends
        Whether dead ends stay.

    Returns
    -------
    Layout
        The same parcels with more street edges.
    """
    state = StreetState(layout, params)
    if not keep_ends:
        # what was left open on a coarser level, and what merging vertices cut off
        close_ends(state)
        retract_ends(state)
    unreached = unreached_parcels(state)
    if unreached:
        distance = state.network_distance()
        for group in group_parcels(state, unreached):
            _reach(state, group, distance, keep_ends=keep_ends)
    prune_tails(state)
    join_components(state)
    if not keep_ends:
        close_ends(state)
        if state.rules.small_block:
            split_blocks(state)
    return state.finish(level=level)


def _reach(
    state: StreetState, group: Sequence[int], distance: Sequence[float], *, keep_ends: bool
) -> None:
    """Lay accesses until all parcels of a group are reached, or no access can be laid."""
    while True:
        group = [f for f in group if not state.is_reached(f)]
        if not group:
            return
        accesses = find_accesses(state, group, distance, keep_ends=keep_ends)
        streets = _cheapest(state, group, accesses, keep_ends=keep_ends)
        if not streets:
            return
        for i in streets:
            state.add(i)
        state.part_has_streets[state.part[group[0]]] = True


def _cheapest(
    state: StreetState, group: Sequence[int], accesses: list[Access], *, keep_ends: bool
) -> list[int]:
    """Chains that the best access adds with its connection; simulated and taken back."""
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
    return best
