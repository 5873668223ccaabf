"""What differs between versions of QGIS and Qt; nothing else asks for a version."""

from __future__ import annotations

from typing import Any

from qgis.core import Qgis, QgsCoordinateReferenceSystem, QgsField

from urban_processing.schema import Column, ColumnType

if Qgis.QGIS_VERSION_INT >= 33800:
    from qgis.PyQt.QtCore import QMetaType as FieldTypes

    _TEXT = "QString"
else:
    from qgis.PyQt.QtCore import QVariant as FieldTypes

    _TEXT = "String"

_TYPES = {
    ColumnType.INTEGER: FieldTypes.Type.LongLong,
    ColumnType.REAL: FieldTypes.Type.Double,
    ColumnType.TEXT: getattr(FieldTypes.Type, _TEXT),
    ColumnType.BOOLEAN: FieldTypes.Type.Bool,
}


def field(column: Column) -> QgsField:
    """Return the field of a column.

    Its readable name is given to the loaded layer: most formats keep none, and QGIS from 3.40 on
    warns of each.
    """
    return QgsField(column.name, _TYPES[column.dtype])


def geographic_base(crs: QgsCoordinateReferenceSystem) -> Any:
    """Return the geographic CRS of a CRS's datum, WGS 84 where QGIS cannot tell."""
    if hasattr(crs, "toGeographicCrs"):  # from 3.24 on
        base = crs.toGeographicCrs()
        if base.isValid():
            return base
    return QgsCoordinateReferenceSystem("EPSG:4326")
