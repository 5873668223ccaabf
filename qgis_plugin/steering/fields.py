"""Columns of the layers that show a session."""

from __future__ import annotations

from qgis.core import QgsFields

from qgis_plugin import compat
from urban_processing.schema import PARCELS, STREETS, Column, ColumnType

PARCEL, STATE, LAND_USE, AREA = "parcel", "state", "land_use", "area_m2"
CLASS, WIDTH, FIXED = "class", "width_m", "fixed_id"

TO_CUT, DONE, LOCKED = "to cut", "done", "locked"
"""States of parcels: the next level may cut it, no level cuts it, it is kept as it is."""

_PARCEL = Column(
    PARCEL,
    ColumnType.INTEGER,
    "",
    "Number that the parcel keeps as long as it is neither cut nor merged.",
    "Parcel",
)
_STATE = Column(STATE, ColumnType.TEXT, "", "Whether the parcel is to be cut.", "State")


def parcel_columns() -> tuple[Column, ...]:
    """Columns of the layer of parcels."""
    return (_PARCEL, _STATE, *_of(PARCELS.columns, LAND_USE, AREA))


def street_columns() -> tuple[Column, ...]:
    """Columns of the layer of streets; the style of layout files reads them."""
    return _of(STREETS.columns, CLASS, WIDTH, FIXED)


def parcel_fields() -> QgsFields:
    """Fields of the layer of parcels."""
    return _fields(parcel_columns())


def street_fields() -> QgsFields:
    """Fields of the layer of streets."""
    return _fields(street_columns())


def _of(columns: tuple[Column, ...], *names: str) -> tuple[Column, ...]:
    known = {column.name: column for column in columns}
    return tuple(known[name] for name in names)


def _fields(columns: tuple[Column, ...]) -> QgsFields:
    fields = QgsFields()
    for column in columns:
        fields.append(compat.field(column))
    return fields
