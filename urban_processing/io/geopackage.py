"""GeoPackages of tables: the same tables give the same bytes."""

from __future__ import annotations

import sqlite3
import warnings
from collections.abc import Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pyogrio
import shapely

from urban_processing.io.styles import layer_style
from urban_processing.metrics.tables import Table
from urban_processing.schema import LAYERS, ColumnType, GeometryType, Layer

VERSION = "1.3"
"""GeoPackage version: the newest that QGIS 3.22 reads."""

FIXED_DATE = "2000-01-01T00:00:00.000Z"
"""Date that files carry in place of the day they were written on."""

METADATA_KEY = "urban_processing_layout"
"""Item of the file's metadata that holds what the tables do not."""

_GEOMETRY_COLUMN = "geom"

_STYLE_TABLE = """
CREATE TABLE "layer_styles" (
  "id" INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  "f_table_catalog" TEXT(256), "f_table_schema" TEXT(256), "f_table_name" TEXT(256),
  "f_geometry_column" TEXT(256), "styleName" TEXT(30), "styleQML" TEXT, "styleSLD" TEXT,
  "useAsDefault" BOOLEAN, "description" TEXT, "owner" TEXT(30), "ui" TEXT(30),
  "update_time" DATETIME)
"""

_COLUMN_TABLES = """
CREATE TABLE IF NOT EXISTS gpkg_data_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, name TEXT, title TEXT,
  description TEXT, mime_type TEXT, constraint_name TEXT,
  CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
  CONSTRAINT gdc_tn UNIQUE (table_name, name));
CREATE TABLE IF NOT EXISTS gpkg_data_column_constraints (
  constraint_name TEXT NOT NULL, constraint_type TEXT NOT NULL, value TEXT, min NUMERIC,
  min_is_inclusive BOOLEAN, max NUMERIC, max_is_inclusive BOOLEAN, description TEXT,
  CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value));
"""


def write_geopackage(
    path: Path, tables: Mapping[str, Table], *, crs: str, metadata: str = ""
) -> None:
    """Write tables as the layers of a new GeoPackage, with QGIS styles and column names.

    Parameters
    ----------
    path
        File to create.
    tables
        Tables by name of the layer, of layers in the schema; written in its order.
    crs
        CRS of the geometries as text, "" for none.
    metadata
        Text kept under `METADATA_KEY`.
    """
    layers = [layer for layer in LAYERS if layer.name in tables]
    with _gdal_options(OGR_CURRENT_DATE=FIXED_DATE):
        for number, layer in enumerate(layers):
            _write_layer(
                path,
                layer,
                tables[layer.name],
                crs=crs,
                dataset_metadata={METADATA_KEY: metadata} if metadata and not number else None,
            )
    with closing(sqlite3.connect(path)) as connection, connection:
        _write_styles(connection, layers)
        _write_column_names(connection, layers)


def field_arrays(
    layer: Layer, table: Table
) -> tuple[list[str], list[npt.NDArray[Any]], list[npt.NDArray[np.bool_] | None]]:
    """Return names, values and masks of missing values of the columns of a table."""
    names, values, masks = [], [], []
    for column in layer.columns:
        given = table.columns[column.name]
        mask = None
        if column.dtype in (ColumnType.INTEGER, ColumnType.REAL) and given.dtype.kind == "f":
            missing = np.isnan(given)
            if column.dtype is ColumnType.INTEGER:
                given = np.where(missing, 0, given).astype(np.int64)
            mask = missing if missing.any() else None
        names.append(column.name)
        values.append(given)
        masks.append(mask)
    return names, values, masks


def _write_layer(
    path: Path,
    layer: Layer,
    table: Table,
    *,
    crs: str,
    dataset_metadata: Mapping[str, str] | None,
) -> None:
    names, values, masks = field_arrays(layer, table)
    spatial = layer.geometry is not GeometryType.NONE and table.geometry is not None
    options: dict[str, Any] = {"layer_options": {"IDENTIFIER": layer.title}}
    if spatial:
        kind = "Unknown" if layer.geometry is GeometryType.ANY else layer.geometry.value
        options |= {"geometry_type": kind, "crs": crs or None, "promote_to_multi": False}
        options["layer_options"] |= {
            "GEOMETRY_NAME": _GEOMETRY_COLUMN,
            "SPATIAL_INDEX": "YES",
        }
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="'crs' was not provided")
        pyogrio.raw.write(
            path,
            geometry=shapely.to_wkb(table.geometry) if spatial else None,
            field_data=values,
            fields=names,
            field_mask=masks,
            layer=layer.name,
            driver="GPKG",
            encoding="UTF-8",
            dataset_options={"VERSION": VERSION},
            dataset_metadata=dataset_metadata,
            **options,
        )


def _write_styles(connection: sqlite3.Connection, layers: list[Layer]) -> None:
    """Add the table that QGIS looks for when it opens a layer."""
    connection.execute(_STYLE_TABLE)
    connection.execute(
        "INSERT INTO gpkg_contents (table_name, data_type, identifier, description, last_change)"
        " VALUES ('layer_styles', 'attributes', 'layer_styles', '', ?)",
        (FIXED_DATE,),
    )
    for layer in layers:
        qml = layer_style(layer.name, aliases={c.name: _alias(c.alias, c.unit) for c in layer.columns})
        if qml is not None:
            connection.execute(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name,"
                " f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description,"
                " owner, ui, update_time) VALUES ('', '', ?, ?, ?, ?, '', 1, ?, '', NULL, ?)",
                (layer.name, _GEOMETRY_COLUMN, layer.name, qml, layer.title, FIXED_DATE),
            )


def _write_column_names(connection: sqlite3.Connection, layers: list[Layer]) -> None:
    """Readable names and descriptions of columns, by the GeoPackage schema extension."""
    connection.executescript(_COLUMN_TABLES)
    connection.executemany(
        "INSERT INTO gpkg_extensions VALUES (?, NULL, 'gpkg_schema',"
        " 'http://www.geopackage.org/spec121/#extension_schema', 'read-write')",
        [("gpkg_data_columns",), ("gpkg_data_column_constraints",)],
    )
    connection.executemany(
        "INSERT INTO gpkg_data_columns (table_name, column_name, name, title, description)"
        " VALUES (?, ?, ?, ?, ?)",
        [
            (layer.name, c.name, _alias(c.alias, c.unit), _alias(c.alias, c.unit), c.description)
            for layer in layers
            for c in layer.columns
        ],
    )


def _alias(alias: str, unit: str) -> str:
    return f"{alias} [{unit}]" if unit else alias


@contextmanager
def _gdal_options(**options: str) -> Iterator[None]:
    """Set options of GDAL for a moment."""
    before = {name: pyogrio.get_gdal_config_option(name) for name in options}
    pyogrio.set_gdal_config_options(options)
    try:
        yield
    finally:
        pyogrio.set_gdal_config_options(before)
