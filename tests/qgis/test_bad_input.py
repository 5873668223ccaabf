"""What is wrong is said in sentences, in the way of QGIS, and nothing is half made."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import processing
from in_qgis import ID, TEMPORARY, rows, square
from qgis.core import (
    QgsFeatureRequest,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProject,
)

Run = Callable[..., dict[str, Any]]
BOW_TIE = "POLYGON ((0 0, 100 100, 100 0, 0 100, 0 0))"
DOUBLE_POINT = "POLYGON ((0 0, 100 0, 100 50, 150 50, 100 50, 100 100, 0 100, 0 0))"


def refused(run: Run, *boundary: Any, **parameters: Any) -> str:
    parameters = {"OUTPUT_PARCELS": TEMPORARY, **parameters}
    with pytest.raises(QgsProcessingException) as caught:
        run(*boundary, **parameters)
    said = str(caught.value)
    assert "Traceback" not in said
    assert "--" not in said  # options of the command line
    return said


@pytest.mark.parametrize(
    ("parameters", "words"),
    [
        ({}, "Give “Smallest parcel” (m²) or “Number of parcels” (a number)"),
        ({"PARCELS": 5, "MIN_AREA": 9}, "“Smallest parcel” or “Number of parcels”, not both"),
        ({"MIN_AREA": 0}, "“Smallest parcel” must be above 0 m²"),
        (
            {"PARCELS": 5, "WEIGHT_SIZE": 0, "WEIGHT_REGULARITY": 0, "WEIGHT_ACCESS": 0},
            "“Weight of equal size (λ1)”",
        ),
    ],
)
def test_values_that_do_not_go_together(
    run: Run, layer: Any, parameters: dict[str, Any], words: str
) -> None:
    assert words in refused(run, layer([square(100)]), **parameters)


@pytest.mark.parametrize(
    ("value", "words"),
    [
        ("many", "“Number of parcels” must be a number; got 'many'"),
        (2.5, "“Number of parcels” must be a whole number; got 2.5"),
        (-3, "PARCELS"),  # QGIS's own check of its limits
    ],
)
def test_numbers_that_are_none_or_out_of_range(
    run: Run, layer: Any, value: Any, words: str
) -> None:
    assert words in refused(run, layer([square(100)]), PARCELS=value)


def test_an_empty_layer(run: Run, layer: Any) -> None:
    assert "no features" in refused(run, layer([]), PARCELS=4)


def test_features_without_geometry(run: Run, layer: Any) -> None:
    assert "without geometry" in refused(run, layer([None, None]), PARCELS=4)


def test_a_layer_of_lines(run: Run, layer: Any) -> None:
    lines = layer(["LINESTRING (0 0, 9 9)"], kind="LineString")
    assert "holds 1 line, but no polygon" in refused(run, lines, PARCELS=4)


def test_no_layer_at_all(run: Run) -> None:
    assert "BOUNDARY" in refused(run, "nowhere.gpkg", PARCELS=4)


def test_a_layer_without_crs(run: Run, layer: Any, feedback: Any) -> None:
    land = layer([square(100)], crs="")
    said = refused(run, land, PARCELS=4)
    assert "land has no CRS" in said
    assert "Assign Projection" in said
    made = run(land, PARCELS=4, CRS="EPSG:25832", OUTPUT_PARCELS=TEMPORARY)["OUTPUT_PARCELS"]
    assert made.crs().authid() == "EPSG:25832"
    assert any("was taken for it" in said for said in feedback.said)


def test_a_crs_that_is_not_metric(run: Run, layer: Any) -> None:
    said = refused(run, layer([square(100)]), PARCELS=4, CRS="EPSG:4326")
    assert "must be projected and in metres" in said


def test_coordinates_that_do_not_fit_the_crs(run: Run, layer: Any) -> None:
    land = layer([square(100)], crs="EPSG:4326")
    assert "no place on the globe" in refused(run, land, PARCELS=4)


def check(how: str) -> Any:
    return getattr(QgsFeatureRequest.InvalidGeometryCheck, how)


def run_with(layer: Any, how: str, feedback: Any, **parameters: Any) -> dict[str, Any]:
    context = QgsProcessingContext()
    context.setFeedback(feedback)
    context.setInvalidGeometryCheck(check(how))
    named = {"BOUNDARY": layer, "PARCELS": 4, "OUTPUT_PARCELS": TEMPORARY, **parameters}
    results: dict[str, Any] = processing.run(ID, named, context=context, feedback=feedback)
    results["OUTPUT_PARCELS"] = (
        context.takeResultLayer(results["OUTPUT_PARCELS"].id()) or (results["OUTPUT_PARCELS"])
    )
    return results


def test_invalid_geometries_stop_the_run_where_the_settings_say_so(
    layer: Any, feedback: Any, provider: Any
) -> None:
    land = layer([square(100), BOW_TIE])
    with pytest.raises(QgsProcessingException, match="invalid geometry"):
        run_with(land, "GeometryAbortOnInvalid", feedback)


def test_invalid_geometries_are_left_out_where_the_settings_say_so(
    layer: Any, feedback: Any, provider: Any
) -> None:
    land = layer([square(100), BOW_TIE])
    results = run_with(land, "GeometrySkipInvalid", feedback, OUTPUT_BOUNDARY=TEMPORARY)
    assert rows(results["OUTPUT_BOUNDARY"])[0][1] == pytest.approx(10_000)


def test_invalid_geometries_are_repaired_where_nobody_looks_at_them(
    layer: Any, feedback: Any, provider: Any
) -> None:
    results = run_with(
        layer([DOUBLE_POINT]), "GeometryNoCheck", feedback, OUTPUT_BOUNDARY=TEMPORARY
    )
    assert rows(results["OUTPUT_BOUNDARY"])[0][1] == pytest.approx(10_000)
    assert any("was repaired" in said for said in feedback.said)
    with pytest.raises(QgsProcessingException, match="which side is land is not clear"):
        run_with(layer([BOW_TIE]), "GeometryNoCheck", feedback)


def test_fields_that_are_named_like_ours_do_no_harm(run: Run, layer: Any) -> None:
    fields = "&field=parcel_id:string&field=area_m2:string&field=fid:integer&field=part:double"
    made = run(layer([square(100)], fields=fields), PARCELS=4, OUTPUT_PARCELS=TEMPORARY)
    assert [row[0] for row in rows(made["OUTPUT_PARCELS"])] == [1, 2, 3, 4]
    assert made["OUTPUT_PARCELS"].fields().lookupField("fid") == -1


@pytest.mark.parametrize("name", ["OUTPUT", "PLOT", "OUTPUT_STREETS"])
def test_places_where_nothing_can_be_written_are_told_before_the_run(
    run: Run, layer: Any, tmp_path: Path, name: str, feedback: Any
) -> None:
    end = ".png" if name == "PLOT" else ".gpkg"
    land = layer([square(100)])
    missing = tmp_path / "missing" / f"a{end}"
    said = refused(run, land, PARCELS=4, **{name: str(missing)})
    assert "does not exist" in said
    folder = tmp_path / f"folder{end}"
    folder.mkdir()
    assert "is a folder" in refused(run, land, PARCELS=4, **{name: str(folder)})
    assert not any("Level" in text for text in feedback.texts)


def test_a_write_protected_file_is_told_before_the_run(
    run: Run, layer: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    locked = tmp_path / "locked.gpkg"
    locked.write_text("precious")
    can = os.access
    monkeypatch.setattr(os, "access", lambda p, mode: Path(p) != locked and can(p, mode))
    for name in ("OUTPUT", "OUTPUT_PARCELS"):
        said = refused(run, layer([square(100)]), PARCELS=4, **{name: str(locked)})
        assert "write-protected" in said
    assert locked.read_text() == "precious"


def test_a_layout_file_that_is_open_is_not_replaced(run: Run, layer: Any, tmp_path: Path) -> None:
    target = tmp_path / "open.gpkg"
    target.write_text("precious")
    (tmp_path / "open.gpkg-wal").touch()
    said = refused(run, layer([square(100)]), PARCELS=4, OUTPUT=str(target))
    assert "open in another program" in said
    assert target.read_text() == "precious"


def test_no_result_replaces_the_input_or_another_result(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    land = tmp_path / "land.gpkg"
    land.write_bytes(sample("rect").read_bytes())
    before = land.read_bytes()
    for name in ("OUTPUT", "OUTPUT_PARCELS"):
        said = refused(run, str(land), PARCELS=4, **{name: str(land)})
        assert "would replace the input" in said
    assert land.read_bytes() == before
    same = str(tmp_path / "same.gpkg")
    said = refused(run, str(land), PARCELS=4, OUTPUT_PARCELS=same, OUTPUT_STREETS=same)
    assert "Streets would replace Parcels" in said


def test_a_map_of_an_unknown_kind(run: Run, layer: Any, tmp_path: Path) -> None:
    said = refused(run, layer([square(100)]), PARCELS=4, PLOT=str(tmp_path / "map.bmp"))
    assert ".png, .svg, .pdf" in said
    assert not list(tmp_path.iterdir())


def test_a_sink_that_fails_is_a_sentence(run: Run, layer: Any, tmp_path: Path) -> None:
    said = refused(run, layer([square(100)]), PARCELS=4, OUTPUT_PARCELS="postgres://nowhere")
    assert "Could not create layer postgres://nowhere" in said


def test_more_parcels_than_fit_into_a_run(run: Run, layer: Any) -> None:
    said = refused(run, layer([square(100_000)]), MIN_AREA=100)
    assert "do not fit into one run" in said


def test_a_large_run_is_announced_as_a_warning(
    run: Run,
    layer: Any,
    feedback: Any,
    engine: Callable[[str], Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(engine("run"), "MANY_PARCELS", 3)
    run(layer([square(100)]), PARCELS=4, OUTPUT_PARCELS=TEMPORARY)
    assert any("about 4 parcels" in warning for warning in feedback.warned)


def test_a_certificate_that_does_not_hold_is_said(
    run: Run,
    layer: Any,
    feedback: Any,
    engine: Callable[[str], Any],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    module = engine("engine.metrics.measured")
    whole = module.certificate

    def broken(layout: Any) -> Any:
        certified = whole(layout)
        first = certified.checks[0]
        failed = type(first)(first.name, False, 1.0, 0.0, "1 parcels that are broken.")
        return type(certified)((failed, *certified.checks[1:]))

    monkeypatch.setattr(module, "certificate", broken)
    results = run(layer([square(100)]), PARCELS=4, OUTPUT_PARCELS=TEMPORARY)
    assert results["OUTPUT_PARCELS"].featureCount() == 4
    (error,) = feedback.errors
    assert "not all that it promises holds" in error
    assert "1 parcels that are broken." in error


@pytest.mark.parametrize("moment", ["levels", "cleaning", "measuring"])
def test_a_cancelled_run_leaves_nothing(
    run: Run, layer: Any, feedback: Any, tmp_path: Path, moment: str
) -> None:
    words = {"levels": "Level 2", "cleaning": "Cleaning", "measuring": "Measuring"}[moment]

    def stop(text: str) -> None:
        if words in text:
            feedback.cancel()

    feedback.setProgressText = stop
    before = set(QgsProject.instance().mapLayers())
    with pytest.raises(QgsProcessingException, match="Cancelled"):
        run(
            layer([square(400)]),
            PARCELS=60,
            OUTPUT_PARCELS=str(tmp_path / "parcels.gpkg"),
            OUTPUT=str(tmp_path / "layout.gpkg"),
            PLOT=str(tmp_path / "map.png"),
        )
    assert list(tmp_path.iterdir()) == []
    assert set(QgsProject.instance().mapLayers()) == before


def test_cancelling_while_features_are_read(run: Run, layer: Any, feedback: Any) -> None:
    feedback.cancel()
    with pytest.raises(QgsProcessingException, match="Cancelled"):
        run(layer([square(400)]), PARCELS=60, OUTPUT_PARCELS=TEMPORARY)


def test_a_python_that_is_too_old_is_told(
    plugins: Path, qgis_app: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    import importlib

    package = importlib.import_module("urban_processing_qgis")
    said: list[str] = []

    class Bar:
        def pushMessage(self, title: str, text: str, level: Any) -> None:
            said.append(text)

    class Interface:
        def messageBar(self) -> Bar:
            return Bar()

    monkeypatch.setattr(sys, "version_info", (3, 9, 18, "final", 0))
    plugin = package.classFactory(Interface())
    plugin.initGui()
    assert plugin.provider is None
    assert "needs Python 3.11 or newer, and this QGIS has 3.9" in said[0]
    plugin.unload()


def test_values_are_checked_where_nobody_has_looked_before(
    provider: Any, layer: Any, feedback: Any
) -> None:
    """As in a model, which runs its steps without checking their values."""
    from qgis.core import QgsApplication

    algorithm = QgsApplication.processingRegistry().createAlgorithmById(ID)
    context = QgsProcessingContext()
    land = layer([square(100)])
    _, good = algorithm.run({"BOUNDARY": land, "PARCELS": 4, "MIN_AREA": 9}, context, feedback)
    assert not good
    assert "“Smallest parcel” or “Number of parcels”, not both" in "\n".join(feedback.errors)


def test_an_invalid_geometry_does_not_harm_later_runs(
    layer: Any, feedback: Any, provider: Any
) -> None:
    """In a task as the dialog starts it: QGIS's own stop would break the interpreter."""
    from qgis.core import QgsApplication, QgsProcessingAlgRunnerTask

    bad, good = layer([square(100), BOW_TIE]), layer([square(100)])
    context = QgsProcessingContext()
    context.setInvalidGeometryCheck(check("GeometryAbortOnInvalid"))
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(ID)
    for land, works in ((bad, False), (good, True)) * 3:
        parameters = {"BOUNDARY": land, "PARCELS": 4, "OUTPUT_PARCELS": TEMPORARY}
        outcome: list[bool] = []
        task = QgsProcessingAlgRunnerTask(algorithm, parameters, context, feedback)
        task.executed.connect(lambda done, results, to=outcome: to.append(done))
        QgsApplication.taskManager().addTask(task)
        while not outcome:
            QgsApplication.processEvents()
        assert outcome == [works]
    assert any("has an invalid geometry" in error for error in feedback.errors)


def test_an_unknown_crs_is_no_silence(run: Run, layer: Any) -> None:
    for text in ("EPSG:999999", "bogus"):
        said = refused(run, layer([square(100)]), PARCELS=4, CRS=text)
        assert f"“CRS to work in” is not known: '{text}'" in said


def test_results_replace_nothing_by_other_names_of_files(
    run: Run, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    land = tmp_path / "land.gpkg"
    land.write_bytes(sample("rect").read_bytes())
    before = land.read_bytes()
    # QGIS adds the suffix by itself
    said = refused(run, str(land), PARCELS=4, OUTPUT_PARCELS=str(land.with_suffix("")))
    assert "would replace the input" in said
    table = f"ogr:dbname='{land}' table=\"boundary\" (geom)"
    source = f"{land}|layername=boundary"
    assert "would replace the input" in refused(run, source, PARCELS=4, OUTPUT_PARCELS=table)
    same = str(tmp_path / "same")
    said = refused(run, source, PARCELS=4, OUTPUT_PARCELS=same, OUTPUT_STREETS=f"{same}.gpkg")
    assert "Streets would replace Parcels" in said
    assert land.read_bytes() == before
    # another table of the input's file harms nothing
    run(source, PARCELS=4, OUTPUT_PARCELS=table.replace("boundary", "parcels"))
    import pyogrio

    assert sorted(pyogrio.list_layers(land)[:, 0]) == ["boundary", "parcels"]


def test_a_layout_file_of_the_project_is_not_replaced(
    layer: Any, sample: Callable[[str], Path], tmp_path: Path, feedback: Any, provider: Any
) -> None:
    from qgis.core import QgsVectorLayer

    target = tmp_path / "layout.gpkg"
    target.write_bytes(sample("rect").read_bytes())
    opened = QgsVectorLayer(f"{target}|layername=boundary", "boundary", "ogr")
    QgsProject.instance().addMapLayer(opened)
    context = QgsProcessingContext()
    context.setProject(QgsProject.instance())
    try:
        with pytest.raises(QgsProcessingException, match="is open in this project"):
            processing.run(
                ID,
                {"BOUNDARY": layer([square(100)]), "PARCELS": 4, "OUTPUT": str(target)},
                context=context,
                feedback=feedback,
            )
    finally:
        QgsProject.instance().removeMapLayer(opened.id())
