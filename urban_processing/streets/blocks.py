"""What new streets do to blocks: small blocks, and parcels between two parallel streets."""

from __future__ import annotations

import math
from collections.abc import Sequence

from urban_processing.mesh.planar import OUTSIDE
from urban_processing.streets.state import StreetState, quantised

SMALL_BLOCK = 5
"""Blocks of fewer parcels are charged for each parcel that they lack."""

LARGEST_BLOCK = 48
"""Number of parcels above which a block is split, and up to which blocks are merged."""

THROUGH_COST = 0.2
"""Cost of each parcel side of street that lies opposite another street of the same parcel."""

PARALLEL = 0.8
"""Cosine of the angle between streets from which they count as parallel."""

OPPOSITE = 0.3
"""Offset in parcel sides from which parallel streets lie on opposite sides of a parcel."""


def layout_cost(state: StreetState, chains: Sequence[int]) -> float:
    """Cost of the blocks, through lots and parcels' fronts that the new street `chains` make."""
    facing = 0.0
    if state.facing is not None:
        facing = sum(state.facing[i] + state.facing[i ^ 1] for i in chains)
    if state.rules.small_block == 0.0:
        return facing
    small = quantised(state.rules.small_block) * small_block_deficit(state, chains)
    return facing + small + quantised(THROUGH_COST * through_length(state, chains))


def small_block_deficit(state: StreetState, chains: Sequence[int]) -> int:
    """Count the parcels that the blocks beside `chains` have less than `SMALL_BLOCK`."""
    deficit = 0
    face = state.face
    done: set[int] = set()
    for chain in chains:
        for first in (face[chain], face[chain ^ 1]):
            if first == OUTSIDE or first in done:
                continue
            block = flood_block(state, first, enough=SMALL_BLOCK)
            done |= block
            deficit += max(0, SMALL_BLOCK - len(block))
    return deficit


def flood_block(state: StreetState, first: int, *, enough: float = math.inf) -> set[int]:
    """Parcels of the block that a parcel belongs to; at least `enough` of a larger one."""
    face, around, street = state.face, state.around, state.street
    block = {first}
    front = [first]
    for f in front:
        for i in around[f]:
            if not street[i]:
                g = face[i ^ 1]
                if g != OUTSIDE and g not in block:
                    block.add(g)
                    front.append(g)
        if len(front) >= enough:
            break
    return block


def through_length(state: StreetState, chains: Sequence[int]) -> float:
    """Length in parcel sides of `chains` opposite another street across one parcel."""
    total = 0.0
    street, around, chord, middle, size = (
        state.street,
        state.around,
        state.chord,
        state.middle,
        state.size,
    )
    for chain in chains:
        along = chord[chain].conjugate()
        here = middle[chain]
        for f in (state.face[chain], state.face[chain ^ 1]):
            if f == OUTSIDE:
                continue
            for i in around[f]:
                if (
                    street[i]
                    and abs((chord[i] * along).real) > PARALLEL
                    and abs(((middle[i] - here) * along).imag) > OPPOSITE
                ):
                    total += min(size[i], size[chain])
    return total
