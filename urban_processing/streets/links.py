"""Links of the street network: what lies between two junctions."""

from __future__ import annotations

from itertools import pairwise

from urban_processing.streets.blocks import layout_cost
from urban_processing.streets.paths import JOIN_COST
from urban_processing.streets.state import StreetState


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
            and all(state.removable[i] for i in link)
            and not any(state.entry[end[i]] for i in link[:-1])
        ):
            links.append(link)
    return links


def stands_free(state: StreetState, link: list[int]) -> bool:
    """Whether a link is all street still, and both its ends are junctions."""
    a, b = state.start[link[0]], state.end[link[-1]]
    enough = 4 if a == b else 3
    return (
        state.degree[a] >= enough
        and state.degree[b] >= enough
        and all(state.street[i] for i in link)
    )


def link_cost(state: StreetState, link: list[int]) -> float:
    """Cost that the network loses with a link."""
    gain = sum(state.size[i] for i in link) + layout_cost(state, link)
    for before, after in pairwise(link):
        if after not in state.ahead[before]:
            gain += state.turn_cost
    for last in (link[-1], link[0] ^ 1):
        goes_on = any(state.street[i] for i in state.ahead[last])
        gain += (-JOIN_COST if goes_on else JOIN_COST) * state.turn_cost
    return gain
