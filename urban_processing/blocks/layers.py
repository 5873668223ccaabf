"""Blocks as layers: polygons, their edges with the streets along them, right-of-way."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.find import FoundBlocks
from urban_processing.blocks.model import UNKNOWN_STREET, BlockRings
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.provenance import Step
from urban_processing.schema import BLOCK_EDGES, BLOCKS, ISSUES, RIGHT_OF_WAY, Layer
from urban_processing.tables import LayerSet, Table, issue_table, make_table, to_map

LAYERS: tuple[Layer, ...] = (BLOCKS, BLOCK_EDGES, RIGHT_OF_WAY, ISSUES)
"""Layers that blocks have, besides provenance."""


def block_layers(found: FoundBlocks, *, history: tuple[Step, ...] = ()) -> LayerSet:
    """Return blocks, their edges and the right-of-way as layers of the schema."""
    blocks = found.blocks
    area = float(shapely.area(blocks.polygons).sum())
    taken = float(shapely.area(found.right_of_way).sum())
    tables = {
        BLOCKS: _block_table(found),
        BLOCK_EDGES: _edge_table(found),
        RIGHT_OF_WAY: make_table(
            RIGHT_OF_WAY,
            {
                "class": found.right_of_way_class,
                "part": found.right_of_way_part,
                "area_m2": shapely.area(found.right_of_way),
            },
            to_map(found.right_of_way, blocks.frame),
        ),
        ISSUES: issue_table(blocks.issues, blocks.frame),
    }
    return LayerSet(
        kind="blocks",
        tables=tables,
        frame=blocks.frame,
        history=history,
        summary=(
            ("blocks", f"{len(blocks):,}"),
            ("area", f"{area / 1e4:,.2f} ha, mean {area / len(blocks):,.0f} m²"),
            ("right-of-way", f"{100 * taken / (area + taken):.1f} %"),
            ("issues", f"{len(blocks.issues)}"),
        ),
    )


def _block_table(found: FoundBlocks) -> Table:
    blocks = found.blocks
    rings = blocks.rings
    length = np.where(blocks.edge_access, _edge_lengths(rings), 0.0)
    known = blocks.edge_street != UNKNOWN_STREET
    pairs = np.column_stack([rings.edge_block, blocks.edge_street])[known]
    around = np.unique(pairs, axis=0)[:, 0]
    n = len(blocks)
    return make_table(
        BLOCKS,
        {
            "block_id": blocks.block_id,
            "part": found.part,
            "area_m2": shapely.area(blocks.polygons),
            "perimeter_m": shapely.length(blocks.polygons),
            "frontage_m": np.bincount(rings.edge_block, weights=length, minlength=n),
            "streets": np.bincount(around, minlength=n),
        },
        to_map(blocks.polygons, blocks.frame),
    )


def _edge_table(found: FoundBlocks) -> Table:
    blocks = found.blocks
    rings = blocks.rings
    runs = _runs(rings, _kinds(found))
    first = np.array([run[0] for run in runs], dtype=np.int64)
    lines = [rings.xy[np.append(run, rings.following[run[-1]])] for run in runs]
    access = blocks.edge_access[first]
    block = rings.edge_block[first]
    street = blocks.edge_street[first]
    shapes = np.empty(len(lines), dtype=object)
    shapes[:] = [shapely.LineString(xy) for xy in lines]
    return make_table(
        BLOCK_EDGES,
        {
            "block_id": blocks.block_id[block],
            "part": found.part[block],
            "street_id": np.where(street == UNKNOWN_STREET, np.nan, street),
            "class": [name or None for name in found.edge_class[first].tolist()],
            "width_m": blocks.edge_width[first],
            "length_m": shapely.length(shapes),
            "access": access,
        },
        to_map(shapes, blocks.frame),
    )


def _edge_lengths(rings: BlockRings) -> FloatArray:
    step = rings.xy[rings.following] - rings.xy
    return np.hypot(step[:, 0], step[:, 1])


def _kinds(found: FoundBlocks) -> IntArray:
    """(K,) number that two edges share whose street is the same in all that a layer says."""
    blocks = found.blocks
    classes = np.unique(found.edge_class, return_inverse=True)[1]
    values = [blocks.edge_street, classes.ravel(), np.nan_to_num(blocks.edge_width, nan=-1.0)]
    kinds = np.unique(np.column_stack(values), axis=0, return_inverse=True)[1]
    return np.asarray(kinds.ravel())


def _runs(rings: BlockRings, kind: IntArray) -> list[npt.NDArray[np.int64]]:
    """Edges that follow one another and are of one kind, ring by ring."""
    runs = []
    for low, high in zip(rings.offsets[:-1].tolist(), rings.offsets[1:].tolist(), strict=True):
        edges = np.arange(low, high)
        begins = np.flatnonzero(kind[low:high] != np.roll(kind[low:high], 1))
        if not len(begins):
            runs.append(edges)
            continue
        turned = np.roll(edges, -int(begins[0]))
        runs += np.split(turned, begins[1:] - begins[0])
    return runs
