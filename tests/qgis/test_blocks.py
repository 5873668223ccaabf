"""`blocks` inside QGIS gives what the library gives."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import shapely
from in_qgis import TEMPORARY, rows, shapes

import urban_processing as up
from urban_processing.schema import BLOCK_EDGES, BLOCKS, RIGHT_OF_WAY

ID = "urban_processing:blocks"
RING = "LINESTRING (500000 0, 500200 0, 500200 100, 500000 100, 500000 0)"
ACROSS = "LINESTRING (500100 0, 500100 100)"
SINKS = {f"OUTPUT_{each.name.upper()}": TEMPORARY for each in (BLOCKS, BLOCK_EDGES, RIGHT_OF_WAY)}


@pytest.fixture
def streets(layer: Callable[..., Any]) -> Any:
    """Two blocks; the street between them is wider than the others."""
    from qgis.core import NULL

    made = layer(
        [RING, ACROSS],
        kind="LineString",
        fields="&field=highway:string&field=width_m:double",
        name="roads",
    )
    made.startEditing()
    for number, feature in enumerate(made.getFeatures()):
        made.changeAttributeValue(feature.id(), 0, ["residential", "primary"][number])
        made.changeAttributeValue(feature.id(), 1, [NULL, 30.0][number])
    assert made.commitChanges()
    return made


@pytest.fixture
def find(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(streets: Any, **parameters: Any) -> dict[str, Any]:
        named = {"STREETS": streets, **parameters}
        results: dict[str, Any] = processing.run(ID, named, feedback=feedback)
        return results

    return call


def test_layers_are_those_of_the_library(find: Any, streets: Any) -> None:
    results = find(streets, **SINKS)
    lines = [shapely.from_wkt(RING), shapely.from_wkt(ACROSS)]
    import geopandas as gpd

    frame = gpd.GeoDataFrame(
        {"highway": ["residential", "primary"], "width_m": [None, 30.0]},
        geometry=lines,
        crs="EPSG:32630",
    )
    frame["width_m"] = frame.width_m.astype("Float64")
    expected = up.find_blocks(frame)
    for each in (BLOCKS, BLOCK_EDGES, RIGHT_OF_WAY):
        made, wanted = results[f"OUTPUT_{each.name.upper()}"], expected.frame(each.name)
        assert [f.name() for f in made.fields()] == list(each.column_names)
        found = np.array(shapes(made), dtype=object)
        assert shapely.equals_exact(found, np.array(wanted.geometry, dtype=object), 1e-6).all()
        values = wanted.drop(columns="geometry").astype(object).to_numpy().tolist()
        assert [list(row) for row in rows(made)] == values
    assert {row[4] for row in rows(results["OUTPUT_BLOCK_EDGES"])} == {12.0, 30.0}


def test_land_in_another_crs_and_what_is_said(
    find: Any, streets: Any, layer: Callable[..., Any], feedback: Any
) -> None:
    land = layer(["POLYGON ((-3.0001 -0.0001, -2.9988 -0.0001, -2.9988 0.0006, -3.0001 0.0006, "
                  "-3.0001 -0.0001))"], crs="EPSG:4326")  # fmt: skip
    results = find(streets, LAND=land, **SINKS)
    access = {bool(row[-1]) for row in rows(results["OUTPUT_BLOCK_EDGES"])}
    assert access == {True, False}
    assert any("CRS of the results" in said for said in feedback.said)
    assert any("blocks: " in said for said in feedback.said)


def test_streets_that_enclose_nothing_are_an_error(find: Any, layer: Callable[..., Any]) -> None:
    from qgis.core import QgsProcessingException

    alone = layer([ACROSS], kind="LineString")
    with pytest.raises(QgsProcessingException, match="enclose nothing"):
        find(alone, **SINKS)
