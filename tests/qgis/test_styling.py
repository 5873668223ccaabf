"""Loaded results: grouped and named, styled, readable on white and on a street map."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import processing
from in_qgis import ID, TEMPORARY, square
from processing.core.ProcessingConfig import ProcessingConfig
from processing.gui.Postprocessing import handleAlgorithmResults
from qgis.core import (
    QgsApplication,
    QgsFeatureRequest,
    QgsMapRendererParallelJob,
    QgsMapSettings,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProject,
    QgsRenderContext,
)
from qgis.PyQt.QtCore import QSize
from qgis.PyQt.QtGui import QColor, QImage

import urban_processing as up
from urban_processing.schema import layer as declared

SHOWN = ["Issues", "Junctions and street ends", "Streets", "Parcels"]


@pytest.fixture
def project(qgis_app: Any) -> Any:
    made = QgsProject.instance()
    made.clear()
    yield made
    made.clear()


@pytest.fixture
def load(provider: Any, project: Any) -> Callable[..., dict[str, Any]]:
    """Run an algorithm and load what it made, as the dialog does."""

    def call(boundary: Any, **parameters: Any) -> dict[str, Any]:
        context = QgsProcessingContext()
        context.setProject(project)
        context.setInvalidGeometryCheck(
            QgsFeatureRequest.InvalidGeometryCheck.GeometryAbortOnInvalid
        )
        feedback = QgsProcessingFeedback()
        algorithm = QgsApplication.processingRegistry().createAlgorithmById(ID)
        sinks = {f"OUTPUT_{n}": TEMPORARY for n in ("PARCELS", "STREETS", "JUNCTIONS", "ISSUES")}
        named = {"BOUNDARY": boundary, **sinks, **parameters}
        named = {key: value for key, value in named.items() if value is not None}
        for definition in algorithm.destinationParameterDefinitions():
            if named.get(definition.name()) == TEMPORARY:
                from qgis.core import QgsProcessingOutputLayerDefinition

                named[definition.name()] = QgsProcessingOutputLayerDefinition(TEMPORARY, project)
        results, good = algorithm.run(named, context, feedback)
        assert good
        assert handleAlgorithmResults(algorithm, context, feedback, parameters=named)
        return results  # type: ignore[no-any-return]

    return call


def group_names(project: Any) -> list[str]:
    return [group.name() for group in project.layerTreeRoot().findGroups()]


def test_results_stand_in_a_group_from_top_to_bottom(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path], provider: Any
) -> None:
    load(str(sample("ellipse")), PARCELS=40, SEED=7)
    assert group_names(project) == ["ellipse, cogenerate, seed 7"]
    (group,) = project.layerTreeRoot().findGroups()
    assert [node.name() for node in group.findLayers()] == SHOWN
    assert len(project.mapLayers()) == len(SHOWN)
    # nobody needs the styles any more
    assert provider.styles == []


def test_a_second_run_has_a_group_of_its_own(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    for seed in (1, 2):
        load(str(sample("ellipse")), PARCELS=20, SEED=seed)
    root = project.layerTreeRoot()
    assert [node.name() for node in root.children()] == [
        "ellipse, cogenerate, seed 2",
        "ellipse, cogenerate, seed 1",
    ]
    for group in root.findGroups():
        assert [node.name() for node in group.findLayers()] == SHOWN
    QgsApplication.processEvents()
    assert len(project.mapLayers()) == 2 * len(SHOWN)


def test_the_group_of_results_in_the_settings_is_respected(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    name = ProcessingConfig.RESULTS_GROUP_NAME
    ProcessingConfig.setSettingValue(name, "Results")
    try:
        load(str(sample("rect")), PARCELS=10)
    finally:
        ProcessingConfig.setSettingValue(name, "")
    (results,) = project.layerTreeRoot().children()
    assert results.name() == "Results"
    assert [node.name() for node in results.findGroups()] == ["rect, cogenerate, seed 0"]


def test_columns_have_readable_names(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    load(str(sample("rect")), PARCELS=10, OUTPUT_METRICS=TEMPORARY)
    for name in ("parcels", "streets", "junctions", "issues", "metrics"):
        each = declared(name)
        (made,) = project.mapLayersByName(each.title)
        assert [f.alias() for f in made.fields()] == [c.label for c in each.columns]


def test_layers_say_what_their_columns_mean_and_how_they_were_made(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    load(str(sample("rect")), PARCELS=10, SEED=5)
    (made,) = project.mapLayersByName("Parcels")
    for column in declared("parcels").columns:
        assert f"{column.name}: {column.description}" in made.metadata().abstract()
    (step,) = made.metadata().history()
    assert step.startswith(f"cogenerate {up.__version__}")
    assert '"parcels": 10' in step
    assert "seed 5" in step
    assert up.cogenerate(sample("rect"), parcels=10).layout.history[0].input_sha256 in step


def test_every_feature_has_a_symbol(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    load(str(sample("planken")), PARCELS=100, PATTERN=1)
    for title in SHOWN:
        (made,) = project.mapLayersByName(title)
        renderer = made.renderer()
        context = QgsRenderContext()
        context.setExpressionContext(made.createExpressionContext())
        renderer.startRender(context, made.fields())
        for feature in made.getFeatures():
            if feature.geometry().isNull():
                continue
            context.expressionContext().setFeature(feature)
            assert renderer.willRenderFeature(feature, context), (title, feature.attributes())
        renderer.stopRender(context)


def test_classes_of_streets_and_irregular_parcels_have_colours_of_their_own(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    load(str(sample("rect")), PARCELS=10)
    for title in ("Streets", "Parcels"):
        (made,) = project.mapLayersByName(title)
        symbols = [rule.symbol() for rule in made.renderer().rootRule().children()]
        fills = [
            symbol.symbolLayer(symbol.symbolLayerCount() - 1).color().name() for symbol in symbols
        ]
        assert len(fills) == 5
        assert len(set(fills)) == len(fills)


@pytest.mark.parametrize("ground", ["#ffffff", "#f2efe9", "#aad3df", "#add19e"])
def test_streets_and_parcels_stand_out(
    load: Callable[..., Any], project: Any, layer: Callable[..., Any], ground: str
) -> None:
    """On white, and on the colours of land, water and woods of a street map."""
    load(layer([square(400)]), PARCELS=16)
    image = render(project, ground)
    inside = image[60:-60, 60:-60].reshape(-1, 3)
    background = np.array(QColor(ground).getRgb()[:3])
    streets = np.abs(inside - np.array([255, 204, 70])).sum(axis=1) < 90
    lines = inside.sum(axis=1) < 3 * 175
    assert streets.mean() > 0.01
    assert lines.mean() > 0.01
    # parcels are nearly opaque: little of what is below shows through
    assert (np.abs(inside - background).sum(axis=1) == 0).mean() < (
        1.0 if ground in ("#ffffff", "#f2efe9") else 0.01
    )


def render(project: Any, ground: str) -> np.ndarray:
    settings = QgsMapSettings()
    layers = [node.layer() for node in project.layerTreeRoot().findLayers()]
    settings.setLayers(layers)
    settings.setDestinationCrs(layers[0].crs())
    settings.setBackgroundColor(QColor(ground))
    settings.setOutputSize(QSize(500, 500))
    extent = project.mapLayersByName("Parcels")[0].extent()
    extent.scale(1.1)
    settings.setExtent(extent)
    job = QgsMapRendererParallelJob(settings)
    job.start()
    job.waitForFinished()
    image = job.renderedImage().convertToFormat(QImage.Format.Format_RGB888)
    bits = image.bits()
    bits.setsize(image.sizeInBytes())
    flat = np.frombuffer(bytes(bits), dtype=np.uint8)
    return (
        flat.reshape(image.height(), image.bytesPerLine())[:, : 3 * image.width()]
        .reshape(image.height(), image.width(), 3)
        .astype(int)
    )


def test_styles_load_from_the_layout_file_too(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    from qgis.core import QgsVectorLayer

    load(str(sample("rect")), PARCELS=10, OUTPUT=str(tmp_path / "layout.gpkg"))
    opened = QgsVectorLayer(f"{tmp_path / 'layout.gpkg'}|layername=streets", "s", "ogr")
    assert opened.isValid()
    (made,) = project.mapLayersByName("Streets")
    labels = [
        [rule.label() for rule in each.renderer().rootRule().children()] for each in (opened, made)
    ]
    assert labels[0] == labels[1]
    assert processing  # imported for its side of the toolbox


def test_names_that_the_user_gave_are_kept(
    load: Callable[..., Any], project: Any, sample: Callable[[str], Path]
) -> None:
    from qgis.core import QgsProcessingOutputLayerDefinition

    named = QgsProcessingOutputLayerDefinition(TEMPORARY, project)
    named.destinationName = "My parcels"
    load(str(sample("rect")), PARCELS=10, OUTPUT_PARCELS=named)
    assert len(project.mapLayersByName("My parcels")) == 1
