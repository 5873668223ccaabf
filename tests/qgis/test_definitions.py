"""What QGIS asks for is what the declarations say, and so what the command line asks for."""

from __future__ import annotations

import enum
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from qgis.core import (
    QgsApplication,
    QgsProcessing,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterNumber,
)

from urban_processing.algorithms import AlgorithmSpec, InputKind, OutputKind, specs
from urban_processing.algorithms.json_schema import description
from urban_processing.cli.options import command_parameters
from urban_processing.params import ParamField

FREE = 1e300
"""QGIS's own limits of a number without limits lie beyond this, or at the ends of 32 bits."""

SHELL_ONLY = {
    "cli": {
        *("place", "layer", "where"),  # QGIS has layers, filters and selections
        *("osm_file", "osm"),  # streets of OpenStreetMap are a layer
        *("overwrite", "record_seconds", "export", "export_format", "quiet"),
        "processes",  # the program that runs QGIS is not Python
    },
    "qgis": set[str](),
}


LEFT_OUT = {"edit", "export"}
"""Algorithms that make plain files, as every sink of QGIS does, and the one for saved sessions,
which QGIS opens in a panel."""

OFFERED = tuple(spec for spec in specs() if spec.name not in LEFT_OUT)


@pytest.fixture(params=OFFERED, ids=lambda spec: spec.name)
def spec(request: pytest.FixtureRequest) -> AlgorithmSpec:
    return request.param  # type: ignore[no-any-return]


@pytest.fixture
def algorithm(provider: Any, spec: AlgorithmSpec) -> Any:
    found = QgsApplication.processingRegistry().algorithmById(f"urban_processing:{spec.name}")
    assert found is not None
    return found


def test_every_algorithm_that_makes_layers_is_in_the_toolbox(provider: Any) -> None:
    shown = [(a.name(), a.displayName(), a.group()) for a in provider.algorithms()]
    assert sorted(shown) == sorted((s.name, s.title, s.group) for s in OFFERED)
    assert len(OFFERED) + len(LEFT_OUT) == len(specs())


def test_texts_are_those_of_the_declaration(algorithm: Any, spec: AlgorithmSpec) -> None:
    assert algorithm.shortDescription() == spec.summary
    for source in spec.references:
        assert source in algorithm.shortHelpString()
    assert not algorithm.icon().isNull()
    assert {spec.name, "planning"} <= set(algorithm.tags())


def test_names_are_those_of_the_command_line(algorithm: Any, spec: AlgorithmSpec) -> None:
    options = {option.name for option in command_parameters(spec)} - SHELL_ONLY["cli"]
    sinks = {
        d.name().lower()
        for d in algorithm.parameterDefinitions()
        if isinstance(d, QgsProcessingParameterFeatureSink)
    }
    asked = {d.name().lower() for d in algorithm.parameterDefinitions()} - sinks
    assert asked - SHELL_ONLY["qgis"] == options
    assert sinks == {f"{o.name}_{layer.name}" for o in spec.outputs for layer in o.layers}


def test_defaults_limits_and_helps_are_those_of_the_declaration(
    algorithm: Any, spec: AlgorithmSpec
) -> None:
    schema = description(spec)["parameters"]["properties"]
    for field in spec.params.fields():
        asked = algorithm.parameterDefinition(field.name.upper())
        declared = schema[field.name]
        assert default_of(asked, field) == declared["default"]
        assert declared["description"] in asked.help()
        unit = declared.get("x-unit")
        assert asked.description() == declared["title"] + (f" [{unit}]" if unit else "")
        advanced = QgsProcessingParameterDefinition.Flag.FlagAdvanced
        assert bool(asked.flags() & advanced) is bool(declared.get("x-advanced"))
        optional = QgsProcessingParameterDefinition.Flag.FlagOptional
        assert bool(asked.flags() & optional) is field.optional
        if isinstance(asked, QgsProcessingParameterNumber):
            least = declared.get("minimum", declared.get("exclusiveMinimum"))
            assert limit(asked.minimum()) == least
            assert limit(asked.maximum()) == declared.get("maximum")
            whole = asked.dataType() == QgsProcessingParameterNumber.Type.Integer
            assert whole is (field.kind is int)
            # a distance that hangs on a layer would change its unit with the layer
            assert asked.type() == "number"


def default_of(asked: Any, field: ParamField) -> Any:
    if issubclass(field.kind, enum.Enum) and asked.defaultValue() is not None:
        assert asked.options() == [
            field.param.labels.get(member.value, member.value) for member in field.kind
        ]
        return list(field.kind)[asked.defaultValue()].value
    return asked.defaultValue()


def limit(value: float) -> float | None:
    return None if abs(value) > FREE or abs(value) >= 2**31 - 1 else value


INPUTS = {
    InputKind.BOUNDARY: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.CORNER_POINTS: QgsProcessing.SourceType.TypeVectorPoint,
    InputKind.FIXED_STREETS: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.OBSTACLES: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.LOCKED_LAND: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.RIM_LINES: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.ENTRY_POINTS: QgsProcessing.SourceType.TypeVectorPoint,
    InputKind.PARCEL_LAYER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.STREET_LAYER: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.CENTRELINES: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.LAND: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.PARCELS_BEFORE: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.PARCELS_AFTER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCKS_BEFORE: QgsProcessing.SourceType.TypeVectorAnyGeometry,
    InputKind.BLOCKS_AFTER: QgsProcessing.SourceType.TypeVectorAnyGeometry,
    InputKind.OBSERVED_PARCELS: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.OBSERVED_BLOCKS: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCK_LAYER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCK_STREETS: QgsProcessing.SourceType.TypeVectorLine,
}


def test_inputs_are_layers_of_the_right_kind(algorithm: Any, spec: AlgorithmSpec) -> None:
    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    for item in spec.inputs:
        asked = algorithm.parameterDefinition(item.name.upper())
        if item.kind is InputKind.OPEN_STREET_MAP:
            assert asked is None
            continue
        assert bool(asked.flags() & optional) is not item.required
        assert asked.description() == item.label
        if item.kind in (InputKind.LAYOUT, InputKind.SUBDIVISION, InputKind.FABRIC):
            assert isinstance(asked, QgsProcessingParameterFile)
        elif item.kind is InputKind.FABRICS:
            assert isinstance(asked, QgsProcessingParameterMultipleLayers)
            assert asked.layerType() == QgsProcessing.SourceType.TypeFile
        else:
            assert isinstance(asked, QgsProcessingParameterFeatureSource)
            assert asked.dataTypes() == [INPUTS[item.kind]]


def test_what_must_be_given_stands_at_the_top(provider: Any) -> None:
    cogenerate = QgsApplication.processingRegistry().algorithmById("urban_processing:cogenerate")
    names = [d.name() for d in cogenerate.parameterDefinitions()]
    assert names[:3] == ["BOUNDARY", "MIN_AREA", "PARCELS"]
    assert names.index("CORNERS") < names.index("PATTERN")
    optimize = QgsApplication.processingRegistry().algorithmById("urban_processing:optimize")
    names = [d.name() for d in optimize.parameterDefinitions()]
    assert names[:3] == ["LAYOUT", "PARCEL_LAYER", "STREET_LAYER"]


def test_results_are_sinks_and_files_and_all_optional(algorithm: Any, spec: AlgorithmSpec) -> None:
    made = {d.name(): d for d in algorithm.destinationParameterDefinitions()}
    optional = QgsProcessingParameterDefinition.Flag.FlagOptional
    assert all(bool(d.flags() & optional) for d in made.values())
    by_default = {name for name, d in made.items() if d.createByDefault()}
    shown = {f"{o.name}_{layer.name}" for o in spec.outputs for layer in o.layers if layer.shown}
    assert by_default == {name.upper() for name in shown}
    files = {n for n, d in made.items() if isinstance(d, QgsProcessingParameterFileDestination)}
    endings = {
        OutputKind.LAYOUT: "gpkg",
        OutputKind.LAYERS: "gpkg",
        OutputKind.MAP: "png",
        OutputKind.REPORT: "html",
        OutputKind.JSON: "json",
        OutputKind.CSV: "csv",
    }
    wanted = {o.name.upper(): endings[o.kind] for o in spec.outputs if o.kind in endings}
    assert {name: made[name].defaultFileExtension() for name in files} == wanted


@pytest.mark.parametrize("name", ["measure", "compare"])
def test_a_report_is_shown_by_the_results_viewer(provider: Any, name: str) -> None:
    found = QgsApplication.processingRegistry().algorithmById(f"urban_processing:{name}")
    assert found.outputDefinition("REPORT").type() == "outputHtml"
    assert found.outputDefinition("JSON").type() == "outputFile"


def test_it_can_run_as_a_batch_and_in_models(algorithm: Any) -> None:
    from qgis.core import QgsProcessingAlgorithm

    flags = QgsProcessingAlgorithm.Flag
    assert algorithm.flags() & flags.FlagSupportsBatch
    assert not algorithm.flags() & flags.FlagHideFromModeler
    assert not algorithm.flags() & flags.FlagNoThreading
