"""Layouts in from layers of parcels and streets, whatever program made them."""

from __future__ import annotations

from os import PathLike, fspath
from pathlib import Path

import pyogrio
from pyogrio.errors import DataSourceError

from urban_processing.errors import BoundaryError
from urban_processing.intake.layouts import build_layout
from urban_processing.io.crs import PYPROJ
from urban_processing.io.features import Source, read_features, split_layer_name
from urban_processing.layout import Layout
from urban_processing.schema import PARCELS, STREETS


def read_layers(parcels: Source, streets: Source, *, snap: float) -> Layout:
    """Make a layout from a layer of parcels and one of streets; it promises what it has.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along; the issues say what that changed.

    Parameters
    ----------
    parcels
        Polygons: a file, also followed by a layer as in ``file.gpkg|layername=plots``, a
        GeoDataFrame, a GeoSeries or shapely geometries.
    streets
        Lines, likewise; in another CRS they are reprojected.
    snap
        Metres within which things fit.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    problems: list[str] = []
    found = []
    for called, source, layer, kind in (
        ("Parcels", parcels, PARCELS, "polygon"),
        ("Streets", streets, STREETS, "line"),
    ):
        path, named = split_layer_name(source)
        chosen = named or layer_in(path, layer.name)
        try:
            found.append(read_features(path, layer=chosen, kind=kind))
        except BoundaryError as error:
            problems += [f"{called}: {problem}" for problem in error.problems]
    if problems:
        raise BoundaryError(problems)
    return build_layout(*found, library=PYPROJ, snap=snap)


def layer_in(source: Source, name: str) -> str | None:
    """Return the name of a layer if a source is a file that has it, else None."""
    if not isinstance(source, str | PathLike) or not Path(source).is_file():
        return None
    try:
        layers = pyogrio.list_layers(fspath(source))[:, 0].tolist()
    except DataSourceError:
        return None  # reading it says what is wrong
    return name if name in layers else None
