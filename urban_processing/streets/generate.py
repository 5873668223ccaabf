"""Street generation on one level of the hierarchy (Chen 2024, section 4.2)."""

from __future__ import annotations

from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams
from urban_processing.streets.connect import join_components, join_entries
from urban_processing.streets.ends import close_ends, prune_tails, retract_ends
from urban_processing.streets.groups import group_parcels, unreached_parcels
from urban_processing.streets.reach import reach_group
from urban_processing.streets.settle import settle_ends
from urban_processing.streets.split import split_blocks
from urban_processing.streets.state import StreetState

ROUNDS = 3
"""Times that dead ends which cannot be led on are taken back and their parcels reached anew."""


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
    for _ in range(ROUNDS):
        if not keep_ends:
            # ends left open on a coarser level, cut off by merged vertices, or by this round
            close_ends(state)
            retract_ends(state)
        unreached = unreached_parcels(state)
        if not unreached:
            break
        distance = state.network_distance()
        for group in group_parcels(state, unreached):
            reach_group(state, group, distance, keep_ends=keep_ends)
    join_entries(state)
    prune_tails(state)
    join_components(state)
    if not keep_ends:
        close_ends(state)
        settle_ends(state, along_holes=False)
        if state.rules.small_block:
            split_blocks(state)
    return state.finish(level=level)
