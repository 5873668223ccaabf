"""Layouts in from layers of parcels and streets, whatever program made them."""

from __future__ import annotations

from urban_processing.errors import BoundaryError
from urban_processing.intake.layouts import build_layout
from urban_processing.io.crs import PYPROJ
from urban_processing.io.features import Source
from urban_processing.io.layers import read_layer
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
    polygons = read_layer("Parcels", parcels, problems, usual=PARCELS.name, columns=())
    lines = read_layer("Streets", streets, problems, usual=STREETS.name, kind="line", columns=())
    if polygons is None or lines is None:
        raise BoundaryError(problems)
    return build_layout(polygons, lines, library=PYPROJ, snap=snap)
