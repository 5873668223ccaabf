"""Plain exports, for programs that want no GeoPackage: files of each layer, or networks."""

from __future__ import annotations

import tempfile
from collections.abc import Callable, Iterable, Mapping
from os import PathLike
from pathlib import Path

import pyogrio
import shapely
from pyogrio.errors import DataLayerError, DataSourceError, FeatureError

from urban_processing.errors import DependencyError, OutputError, ParameterError
from urban_processing.io.frames import table_frame
from urban_processing.io.networks import OSM_FILES, SUMO_FILES, write_osm, write_sumo
from urban_processing.layout import Layout
from urban_processing.layout_file.files import as_written
from urban_processing.layout_file.geopackage import field_arrays
from urban_processing.metrics.tables import layout_tables
from urban_processing.params.export import ExportKind
from urban_processing.paths import folder_problems
from urban_processing.schema import LAYERS, STREETS, GeometryType, Layer, layer
from urban_processing.site import DEGREE_DIGITS
from urban_processing.tables import Table

_IN_WGS84 = {ExportKind.GEOJSON: "GeoJSON", ExportKind.OSM: "OpenStreetMap"}
"""Formats that have no other CRS, and what to call them."""

_NETWORKS = {ExportKind.OSM: (write_osm, OSM_FILES), ExportKind.SUMO: (write_sumo, SUMO_FILES)}
"""What writes the formats of networks, and the files that it makes."""


def export_layout(
    layout: Layout,
    folder: str | PathLike[str],
    *,
    kind: str = ExportKind.GEOJSON,
    overwrite: bool = False,
) -> Path:
    """Write a layout as plain files: its layers, or its network of streets.

    Parameters
    ----------
    layout
        The layout.
    folder
        Folder for the files; made if its parent exists.
    kind
        An `ExportKind`. OpenStreetMap's is ``layout.osm``, with streets and parcels, and
        ``streets.osm``, with streets alone; SUMO's is ``layout.nod.xml`` and ``layout.edg.xml``.
    overwrite
        Whether existing files may be replaced.

    Returns
    -------
    Path
        The folder.

    Raises
    ------
    OutputError
        If files cannot be written there, the format is in WGS 84 and there is no CRS, or there are
        no streets for SUMO.
    ParameterError
        If `kind` is no `ExportKind`.
    """
    crs, written = layout.frame.crs, as_written(layout)
    if kind in _NETWORKS:
        target = _checked(folder, LAYERS, crs=crs, kind=kind, overwrite=overwrite)
        write, _ = _NETWORKS[ExportKind(kind)]
        return _put(target, lambda temporary: write(written, temporary))
    layers = {layer(name): table for name, table in layout_tables(written).items()}
    return export_layers(layers, folder, crs=crs, kind=kind, overwrite=overwrite)


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
    target = _checked(folder, layers, crs=crs, kind=kind, overwrite=overwrite)
    if kind in _NETWORKS:
        raise OutputError(_no_network(kind))
    write = _write_geojson if kind == ExportKind.GEOJSON else _write_parquet

    def write_all(temporary: Path) -> None:
        for each, table in layers.items():
            write(temporary, each, table, crs)

    return _put(target, write_all)


def _checked(
    folder: str | PathLike[str], layers: Iterable[Layer], *, crs: str, kind: str, overwrite: bool
) -> Path:
    """Return the folder; raise `OutputError` if files cannot be written there."""
    problems = check_export(folder, kind=kind, overwrite=overwrite, layers=layers)
    if kind in _IN_WGS84 and not crs:
        problems.append(
            f"{_IN_WGS84[ExportKind(kind)]} is in WGS 84, but the layout has no CRS: give its "
            "boundary one."
        )
    if problems:
        raise OutputError(problems)
    return Path(folder)


def _put(target: Path, write: Callable[[Path], None]) -> Path:
    """Let files be written into a folder; they appear there when all are ready."""
    try:
        target.mkdir(exist_ok=True)
        with tempfile.TemporaryDirectory(dir=target, prefix=".export-") as temporary:
            write(Path(temporary))
            for file in sorted(Path(temporary).iterdir()):
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
    target, chosen, known = Path(folder), ExportKind(kind), list(layers)
    network = [] if chosen not in _NETWORKS or STREETS in known else [_no_network(kind)]
    if not target.exists():
        return network + folder_problems(target.parent)
    problems = network + folder_problems(target)
    if problems or overwrite:
        return problems
    existing = [name for name in _file_names(chosen, known) if (target / name).exists()]
    if existing:
        problems.append(
            f"The folder {target} already holds {', '.join(existing)}: choose another, or allow "
            "overwriting (--overwrite)."
        )
    return problems


def _no_network(kind: str) -> str:
    others = " or ".join(kind for kind in ExportKind if not kind.of_layouts)
    return f"{kind} is a format of layouts, which have a network of streets: choose {others}."


def _file_names(kind: ExportKind, layers: Iterable[Layer]) -> tuple[str, ...]:
    if kind in _NETWORKS:
        return _NETWORKS[kind][1]
    return tuple(each.name + _suffix(each, kind) for each in layers)


def _suffix(layer: Layer, kind: ExportKind) -> str:
    if kind is ExportKind.PARQUET:
        return ".parquet"
    return ".csv" if layer.geometry is GeometryType.NONE else ".geojson"


def _write_geojson(folder: Path, layer: Layer, table: Table, crs: str) -> None:
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
            {"RFC7946": "YES", "COORDINATE_PRECISION": str(DEGREE_DIGITS)} if spatial else None
        ),
    )


def _write_parquet(folder: Path, layer: Layer, table: Table, crs: str) -> None:
    path = folder / (layer.name + _suffix(layer, ExportKind.PARQUET))
    try:
        table_frame(layer, table, crs=crs).to_parquet(path)
    except ImportError as error:
        raise DependencyError("GeoParquet needs the package pyarrow: install it.") from error
