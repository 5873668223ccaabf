"""Choice of the projected, metric CRS that a layout is made in.

The rule is here; what is known of a CRS, and coordinates in another, come from the library that
the shell works with: pyproj, or QGIS.
"""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np
import numpy.typing as npt

from urban_processing.errors import BoundaryError

AREA_SCALE_TOLERANCE = 0.01
"""A CRS is kept while its area scale is off by no more than this on the land."""

UTM_TOLERANCE = 0.0025
"""A UTM zone is used while its area scale is off by no more than this: the zone's own 0.2 %
at its edge on the equator, and a little beyond for towns that straddle two zones."""

METRE_TOLERANCE = 1e-4
"""Units that differ from the metre by less (such as the legal metre) count as metres."""

LOCAL_NAME = "Local Lambert azimuthal equal-area"
WGS84 = "EPSG:4326"

_LOCAL_PLACE = re.compile(rf"{LOCAL_NAME} ([\d.]+)([NS]) ([\d.]+)([EW])")

FloatArray = npt.NDArray[np.float64]
C = TypeVar("C")


@dataclass(frozen=True)
class CrsFacts:
    """What is to be known of a CRS.

    Parameters
    ----------
    name
        Its name without code.
    projected, geographic
        Whether it is one or the other; some are neither.
    unit
        Name of the unit of its axes.
    metres
        Length of that unit in metres; of several, the one that is least like a metre.
    semi_axes
        Semi-major and semi-minor axis of its ellipsoid in metres; None where it has none.
    """

    name: str
    projected: bool
    geographic: bool
    unit: str
    metres: float
    semi_axes: tuple[float, float] | None

    @property
    def metric(self) -> bool:
        """Whether the CRS is projected and counts in metres."""
        return self.projected and abs(self.metres - 1.0) < METRE_TOLERANCE


class CrsLibrary(Protocol[C]):
    """A library that knows CRSs, each an object of its own type `C` with ``==``."""

    def facts(self, crs: C) -> CrsFacts:
        """Return what is to be known of a CRS."""
        ...

    def text(self, crs: C) -> str:
        """Return its authority code where it has one, else its WKT."""
        ...

    def from_text(self, text: str) -> C:
        """Return the CRS of a code or WKT."""
        ...

    def geodetic(self, crs: C) -> C:
        """Return longitude and latitude in degrees on the datum of a CRS."""
        ...

    def transform(self, xy: FloatArray, source: C, target: C) -> FloatArray:
        """Transform (n, 2) coordinates, x before y; what has no image becomes infinite."""
        ...


@dataclass(frozen=True)
class WorkingCrs(Generic[C]):
    """The CRS to work in, and why it is not the input's own (empty where it is)."""

    crs: C
    reason: str = ""


def crs_label(crs: C, library: CrsLibrary[C]) -> str:
    """Return a name for people: ``WGS 84 / UTM zone 30N (EPSG:32630)``."""
    text, name = library.text(crs), library.facts(crs).name
    return f"{name} ({text})" if len(text) < 20 else name


def choose_crs(crs: C, xy: FloatArray, library: CrsLibrary[C]) -> WorkingCrs[C]:
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
    library
        What knows the CRSs.
    """
    lon_lat = library.transform(xy, crs, library.geodetic(crs))
    if not np.isfinite(lon_lat).all() or (np.abs(lon_lat[:, 1]) > 90).any():
        raise BoundaryError(
            f"The coordinates do not fit the CRS {crs_label(crs, library)}: they have no place "
            "on the globe. Give the right CRS with crs (--crs), or assign it in the file."
        )
    reason = _why_not(crs, _probes(lon_lat), library)
    if not reason:
        return WorkingCrs(crs)
    lon_lat = _unwrapped(library.transform(xy, crs, library.from_text(WGS84)))
    centre = 0.5 * (lon_lat.min(axis=0) + lon_lat.max(axis=0))
    zone = _utm_zone(*centre)
    if zone is not None:
        utm = library.from_text(zone)
        if area_scale_error(utm, _probes(lon_lat), library) <= UTM_TOLERANCE:
            return WorkingCrs(utm, reason)
    return WorkingCrs(library.from_text(local_equal_area(*np.round(centre))), reason)


def area_scale_error(crs: C, lon_lat: FloatArray, library: CrsLibrary[C]) -> float:
    """Return the largest error of the area scale of a projected CRS at some places.

    Mapped area over true area of a cell of some ten metres on the ellipsoid, so that it also
    holds where the projection formulas are spherical, as in Web Mercator.

    Parameters
    ----------
    crs
        Projected CRS.
    lon_lat
        (n, 2) degrees on the CRS's own datum.
    library
        What knows the CRS.
    """
    facts = library.facts(crs)
    step = 1e-4
    corners = np.array([[-1, -1], [1, -1], [1, 1], [-1, 1]]) * step / 2
    cells = (lon_lat[:, None, :] + corners).reshape(-1, 2)
    mapped = library.transform(cells, library.geodetic(crs), crs).reshape(-1, 4, 2)
    if not np.isfinite(mapped).all():
        return math.inf
    unit = facts.metres
    diagonals = (mapped[:, 2] - mapped[:, 0]) * unit, (mapped[:, 3] - mapped[:, 1]) * unit
    area = 0.5 * np.abs(
        diagonals[0][:, 0] * diagonals[1][:, 1] - diagonals[0][:, 1] * diagonals[1][:, 0]
    )
    true = _cell_area(facts, np.radians(lon_lat[:, 1]), math.radians(step))
    return float(np.max(np.abs(area / true - 1.0), initial=0.0))


def local_equal_area(lon: float, lat: float) -> str:
    """Return the Lambert azimuthal equal-area projection about a place in degrees, as WKT."""
    lon = (lon + 180.0) % 360.0 - 180.0
    place = f"{abs(lat):g}{'S' if lat < 0 else 'N'} {abs(lon):g}{'W' if lon < 0 else 'E'}"
    metre, degree = 'LENGTHUNIT["metre",1]', 'ANGLEUNIT["degree",0.0174532925199433]'
    return (
        f'PROJCRS["{LOCAL_NAME} {place}",BASEGEOGCRS["WGS 84",'
        f'DATUM["World Geodetic System 1984",ELLIPSOID["WGS 84",6378137,298.257223563,{metre}]],'
        f'PRIMEM["Greenwich",0,{degree}],ID["EPSG",4326]],CONVERSION["unknown",'
        'METHOD["Lambert Azimuthal Equal Area",ID["EPSG",9820]],'
        f'PARAMETER["Latitude of natural origin",{lat:g},{degree},ID["EPSG",8801]],'
        f'PARAMETER["Longitude of natural origin",{lon:g},{degree},ID["EPSG",8802]],'
        f'PARAMETER["False easting",0,{metre},ID["EPSG",8806]],'
        f'PARAMETER["False northing",0,{metre},ID["EPSG",8807]]],CS[Cartesian,2],'
        f'AXIS["(E)",east,ORDER[1],{metre}],AXIS["(N)",north,ORDER[2],{metre}]]'
    )


def local_equal_area_again(name: str) -> str | None:
    """Return the WKT of a `local_equal_area` projection by its name, None for other names.

    Other programs write the projection in other words, but keep its name.
    """
    found = _LOCAL_PLACE.fullmatch(name)
    if found is None:
        return None
    lat, south, lon, west = found.groups()
    return local_equal_area(
        -float(lon) if west == "W" else float(lon), -float(lat) if south == "S" else float(lat)
    )


def _why_not(crs: C, lon_lat: FloatArray, library: CrsLibrary[C]) -> str:
    """Why a CRS is not fit to work in; empty where it is."""
    facts = library.facts(crs)
    if not facts.projected:
        return "its coordinates are degrees"
    if not facts.metric:
        return f"its unit is the {facts.unit}, not the metre"
    error = area_scale_error(crs, lon_lat, library)
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


def _utm_zone(lon: float, lat: float) -> str | None:
    if not -80 <= lat <= 84:
        return None
    zone = int((lon + 180.0) % 360.0 // 6) + 1
    return f"EPSG:{(32600 if lat >= 0 else 32700) + zone}"


def _cell_area(facts: CrsFacts, lat: FloatArray, step: float) -> FloatArray:
    """Area in m² of a cell of `step` by `step` radians on the ellipsoid of a CRS."""
    if facts.semi_axes is None:
        raise BoundaryError(
            f"The CRS {facts.name} has no ellipsoid: choose another with crs (--crs)."
        )
    a, b = facts.semi_axes
    e2 = 1.0 - (b / a) ** 2
    w2 = 1.0 - e2 * np.sin(lat) ** 2
    meridian, normal = a * (1.0 - e2) / w2**1.5, a / np.sqrt(w2)
    return np.asarray(meridian * normal * np.cos(lat) * step**2)
