"""The layers of a calibration: blocks with the bounds of their parcels, and these parcels."""

from __future__ import annotations

import dataclasses

from urban_processing.parcelling.layers import SUBDIVIDED_BLOCKS, SUBDIVIDED_PARCELS
from urban_processing.schema import (
    BLOCK_ID,
    ISSUES,
    PARCELS,
    PROVENANCE,
    TRUE_AREA,
    Column,
    ColumnType,
    GeometryType,
    Layer,
)

CALIBRATION_KIND = "calibration"
"""What files say that they hold."""

BOUNDS = ("min_area", "max_area", "min_width", "max_width")
"""Parameters of subdivision that are worked out, each a column of the blocks."""

_BOUND = {
    "min_area": "Smallest parcel: mean area less k standard deviations.",
    "max_area": "Largest parcel: mean area plus k standard deviations.",
    "min_width": "Smallest width: mean width less k standard deviations.",
    "max_width": "Largest width: mean width plus k standard deviations.",
}


def _measured(name: str, unit: str, alias: str, description: str) -> Column:
    return Column(name, ColumnType.REAL, unit, description, alias, nullable=True)


def _bound(name: str) -> Column:
    column = SUBDIVIDED_BLOCKS.column(name)
    return dataclasses.replace(column, description=_BOUND[name], nullable=False)


CALIBRATED_BLOCKS = Layer(
    SUBDIVIDED_BLOCKS.name,
    GeometryType.POLYGON,
    (
        BLOCK_ID,
        SUBDIVIDED_BLOCKS.column("part"),
        TRUE_AREA,
        dataclasses.replace(
            SUBDIVIDED_BLOCKS.column("parcels"), description="Number of its observed parcels."
        ),
        _measured("area_mean_m2", "m²", "Mean area", "Mean area of its parcels."),
        _measured(
            "area_sd_m2",
            "m²",
            "Deviation of areas",
            "Standard deviation of the areas of its parcels.",
        ),
        _measured("width_mean_m", "m", "Mean width", "Mean width of its parcels."),
        _measured(
            "width_sd_m",
            "m",
            "Deviation of widths",
            "Standard deviation of the widths of its parcels.",
        ),
        *(_bound(name) for name in BOUNDS),
    ),
    SUBDIVIDED_BLOCKS.title,
    shown=True,
    open=True,
)
"""Blocks as `subdivide` takes them; the columns of the blocks given follow."""

OBSERVED_PARCELS = Layer(
    PARCELS.name,
    GeometryType.POLYGON,
    (
        dataclasses.replace(
            PARCELS.column("parcel_id"),
            description="Number of the parcel: its own, or that of its feature, counted from 1.",
        ),
        dataclasses.replace(
            BLOCK_ID, description="Number of the block; empty where it is left out.", nullable=True
        ),
        TRUE_AREA,
        dataclasses.replace(
            SUBDIVIDED_PARCELS.column("box_width_m"),
            description="Width: shorter side of the smallest rotated rectangle around it.",
        ),
        SUBDIVIDED_PARCELS.column("box_length_m"),
    ),
    "Observed parcels",
    shown=True,
    open=True,
)
"""Parcels as they were observed; their own columns follow."""

CALIBRATION: tuple[Layer, ...] = (CALIBRATED_BLOCKS, OBSERVED_PARCELS, ISSUES, PROVENANCE)
"""All layers of a calibration."""
