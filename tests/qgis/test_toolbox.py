"""Models, iteration, new declarations: what the toolbox does with an algorithm."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import processing
from in_qgis import ID, TEMPORARY, square
from qgis.core import (
    QgsApplication,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
    QgsProcessingModelAlgorithm,
    QgsProcessingModelChildAlgorithm,
    QgsProcessingModelChildParameterSource,
    QgsProcessingModelOutput,
    QgsProcessingModelParameter,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProject,
    QgsVectorLayer,
)

import urban_processing as up

Run = Callable[..., dict[str, Any]]


def test_it_works_in_a_model(provider: Any, layer: Callable[..., Any]) -> None:
    """Land, laid out, and the parcels' centroids after it."""
    model = QgsProcessingModelAlgorithm("layout", "tests")
    model.addModelParameter(
        QgsProcessingParameterFeatureSource("LAND", "Land"), QgsProcessingModelParameter("LAND")
    )
    source = QgsProcessingModelChildParameterSource
    lay = QgsProcessingModelChildAlgorithm(ID)
    lay.setChildId("lay")
    lay.addParameterSources("BOUNDARY", [source.fromModelParameter("LAND")])
    lay.addParameterSources("PARCELS", [source.fromStaticValue(12)])
    # a sink that the model hands out, so that it is loaded and styled
    streets = QgsProcessingModelOutput("streets")
    streets.setChildId("lay")
    streets.setChildOutputName("OUTPUT_STREETS")
    lay.setModelOutputs({"streets": streets})
    lay.addParameterSources("OUTPUT_PARCELS", [source.fromStaticValue(TEMPORARY)])
    filled_in(lay)
    model.addChildAlgorithm(lay)
    dots = QgsProcessingModelChildAlgorithm("native:centroids")
    dots.setChildId("dots")
    dots.addParameterSources("INPUT", [source.fromChildOutput("lay", "OUTPUT_PARCELS")])
    made = QgsProcessingModelOutput("centroids")
    made.setChildId("dots")
    made.setChildOutputName("OUTPUT")
    dots.setModelOutputs({"centroids": made})
    filled_in(dots)
    model.addChildAlgorithm(dots)
    good, problems = model.validate()
    assert good, problems

    land = layer([square(200)])
    context, feedback = QgsProcessingContext(), QgsProcessingFeedback()
    project = QgsProject.instance()
    context.setProject(project)
    model.initAlgorithm()
    names = [d.name() for d in model.parameterDefinitions()]
    sinks = {
        d.name(): TEMPORARY
        for d in model.parameterDefinitions()
        if isinstance(d, QgsProcessingParameterFeatureSink)
    }
    assert set(names) == {"LAND", *sinks}
    results, good = model.run({"LAND": land, **sinks}, context, feedback)
    assert good
    centroids = context.getMapLayer(results["dots:centroids"])
    assert centroids.featureCount() == 12
    assert "area_m2" in [field.name() for field in centroids.fields()]


def filled_in(child: QgsProcessingModelChildAlgorithm) -> None:
    """Give every parameter its default, as the model designer does."""
    for definition in child.algorithm().parameterDefinitions():
        given = child.parameterSources()
        if definition.name() not in given and definition.defaultValue() is not None:
            value = QgsProcessingModelChildParameterSource.fromStaticValue(
                definition.defaultValue()
            )
            child.addParameterSources(definition.name(), [value])


def test_it_runs_over_each_feature_of_a_layer(
    provider: Any, layer: Callable[..., Any], tmp_path: Path
) -> None:
    from processing.gui.AlgorithmExecutor import executeIterating

    land = layer([square(200), square(100, x=691_000.0)])
    project = QgsProject.instance()
    project.addMapLayer(land)
    context, feedback = QgsProcessingContext(), QgsProcessingFeedback()
    context.setProject(project)
    algorithm = QgsApplication.processingRegistry().createAlgorithmById(ID)
    parameters = {
        "BOUNDARY": land.id(),
        "MIN_AREA": 900,
        "OUTPUT_PARCELS": str(tmp_path / "parcels.gpkg"),
    }
    assert executeIterating(algorithm, parameters, "BOUNDARY", context, feedback)
    counts = [
        QgsVectorLayer(str(path), "p", "ogr").featureCount()
        for path in sorted(tmp_path.glob("parcels_*.gpkg"))
    ]
    assert len(counts) == 2
    assert counts[0] > counts[1] > 1
    project.removeMapLayer(land.id())


def test_values_of_expressions_are_taken(run: Run, layer: Callable[..., Any]) -> None:
    from qgis.core import QgsProperty

    made = run(
        layer([square(200)]), PARCELS=QgsProperty.fromExpression("3 * 4"), OUTPUT_PARCELS=TEMPORARY
    )
    assert made["OUTPUT_PARCELS"].featureCount() == 12


@pytest.fixture
def another(provider: Any, engine: Callable[[str], Any]) -> Iterator[Any]:
    """A provider with an algorithm that nobody has written for QGIS."""
    spec, base = engine("engine.algorithms.spec"), engine("engine.params.base")
    errors = engine("engine.errors")
    pattern = engine("engine.params.cogenerate").StreetPattern
    declared = [
        ("raised", Annotated[float, base.Param(label="By", help="By what.", unit="m²")], 1.5),
        ("named", Annotated[str, base.Param(label="Name", help="A name.")], "a"),
        ("on", Annotated[bool, base.Param(label="On", help="Whether.", advanced=True)], False),
        ("way", Annotated[pattern | None, base.Param(label="Way", help="Which way.")], None),
    ]
    params_class = dataclasses.make_dataclass(
        "Params", declared, bases=(base.Params,), frozen=True, kw_only=True
    )
    seen: list[Any] = []

    def rerun(inputs: Mapping[str, Any], params: Any, told: Any) -> Mapping[str, Any]:
        told.update(0.5, "Half")
        seen.append((inputs, params))
        if params.named == "bad":
            raise errors.InfeasibleError(["It cannot be.", "Nor this (--named)."])
        layout = inputs["layout"]
        return {"output": layout.replace(min_area=layout.min_area - params.raised)}

    made = spec.AlgorithmSpec(
        name="lower",
        title="Lower the smallest area",
        group="Tests",
        summary="Lower the smallest area.",
        description="A layout in, a layout out.",
        params=params_class,
        inputs=(
            spec.Input(name="layout", kind=spec.InputKind.LAYOUT, label="Layout", help="A file."),
        ),
        outputs=(
            spec.Output(
                name="output",
                kind=spec.OutputKind.LAYOUT,
                label="Layout file",
                help="A file.",
                layers=engine("engine.schema").LAID_OUT,
            ),
        ),
        run=rerun,
    )
    provider_class = engine("provider").UrbanProcessingProvider

    class Another(provider_class):  # type: ignore[valid-type,misc]
        def id(self) -> str:
            return "another"

    extra = Another((made,))
    QgsApplication.processingRegistry().addProvider(extra)
    extra.seen = seen
    yield extra
    QgsApplication.processingRegistry().removeProvider(extra)


def test_a_new_declaration_needs_no_new_code(
    another: Any, run: Run, sample: Callable[[str], Path], tmp_path: Path, feedback: Any
) -> None:
    first, second = tmp_path / "first.gpkg", tmp_path / "second.gpkg"
    up.cogenerate(sample("ellipse"), parcels=30).save(first)
    results = processing.run(
        "another:lower",
        {
            "LAYOUT": str(first),
            "RAISED": 20.0,
            "NAMED": "x",
            "ON": True,
            "WAY": 2,
            "OUTPUT": str(second),
            "OUTPUT_PARCELS": TEMPORARY,
        },
        feedback=feedback,
    )
    ((_, params),) = another.seen
    assert (params.raised, params.named, params.on, params.way.value) == (20.0, "x", True, "tree")
    assert results["OUTPUT_PARCELS"].featureCount() == 30
    before, after = up.read_layout(first), up.read_layout(second)
    assert after.layout.min_area == before.layout.min_area - 20
    assert after.certificate.holds
    assert after.parcels.geometry.equals(before.parcels.geometry)
    assert after.provenance.input_sha256.equals(before.provenance.input_sha256)


def test_values_left_out_are_the_defaults(
    another: Any, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    file = tmp_path / "a.gpkg"
    up.cogenerate(sample("rect"), parcels=6).save(file)
    processing.run("another:lower", {"LAYOUT": str(file), "OUTPUT_PARCELS": TEMPORARY})
    ((_, params),) = another.seen
    assert (params.raised, params.named, params.on, params.way) == (1.5, "a", False, None)


def test_errors_of_an_algorithm_are_sentences(
    another: Any, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    file = tmp_path / "a.gpkg"
    up.cogenerate(sample("rect"), parcels=6).save(file)
    with pytest.raises(QgsProcessingException) as caught:
        processing.run("another:lower", {"LAYOUT": str(file), "NAMED": "bad"})
    assert str(caught.value) == "It cannot be.\nNor this."


@pytest.mark.parametrize(
    ("content", "words"), [(b"no database", "not a layout file"), (None, "does not exist")]
)
def test_other_files_are_no_layouts(
    another: Any, tmp_path: Path, content: bytes | None, words: str
) -> None:
    file = tmp_path / "other.gpkg"
    if content is not None:
        file.write_bytes(content)
    with pytest.raises(QgsProcessingException) as caught:
        processing.run("another:lower", {"LAYOUT": str(file)})
    assert words in str(caught.value)


def test_a_layout_file_that_lost_a_layer_is_damaged(
    another: Any, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    import sqlite3
    from contextlib import closing

    file = tmp_path / "a.gpkg"
    up.cogenerate(sample("rect"), parcels=6).save(file)
    with closing(sqlite3.connect(file)) as connection, connection:
        connection.execute("DELETE FROM gpkg_contents WHERE table_name = 'streets'")
        connection.execute("DROP TABLE streets")
    with pytest.raises(QgsProcessingException, match="damaged"):
        processing.run("another:lower", {"LAYOUT": str(file)})
