"""Choice of the projected, metric CRS that a layout is made in."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import pyproj
from pyproj.crs import GeographicCRS, ProjectedCRS
from pyproj.crs.coordinate_operation import LambertAzimuthalEqualAreaConversion
from pyproj.exceptions import CRSError

from urban_processing.errors import BoundaryError

AREA_SCALE_TOLERANCE = 0.01
"""A CRS is kept while its area scale is off by no more than this on the land."""

UTM_TOLERANCE = 0.0025
"""A UTM zone is used while its area scale is off by no more than this: the zone's own 0.2 %
at its edge on the equator, and a little beyond for towns that straddle two zones."""

METRE_TOLERANCE = 1e-4
"""Units that differ from the metre by less (such as the legal metre) count as metres."""

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class WorkingCrs:
    """The CRS to work in, and why it is not the input's own (empty where it is)."""

    crs: pyproj.CRS
    reason: str = ""


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


def crs_text(crs: pyproj.CRS | None) -> str:
    """Return the authority code of a CRS where it has one, else its WKT, "" for none."""
    if crs is None:
        return ""
    found = crs.to_authority()
    if found is not None:
        code = ":".join(found)
        if pyproj.CRS.from_user_input(code).equals(crs, ignore_axis_order=True):
            return code
    local = _local_centre(crs)
    return str((crs if local is None else local_equal_area(*local)).to_wkt("WKT2_2019"))


def crs_label(crs: pyproj.CRS) -> str:
    """Return a name for people: ``WGS 84 / UTM zone 30N (EPSG:32630)``."""
    text = crs_text(crs)
    return f"{crs.name} ({text})" if len(text) < 20 else str(crs.name)


def is_metric(crs: pyproj.CRS) -> bool:
    """Whether a CRS is projected and counts in metres."""
    return bool(crs.is_projected) and all(
        abs(axis.unit_conversion_factor - 1.0) < METRE_TOLERANCE for axis in crs.axis_info[:2]
    )


def transform(xy: FloatArray, source: pyproj.CRS, target: pyproj.CRS) -> FloatArray:
    """Transform (n, 2) coordinates, x before y; what has no image becomes infinite."""
    if source == target:
        return xy
    transformer = pyproj.Transformer.from_crs(source, target, always_xy=True)
    x, y = transformer.transform(xy[:, 0], xy[:, 1])
    return np.column_stack([x, y])


def area_scale_error(crs: pyproj.CRS, lon_lat: FloatArray) -> float:
    """Return the largest error of the area scale of a projected CRS at some places.

    Mapped area over true area of a cell of some ten metres on the ellipsoid, so that it also
    holds where the projection formulas are spherical, as in Web Mercator.

    Parameters
    ----------
    crs
        Projected CRS.
    lon_lat
        (n, 2) degrees on the CRS's own datum.
    """
    geodetic = _geodetic(crs)
    step = 1e-4
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * step / 2
    cells = (lon_lat[:, None, :] + corners).reshape(-1, 2)
    mapped = transform(cells, geodetic, crs).reshape(-1, 4, 2)
    if not np.isfinite(mapped).all():
        return math.inf
    unit = crs.axis_info[0].unit_conversion_factor
    diagonals = (mapped[:, 2] - mapped[:, 0]) * unit, (mapped[:, 3] - mapped[:, 1]) * unit
    area = 0.5 * np.abs(
        diagonals[0][:, 0] * diagonals[1][:, 1] - diagonals[0][:, 1] * diagonals[1][:, 0]
    )
    true = _cell_area(crs, np.radians(lon_lat[:, 1]), math.radians(step))
    return float(np.max(np.abs(area / true - 1.0), initial=0.0))


def choose_crs(crs: pyproj.CRS, xy: FloatArray) -> WorkingCrs:
    """Choose the CRS to lay out land in.

    The input's own CRS where it is metric and true to area within 1 %, else the UTM zone at
    the land's centre, else, where the land leaves the zone, a Lambert azimuthal equal-area
    projection about its centre.

    Parameters
    ----------
    crs
        CRS of the input.
    xy
        (n, 2) coordinates of the land's vertices in `crs`.
    """
    lon_lat = transform(xy, crs, _geodetic(crs))
    if not np.isfinite(lon_lat).all() or (np.abs(lon_lat[:, 1]) > 90).any():
        raise BoundaryError(
            f"The coordinates do not fit the CRS {crs_label(crs)}: they have no place on the "
            "globe. Give the right CRS with crs (--crs), or assign it in the file."
        )
    reason = _why_not(crs, _probes(lon_lat))
    if not reason:
        return WorkingCrs(crs)
    lon_lat = _unwrapped(transform(xy, crs, WGS84))
    centre = 0.5 * (lon_lat.min(axis=0) + lon_lat.max(axis=0))
    utm = _utm_zone(*centre)
    if utm is not None and area_scale_error(utm, _probes(lon_lat)) <= UTM_TOLERANCE:
        return WorkingCrs(utm, reason)
    return WorkingCrs(local_equal_area(*np.round(centre)), reason)


def local_equal_area(lon: float, lat: float) -> pyproj.CRS:
    """Return the Lambert azimuthal equal-area projection about a place in degrees."""
    lon = (lon + 180.0) % 360.0 - 180.0
    return ProjectedCRS(
        conversion=LambertAzimuthalEqualAreaConversion(
            latitude_natural_origin=lat, longitude_natural_origin=lon
        ),
        name=f"{_LOCAL_NAME} {abs(lat):g}{'S' if lat < 0 else 'N'} "
        f"{abs(lon):g}{'W' if lon < 0 else 'E'}",
        geodetic_crs=WGS84,
    )


WGS84 = pyproj.CRS.from_epsg(4326)
_LOCAL_NAME = "Local Lambert azimuthal equal-area"


def _geodetic(crs: pyproj.CRS) -> pyproj.CRS:
    """Return longitude and latitude in degrees on the datum of a CRS."""
    base = crs.geodetic_crs
    if base is None:
        return WGS84
    axes = base.axis_info
    if base.is_geographic and len(axes) == 2 and axes[0].unit_name == "degree":
        return base
    return GeographicCRS(datum=base.datum)


def _why_not(crs: pyproj.CRS, lon_lat: FloatArray) -> str:
    """Why a CRS is not fit to work in; empty where it is."""
    if not crs.is_projected:
        return "its coordinates are degrees"
    if not is_metric(crs):
        return f"its unit is the {crs.axis_info[0].unit_name}, not the metre"
    error = area_scale_error(crs, lon_lat)
    if error > AREA_SCALE_TOLERANCE:
        return f"it distorts areas by {100 * error:.3g} % here"
    return ""


def _probes(lon_lat: FloatArray) -> FloatArray:
    """Return places to measure distortion at: a spread of the vertices, and the extremes."""
    some = lon_lat[:: max(1, len(lon_lat) // 64)]
    extremes = lon_lat[np.concatenate([lon_lat.argmin(axis=0), lon_lat.argmax(axis=0)])]
    return np.vstack([some, extremes])


def _unwrapped(lon_lat: FloatArray) -> FloatArray:
    """Shift longitudes so that land across the 180th meridian is in one piece."""
    if np.ptp(lon_lat[:, 0]) <= 180:
        return lon_lat
    return np.column_stack([lon_lat[:, 0] % 360.0, lon_lat[:, 1]])


def _utm_zone(lon: float, lat: float) -> pyproj.CRS | None:
    if not -80 <= lat <= 84:
        return None
    zone = int((lon + 180.0) % 360.0 // 6) + 1
    return pyproj.CRS.from_epsg((32600 if lat >= 0 else 32700) + zone)


def _cell_area(crs: pyproj.CRS, lat: FloatArray, step: float) -> FloatArray:
    """Area in m² of a cell of `step` by `step` radians on the ellipsoid of a CRS."""
    ellipsoid = crs.ellipsoid or WGS84.ellipsoid
    if ellipsoid is None:
        raise BoundaryError(
            f"The CRS {crs.name} has no ellipsoid: choose another with crs (--crs)."
        )
    a, b = ellipsoid.semi_major_metre, ellipsoid.semi_minor_metre
    e2 = 1.0 - (b / a) ** 2
    w2 = 1.0 - e2 * np.sin(lat) ** 2
    meridian, normal = a * (1.0 - e2) / w2**1.5, a / np.sqrt(w2)
    return np.asarray(meridian * normal * np.cos(lat) * step**2)


def _local_centre(crs: pyproj.CRS) -> tuple[float, float] | None:
    """Centre (lon, lat) of a CRS made by `local_equal_area`, also after it was in a file."""
    if not crs.name.startswith(_LOCAL_NAME) or crs.coordinate_operation is None:
        return None
    values = {p.name: p.value for p in crs.coordinate_operation.params}
    names = "Longitude of natural origin", "Latitude of natural origin"
    if not all(name in values for name in names):
        return None
    return float(values[names[0]]), float(values[names[1]])
