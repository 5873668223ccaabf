"""The layers of a subdivision: parcels, and the blocks with what held for each of them."""

from __future__ import annotations

import enum

from urban_processing.params.base import ParamField
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.schema import (
    BLOCK_ID,
    ISSUES,
    PARCELS,
    PART,
    PROVENANCE,
    TRUE_AREA,
    Column,
    ColumnType,
    GeometryType,
    Layer,
)

SUBDIVIDED_PARCELS = Layer(
    PARCELS.name,
    GeometryType.POLYGON,
    (
        *PARCELS.columns,
        BLOCK_ID,
        Column("strategy", ColumnType.TEXT, "", "Strategy that made the parcel.", "Strategy"),
    ),
    PARCELS.title,
    shown=True,
)
"""Parcels in blocks that are net of rights-of-way: gross and net area are the same, the rim of
the land is that of the blocks, and `part` is the place of the block in the layer of blocks."""


def _parameter_column(field: ParamField) -> Column:
    kind = ColumnType.TEXT if issubclass(field.kind, enum.Enum) else ColumnType.REAL
    param = field.param
    return Column(field.name, kind, param.unit, param.help, param.label, field.optional)


SUBDIVIDED_BLOCKS = Layer(
    "blocks",
    GeometryType.POLYGON,
    (
        BLOCK_ID,
        PART,
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
