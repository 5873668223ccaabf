"""Runs inside QGIS give what the library gives."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import geopandas as gpd
import pandas as pd
import pyogrio
import shapely
from in_qgis import TEMPORARY, rows, shapes, square
from qgis.core import (
    QgsProcessingFeatureSourceDefinition,
)

import urban_processing as up
from urban_processing.schema import LAID_OUT, GeometryType, layer

Run = Callable[..., dict[str, Any]]


@pytest.mark.parametrize(
    "name", ["rect", "triangle", "ellipse", "irregular_64ha", "sant_adria", "planken"]
)
def test_layers_are_those_of_the_library(
    run: Run, sample: Callable[[str], Path], name: str
) -> None:
    sinks = {f"OUTPUT_{each.name.upper()}": TEMPORARY for each in LAID_OUT}
    results = run(str(sample(name)), PARCELS=60, PATTERN=1, SEED=3, **sinks)
    expected = up.cogenerate(sample(name), parcels=60, pattern="cul-de-sac", seed=3)
    for each in LAID_OUT:
        made = results[f"OUTPUT_{each.name.upper()}"]
        frame = expected.frame(each.name)
        assert [f.name() for f in made.fields()] == list(each.column_names)
        assert made.featureCount() == len(frame)
        if each.name in ("provenance", "metrics"):
            continue  # with the seconds that the library's run took
        values = frame.drop(columns="geometry").astype(object)
        for row, wanted in zip(rows(made), values.to_numpy().tolist(), strict=True):
            for value, given in zip(row, wanted, strict=True):
                if isinstance(value, float):
                    assert value == pytest.approx(given, rel=1e-9, abs=1e-9)
                elif value is None:
                    assert pd.isna(given)
                else:
                    assert value == given
        if each.geometry is GeometryType.ANY:
            continue  # places inside the areas
        assert made.crs().authid() == str(expected.crs)
        found = np.array(shapes(made), dtype=object)
        assert shapely.equals_exact(
            shapely.normalize(found), shapely.normalize(np.asarray(frame.geometry)), 1e-6
        ).all()


def test_issues_are_shown_at_places(run: Run, layer: Any) -> None:
    # two squares, one of them too small for a parcel: an area becomes a place inside it
    land = layer([square(200), square(20, x=691_000.0)])
    made = run(land, MIN_AREA=2000, OUTPUT_ISSUES=TEMPORARY)["OUTPUT_ISSUES"]
    column = {field.name(): i for i, field in enumerate(made.fields())}
    found = {
        row[column["code"]]: shape for row, shape in zip(rows(made), shapes(made), strict=True)
    }
    place = found["part_below_min_area"]
    assert place.geom_type == "Point"
    assert shapely.from_wkt(square(20, x=691_000.0)).contains(place)


def test_the_layout_file_is_that_of_the_command_line(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    inside, outside = tmp_path / "qgis.gpkg", tmp_path / "cli.gpkg"
    run(str(sample("sant_adria")), PARCELS=80, OUTPUT=str(inside))
    up.cogenerate(sample("sant_adria"), parcels=80).save(outside)
    for name in pyogrio.list_layers(outside)[:, 0]:
        if name == "layer_styles":
            continue
        ours, theirs = (pyogrio.read_dataframe(p, layer=name) for p in (inside, outside))
        assert list(ours.columns) == list(theirs.columns)
        assert ours.equals(theirs), name
        if "geometry" in ours:
            assert ours.crs == theirs.crs
            assert (
                (pyogrio.read_info(inside, layer=name)["geometry_type"])
                == (pyogrio.read_info(outside, layer=name)["geometry_type"])
            )
    for query in (
        "SELECT table_name, identifier, data_type, last_change FROM gpkg_contents ORDER BY 1",
        "SELECT f_table_name, styleName, styleQML, useAsDefault FROM layer_styles ORDER BY 1",
        "SELECT * FROM gpkg_data_columns ORDER BY 1, 2",
        "SELECT * FROM gpkg_metadata",
    ):
        contents = []
        for path in (inside, outside):
            with closing(sqlite3.connect(path)) as connection:
                contents.append(connection.execute(query).fetchall())
        assert contents[0] == contents[1]
    again = up.read_layout(inside)
    assert again.certificate.holds
    assert [p.name for p in tmp_path.glob("qgis*")] == ["qgis.gpkg"]


def test_the_same_run_gives_the_same_bytes(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    files = [tmp_path / "a.gpkg", tmp_path / "b.gpkg"]
    for file in files:
        run(str(sample("ellipse")), PARCELS=40, OUTPUT=str(file))
    assert files[0].read_bytes() == files[1].read_bytes()


def test_a_map_is_that_of_the_library(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    results = run(str(sample("rect")), PARCELS=30, PLOT=str(tmp_path / "inside.svg"))
    assert results["PLOT"] == str(tmp_path / "inside.svg")
    up.cogenerate(sample("rect"), parcels=30).plot(tmp_path / "outside.svg")
    assert (tmp_path / "inside.svg").read_bytes() == (tmp_path / "outside.svg").read_bytes()


def test_sinks_go_to_files_of_any_format(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    results = run(
        str(sample("planken")),
        PARCELS=40,
        OUTPUT_PARCELS=str(tmp_path / "parcels.gpkg"),
        OUTPUT_STREETS=str(tmp_path / "streets.geojson"),
        OUTPUT_METRICS=str(tmp_path / "metrics.csv"),
        OUTPUT_ISSUES=str(tmp_path / "issues.fgb"),
    )
    assert set(results) == {f"OUTPUT_{n}" for n in ("PARCELS", "STREETS", "METRICS", "ISSUES")}
    parcels = gpd.read_file(tmp_path / "parcels.gpkg")
    assert len(parcels) == 40
    assert set(layer("parcels").column_names) <= set(parcels.columns)
    assert parcels.rim.dtype == bool
    assert len(gpd.read_file(tmp_path / "streets.geojson")) > 4
    text = (tmp_path / "metrics.csv").read_text(encoding="utf-8")
    assert "irregularity_mean" in text


def test_only_the_selected_features_are_laid_out(run: Run, layer: Any) -> None:
    land = layer([square(300), square(200, x=691_000.0)])
    land.selectByIds([2])
    chosen = QgsProcessingFeatureSourceDefinition(land.id(), selectedFeaturesOnly=True)
    from qgis.core import QgsProject

    QgsProject.instance().addMapLayer(land)
    try:
        made = run(chosen, PARCELS=8, OUTPUT_BOUNDARY=TEMPORARY)["OUTPUT_BOUNDARY"]
    finally:
        QgsProject.instance().removeMapLayer(land.id())
    ((area,),) = [row[1:] for row in rows(made)]
    assert area == pytest.approx(40_000, rel=1e-9)


def test_corners_come_from_a_layer_of_points(run: Run, layer: Any, feedback: Any) -> None:
    land = layer([square(300)])
    xy = shapely.get_coordinates(shapely.from_wkt(square(300)))[:4]
    corners = layer([f"POINT ({x} {y})" for x, y in xy], kind="Point", name="corners")
    outcome = run(land, PARCELS=10, CORNERS=corners, OUTPUT_PARCELS=TEMPORARY)
    assert outcome["OUTPUT_PARCELS"].featureCount() == 10
    far = layer(["POINT (0 0)"], kind="Point", name="corners")
    with pytest.raises(Exception, match="Corner 1 lies"):
        run(land, PARCELS=10, CORNERS=far, OUTPUT_PARCELS=TEMPORARY)


def test_streets_obstacles_and_entries_come_from_layers(run: Run, layer: Any) -> None:
    land = layer([square(300)])
    x, y = 690_000.0, 5_700_000.0
    roads = layer(
        [f"LINESTRING ({x - 9} {y + 100}, {x + 309} {y + 120})"] * 2,
        kind="LineString",
        fields="&field=class:string&field=width_m:double",
    )
    first = next(iter(roads.getFeatures())).id()
    roads.dataProvider().changeAttributeValues({first: {0: "main road", 1: 21.5}})
    lake = layer([square(60, x=x + 200, y=y + 200)])
    gate = layer([f"POINT ({x} {y + 50})"], kind="Point")
    outcome = run(
        land,
        PARCELS=20,
        STREETS=roads,
        OBSTACLES=lake,
        ENTRIES=gate,
        OUTPUT_STREETS=TEMPORARY,
        OUTPUT_OBSTACLES=TEMPORARY,
        OUTPUT_JUNCTIONS=TEMPORARY,
    )
    streets = outcome["OUTPUT_STREETS"]
    given = [f for f in streets.getFeatures() if str(f["fixed_id"]) != "NULL"]
    assert {(f["class"], f["width_m"]) for f in given} == {("main road", 21.5)}
    (water,) = shapes(outcome["OUTPUT_OBSTACLES"])
    assert water.area == pytest.approx(3600, rel=1e-6)
    assert "entry" in {f["kind"] for f in outcome["OUTPUT_JUNCTIONS"].getFeatures()}


def test_contradictions_of_layers_and_values_are_said_in_the_dialogs_words(
    run: Run, layer: Any
) -> None:
    land = layer([square(300)])
    edge = layer(["LINESTRING (690000 5700000, 690300 5700000)"], kind="LineString")
    with pytest.raises(Exception, match=r"“Streets on the rim” none speaks.*“Rim lines”"):
        run(land, PARCELS=9, RIM=1, RIM_LINES=edge, OUTPUT_PARCELS=TEMPORARY)


def test_multipolygons_heights_and_curves_are_read(run: Run, layer: Any) -> None:
    land = layer(
        [
            "CURVEPOLYGON (COMPOUNDCURVE (CIRCULARSTRING (690000 5700000, 690100 5700100, "
            "690200 5700000), (690200 5700000, 690000 5700000)))"
        ],
        kind="CurvePolygon",
    )
    made = run(land, PARCELS=6, SIMPLIFY=0.1, OUTPUT_BOUNDARY=TEMPORARY)["OUTPUT_BOUNDARY"]
    assert rows(made)[0][1] == pytest.approx(np.pi * 100**2 / 2, rel=1e-3)
    heights = layer(
        ["MULTIPOLYGON Z (((0 0 5, 90 0 5, 90 90 5, 0 90 5, 0 0 5)))"], kind="MultiPolygonZ"
    )
    made = run(heights, PARCELS=4, OUTPUT_PARCELS=TEMPORARY)["OUTPUT_PARCELS"]
    assert made.featureCount() == 4


def test_progress_goes_from_nothing_to_all_and_figures_are_said(
    run: Run, sample: Callable[[str], Path], feedback: Any
) -> None:
    run(str(sample("ellipse")), PARCELS=100, OUTPUT_PARCELS=TEMPORARY)
    assert feedback.fractions == sorted(feedback.fractions)
    assert feedback.fractions[-1] >= 90
    assert any("Level 3" in text for text in feedback.texts)
    said = "\n".join(feedback.said)
    assert "Expected: about 100 parcels" in said
    assert "parcels: 100 of" in said
    assert "certificate: holds" in said
    assert feedback.errors == []
