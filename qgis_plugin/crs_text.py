"""CRSs as text; read without numpy and shapely."""

from __future__ import annotations

from qgis.core import QgsCoordinateReferenceSystem


def crs_of(text: str) -> QgsCoordinateReferenceSystem:
    """Return the CRS of an authority code or WKT; an invalid one of an empty text."""
    if text.startswith(("PROJCRS", "PROJCS", "GEOGCRS", "GEOGCS", "BOUNDCRS")):
        return QgsCoordinateReferenceSystem.fromWkt(text)
    return QgsCoordinateReferenceSystem(text)
