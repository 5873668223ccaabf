"""CRSs by QGIS: no pyproj inside QGIS, which has a PROJ of its own."""

from __future__ import annotations

import numpy as np
import shapely
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsCoordinateTransformContext,
    QgsCsException,
    QgsEllipsoidUtils,
    QgsGeometry,
    QgsUnitTypes,
)

from qgis_plugin.compat import geographic_base
from qgis_plugin.crs_text import crs_of
from urban_processing.intake.crs_choice import CrsFacts, FloatArray, local_equal_area_again

_METRE = QgsUnitTypes.DistanceUnit.DistanceMeters


class QgisCrs:
    """What the choice of a CRS needs to know, from QGIS; a `CrsLibrary`.

    Parameters
    ----------
    context
        Which transformations between datums the user's project prefers.
    """

    def __init__(self, context: QgsCoordinateTransformContext) -> None:
        self.context = context

    def facts(self, crs: QgsCoordinateReferenceSystem) -> CrsFacts:
        """Return what is to be known of a CRS."""
        unit = crs.mapUnits()
        ellipsoid = QgsEllipsoidUtils.ellipsoidParameters(crs.ellipsoidAcronym())
        known = ellipsoid.valid and ellipsoid.semiMajor > 0
        return CrsFacts(
            name=crs.description() or "a CRS without a name",
            projected=not crs.isGeographic(),
            geographic=crs.isGeographic(),
            unit=QgsUnitTypes.toString(unit),
            metres=QgsUnitTypes.fromUnitToUnitFactor(unit, _METRE),
            semi_axes=(ellipsoid.semiMajor, ellipsoid.semiMinor) if known else None,
        )

    def text(self, crs: QgsCoordinateReferenceSystem) -> str:
        """Return its authority code where it has one, else its WKT."""
        code = str(crs.authid())
        if code and not code.startswith("USER:"):
            return code
        wkt = str(crs.toWkt(QgsCoordinateReferenceSystem.WktVariant.WKT_PREFERRED))
        return local_equal_area_again(_name_in(wkt)) or wkt

    def from_text(self, text: str) -> QgsCoordinateReferenceSystem:
        """Return the CRS of a code or WKT."""
        return crs_of(text)

    def geodetic(self, crs: QgsCoordinateReferenceSystem) -> QgsCoordinateReferenceSystem:
        """Return longitude and latitude in degrees on the datum of a CRS."""
        return geographic_base(crs)

    def transform(
        self,
        xy: FloatArray,
        source: QgsCoordinateReferenceSystem,
        target: QgsCoordinateReferenceSystem,
    ) -> FloatArray:
        """Transform (n, 2) coordinates, x before y.

        QGIS transforms all or none: where a single place has no image, all become infinite.
        """
        if source == target or len(xy) == 0:
            return xy
        places = QgsGeometry()
        places.fromWkb(shapely.to_wkb(shapely.multipoints(xy)))
        try:
            places.transform(QgsCoordinateTransform(source, target, self.context))
        except QgsCsException:
            return np.full_like(xy, np.inf)
        return np.asarray(shapely.get_coordinates(shapely.from_wkb(bytes(places.asWkb()))))


def _name_in(wkt: str) -> str:
    return wkt.split('"', 2)[1] if wkt.count('"') >= 2 else ""
