"""Plain exports of a layout: one file for each layer, for programs that want no GeoPackage."""

from __future__ import annotations

import enum
import tempfile
from collections.abc import Iterable, Mapping
from os import PathLike
from pathlib import Path

import pyogrio
import shapely
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError

from urban_processing.errors import DependencyError, OutputError, ParameterError
from urban_processing.io.frames import table_frame
from urban_processing.layout import Layout
from urban_processing.layout_file.files import as_written
from urban_processing.layout_file.geopackage import field_arrays
from urban_processing.metrics.tables import layout_tables
from urban_processing.paths import folder_problems
from urban_processing.schema import LAYERS, GeometryType, Layer, layer
from urban_processing.tables import Table

COORDINATE_DIGITS = "9"
"""Digits after the point of degrees: 0.1 mm, so that neighbours still fit together."""


class ExportKind(enum.StrEnum):
    """Format of an export: GeoJSON in WGS 84 (RFC 7946), or GeoParquet in the layout's CRS."""

    GEOJSON = "geojson"
    PARQUET = "parquet"


def export_layout(
    layout: Layout,
    folder: str | PathLike[str],
    *,
    kind: str = ExportKind.GEOJSON,
    overwrite: bool = False,
) -> Path:
    """Write every layer of a layout as a file of its own; see `export_layers`."""
    tables = layout_tables(as_written(layout))
    layers = {layer(name): table for name, table in tables.items()}
    return export_layers(layers, folder, crs=layout.frame.crs, kind=kind, overwrite=overwrite)


def export_layers(
    layers: Mapping[Layer, Table],
    folder: str | PathLike[str],
    *,
    crs: str,
    kind: str = ExportKind.GEOJSON,
    overwrite: bool = False,
) -> Path:
    """Write every layer as a file of its own.

    Layers without geometry become CSV beside GeoJSON, and Parquet beside GeoParquet.

    Parameters
    ----------
    layers
        Rows of each layer.
    folder
        Folder for the files; made if its parent exists.
    crs
        CRS of the geometries as text, "" for none.
    kind
        An `ExportKind`.
    overwrite
        Whether existing files may be replaced.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OutputError
        If files cannot be written there, or GeoJSON is asked for and there is no CRS.
    """
    target = Path(folder)
    problems = check_export(target, kind=kind, overwrite=overwrite, layers=layers)
    chosen = ExportKind(kind)
    if chosen is ExportKind.GEOJSON and not crs:
        problems.append("GeoJSON is in WGS 84, but the layout has no CRS: give its boundary one.")
    if problems:
        raise OutputError(problems)
    write = _write_geojson if chosen is ExportKind.GEOJSON else _write_parquet
    try:
        target.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target, prefix=".export-") as temporary:
            made = [write(Path(temporary), each, table, crs) for each, table in layers.items()]
            for file in made:
                file.replace(target / file.name)
    except (DataSourceError, DataLayerError, FeatureError, OSError) as error:
        raise OutputError(f"The export to {target} cannot be written: {error}") from error
    return target


def check_export(
    folder: str | PathLike[str],
    *,
    kind: str = ExportKind.GEOJSON,
    overwrite: bool = False,
    layers: Iterable[Layer] = LAYERS,
) -> list[str]:
    """Return why layers cannot be exported to a folder; nothing where they can.

    Raises
    ------
    ParameterError
        If `kind` is no `ExportKind`.
    """
    if kind not in list(ExportKind):
        raise ParameterError(f"kind must be one of {', '.join(ExportKind)}; got {kind!r}.")
    target = Path(folder)
    if not target.exists():
        return folder_problems(target.parent)
    problems = folder_problems(target)
    if problems or overwrite:
        return problems
    names = (each.name + _suffix(each, ExportKind(kind)) for each in layers)
    existing = [name for name in names if (target / name).exists()]
    if existing:
        problems.append(
            f"The folder {target} already holds {', '.join(existing)}: choose another, or allow "
            "overwriting (--overwrite)."
        )
    return problems


def _suffix(layer: Layer, kind: ExportKind) -> str:
    if kind is ExportKind.PARQUET:
        return ".parquet"
    return ".csv" if layer.geometry is GeometryType.NONE else ".geojson"


def _write_geojson(folder: Path, layer: Layer, table: Table, crs: str) -> Path:
    path = folder / (layer.name + _suffix(layer, ExportKind.GEOJSON))
    names, values, masks = field_arrays(layer, table)
    spatial = layer.geometry is not GeometryType.NONE
    pyogrio.raw.write(
        path,
        geometry=shapely.to_wkb(table.geometry) if spatial else None,
        field_data=values,
        fields=names,
        field_mask=masks,
        driver="GeoJSON" if spatial else "CSV",
        geometry_type="Unknown" if spatial else None,
        crs=crs if spatial else None,
        encoding="UTF-8",
        layer_options=(
            {"RFC7946": "YES", "COORDINATE_PRECISION": COORDINATE_DIGITS} if spatial else None
        ),
    )
    return path


def _write_parquet(folder: Path, layer: Layer, table: Table, crs: str) -> Path:
    path = folder / (layer.name + _suffix(layer, ExportKind.PARQUET))
    try:
        table_frame(layer, table, crs=crs).to_parquet(path)
    except ImportError as error:
        raise DependencyError("GeoParquet needs the package pyarrow: install it.") from error
    return path
