"""Observed parcels and their blocks out of files and frames."""

from __future__ import annotations

from os import fspath

import pyproj

from urban_processing.calibration.model import Observed
from urban_processing.errors import BoundaryError
from urban_processing.intake.features import Features
from urban_processing.intake.observed import build_observed
from urban_processing.io.crs import PYPROJ, asked_crs
from urban_processing.io.features import Source, read_features, split_layer_name
from urban_processing.io.layouts import layer_in
from urban_processing.schema import BLOCKS, PARCELS


def read_observed(
    parcels: Source,
    blocks: Source | None = None,
    *,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
) -> Observed:
    """Read observed parcels, and the blocks that they are in.

    Parameters
    ----------
    parcels
        Polygons: a file, also followed by a layer as in ``file.gpkg|layername=plots``, a
        GeoDataFrame, a GeoSeries or shapely geometries. Of a file that has several layers, that
        called ``parcels`` is read.
    blocks
        Polygons, likewise; of a file that has several layers, that called ``blocks``. By default
        that layer of a file whose ``parcels`` are read, if it has both.
    layer, where
        Layer of a file of parcels, and which features of it.
    crs
        Projected CRS in metres to work in; the CRS of parcels that have none.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    """
    problems: list[str] = []
    asked = asked_crs(crs, problems)
    if blocks is None and layer is None and layer_in(parcels, PARCELS.name) is not None:
        named = layer_in(parcels, BLOCKS.name)
        blocks = None if named is None else f"{fspath(parcels)}|layername={named}"
    found = _read("Parcels", parcels, PARCELS.name, problems, layer=layer, where=where)
    around = None if blocks is None else _read("Blocks", blocks, BLOCKS.name, problems)
    return build_observed(found, library=PYPROJ, asked=asked, blocks=around, problems=problems)


def _read(
    called: str,
    source: Source,
    usual: str,
    problems: list[str],
    *,
    layer: str | None = None,
    where: str | None = None,
) -> Features[pyproj.CRS] | None:
    """Read a layer with all its columns; None where that failed, and why is added to `problems`."""
    path, named = split_layer_name(source)
    layer = layer or named or layer_in(path, usual)
    try:
        return read_features(path, layer=layer, where=where, columns=None)
    except BoundaryError as error:
        problems += [f"{called}: {problem}" for problem in error.problems]
        return None
