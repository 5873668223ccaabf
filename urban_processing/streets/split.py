"""Splitting blocks that have grown too large."""

from __future__ import annotations

import math

import numpy as np

from urban_processing.streets.blocks import LARGEST_BLOCK, flood_block, layout_cost
from urban_processing.streets.paths import find_paths, join_cost
from urban_processing.streets.state import StreetState, quantised

SMALLEST_HALF = 5
"""Number of parcels that both halves of a split block have at least."""

IMBALANCE_COST = 2.0
"""Cost of a split that leaves one half without a parcel; in proportion below."""


def split_blocks(state: StreetState) -> None:
    """Lay a street across each block of more than `LARGEST_BLOCK` parcels.

    The cheapest street from one side of the block to another that leaves both halves with
    `SMALLEST_HALF` parcels and more, until no block is larger or none can be split.
    """
    label = state.blocks()
    order = np.argsort(label, kind="stable")
    bounds = np.append(np.flatnonzero(np.diff(label[order], prepend=-1)), len(order))
    large = np.flatnonzero(np.diff(bounds) > LARGEST_BLOCK)
    blocks = [set(order[bounds[k] : bounds[k + 1]].tolist()) for k in large.tolist()]
    while blocks:
        block = blocks.pop()
        path = _best_split(state, block)
        if path is None:
            continue
        for i in path:
            state.add(i)
        half = flood_block(state, state.face[path[0]])
        blocks += [part for part in (half, block - half) if len(part) > LARGEST_BLOCK]


def _best_split(state: StreetState, block: set[int]) -> list[int] | None:
    best: list[int] | None = None
    best_cost = math.inf
    for first in entries(state, block):
        start = state.start[first]
        paths = find_paths(
            state,
            [(join_cost(state, first ^ 1), first)],
            {start},
            count=3,
            bound=best_cost,
        )
        for cost, path in paths:
            total = cost + _imbalance(state, block, path)
            if total < best_cost:
                best_cost, best = total, path
    return best


def entries(state: StreetState, block: set[int]) -> list[int]:
    """Chains that lead from the streets around a block into it."""
    entries = set()
    for f in block:
        for j in state.around[f]:
            if state.usable[j] and not state.street[j]:
                entries |= {i for i in (j, j ^ 1) if state.degree[state.start[i]]}
    return sorted(entries)


def _imbalance(state: StreetState, block: set[int], path: list[int]) -> float:
    """Cost of the blocks that a path makes; infinite where a half becomes too small."""
    mark = len(state.journal)
    for i in path:
        state.add(i)
    half = len(flood_block(state, state.face[path[0]]))
    cost = layout_cost(state, path)
    state.undo(mark)
    other = len(block) - half
    if min(half, other) < SMALLEST_HALF:
        return math.inf
    return cost + quantised(IMBALANCE_COST * abs(half - other) / len(block))
