"""Taking back streets that no parcel needs."""

from __future__ import annotations

from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams
from urban_processing.streets.blocks import LARGEST_BLOCK, layout_cost
from urban_processing.streets.ends import close_ends, is_spare, prune_tails
from urban_processing.streets.paths import JOIN_COST
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
        links = sorted(((-_gain(state, link), link) for link in street_links(state)))
        removed = False
        for loss, link in links:
            if loss >= 0.0:
                break
            a = block_of(state.face[link[0]])
            b = block_of(state.face[link[0] ^ 1])
            if a == b or members[a] + members[b] > LARGEST_BLOCK:
                continue
            if not _stands_free(state, link) or not is_spare(state, link):
                continue
            for i in link:
                state.remove(i)
            merged[b] = a
            members[a] += members[b]
            removed = True
        if not removed:
            return


def street_links(state: StreetState) -> list[list[int]]:
    """Interior streets from junction to junction, each in one direction."""
    degree, street, end = state.degree, state.street, state.end
    links = []
    for first in range(len(street)):
        if not street[first] or degree[state.start[first]] < 3:
            continue
        link = [first]
        while degree[end[link[-1]]] == 2:
            back = link[-1] ^ 1
            link.append(next(i for i in state.out[end[back ^ 1]] if street[i] and i != back))
        if (
            degree[end[link[-1]]] >= 3
            and first < link[-1] ^ 1
            and all(state.interior[i] for i in link)
        ):
            links.append(link)
    return links


def _stands_free(state: StreetState, link: list[int]) -> bool:
    """Whether a link is all street still, and both its ends are junctions."""
    a, b = state.start[link[0]], state.end[link[-1]]
    enough = 4 if a == b else 3
    return (
        state.degree[a] >= enough
        and state.degree[b] >= enough
        and all(state.street[i] for i in link)
    )


def _gain(state: StreetState, link: list[int]) -> float:
    """Cost that the network loses with a link."""
    gain = sum(state.size[i] for i in link) + layout_cost(state, link)
    for before, after in zip(link, link[1:], strict=False):
        if after not in state.ahead[before]:
            gain += state.turn_cost
    for last in (link[-1], link[0] ^ 1):
        goes_on = any(state.street[i] for i in state.ahead[last])
        gain += (-JOIN_COST if goes_on else JOIN_COST) * state.turn_cost
    return gain
