"""Layout files in and out, by pyogrio."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from urban_processing.io.frames import GeoLayout
from urban_processing.io.geopackage import PYOGRIO
from urban_processing.layout import Layout
from urban_processing.layout_file import files, subdivisions, writing
from urban_processing.parcelling.reuse import Previous
from urban_processing.tables import LayerSet


def write_layout(
    layout: Layout,
    path: str | PathLike[str],
    *,
    overwrite: bool = False,
    record_seconds: bool = False,
) -> Path:
    """Write a layout as a GeoPackage with all its layers, styled for QGIS.

    The file appears whole or not at all. The same layout gives the same bytes.

    Parameters
    ----------
    layout
        The layout.
    path
        File to write, ending in ``.gpkg``.
    overwrite
        Whether an existing file may be replaced.
    record_seconds
        Whether to record how long the steps took: then no two files are the same.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        If the file cannot be written there.
    """
    written = files.as_written(layout, record_seconds=record_seconds)
    return files.write_layout(written, path, library=PYOGRIO, overwrite=overwrite)


def write_layers(
    made: LayerSet,
    path: str | PathLike[str],
    *,
    overwrite: bool = False,
    record_seconds: bool = False,
) -> Path:
    """Write layers as a GeoPackage; see `urban_processing.layout_file.writing`."""
    return writing.write_layer_set(
        made, path, library=PYOGRIO, overwrite=overwrite, record_seconds=record_seconds
    )


def read_subdivision(path: str | PathLike[str]) -> Previous:
    """Read a file of parcels; see `urban_processing.layout_file.subdivisions`."""
    return subdivisions.read_subdivision(path, library=PYOGRIO)


def read_layout(path: str | PathLike[str], *, snap: float | None = None) -> GeoLayout:
    """Read a layout file; the layout is the one that was written.

    Parameters
    ----------
    path
        The file.
    snap
        Where it is given, parcels and streets that were edited and do not fit together any more
        are fitted within this many metres, and the issues say what that changed.

    Raises
    ------
    BoundaryError
        If there is no such file, or it is no layout file.
    TopologyError
        If its parcels or streets were changed so that they no longer fit together.
    """
    return GeoLayout(files.read_layout(path, library=PYOGRIO, snap=snap))
