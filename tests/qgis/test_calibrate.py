"""`calibrate` inside QGIS gives what the library gives, and says what is wrong."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import geopandas as gpd
import pandas as pd
import shapely
from in_qgis import TEMPORARY, rows, shapes
from qgis.core import QgsProcessingException

import urban_processing as up
from urban_processing.calibration.layers import CALIBRATED_BLOCKS, OBSERVED_PARCELS

ID = "urban_processing:calibrate"
CRS = "EPSG:32630"
X, Y = 500_000.0, 5_700_000.0
BLOCKS, PARCELS, ISSUES = "OUTPUT_BLOCKS", "OUTPUT_PARCELS", "OUTPUT_ISSUES"
SINKS = dict.fromkeys((BLOCKS, PARCELS, ISSUES), TEMPORARY)


def box(*bounds: float) -> shapely.Polygon:
    return shapely.transform(shapely.box(*bounds), lambda xy: xy + np.array((X, Y)))


LOTS = [box(x, y, x + 20, y + 30) for y in (0, 30) for x in (0, 20, 40)]
LOTS += [box(80, 0, 95, 40), box(95, 0, 120, 40), box(60, -200, 64, 300)]
AROUND = [box(78, 0, 122, 42), box(0, 0, 60, 61)]


@pytest.fixture
def parcels(layer: Callable[..., Any]) -> Any:
    return layer([p.wkt for p in LOTS], CRS, name="plots")


@pytest.fixture
def blocks(layer: Callable[..., Any]) -> Callable[..., Any]:
    """Blocks with a column of their own."""

    def make(crs: str = CRS, polygons: list[shapely.Polygon] = AROUND) -> Any:
        made = layer([p.wkt for p in polygons], crs, fields="&field=strategy:string", name="around")
        made.startEditing()
        for feature in list(made.getFeatures())[:1]:
            made.changeAttributeValue(feature.id(), 0, "obb")
        assert made.commitChanges()
        return made

    return make


@pytest.fixture
def calibrate(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(parcels: Any, **parameters: Any) -> dict[str, Any]:
        named = {"PARCELS": parcels, **SINKS, **parameters}
        results: dict[str, Any] = processing.run(ID, named, feedback=feedback)
        return results

    return call


def table(made: Any) -> list[dict[str, Any]]:
    names = [field.name() for field in made.fields()]
    return [dict(zip(names, row, strict=True)) for row in rows(made)]


def assert_same(made: Any, wanted: gpd.GeoDataFrame) -> None:
    found = np.array(shapes(made), dtype=object)
    assert shapely.equals_exact(found, np.array(wanted.geometry, dtype=object), 1e-6).all()
    assert [f.name() for f in made.fields()] == list(wanted.columns[:-1])
    for row, known in zip(table(made), wanted.to_dict("records"), strict=True):
        for name, value in row.items():
            if value is None:
                assert pd.isna(known[name])
            else:
                number = isinstance(value, float)
                assert known[name] == (pytest.approx(value, rel=1e-9) if number else value)


def test_layers_are_those_of_the_library(calibrate: Any, parcels: Any, feedback: Any) -> None:
    results = calibrate(parcels, SPREAD=1.5)
    expected = up.calibrate(gpd.GeoSeries(LOTS, crs=CRS), spread=1.5)
    assert_same(results[BLOCKS], expected.blocks)
    assert_same(results[PARCELS], expected.parcels)
    assert {f.name() for f in results[BLOCKS].fields()} == set(CALIBRATED_BLOCKS.column_names)
    assert {f.name() for f in results[PARCELS].fields()} == set(OBSERVED_PARCELS.column_names)
    assert [row["code"] for row in table(results[ISSUES])] == ["parcel_thin"]
    assert any(said.startswith("parcels: 8") for said in feedback.said)


def test_blocks_with_their_columns_go_on_to_subdivide(
    calibrate: Any, parcels: Any, blocks: Callable[..., Any], tmp_path: Path
) -> None:
    import processing

    file, picture = tmp_path / "blocks.gpkg", tmp_path / "map.png"
    results = calibrate(parcels, BLOCKS=blocks(), OUTPUT=str(file), PLOT=str(picture))
    frame = gpd.GeoDataFrame({"strategy": ["obb", None]}, geometry=AROUND, crs=CRS)
    assert_same(results[BLOCKS], up.calibrate(gpd.GeoSeries(LOTS, crs=CRS), frame).blocks)
    assert [row["parcels"] for row in table(results[BLOCKS])] == [6, 2]
    assert picture.read_bytes().startswith(b"\x89PNG")
    for source in (results[BLOCKS], f"{file}|layername=blocks"):
        call = {"BLOCKS": source, PARCELS: TEMPORARY}
        made = table(processing.run("urban_processing:subdivide", call)[PARCELS])
        assert {(p["block_id"], p["strategy"]) for p in made} == {(1, "skeleton"), (2, "obb")}
        assert len(made) == len(up.subdivide(file).parcels)


def test_blocks_are_reprojected_and_it_is_said(
    calibrate: Any, parcels: Any, blocks: Callable[..., Any], feedback: Any
) -> None:
    degrees = list(gpd.GeoSeries(AROUND, crs=CRS).to_crs(4326))
    results = calibrate(parcels, BLOCKS=blocks("EPSG:4326", degrees))
    assert results[BLOCKS].crs().authid() == CRS
    assert [row["parcels"] for row in table(results[BLOCKS])] == [6, 2]
    assert any("The blocks were reprojected from WGS 84" in said for said in feedback.said)


def test_what_is_wrong_is_said(
    calibrate: Any, parcels: Any, blocks: Callable[..., Any], layer: Callable[..., Any]
) -> None:
    with pytest.raises(QgsProcessingException, match="No parcel lies in a block"):
        calibrate(parcels, BLOCKS=blocks(polygons=[box(900, 0, 950, 40)]))
    with pytest.raises(QgsProcessingException, match="SPREAD"):
        calibrate(parcels, SPREAD=-1)
    with pytest.raises(QgsProcessingException, match="has no CRS"):
        calibrate(layer([p.wkt for p in LOTS], ""))
    with pytest.raises(QgsProcessingException, match="has no features"):
        calibrate(layer([], CRS))
