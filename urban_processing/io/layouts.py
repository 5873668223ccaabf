"""Layouts in from layers of parcels and streets, whatever program made them."""

from __future__ import annotations

from urban_processing.errors import BoundaryError
from urban_processing.intake.layouts import build_layout
from urban_processing.io.crs import PYPROJ
from urban_processing.io.features import Source
from urban_processing.io.layers import read_layer
from urban_processing.layer_rows import PARCEL_COLUMNS, STREET_COLUMNS
from urban_processing.layout import Layout
from urban_processing.schema import PARCELS, STREETS


def read_layers(
    parcels: Source,
    streets: Source,
    *,
    snap: float,
    min_area: float | None = None,
    before: Layout | None = None,
) -> Layout:
    """Make a layout from a layer of parcels and one of streets; it promises what it has.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along; the issues say what that changed. Columns of parcels and streets that a
    layout file has, too, such as land_use, locked and level, count.

    Parameters
    ----------
    parcels
        Polygons: a file, also followed by a layer as in ``file.gpkg|layername=plots``, a
        GeoDataFrame, a GeoSeries or shapely geometries.
    streets
        Lines, likewise; in another CRS they are reprojected.
    snap
        Metres within which things fit.
    min_area
        The smallest parcel allowed, m²; by default the smallest there is.
    before
        The layout that the layers are edited from, whose CRS, parameters and decisions go on.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    problems: list[str] = []
    polygons = read_layer("Parcels", parcels, problems, usual=PARCELS.name, columns=PARCEL_COLUMNS)
    lines = read_layer(
        "Streets", streets, problems, usual=STREETS.name, kind="line", columns=STREET_COLUMNS
    )
    if polygons is None or lines is None:
        raise BoundaryError(problems)
    return build_layout(
        polygons, lines, library=PYPROJ, snap=snap, min_area=min_area, before=before
    )
