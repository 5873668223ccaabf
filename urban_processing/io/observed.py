"""Observed parcels and their blocks out of files and frames."""

from __future__ import annotations

from os import fspath

from urban_processing.calibration.model import Observed
from urban_processing.intake.observed import build_observed
from urban_processing.io.crs import PYPROJ, asked_crs
from urban_processing.io.features import Source
from urban_processing.io.layers import layer_in, read_layer
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
    found = read_layer("Parcels", parcels, problems, usual=PARCELS.name, layer=layer, where=where)
    around = None
    if blocks is not None:
        around = read_layer("Blocks", blocks, problems, usual=BLOCKS.name)
    return build_observed(found, library=PYPROJ, asked=asked, blocks=around, problems=problems)
