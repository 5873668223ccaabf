"""Mid-block streets: laying streets across blocks that are longer than wanted."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.access_rule import MEASURED_M
from urban_processing.layout import Layout
from urban_processing.mesh.planar import IntArray
from urban_processing.params import CogenerateParams
from urban_processing.streets.block_length import longest_sides
from urban_processing.streets.blocks import flood_block, layout_cost
from urban_processing.streets.paths import find_paths, join_cost
from urban_processing.streets.split import entries
from urban_processing.streets.state import StreetState

SMALLEST_HALF = 4
"""Number of parcels that both halves of a divided block have at least; three make a small one."""

OFF_CENTRE_COST = 12.0
"""Cost of a street at the end of the side it divides, against one at its middle."""

EXCESS_COST = 4.0
"""Cost of each parcel side by which the halves of a block stay longer than wanted."""

NEAREST_END = 0.1
"""A street that divides a side lies at least this share of it away from both ends."""

TRIED = 6
"""Number of streets across a block whose halves are measured."""


@dataclass(frozen=True)
class _Street:
    """A street that could divide a block; compared by what it costs before halves are measured."""

    cost: float
    path: tuple[int, ...]


class BlockLimit:
    """The longest block that is wanted, with the parcels of a layout to measure blocks by."""

    def __init__(self, state: StreetState, params: CogenerateParams) -> None:
        self.limit = params.max_block_length or math.inf
        self.hard = params.hard_block_length
        self.polygons = state.layout.mesh.face_polygons()

    def longest_side(self, block: set[int]) -> tuple[float, shapely.LineString]:
        """Length of the longest side of a block of parcels, and the side."""
        faces = np.array(sorted(block))
        sides = longest_sides(self.polygons[faces], np.zeros(len(faces), dtype=np.int64))
        return float(sides.length[0]), sides.line[0]

    def excess(self, block: set[int]) -> float:
        """Length in metres by which a block is longer than wanted."""
        return max(0.0, self.longest_side(block)[0] - self.limit)

    def allows(self, block: set[int]) -> bool:
        """Whether a block is short enough."""
        return math.isinf(self.limit) or self.excess(block) <= MEASURED_M

    def too_long(self, label: IntArray) -> list[set[int]]:
        """Blocks that are too long, of those that parcels are labelled with."""
        _, block = np.unique(label, return_inverse=True)
        length = longest_sides(self.polygons, block).length
        return [
            set(np.flatnonzero(block == b).tolist())
            for b in np.flatnonzero(length > self.limit + MEASURED_M).tolist()
        ]


def divide_long_blocks(layout: Layout, params: CogenerateParams) -> Layout:
    """Lay streets across the blocks of a finished layout that are longer than wanted."""
    if params.max_block_length is None:
        return layout
    state = StreetState(layout, params)
    shorten_blocks(state, BlockLimit(state, params))
    return state.finish(level=int(layout.edge_level.max(initial=0)))


def shorten_blocks(state: StreetState, limit: BlockLimit) -> None:
    """Lay streets across blocks that are too long, each near the middle of the longest side.

    A street runs along parcels from that side to another street. It leaves `SMALLEST_HALF`
    parcels and more on both sides, or one where the limit is a hard one. Blocks that no street
    divides so stay as they are.
    """
    if math.isinf(limit.limit):
        return
    blocks = limit.too_long(state.blocks())
    while blocks:
        block = blocks.pop()
        path = _best_street(state, limit, block)
        if path is None:
            continue
        for i in path:
            state.add(i)
        half = flood_block(state, state.face[path[0]])
        blocks += [part for part in (half, block - half) if not limit.allows(part)]


def _best_street(state: StreetState, limit: BlockLimit, block: set[int]) -> tuple[int, ...] | None:
    """The street that costs least with what its two halves are too long by."""
    least = 1 if limit.hard else SMALLEST_HALF
    best: tuple[int, ...] | None = None
    best_cost = math.inf
    tried = 0
    for street in _streets(state, limit, block):
        if tried == TRIED or street.cost >= best_cost:
            break
        mark = len(state.journal)
        for i in street.path:
            state.add(i)
        half = flood_block(state, state.face[street.path[0]])
        other = block - half
        cost = street.cost + layout_cost(state, street.path)
        state.undo(mark)
        if min(len(half), len(other)) < least:
            continue
        tried += 1
        cost += EXCESS_COST * (limit.excess(half) + limit.excess(other)) / state.side
        if round(cost, 6) < best_cost:
            best_cost, best = round(cost, 6), street.path
    return best


def _streets(state: StreetState, limit: BlockLimit, block: set[int]) -> list[_Street]:
    """Streets from the longest side of a block across it, the cheapest first."""
    length, side = limit.longest_side(block)
    ways = entries(state, block)
    xy = state.layout.mesh.xy[state.graph.node_vertex[[state.start[i] for i in ways]]]
    points = shapely.points(xy)
    off = shapely.distance(points, side)
    place = shapely.line_locate_point(side, points) / length
    streets = []
    for first, away, share in zip(ways, off.tolist(), place.tolist(), strict=True):
        if away > MEASURED_M or not NEAREST_END <= share <= 1.0 - NEAREST_END:
            continue
        starts = [(join_cost(state, first ^ 1), first)]
        off_centre = OFF_CENTRE_COST * abs(2.0 * share - 1.0)
        for cost, path in find_paths(state, starts, {state.start[first]}, count=3):
            streets.append(_Street(round(cost + off_centre, 6), tuple(path)))
    return sorted(streets, key=lambda street: (street.cost, street.path))
