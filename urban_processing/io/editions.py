"""Parcels before and after an edit, from files and frames."""

from __future__ import annotations

import pyproj

from urban_processing.errors import BoundaryError
from urban_processing.intake.editions import EditionLayers, build_editions
from urban_processing.io.crs import PYPROJ
from urban_processing.io.features import Source, read_features, split_layer_name
from urban_processing.io.layers import layer_in
from urban_processing.persistence.editions import Editions
from urban_processing.schema import BLOCK_ID, PARCELS, STREETS


def read_editions(
    before: Source,
    after: Source,
    blocks_before: Source | None = None,
    blocks_after: Source | None = None,
) -> Editions:
    """Read two states of a layout.

    Parameters
    ----------
    before, after
        Parcels: files, also followed by a layer as in ``file.gpkg|layername=plots``, frames or
        geometries. Of a layout file the parcels are taken.
    blocks_before, blocks_after
        Polygons of blocks or lines around them, likewise. Where none are given, parcels of a
        layout file that have no column of blocks lie in the blocks between its streets.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    problems: list[str] = []
    found = []
    for called, parcels, blocks in (
        ("before", before, blocks_before),
        ("after", after, blocks_after),
    ):
        try:
            found.append(_edition(parcels, blocks))
        except BoundaryError as error:
            problems += [f"Parcels {called}: {problem}" for problem in error.problems]
    if problems:
        raise BoundaryError(problems)
    return build_editions(*found, library=PYPROJ)


def _edition(parcels: Source, blocks: Source | None) -> EditionLayers[pyproj.CRS]:
    source, layer = split_layer_name(parcels)
    read = read_features(source, layer=layer or layer_in(source, PARCELS.name), columns=None)
    if blocks is None:
        streets = layer_in(source, STREETS.name)
        if layer is not None or streets is None or BLOCK_ID.name in read.columns:
            return EditionLayers(read)
        return EditionLayers(read, read_features(source, layer=streets, kind="line"))
    source, layer = split_layer_name(blocks)
    return EditionLayers(read, read_features(source, layer=layer))
