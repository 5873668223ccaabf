"""The layers of a subdivision: parcels, and the blocks with what held for each of them."""

from __future__ import annotations

import dataclasses
import enum

from urban_processing.params.base import ParamField
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.schema import (
    BLOCK_ID,
    ISSUES,
    PARCELS,
    PART,
    PROVENANCE,
    STEERING_COLUMNS,
    TRUE_AREA,
    Column,
    ColumnType,
    GeometryType,
    Layer,
)

_MEANINGS = {
    "part": "Place of the block in the layer of blocks, counted from 0.",
    "level": "Number of cuts that made the parcel out of its block.",
    "area_m2": "Area.",
    "net_area_m2": "The same, as blocks are net of rights-of-way.",
    "frontage_m": "Length of the boundary on street sides of the block.",
    "rim": "Whether an edge lies on the contour of the block.",
    "land_use": "Use of the parcel: parcel, or patio for the open inside of a block.",
    "locked": "Whether the parcel is not to be cut; never.",
}
"""What columns of parcels mean where these lie in blocks that are net of rights-of-way."""


def _of_blocks(column: Column) -> Column:
    meaning = _MEANINGS.get(column.name, column.description)
    return dataclasses.replace(column, description=meaning)


SUBDIVIDED_PARCELS = Layer(
    PARCELS.name,
    GeometryType.POLYGON,
    (
        *(_of_blocks(c) for c in PARCELS.columns if c.name not in STEERING_COLUMNS),
        BLOCK_ID,
        Column("strategy", ColumnType.TEXT, "", "Strategy that made the parcel.", "Strategy"),
        Column(
            "box_width_m",
            ColumnType.REAL,
            "m",
            "Shorter side of the smallest rotated rectangle around it: the width that bounds hold "
            "for, at street corners too.",
            "Width of its box",
        ),
        Column(
            "box_length_m",
            ColumnType.REAL,
            "m",
            "Longer side of that rectangle.",
            "Length of its box",
        ),
    ),
    PARCELS.title,
    shown=True,
)
"""Parcels, with the columns that those of a layout have."""


def _parameter_column(field: ParamField) -> Column:
    kind = ColumnType.TEXT if issubclass(field.kind, enum.Enum) else ColumnType.REAL
    param = field.param
    return Column(field.name, kind, param.unit, param.help, param.label, field.optional)


SUBDIVIDED_BLOCKS = Layer(
    "blocks",
    GeometryType.POLYGON,
    (
        BLOCK_ID,
        _of_blocks(PART),
        TRUE_AREA,
        Column("parcels", ColumnType.INTEGER, "", "Number of its parcels.", "Parcels"),
        Column(
            "block_key",
            ColumnType.TEXT,
            "",
            "Hash of contour, streets and parameters: the same where nothing changed.",
            "Key",
        ),
        *(_parameter_column(f) for f in SubdivideParams.fields() if f.param.per_feature),
    ),
    "Blocks",
    shown=True,
)
"""Blocks with the parameters that held for each; a layer like this may be given again."""

SUBDIVISION: tuple[Layer, ...] = (SUBDIVIDED_PARCELS, SUBDIVIDED_BLOCKS, ISSUES, PROVENANCE)
"""All layers of a subdivision; one that goes on from another has `CHANGES` besides."""
