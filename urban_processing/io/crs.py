"""CRSs by pyproj."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import pyproj
from pyproj.crs import GeographicCRS
from pyproj.exceptions import CRSError

from urban_processing.errors import BoundaryError
from urban_processing.intake import crs_choice
from urban_processing.intake.crs_choice import CrsFacts, FloatArray, local_equal_area_again

WGS84 = pyproj.CRS.from_user_input(crs_choice.WGS84)


class Pyproj:
    """What the choice of a CRS needs to know, from pyproj; a `CrsLibrary`."""

    def facts(self, crs: pyproj.CRS) -> CrsFacts:
        """Return what is to be known of a CRS."""
        axes = crs.axis_info[:2]
        unlike = max(axes, key=lambda axis: abs(axis.unit_conversion_factor - 1.0))
        ellipsoid = crs.ellipsoid
        return CrsFacts(
            name=crs.name,
            projected=bool(crs.is_projected),
            geographic=bool(crs.is_geographic),
            unit=unlike.unit_name,
            metres=unlike.unit_conversion_factor,
            semi_axes=None
            if ellipsoid is None
            else (ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre),
        )

    def text(self, crs: pyproj.CRS) -> str:
        """Return the authority code of a CRS where it has one, else its WKT."""
        return crs_text(crs)

    def from_text(self, text: str) -> pyproj.CRS:
        """Return the CRS of a code or WKT."""
        return pyproj.CRS.from_user_input(text)

    def geodetic(self, crs: pyproj.CRS) -> pyproj.CRS:
        """Return longitude and latitude in degrees on the datum of a CRS."""
        base = crs.geodetic_crs
        if base is None:
            return WGS84
        axes = base.axis_info
        if base.is_geographic and len(axes) == 2 and axes[0].unit_name == "degree":
            return base
        return GeographicCRS(datum=base.datum)

    def transform(self, xy: FloatArray, source: pyproj.CRS, target: pyproj.CRS) -> FloatArray:
        """Transform (n, 2) coordinates, x before y; what has no image becomes infinite."""
        if source == target:
            return xy
        x, y = _transformer(source, target).transform(xy[:, 0], xy[:, 1])
        return np.column_stack([x, y])


@lru_cache(maxsize=16)
def _transformer(source: pyproj.CRS, target: pyproj.CRS) -> pyproj.Transformer:
    """Return a transformer, which takes much longer to make than to use."""
    return pyproj.Transformer.from_crs(source, target, always_xy=True)


PYPROJ = Pyproj()


def parse_crs(value: object) -> pyproj.CRS:
    """Return the horizontal CRS that a user means, such as ``EPSG:32630`` or WKT.

    Raises
    ------
    BoundaryError
        If PROJ does not know it.
    """
    try:
        return horizontal(pyproj.CRS.from_user_input(value))
    except CRSError as error:
        raise BoundaryError(
            f"The CRS {value!r} is not known; give a code such as 'EPSG:32630', or WKT."
        ) from error


def horizontal(crs: pyproj.CRS) -> pyproj.CRS:
    """Return the two-dimensional CRS without heights and datum shifts."""
    if crs.is_compound:
        crs = crs.sub_crs_list[0]
    if crs.is_bound and crs.source_crs is not None:
        crs = crs.source_crs
    return crs.to_2d() if len(crs.axis_info) > 2 else crs


def crs_text(crs: pyproj.CRS) -> str:
    """Return the authority code of a CRS where it has one, else its WKT."""
    found = crs.to_authority()
    if found is not None:
        code = ":".join(found)
        if pyproj.CRS.from_user_input(code).equals(crs, ignore_axis_order=True):
            return code
    return local_equal_area_again(crs.name) or str(crs.to_wkt("WKT2_2019"))


def asked_crs(crs: object, problems: list[str]) -> pyproj.CRS | None:
    """Return a CRS that was asked for; None if none was, or what is wrong is in `problems`."""
    if crs is None:
        return None
    try:
        return parse_crs(crs)
    except BoundaryError as error:
        problems += error.problems
        return None
