"""Taking back streets that no parcel needs."""

from __future__ import annotations

from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams
from urban_processing.streets.blocks import LARGEST_BLOCK
from urban_processing.streets.ends import close_ends, is_spare, prune_tails
from urban_processing.streets.links import link_cost, stands_free, street_links
from urban_processing.streets.state import StreetState


def prune_streets(layout: Layout, params: CogenerateParams, *, keep_ends: bool) -> Layout:
    """Take back redundant dead ends and links of the street network, for good.

    A street goes where all parcels stay reached, the network stays connected, no block of
    more than `LARGEST_BLOCK` parcels arises, and, unless `keep_ends`, no dead end.

    Parameters
    ----------
    layout
        A layout whose parcels are final.
    params
        Weights of street length and junctions.
    keep_ends
        Whether dead ends are wanted.
    """
    state = StreetState(layout, params)
    prune_tails(state)
    if not keep_ends:
        close_ends(state)
    prune_links(state)
    return state.finish(level=int(layout.edge_level.max(initial=0)))


def prune_links(state: StreetState) -> None:
    """Take back street links between two blocks that may become one.

    A link with the same block on both sides is a bridge of the network and stays; taking
    back any other keeps the network connected. Links end at junctions of three streets and
    more, so none leaves a dead end.
    """
    block: list[int] = state.blocks().tolist()
    members = [0] * len(block)
    for b in block:
        members[b] += 1
    merged = list(range(len(block)))

    def block_of(face: int) -> int:
        b = block[face]
        while merged[b] != b:
            b = merged[b]
        return b

    while True:
        links = sorted((-link_cost(state, link), link) for link in street_links(state))
        removed = False
        for loss, link in links:
            if loss >= 0.0:
                break
            a = block_of(state.face[link[0]])
            b = block_of(state.face[link[0] ^ 1])
            if a == b or members[a] + members[b] > LARGEST_BLOCK:
                continue
            if not stands_free(state, link) or not is_spare(state, link):
                continue
            for i in link:
                state.remove(i)
            merged[b] = a
            members[a] += members[b]
            removed = True
        if not removed:
            return
