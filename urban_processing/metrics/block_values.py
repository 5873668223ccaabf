"""Metrics of blocks."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.fabric.model import Fabric
from urban_processing.mesh.planar import BoolArray
from urban_processing.metrics.averages import highest, in_part, lowest, mean, percent
from urban_processing.metrics.land_values import land_area
from urban_processing.streets.block_length import BlockSides

SMALL_BLOCK = 3
"""Blocks of at most this many parcels count as small."""


def block_values(fabric: Fabric, sides: BlockSides | None, part: int | None) -> dict[str, float]:
    """Metrics of the blocks of the whole, or of one part."""
    blocks = fabric.blocks
    inside = in_part(blocks.part, part)
    if sides is None or not inside.any():
        return {"blocks": 0, "blocks_per_km2": 0.0}
    length = sides.length[inside]
    area = shapely.area(blocks.polygons[inside])
    perimeter = shapely.length(blocks.polygons[inside])
    land = land_area(fabric, part)
    return {
        **_parcels_in_blocks(fabric, inside),
        "blocks": int(inside.sum()),
        "block_length_median_m": float(np.median(length)),
        "block_length_max_m": highest(length),
        "block_area_mean_m2": mean(area),
        "block_area_median_m2": float(np.median(area)),
        "blocks_per_km2": 1e6 * int(inside.sum()) / land,
        "block_perimeter_max_m": highest(perimeter),
        "block_perimeter_mean_m": mean(perimeter),
        "block_perimeter_min_m": lowest(perimeter),
    }


def _parcels_in_blocks(fabric: Fabric, inside: BoolArray) -> dict[str, float]:
    if fabric.parcels is None:
        return {}
    of = fabric.parcels.block
    size = np.bincount(of[of >= 0], minlength=len(fabric.blocks))[inside]
    size = size[size > 0]
    return {
        "block_parcels_median": float(np.median(size)) if len(size) else math.nan,
        "block_parcels_max": highest(size),
        "small_blocks_pct": percent(size <= SMALL_BLOCK),
    }
