"""Taking back streets that no parcel needs."""

from __future__ import annotations

from urban_processing.layout import Layout
from urban_processing.params import CogenerateParams
from urban_processing.streets.blocks import LARGEST_BLOCK, flood_block
from urban_processing.streets.ends import close_ends, is_spare, prune_tails
from urban_processing.streets.links import link_cost, stands_free, street_links
from urban_processing.streets.settle import settle_ends
from urban_processing.streets.shorten import BlockLimit, shorten_blocks
from urban_processing.streets.state import StreetState


def prune_streets(layout: Layout, params: CogenerateParams, *, keep_ends: bool) -> Layout:
    """Take back redundant dead ends and links of the street network, for good.

    A street goes where all parcels stay reached, the network stays connected, no block of
    more than `LARGEST_BLOCK` parcels or longer than wanted arises, and, unless `keep_ends`, no
    dead end. Where a dead end has no other way on it is led along a hole, such as the shore of a
    lake. Blocks that are longer than wanted get streets across before.

    Parameters
    ----------
    layout
        A layout whose parcels are final.
    params
        Weights of street length and junctions, and the longest block that is wanted.
    keep_ends
        Whether dead ends are wanted.
    """
    state = StreetState(layout, params)
    prune_tails(state)
    if not keep_ends:
        close_ends(state)
        settle_ends(state, along_holes=True)
    limit = BlockLimit(state, params)
    shorten_blocks(state, limit)
    prune_links(state, limit)
    return state.finish(level=int(layout.edge_level.max(initial=0)))


def prune_links(state: StreetState, limit: BlockLimit) -> None:
    """Take back street links between two blocks that may become one.

    A link with the same region on both sides is a bridge of the network and stays; taking
    back any other keeps the network connected. Links end at junctions of three streets and
    more, so none leaves a dead end.
    """
    blocks = _Merged(state.blocks().tolist())
    regions = _Merged(state.regions().tolist())
    while True:
        links = sorted((-link_cost(state, link), link) for link in street_links(state))
        removed = False
        for loss, link in links:
            if loss >= 0.0:
                break
            left, right = state.face[link[0]], state.face[link[0] ^ 1]
            if regions.same(left, right) or blocks.members(left, right) > LARGEST_BLOCK:
                continue
            if not stands_free(state, link) or not is_spare(state, link):
                continue
            if not limit.allows(flood_block(state, left) | flood_block(state, right)):
                continue
            for i in link:
                state.remove(i)
            blocks.merge(left, right)
            regions.merge(left, right)
            removed = True
        if not removed:
            return


class _Merged:
    """Sets of parcels that are merged one by one (union-find)."""

    def __init__(self, label: list[int]) -> None:
        self._label = label
        self._parent = list(range(max(label) + 1))
        self._members = [0] * len(self._parent)
        for k in label:
            self._members[k] += 1

    def _root(self, parcel: int) -> int:
        k = self._label[parcel]
        while self._parent[k] != k:
            k = self._parent[k]
        return k

    def same(self, a: int, b: int) -> bool:
        return self._root(a) == self._root(b)

    def members(self, a: int, b: int) -> int:
        """Count the parcels of both sets together."""
        a, b = self._root(a), self._root(b)
        return self._members[a] + (self._members[b] if a != b else 0)

    def merge(self, a: int, b: int) -> None:
        a, b = self._root(a), self._root(b)
        if a != b:
            self._parent[b] = a
            self._members[a] += self._members[b]
