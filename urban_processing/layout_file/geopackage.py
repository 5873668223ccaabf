"""GeoPackages of tables: the same tables give the same bytes."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

from urban_processing.layout_file.styles import layer_style
from urban_processing.schema import ColumnType, Layer
from urban_processing.tables import Table

VERSION = "1.3"
"""GeoPackage version: the newest that QGIS 3.22 reads."""

FIXED_DATE = "2000-01-01T00:00:00.000Z"
"""Date that files carry in place of the day they were written on."""

LAYOUT_STATE, LAYERS_STATE = "urn:urban-processing:layout", "urn:urban-processing:layers"
"""Standard of the metadata row that holds what the tables do not say, of a layout and of other
layers. Metadata under GDAL's own standard would make GDAL leave an .aux.xml file beside the
GeoPackage."""

GEOMETRY_COLUMN = "geom"
"""Name of the column of geometries."""

_STYLE_TABLE = """
CREATE TABLE "layer_styles" (
  "id" INTEGER PRIMARY KEY AUTOINCREMENT NOT NULL,
  "f_table_catalog" TEXT(256), "f_table_schema" TEXT(256), "f_table_name" TEXT(256),
  "f_geometry_column" TEXT(256), "styleName" TEXT(30), "styleQML" TEXT, "styleSLD" TEXT,
  "useAsDefault" BOOLEAN, "description" TEXT, "owner" TEXT(30), "ui" TEXT(30),
  "update_time" DATETIME)
"""

_EXTENSION_TABLE = """
CREATE TABLE IF NOT EXISTS gpkg_extensions (
  table_name TEXT, column_name TEXT, extension_name TEXT NOT NULL, definition TEXT NOT NULL,
  scope TEXT NOT NULL, CONSTRAINT ge_tce UNIQUE (table_name, column_name, extension_name))
"""

_METADATA_TABLES = """
CREATE TABLE gpkg_metadata (
  id INTEGER CONSTRAINT m_pk PRIMARY KEY ASC NOT NULL,
  md_scope TEXT NOT NULL DEFAULT 'dataset', md_standard_uri TEXT NOT NULL,
  mime_type TEXT NOT NULL DEFAULT 'text/xml', metadata TEXT NOT NULL DEFAULT '');
CREATE TABLE gpkg_metadata_reference (
  reference_scope TEXT NOT NULL, table_name TEXT, column_name TEXT, row_id_value INTEGER,
  timestamp DATETIME NOT NULL DEFAULT (strftime('%Y-%m-%dT%H:%M:%fZ','now')),
  md_file_id INTEGER NOT NULL, md_parent_id INTEGER,
  CONSTRAINT crmr_mfi_fk FOREIGN KEY (md_file_id) REFERENCES gpkg_metadata(id),
  CONSTRAINT crmr_mpi_fk FOREIGN KEY (md_parent_id) REFERENCES gpkg_metadata(id));
"""

_COLUMN_TABLES = """
CREATE TABLE gpkg_data_columns (
  table_name TEXT NOT NULL, column_name TEXT NOT NULL, name TEXT, title TEXT,
  description TEXT, mime_type TEXT, constraint_name TEXT,
  CONSTRAINT pk_gdc PRIMARY KEY (table_name, column_name),
  CONSTRAINT gdc_tn UNIQUE (table_name, name));
CREATE TABLE gpkg_data_column_constraints (
  constraint_name TEXT NOT NULL, constraint_type TEXT NOT NULL, value TEXT, min NUMERIC,
  min_is_inclusive BOOLEAN, max NUMERIC, max_is_inclusive BOOLEAN, description TEXT,
  CONSTRAINT gdcc_ntv UNIQUE (constraint_name, constraint_type, value));
"""


class LayerLibrary(Protocol):
    """A library that reads and writes the layers of a GeoPackage; its errors are OSErrors."""

    def write_layers(self, path: Path, tables: Mapping[Layer, Table], *, crs: str) -> None:
        """Write tables as layers of a new GeoPackage of `VERSION`, dated `FIXED_DATE`.

        Geometries stand in the column `GEOMETRY_COLUMN`; a layer's identifier is its title.
        """
        ...

    def read_layer(
        self, path: Path, layer: str, columns: Sequence[str]
    ) -> tuple[npt.NDArray[np.object_], dict[str, npt.NDArray[Any]]]:
        """Return geometries and columns of a layer in the order in which they were written.

        Missing numbers are NaN; a layer without geometry has no geometries.
        """
        ...

    def layer_names(self, path: Path) -> list[str]:
        """Return the names of a file's layers."""
        ...

    def column_names(self, path: Path, layer: str) -> list[str]:
        """Return the names of a layer's columns."""
        ...


def write_geopackage(
    path: Path,
    tables: Mapping[Layer, Table],
    *,
    crs: str,
    library: LayerLibrary,
    state: tuple[str, str],
) -> None:
    """Write tables as the layers of a new GeoPackage, with QGIS styles and column names.

    Parameters
    ----------
    path
        File to create.
    tables
        Rows of each layer, written in their order.
    crs
        CRS of the geometries as text, "" for none.
    library
        What writes the layers.
    state
        `LAYOUT_STATE` or `LAYERS_STATE`, and JSON kept in the file's metadata, for `read_state`.
    """
    layers = list(tables)
    library.write_layers(path, tables, crs=crs)
    with closing(sqlite3.connect(path)) as connection, connection:
        _write_state(connection, *state)
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
        if column.dtype is not ColumnType.TEXT and given.dtype.kind == "f":
            missing = np.isnan(given)
            if column.dtype is not ColumnType.REAL:
                given = np.where(missing, 0, given).astype(column.dtype.value)
            mask = missing if missing.any() else None
        names.append(column.name)
        values.append(given)
        masks.append(mask)
    return names, values, masks


def field_values(layer: Layer, table: Table) -> list[list[Any]]:
    """Return the columns of a table as lists of plain Python values, None where one is missing."""
    _, values, masks = field_arrays(layer, table)
    columns = [value.tolist() for value in values]
    for column, mask in zip(columns, masks, strict=True):
        for row in [] if mask is None else np.flatnonzero(mask).tolist():
            column[row] = None
    return columns


def read_state(path: Path, standard: str) -> str | None:
    """Return the state of a file that `write_geopackage` wrote, None for any other file.

    `standard` is `LAYOUT_STATE` or `LAYERS_STATE`.
    """
    try:
        with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
            row = connection.execute(
                "SELECT metadata FROM gpkg_metadata WHERE md_standard_uri = ?", (standard,)
            ).fetchone()
    except sqlite3.DatabaseError:
        return None  # no database, or one without metadata
    return None if row is None else str(row[0])


def _write_state(connection: sqlite3.Connection, standard: str, state: str) -> None:
    connection.executescript(_METADATA_TABLES)
    connection.execute(
        "INSERT INTO gpkg_metadata VALUES (1, 'dataset', ?, 'application/json', ?)",
        (standard, state),
    )
    connection.execute(
        "INSERT INTO gpkg_metadata_reference VALUES ('geopackage', NULL, NULL, NULL, ?, 1, NULL)",
        (FIXED_DATE,),
    )
    _register(
        connection,
        "gpkg_metadata",
        "http://www.geopackage.org/spec120/#extension_metadata",
        tables=("gpkg_metadata", "gpkg_metadata_reference"),
    )


def _register(
    connection: sqlite3.Connection, extension: str, definition: str, *, tables: tuple[str, ...]
) -> None:
    # GDAL makes it together with a spatial index, so not where no layer has geometries
    connection.execute(_EXTENSION_TABLE)
    connection.executemany(
        "INSERT INTO gpkg_extensions VALUES (?, NULL, ?, ?, 'read-write')",
        [(table, extension, definition) for table in tables],
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
        qml = layer_style(layer)
        if qml is not None:
            connection.execute(
                "INSERT INTO layer_styles (f_table_catalog, f_table_schema, f_table_name,"
                " f_geometry_column, styleName, styleQML, styleSLD, useAsDefault, description,"
                " owner, ui, update_time) VALUES ('', '', ?, ?, ?, ?, '', 1, ?, '', NULL, ?)",
                (layer.name, GEOMETRY_COLUMN, layer.name, qml, layer.title, FIXED_DATE),
            )


def _write_column_names(connection: sqlite3.Connection, layers: list[Layer]) -> None:
    """Readable names and descriptions of columns, by the GeoPackage schema extension."""
    connection.executescript(_COLUMN_TABLES)
    _register(
        connection,
        "gpkg_schema",
        "http://www.geopackage.org/spec121/#extension_schema",
        tables=("gpkg_data_columns", "gpkg_data_column_constraints"),
    )
    connection.executemany(
        "INSERT INTO gpkg_data_columns (table_name, column_name, name, title, description)"
        " VALUES (?, ?, ?, ?, ?)",
        [
            (layer.name, c.name, c.label, c.label, c.description)
            for layer in layers
            for c in layer.columns
        ],
    )
