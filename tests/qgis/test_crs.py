"""QGIS and pyproj choose the same CRS and put the land in the same place."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import pyogrio
import shapely
from in_qgis import TEMPORARY, shapes
from qgis.core import QgsCoordinateReferenceSystem, QgsCoordinateTransformContext

from urban_processing.intake.crs_choice import choose_crs, crs_label, local_equal_area
from urban_processing.io.crs import PYPROJ, WGS84, parse_crs

Run = Callable[..., dict[str, Any]]

CASES = [
    (4326, -0.2, 51.45, 0.02),
    (4326, 174.8, -41.3, 0.02),
    (4326, -111.05, 41.0, 6.0),
    (4326, 20.0, -85.0, 0.02),
    (4326, 12.0, 47.0, 0.3),
    (4258, 9.5, 47.2, 0.02),
    (3857, -0.2, 51.45, 0.02),
    (3857, 13.4, 5.0, 0.02),
    (3435, -87.65, 41.9, 0.02),
    (32630, 10.0, 50.0, 0.02),
    (32630, -3.0, 50.0, 0.02),
    (2056, 9.5, 47.2, 0.02),
    (27700, -0.1, 51.5, 0.02),
    (2193, 174.8, -41.3, 0.02),
    (3035, 9.0, 47.0, 0.02),
    (5514, 14.4, 50.1, 0.02),
]


@pytest.fixture
def library(engine: Callable[[str], Any]) -> Any:
    return engine("crs").QgisCrs(QgsCoordinateTransformContext())


@pytest.mark.parametrize(("code", "lon", "lat", "size"), CASES)
def test_the_choice_is_the_same(
    library: Any, code: int, lon: float, lat: float, size: float
) -> None:
    square = np.array([[0, 0], [1, 0], [1, 1], [0, 1]]) * size + [lon, lat]
    outside = parse_crs(f"EPSG:{code}")
    xy = PYPROJ.transform(square, WGS84, outside)
    expected = choose_crs(outside, xy, PYPROJ)
    found = choose_crs(QgsCoordinateReferenceSystem(f"EPSG:{code}"), xy, library)
    assert library.text(found.crs) == PYPROJ.text(expected.crs)
    assert bool(found.reason) == bool(expected.reason)
    assert crs_label(found.crs, library) == crs_label(expected.crs, PYPROJ)
    if code == 5514:  # its datum has several shifts, and each PROJ has its favourite
        return
    moved = library.transform(square, library.from_text("EPSG:4326"), found.crs)
    wanted = PYPROJ.transform(square, WGS84, expected.crs)
    np.testing.assert_allclose(moved, wanted, atol=1e-6)


def test_places_without_an_image_become_infinite(library: Any) -> None:
    xy = np.array([[0.0, 90.0], [400.0, 91.0]])
    mercator = library.from_text("EPSG:3857")
    assert np.isinf(library.transform(xy, library.from_text("EPSG:4326"), mercator)).all()


def test_texts_come_back(library: Any) -> None:
    for text in ("EPSG:32630", "EPSG:2056", local_equal_area(-108.0, 44.0)):
        assert library.text(library.from_text(text)) == text
    assert not library.from_text("").isValid()


@pytest.mark.parametrize("name", ["wandsworth", "schaan", "wyoming"])
def test_land_in_degrees_is_laid_out_as_by_the_library(
    run: Run, sample: Callable[[str], Path], feedback: Any, name: str
) -> None:
    import urban_processing as up

    assert pyogrio.read_info(sample(name))["crs"] == "EPSG:4326" or name == "wyoming"
    made = run(str(sample(name)), PARCELS=50, OUTPUT_PARCELS=TEMPORARY)["OUTPUT_PARCELS"]
    expected = up.cogenerate(sample(name), parcels=50)
    assert made.featureCount() == len(expected.parcels)
    assert shapely.equals_exact(
        shapely.normalize(np.array(shapes(made), dtype=object)),
        shapely.normalize(np.asarray(expected.parcels.geometry)),
        2e-6,
    ).all()
    assert any("CRS of the results" in said for said in feedback.said)


def test_the_user_may_pick_the_crs(run: Run, sample: Callable[[str], Path]) -> None:
    made = run(str(sample("schellenberg")), PARCELS=20, CRS="EPSG:2056", OUTPUT_PARCELS=TEMPORARY)[
        "OUTPUT_PARCELS"
    ]
    assert made.crs().authid() == "EPSG:2056"
    assert made.extent().xMinimum() > 2_500_000
