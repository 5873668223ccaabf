"""The layers of a fabric that was measured."""

from __future__ import annotations

import dataclasses

from urban_processing.schema import (
    BLOCK_ID,
    BOUNDARY,
    ISSUES,
    JUNCTIONS,
    METRICS,
    PARCELS,
    PART,
    PROVENANCE,
    RIGHT_OF_WAY,
    STEERING_COLUMNS,
    STREETS,
    TRUE_AREA,
    Column,
    ColumnType,
    GeometryType,
    Layer,
)

_LAYOUTS_ALONE = ("level", "locked", "lineage", "fixed_id", *STEERING_COLUMNS)
"""Columns of a layout that say how it was made."""


def _kept(layer: Layer) -> tuple[Column, ...]:
    return tuple(column for column in layer.columns if column.name not in _LAYOUTS_ALONE)


def _missing(column: Column) -> Column:
    return dataclasses.replace(column, nullable=True)


MEASURED_PARCELS = Layer(
    PARCELS.name,
    GeometryType.POLYGON,
    (
        *_kept(PARCELS),
        dataclasses.replace(BLOCK_ID, description="Block it lies in.", nullable=True),
        _missing(PARCELS.column("level")),
        Column(
            "undesirable",
            ColumnType.BOOLEAN,
            "",
            "Whether its angle deviation is above 15° or its rectangle ratio above 1.2 (Yang "
            "2013).",
            "Undesirable",
        ),
        Column(
            "neighbours",
            ColumnType.INTEGER,
            "",
            "Number of parcels that it shares a line of its boundary with.",
            "Neighbours",
        ),
    ),
    PARCELS.title,
    shown=True,
)
"""Parcels, with the columns that those of a layout have, and whatever the metrics ask besides."""

MEASURED_STREETS = Layer(STREETS.name, GeometryType.LINE, _kept(STREETS), STREETS.title, shown=True)

MEASURED_BLOCKS = Layer(
    "blocks",
    GeometryType.POLYGON,
    (
        BLOCK_ID,
        PART,
        dataclasses.replace(TRUE_AREA, description="Area, to the centreline of streets."),
        Column("perimeter_m", ColumnType.REAL, "m", "Length of its outline.", "Perimeter"),
        Column("length_m", ColumnType.REAL, "m", "Length of its longest side.", "Length"),
        Column("parcels", ColumnType.INTEGER, "", "Number of parcels in it.", "Parcels"),
    ),
    "Blocks",
    shown=True,
)

STREET_LAND = Layer(RIGHT_OF_WAY.name, GeometryType.POLYGON, (PART, TRUE_AREA), RIGHT_OF_WAY.title)

MEASURED: tuple[Layer, ...] = (
    MEASURED_PARCELS,
    MEASURED_STREETS,
    JUNCTIONS,
    MEASURED_BLOCKS,
    BOUNDARY,
    STREET_LAND,
    ISSUES,
    METRICS,
    PROVENANCE,
)
"""Layers that a measured fabric can have."""

MEASURED_KIND = "measured fabric"
