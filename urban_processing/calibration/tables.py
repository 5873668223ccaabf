"""The rows of the layers of a calibration."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks
from urban_processing.calibration.bounds import Statistics
from urban_processing.calibration.grouping import OUTSIDE
from urban_processing.calibration.layers import CALIBRATED_BLOCKS, OBSERVED_PARCELS
from urban_processing.calibration.model import Observed
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.schema import Layer
from urban_processing.tables import Table, make_table, to_map, with_columns


def block_layer(
    blocks: Blocks,
    statistics: Mapping[str, Statistics],
    bounds: Mapping[str, FloatArray],
) -> tuple[Layer, Table]:
    """Return the blocks with what was measured and what follows from it.

    Parameters
    ----------
    blocks
        B blocks, with columns to be carried along.
    statistics
        Of ``area`` and ``width``.
    bounds
        (B,) values of each of `urban_processing.calibration.layers.BOUNDS`.
    """
    layer, more = _with_own(CALIBRATED_BLOCKS, blocks.columns)
    area, width = statistics["area"], statistics["width"]
    values = {
        "block_id": blocks.block_id,
        "part": np.arange(len(blocks)),
        "area_m2": shapely.area(blocks.polygons),
        "parcels": area.count,
        "area_mean_m2": area.mean,
        "area_sd_m2": area.deviation,
        "width_mean_m": width.mean,
        "width_sd_m": width.deviation,
        **bounds,
        **more,
    }
    return layer, make_table(layer, values, to_map(blocks.polygons, blocks.frame))


def parcel_layer(
    observed: Observed, block: IntArray, blocks: Blocks, boxes: FloatArray
) -> tuple[Layer, Table]:
    """Return the parcels with their blocks.

    Parameters
    ----------
    observed
        n parcels.
    block
        (n,) row of the block of each; `OUTSIDE` where it is left out.
    blocks
        The blocks.
    boxes
        (n, 2) shorter and longer side of the smallest rectangle around each.
    """
    layer, more = _with_own(OBSERVED_PARCELS, observed.columns)
    values = {
        "parcel_id": observed.parcel_id,
        "block_id": np.where(block == OUTSIDE, np.nan, blocks.block_id[block]),
        "area_m2": shapely.area(observed.parcels),
        "box_width_m": boxes[:, 0],
        "box_length_m": boxes[:, 1],
        **more,
    }
    return layer, make_table(layer, values, to_map(observed.parcels, observed.frame))


def _with_own(
    layer: Layer, columns: Mapping[str, npt.NDArray[Any]]
) -> tuple[Layer, dict[str, npt.NDArray[Any]]]:
    """Return a layer with columns that were given, but for those that it has itself."""
    declared = {*(name.lower() for name in layer.column_names), "fid", "geom", "geometry"}
    return with_columns(layer, {k: v for k, v in columns.items() if k.lower() not in declared})
