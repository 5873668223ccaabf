"""Which CRS a layout is made in."""

from __future__ import annotations

import numpy as np
import pyproj
import pytest

from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import (
    WorkingCrs,
    area_scale_error,
    choose_crs,
    local_equal_area,
)
from urban_processing.io.crs import PYPROJ, WGS84, crs_text, parse_crs


def choose(code: int, lon: float, lat: float, size: float = 0.02) -> WorkingCrs[pyproj.CRS]:
    """Choose for a small square at a place, given in a CRS."""
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size + [lon, lat]
    crs = pyproj.CRS.from_epsg(code)
    return choose_crs(crs, PYPROJ.transform(square, WGS84, crs), PYPROJ)


@pytest.mark.parametrize(
    ("code", "lon", "lat"),
    [
        (32633, 15.0, 48.7),
        (2056, 9.5, 47.2),
        (27700, -0.1, 51.5),
        (2193, 174.8, -41.3),
        (3035, 9.0, 47.0),
    ],
)
def test_metric_and_true_crs_is_kept(code: int, lon: float, lat: float) -> None:
    chosen = choose(code, lon, lat)
    assert chosen.reason == ""
    assert crs_text(chosen.crs) == f"EPSG:{code}"


@pytest.mark.parametrize(
    ("code", "lon", "lat", "expected", "word"),
    [
        (4326, -0.2, 51.45, "EPSG:32630", "degrees"),
        (4326, 174.8, -41.3, "EPSG:32760", "degrees"),
        (3857, -0.2, 51.45, "EPSG:32630", "distorts"),
        (3857, 13.4, 5.0, "EPSG:32633", "distorts"),
        (3435, -87.65, 41.9, "EPSG:32616", "foot"),
        (32630, 10.0, 50.0, "EPSG:32632", "distorts"),
    ],
)
def test_unfit_crs_becomes_utm(code: int, lon: float, lat: float, expected: str, word: str) -> None:
    chosen = choose(code, lon, lat)
    assert crs_text(chosen.crs) == expected
    assert word in chosen.reason


def test_land_beyond_a_zone_gets_an_equal_area_projection() -> None:
    chosen = choose(4326, -111.05, 41.0, size=6.0)
    assert "equal-area 44N 108W" in chosen.crs.name
    corners = np.array([[-111.05, 41.0], [-105.05, 47.0]])
    assert area_scale_error(chosen.crs, corners, PYPROJ) < 1e-6


def test_poles_are_no_utm_zone() -> None:
    assert "equal-area" in choose(4326, 20.0, -85.0).crs.name


def test_area_scale_is_that_of_the_ellipsoid() -> None:
    # Web Mercator stretches both axes by sec(latitude), and is spherical besides
    mercator = pyproj.CRS.from_epsg(3857)
    error = area_scale_error(mercator, np.array([[10.0, 60.0]]), PYPROJ)
    assert error == pytest.approx(3.0, abs=0.02)
    utm = pyproj.CRS.from_epsg(32633)
    assert area_scale_error(utm, np.array([[15.0, 48.0]]), PYPROJ) == pytest.approx(8e-4, rel=1e-3)


def test_text_of_a_local_projection_survives_old_wkt() -> None:
    local = PYPROJ.from_text(local_equal_area(-108.0, 43.0))
    again = pyproj.CRS.from_wkt(local.to_wkt("WKT1_GDAL"))
    assert crs_text(again) == crs_text(local)


def test_heights_are_dropped() -> None:
    assert crs_text(parse_crs("EPSG:25832+7837")) == "EPSG:25832"


def test_unknown_crs_is_named() -> None:
    with pytest.raises(BoundaryError, match="'EPSG:0'"):
        parse_crs("EPSG:0")


def test_impossible_coordinates_are_refused() -> None:
    with pytest.raises(BoundaryError, match="no place on the globe"):
        choose_crs(WGS84, np.array([[690423.0, 5700151.0]]), PYPROJ)
