"""`measure` and `compare` inside QGIS: files and layers, sinks, reports, and what is wrong."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import pyogrio
import shapely
from click.testing import CliRunner
from in_qgis import TEMPORARY, rows
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsCoordinateTransform,
    QgsGeometry,
    QgsProcessingException,
    QgsProcessingFeatureSourceDefinition,
    QgsProject,
)

import urban_processing as up
from urban_processing.cli.app import app

CRS = "EPSG:32630"
X, Y = 500_000.0, 5_700_000.0
MEASURE, COMPARE = "urban_processing:measure", "urban_processing:compare"
PARCELS, STREETS, BLOCKS = "OUTPUT_PARCELS", "OUTPUT_STREETS", "OUTPUT_BLOCKS"
METRICS, ISSUES = "OUTPUT_METRICS", "OUTPUT_ISSUES"
SINKS = dict.fromkeys((PARCELS, STREETS, BLOCKS, METRICS, ISSUES), TEMPORARY)

Algorithm = Callable[..., dict[str, Any]]


def placed(geometry: Any) -> Any:
    return shapely.transform(geometry, lambda xy: xy + np.array((X, Y)))


PLOTS = [placed(shapely.box(20 * i, y, 20 * i + 20, y + 40)) for y in (4, 52) for i in range(6)]
LINES = [placed(shapely.LineString([(0, y), (120, y)])) for y in (0, 48, 96)]
LINES += [placed(shapely.LineString([(x, 0), (x, 96)])) for x in (0, 120)]
LAND, WEST = placed(shapely.box(0, 0, 120, 96)), placed(shapely.box(0, 0, 60, 96))


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("layouts")
    up.cogenerate(LAND, crs=CRS, min_area=500).save(folder / "layout.gpkg")
    up.cogenerate(LAND, crs=CRS, min_area=900).save(folder / "other.gpkg")
    return folder


@pytest.fixture
def plots(layer: Callable[..., Any]) -> Any:
    return layer([p.wkt for p in PLOTS], CRS, name="plots")


@pytest.fixture
def streets(layer: Callable[..., Any]) -> Any:
    return layer([line.wkt for line in LINES], CRS, "LineString", name="roads")


@pytest.fixture
def run(provider: Any, feedback: Any) -> Algorithm:
    import processing

    def call(name: str, **parameters: Any) -> dict[str, Any]:
        results: dict[str, Any] = processing.run(name, parameters, feedback=feedback)
        return results

    return call


@pytest.fixture
def refused(run: Algorithm) -> Callable[..., str]:
    """The sentences that a run fails with."""

    def call(name: str, **parameters: Any) -> str:
        with pytest.raises(QgsProcessingException) as error:
            run(name, **parameters)
        return str(error.value)

    return call


def table(made: Any) -> list[dict[str, Any]]:
    names = [field.name() for field in made.fields()]
    return [dict(zip(names, row, strict=True)) for row in rows(made)]


def metrics(made: Any) -> dict[str, float | None]:
    return {row["metric"]: row["value"] for row in table(made) if row["part"] is None}


def in_csv(path: Path) -> dict[str, dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return {row["metric"]: row for row in csv.DictReader(file)}


# ---- measure


def test_a_layout_file_gives_the_figures_of_the_command_line(
    run: Algorithm, folder: Path, tmp_path: Path, feedback: Any
) -> None:
    file, mine = (
        folder / "layout.gpkg",
        {e: tmp_path / f"qgis.{e}" for e in ("html", "json", "csv")},
    )
    out, picture = tmp_path / "qgis.gpkg", tmp_path / "map.png"
    results = run(
        MEASURE,
        LAYOUT=str(file),
        **{"REPORT": str(mine["html"]), "JSON": str(mine["json"]), "CSV": str(mine["csv"])},
        OUTPUT=str(out),
        PLOT=str(picture),
        **SINKS,
    )
    theirs = {e: tmp_path / f"cli.{e}" for e in mine}
    call = ["measure", file, "-o", tmp_path / "cli.gpkg", "--report", theirs["html"]]
    call += ["--json", theirs["json"], "--csv", theirs["csv"]]
    assert CliRunner().invoke(app, [str(c) for c in call]).exit_code == 0
    for ending, path in mine.items():
        assert path.read_text() == theirs[ending].read_text(), ending
    assert json.loads(mine["json"].read_text())["title"] == "layout"
    known = pyogrio.read_dataframe(tmp_path / "cli.gpkg", layer="metrics")
    whole = known[known.part.isna()].set_index("metric").value
    for name, value in metrics(results[METRICS]).items():
        assert value == (None if np.isnan(whole[name]) else pytest.approx(whole[name])), name
    assert len(table(results[PARCELS])) == whole["parcels"]
    assert set(pyogrio.list_layers(out)[:, 0]) == set(
        pyogrio.list_layers(tmp_path / "cli.gpkg")[:, 0]
    )
    assert picture.read_bytes().startswith(b"\x89PNG")
    assert any(said.startswith("parcels: ") for said in feedback.said)
    assert f"CRS of the results: {CRS}" in " ".join(feedback.said)


def test_layers_of_parcels_and_streets(
    run: Algorithm, plots: Any, streets: Any, tmp_path: Path
) -> None:
    out = tmp_path / "m.csv"
    results = run(MEASURE, PARCEL_LAYER=plots, STREET_LAYER=streets, CSV=str(out), **SINKS)
    known = up.measure(parcels=gdf(PLOTS), streets=gdf(LINES))
    for name, value in metrics(results[METRICS]).items():
        wanted = known.metric(name)
        assert value == (None if np.isnan(wanted) else pytest.approx(wanted, rel=1e-9)), name
    assert in_csv(out)["parcels"]["plots"] == "12.0"
    assert len(table(results[BLOCKS])) == 2
    assert {row["undesirable"] for row in table(results[PARCELS])} <= {False, True}
    assert results[PARCELS].crs().authid() == CRS


def gdf(geometries: list[Any]) -> Any:
    import geopandas as gpd

    return gpd.GeoSeries(geometries, crs=CRS)


def test_selected_features_in_land(
    run: Algorithm, plots: Any, streets: Any, layer: Callable[..., Any], feedback: Any
) -> None:
    plots.selectByIds([f.id() for f in plots.getFeatures()][:6])
    chosen = QgsProcessingFeatureSourceDefinition(plots.id(), selectedFeaturesOnly=True)
    QgsProject.instance().addMapLayers([plots])
    try:
        results = run(MEASURE, PARCEL_LAYER=chosen, STREET_LAYER=streets, **SINKS)
        assert metrics(results[METRICS])["parcels"] == 6
        west = layer([WEST.wkt], CRS)
        results = run(MEASURE, PARCEL_LAYER=chosen, STREET_LAYER=streets, LAND=west, **SINKS)
    finally:
        QgsProject.instance().takeMapLayer(plots)
    assert metrics(results[METRICS])["parcels"] == 3
    assert "parcels_outside" in {row["code"] for row in table(results[ISSUES])}
    assert any("3 parcel(s) lie outside the land" in said for said in feedback.said)


def test_layers_in_other_crss(
    run: Algorithm, plots: Any, layer: Callable[..., Any], feedback: Any
) -> None:
    there = QgsCoordinateReferenceSystem("EPSG:25830")
    way = QgsCoordinateTransform(QgsCoordinateReferenceSystem(CRS), there, QgsProject.instance())
    texts = []
    for line in LINES:
        geometry = QgsGeometry.fromWkt(line.wkt)
        geometry.transform(way)
        texts.append(geometry.asWkt(6))
    moved = layer(texts, "EPSG:25830", "LineString", name="roads")
    results = run(MEASURE, PARCEL_LAYER=plots, STREET_LAYER=moved, **SINKS)
    assert any("they were reprojected to" in said for said in feedback.said)
    assert metrics(results[METRICS])["unreached"] == 0
    results = run(MEASURE, PARCEL_LAYER=plots, CRS="EPSG:25830", **SINKS)
    assert results[PARCELS].crs().authid() == "EPSG:25830"


def test_a_layer_without_a_crs_is_given_one(
    run: Algorithm, refused: Callable[..., str], layer: Callable[..., Any]
) -> None:
    bare = layer([p.wkt for p in PLOTS], "", name="plots")
    assert "plots has no CRS." in refused(MEASURE, PARCEL_LAYER=bare, **SINKS)
    results = run(MEASURE, PARCEL_LAYER=bare, CRS=CRS, **SINKS)
    assert metrics(results[METRICS])["parcels"] == 12


def test_styles_and_a_group_for_the_layers_that_were_measured(
    provider: Any, feedback: Any, folder: Path
) -> None:
    import processing

    results = processing.runAndLoadResults(
        MEASURE, {"LAYOUT": str(folder / "layout.gpkg"), **SINKS}, feedback=feedback
    )
    project = QgsProject.instance()
    try:
        (group,) = project.layerTreeRoot().children()
        assert group.name() == "layout, measure"
        names = [child.name() for child in group.children()]
        assert names.index("Streets") < names.index("Parcels")
        parcels = project.mapLayer(results[PARCELS])
        assert parcels.attributeDisplayName(parcels.fields().indexOf("area_m2")) == "Area [m²]"
    finally:
        project.clear()


def test_a_cancelled_run_leaves_nothing(
    provider: Any, feedback: Any, folder: Path, tmp_path: Path
) -> None:
    import processing

    feedback.progressChanged.connect(lambda share: feedback.cancel() if share > 20 else None)
    call = {"LAYOUT": str(folder / "layout.gpkg"), "REPORT": str(tmp_path / "r.html"), **SINKS}
    with pytest.raises(QgsProcessingException):
        processing.run(MEASURE, call, feedback=feedback)
    assert not list(tmp_path.iterdir())


# ---- compare


def test_two_layout_files(run: Algorithm, folder: Path, tmp_path: Path) -> None:
    files = [str(folder / "layout.gpkg"), str(folder / "other.gpkg")]
    mine, theirs = tmp_path / "qgis.json", tmp_path / "cli.json"
    results = run(
        COMPARE,
        LAYOUTS=files,
        REFERENCE="other",
        JSON=str(mine),
        REPORT=str(tmp_path / "r.html"),
        OUTPUT_COMPARISON=TEMPORARY,
        OUTPUT_DISTANCES=TEMPORARY,
    )
    call = ["compare", *files, "--reference", "other", "--json", str(theirs)]
    assert CliRunner().invoke(app, call).exit_code == 0
    assert mine.read_text() == theirs.read_text()
    assert {row["reference"] for row in table(results["OUTPUT_COMPARISON"])} == {"other"}
    assert {row["side"] for row in table(results["OUTPUT_DISTANCES"])} == {"layout"}
    assert "<title>" in (tmp_path / "r.html").read_text()


def test_a_layout_and_what_is_there(
    run: Algorithm, folder: Path, plots: Any, streets: Any, tmp_path: Path, feedback: Any
) -> None:
    results = run(
        COMPARE,
        LAYOUTS=[str(folder / "layout.gpkg")],
        PARCEL_LAYER=plots,
        STREET_LAYER=streets,
        CSV=str(tmp_path / "c.csv"),
        OUTPUT_COMPARISON=TEMPORARY,
    )
    assert {row["reference"] for row in table(results["OUTPUT_COMPARISON"])} == {"real"}
    found = up.compare(folder / "layout.gpkg", parcels=gdf(PLOTS), streets=gdf(LINES))
    wanted = found.sides["real"]
    for name, row in in_csv(tmp_path / "c.csv").items():
        if row["real"]:
            assert float(row["real"]) == pytest.approx(wanted.metric(name), rel=1e-9), name
    streets_alone = run(
        COMPARE,
        LAYOUTS=[str(folder / "layout.gpkg")],
        STREET_LAYER=streets,
        OUTPUT_COMPARISON=TEMPORARY,
    )
    assert len(table(streets_alone["OUTPUT_COMPARISON"])) > 20


# ---- bad input


def test_what_cannot_be_measured(
    refused: Callable[..., str], folder: Path, plots: Any, streets: Any, tmp_path: Path,
    layer: Callable[..., Any],
) -> None:  # fmt: skip
    file = str(folder / "layout.gpkg")
    assert "Give “Layout file”, or layers of parcels, streets, or both." in refused(MEASURE)
    said = refused(MEASURE, LAYOUT=file, STREET_LAYER=streets)
    assert "Give “Layout file”, or layers, not both." in said
    assert "A layout is ready as it is" in refused(MEASURE, LAYOUT=file, CRS=CRS)
    assert "does not exist" in refused(MEASURE, LAYOUT=str(tmp_path / "none.gpkg"))
    plain = tmp_path / "plain.gpkg"
    gdf(PLOTS).to_frame("geometry").to_file(plain)
    assert "was not made by this software" in refused(MEASURE, LAYOUT=str(plain))
    blocks = up.find_blocks(gdf(LINES).to_frame("geometry")).save(tmp_path / "blocks.gpkg")
    said = refused(MEASURE, LAYOUT=str(blocks))
    assert "There are neither parcels nor streets in " in said
    far = layer(
        [shapely.transform(p, lambda xy: xy + 90_000).wkt for p in LINES], CRS, "LineString"
    )
    assert "do not overlap" in refused(MEASURE, PARCEL_LAYER=plots, STREET_LAYER=far)
    assert "no polygon" in refused(MEASURE, PARCEL_LAYER=streets)
    said = refused(MEASURE, PARCEL_LAYER=plots, DEFAULT_WIDTH=0)
    assert "“Width of other streets” must be above 0 m; got 0" in said


def test_what_cannot_be_compared(
    refused: Callable[..., str], folder: Path, tmp_path: Path, layer: Callable[..., Any]
) -> None:
    file = str(folder / "layout.gpkg")
    assert "A comparison needs two sides" in refused(COMPARE, LAYOUTS=[file])
    said = refused(COMPARE, LAYOUTS=[file, str(folder / "other.gpkg")], REFERENCE="x")
    assert "There is no side called 'x' to compare with: the sides are layout, other." in said
    none, nor = tmp_path / "none.gpkg", tmp_path / "nor.gpkg"
    said = refused(COMPARE, LAYOUTS=[str(none), str(nor)])
    assert f"The file {none} does not exist.\nThe file {nor} does not exist." in said
    said = refused(COMPARE, LAYOUTS=[file, file], LAND=layer([LAND.wkt], CRS))
    assert "Land is for what is there" in said


def test_no_result_replaces_an_input(
    refused: Callable[..., str], folder: Path, tmp_path: Path
) -> None:
    file, other = folder / "layout.gpkg", folder / "other.gpkg"
    before = file.read_bytes()
    assert "would replace the input" in refused(MEASURE, LAYOUT=str(file), OUTPUT=str(file))
    said = refused(COMPARE, LAYOUTS=[str(other), str(file)], OUTPUT=str(file))
    assert "would replace the input" in said
    assert file.read_bytes() == before
    said = refused(MEASURE, LAYOUT=str(file), REPORT=str(tmp_path / "r.txt"))
    assert "must end in .html" in said
    assert not list(tmp_path.iterdir())
