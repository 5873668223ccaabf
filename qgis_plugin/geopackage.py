"""Layers of GeoPackages by the GDAL of QGIS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from osgeo import gdal, ogr, osr

from urban_processing.layout_file.geopackage import (
    FIXED_DATE,
    GEOMETRY_COLUMN,
    VERSION,
    field_values,
)
from urban_processing.schema import ColumnType, GeometryType, Layer
from urban_processing.tables import Table

_FIELDS = {
    ColumnType.INTEGER: ogr.OFTInteger64,
    ColumnType.REAL: ogr.OFTReal,
    ColumnType.TEXT: ogr.OFTString,
    ColumnType.BOOLEAN: ogr.OFTInteger,
}
_GEOMETRIES = {
    GeometryType.NONE: ogr.wkbNone,
    GeometryType.POINT: ogr.wkbPoint,
    GeometryType.LINE: ogr.wkbLineString,
    GeometryType.POLYGON: ogr.wkbPolygon,
    GeometryType.ANY: ogr.wkbUnknown,
}
_WHOLE = (ogr.OFTInteger, ogr.OFTInteger64)


class Ogr:
    """Reads and writes layers with osgeo, which every QGIS has; a `LayerLibrary`."""

    def write_layers(self, path: Path, tables: Mapping[Layer, Table], *, crs: str) -> None:
        """Write tables as layers of a new GeoPackage."""
        with _os_errors(), _config_option("OGR_CURRENT_DATE", FIXED_DATE):
            file = _required(
                ogr.GetDriverByName("GPKG").CreateDataSource(str(path), [f"VERSION={VERSION}"])
            )
            system = _spatial_reference(crs)
            for layer, table in tables.items():
                _write_layer(file, layer, table, system)
            _succeeded(file.FlushCache() or ogr.OGRERR_NONE)

    def read_layer(
        self, path: Path, layer: str, columns: Sequence[str]
    ) -> tuple[npt.NDArray[np.object_], dict[str, npt.NDArray[Any]]]:
        """Return geometries and columns of a layer in the order in which they were written."""
        with _os_errors():
            file = _required(gdal.OpenEx(str(path), gdal.OF_VECTOR | gdal.OF_READONLY))
            found = _required(file.GetLayerByName(layer))
            definition = found.GetLayerDefn()
            index = [definition.GetFieldIndex(name) for name in columns]
            if -1 in index:
                raise KeyError(columns[index.index(-1)])
            rows = list(found)
            wkb = [_wkb(row.GetGeometryRef()) for row in rows]
            values = [[row.GetField(i) for row in rows] for i in index]
            kinds = [definition.GetFieldDefn(i).GetType() for i in index]
        geometry = np.empty(len(wkb) if definition.GetGeomType() != ogr.wkbNone else 0, object)
        geometry[:] = shapely.from_wkb(wkb[: len(geometry)])
        return geometry, {
            name: _array(column, kind)
            for name, column, kind in zip(columns, values, kinds, strict=True)
        }

    def layer_names(self, path: Path) -> list[str]:
        """Return the names of a file's layers."""
        with _os_errors():
            file = _required(gdal.OpenEx(str(path), gdal.OF_VECTOR | gdal.OF_READONLY))
            return [file.GetLayer(i).GetName() for i in range(file.GetLayerCount())]

    def column_names(self, path: Path, layer: str) -> list[str]:
        """Return the names of a layer's columns."""
        with _os_errors():
            file = _required(gdal.OpenEx(str(path), gdal.OF_VECTOR | gdal.OF_READONLY))
            definition = _required(file.GetLayerByName(layer)).GetLayerDefn()
            return [definition.GetFieldDefn(i).GetName() for i in range(definition.GetFieldCount())]


OGR = Ogr()


def _write_layer(file: Any, layer: Layer, table: Table, system: Any) -> None:
    options = [f"IDENTIFIER={layer.title}"]
    kind = _GEOMETRIES[layer.geometry]
    several = kind == ogr.wkbPolygon and table.in_pieces
    if several:
        kind = ogr.wkbMultiPolygon
    if kind != ogr.wkbNone:
        options += [f"GEOMETRY_NAME={GEOMETRY_COLUMN}", "SPATIAL_INDEX=YES"]
    made = _required(
        file.CreateLayer(layer.name, None if kind == ogr.wkbNone else system, kind, options)
    )
    for column in layer.columns:
        definition = ogr.FieldDefn(column.name, _FIELDS[column.dtype])
        if column.dtype is ColumnType.BOOLEAN:
            definition.SetSubType(ogr.OFSTBoolean)
        _succeeded(made.CreateField(definition))
    columns = field_values(layer, table)
    geometries: list[bytes | None] = [None] * len(table)
    if kind != ogr.wkbNone and table.geometry is not None:
        geometries = shapely.to_wkb(table.geometry).tolist()
    file.StartTransaction()
    for row, wkb in enumerate(geometries):
        feature = ogr.Feature(made.GetLayerDefn())
        for i, values in enumerate(columns):
            if values[row] is not None:
                feature.SetField(i, values[row])
        if wkb is not None:
            made_of = ogr.CreateGeometryFromWkb(wkb)
            feature.SetGeometry(ogr.ForceToMultiPolygon(made_of) if several else made_of)
        _succeeded(made.CreateFeature(feature))
    _succeeded(file.CommitTransaction())


def _spatial_reference(crs: str) -> Any:
    if not crs:
        return None
    system = osr.SpatialReference()
    _succeeded(system.SetFromUserInput(crs))
    system.SetAxisMappingStrategy(osr.OAMS_TRADITIONAL_GIS_ORDER)
    return system


def _wkb(geometry: Any) -> bytes | None:
    return None if geometry is None else bytes(geometry.ExportToWkb())


def _array(values: list[Any], kind: int) -> npt.NDArray[Any]:
    """Return a column as an array: numbers with gaps as floats, the gaps NaN."""
    if kind == ogr.OFTReal or (kind in _WHOLE and None in values):
        return np.array([np.nan if v is None else v for v in values], dtype=np.float64)
    if kind in _WHOLE:
        return np.array(values, dtype=np.int64)
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out


def _required(made: Any) -> Any:
    """Return what GDAL made; its message as an error where it made nothing."""
    if made is None:
        raise OSError(gdal.GetLastErrorMsg() or "GDAL gives no reason")
    return made


def _succeeded(code: int) -> None:
    if code not in (None, ogr.OGRERR_NONE):
        raise OSError(gdal.GetLastErrorMsg() or f"GDAL gives no reason (error {code})")


@contextmanager
def _os_errors() -> Iterator[None]:
    """Turn GDAL's exceptions, which some other plugin may have switched on, into OSErrors."""
    try:
        yield
    except RuntimeError as error:
        raise OSError(str(error)) from error


@contextmanager
def _config_option(name: str, value: str) -> Iterator[None]:
    """Set an option of GDAL for a moment, for this thread alone where GDAL can."""
    set_option = getattr(gdal, "SetThreadLocalConfigOption", gdal.SetConfigOption)
    before = getattr(gdal, "GetThreadLocalConfigOption", gdal.GetConfigOption)(name)
    set_option(name, value)
    try:
        yield
    finally:
        set_option(name, before)
