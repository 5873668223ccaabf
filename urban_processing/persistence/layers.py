"""The layers that a transfer makes."""

from __future__ import annotations

import enum

from urban_processing.schema import (
    ISSUES,
    PARCELS,
    PROVENANCE,
    TRUE_AREA,
    Column,
    ColumnType,
    GeometryType,
    Layer,
)


class Change(enum.StrEnum):
    """What became of a parcel."""

    KEPT = "kept"
    """Its number goes on; shape and place are the same."""
    MOVED = "moved"
    """Its number goes on; shape or place are others."""
    SPLIT = "split"
    """A new parcel, more than half of which was one old parcel."""
    MERGED = "merged"
    """An old parcel whose number ends, more than half of which is in one new parcel."""
    GONE = "gone"
    """Any other old parcel whose number ends."""
    NEW = "new"
    """Any other new parcel."""


_KINDS = ", ".join(Change)

_CHANGE = Column("change", ColumnType.TEXT, "", f"What became of the parcel: {_KINDS}.", "Change")

TRANSFERRED_PARCELS = Layer(
    PARCELS.name,
    GeometryType.POLYGON,
    (
        PARCELS.column("parcel_id"),
        TRUE_AREA,
        _CHANGE,
        Column(
            "old_id",
            ColumnType.INTEGER,
            "",
            "Number of the parcel before that it is, or was a part of.",
            "Parcel before",
            nullable=True,
        ),
    ),
    PARCELS.title,
    shown=True,
    open=True,
)
"""Parcels after an edit; columns carried over and own columns follow."""

CHANGES = Layer(
    "changes",
    GeometryType.POLYGON,
    (
        _CHANGE,
        Column("old_id", ColumnType.INTEGER, "", "Number before.", "Number before", nullable=True),
        Column("new_id", ColumnType.INTEGER, "", "Number after.", "Number after", nullable=True),
        Column(
            "overlap_old",
            ColumnType.REAL,
            "",
            "Area in common as a share of the parcel before, moved along with its block.",
            "Share of the parcel before",
            nullable=True,
        ),
        Column(
            "overlap_new",
            ColumnType.REAL,
            "",
            "Area in common as a share of the parcel after.",
            "Share of the parcel after",
            nullable=True,
        ),
        Column(
            "distance",
            ColumnType.REAL,
            "",
            "Distance d of the relative positions of both in their blocks (Vanegas 2012, section "
            "5.2); empty where they were not compared.",
            "Distance",
            nullable=True,
        ),
    ),
    "Changes of parcels",
    shown=True,
)
"""One row for each parcel after, drawn as it is, and one for each number that ended, drawn as it
was."""

TRANSFER: tuple[Layer, ...] = (TRANSFERRED_PARCELS, CHANGES, ISSUES, PROVENANCE)
"""All layers of a transfer."""

OWN = (frozenset(PARCELS.column_names) | {"strategy", "box_width_m", "box_length_m"}) - {
    "parcel_id"
}
"""Columns of parcels that say what a parcel is in its layout: they are not carried over."""
