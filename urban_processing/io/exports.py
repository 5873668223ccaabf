"""Plain exports of a layout: one file for each layer, for programs that want no GeoPackage."""

from __future__ import annotations

import enum
import tempfile
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
from urban_processing.metrics.tables import Table, layout_tables
from urban_processing.paths import folder_problems
from urban_processing.schema import LAYERS, GeometryType, Layer

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
    """Write every layer of a layout as a file of its own.

    Layers without geometry become CSV beside GeoJSON, and Parquet beside GeoParquet.

    Parameters
    ----------
    layout
        The layout.
    folder
        Folder for the files; made if its parent exists.
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
        If files cannot be written there, or GeoJSON is asked for and the layout has no CRS.
    """
    target = Path(folder)
    problems = check_export(target, kind=kind, overwrite=overwrite)
    chosen = ExportKind(kind)
    if chosen is ExportKind.GEOJSON and not layout.frame.crs:
        problems.append("GeoJSON is in WGS 84, but the layout has no CRS: give its boundary one.")
    if problems:
        raise OutputError(problems)
    tables = layout_tables(as_written(layout))
    layers = [layer for layer in LAYERS if layer.name in tables]
    write = _write_geojson if chosen is ExportKind.GEOJSON else _write_parquet
    try:
        target.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target, prefix=".export-") as temporary:
            made = [
                write(Path(temporary), layer, tables[layer.name], layout.frame.crs)
                for layer in layers
            ]
            for file in made:
                file.replace(target / file.name)
    except (DataSourceError, DataLayerError, FeatureError, OSError) as error:
        raise OutputError(f"The export to {target} cannot be written: {error}") from error
    return target


def check_export(
    folder: str | PathLike[str], *, kind: str = ExportKind.GEOJSON, overwrite: bool = False
) -> list[str]:
    """Return why a layout cannot be exported to a folder; nothing where it can.

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
    names = (layer.name + _suffix(layer, ExportKind(kind)) for layer in LAYERS)
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
        table_frame(layer.name, table, crs=crs).to_parquet(path)
    except ImportError as error:
        raise DependencyError("GeoParquet needs the package pyarrow: install it.") from error
    return path
