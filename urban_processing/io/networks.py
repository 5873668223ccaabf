"""Layouts out as networks: for programs of OpenStreetMap, and for SUMO."""

from __future__ import annotations

import warnings
from pathlib import Path

import numpy as np

from urban_processing.errors import OutputError
from urban_processing.io.crs import PYPROJ, WGS84
from urban_processing.layout import Layout
from urban_processing.mesh.planar import FloatArray
from urban_processing.network_files.osm import osm_document
from urban_processing.network_files.sumo import NO_PROJECTION, sumo_documents

OSM_FILES = ("layout.osm", "streets.osm")
SUMO_FILES = ("layout.nod.xml", "layout.edg.xml")


def write_osm(layout: Layout, folder: Path) -> None:
    """Write a layout, and its streets alone, for what takes every way for a street.

    Raises
    ------
    OutputError
        If the CRS of the layout has no relation to WGS 84.
    """
    places = _lon_lat(layout)
    (folder / OSM_FILES[0]).write_bytes(osm_document(layout, places))
    (folder / OSM_FILES[1]).write_bytes(osm_document(layout, places, parcels=False))


def write_sumo(layout: Layout, folder: Path) -> None:
    """Write the nodes and edges of a layout, which need no CRS.

    Raises
    ------
    OutputError
        If there are no streets, or the CRS of the layout has no relation to WGS 84.
    """
    if not layout.edge_street.any():
        raise OutputError("The layout has no streets, and SUMO knows nothing else.")
    if layout.frame.crs:
        written = sumo_documents(
            layout, projection=_projection(layout.frame.crs), lon_lat=_lon_lat(layout)
        )
    else:
        written = sumo_documents(layout, projection=NO_PROJECTION)
    for name, content in zip(SUMO_FILES, written, strict=True):
        (folder / name).write_bytes(content)


def _projection(text: str) -> str:
    """CRS as SUMO reads it: its code, else PROJ 4's notation, which knows no shift of datum."""
    crs = PYPROJ.from_text(text)
    code = crs.to_authority()
    if code is not None:
        return ":".join(code)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", UserWarning)  # that something is lost
        return str(crs.to_proj4())


def _lon_lat(layout: Layout) -> FloatArray:
    """(V, 2) longitude and latitude of the vertices."""
    xy = layout.mesh.xy + np.asarray(layout.frame.origin)
    places = PYPROJ.transform(xy, PYPROJ.from_text(layout.frame.crs), WGS84)
    if not np.isfinite(places).all():
        raise OutputError("The CRS of the layout has no relation to WGS 84: give its boundary one.")
    return places
