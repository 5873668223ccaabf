"""From an algorithm's declaration to the parameters and outputs that QGIS shows."""

from __future__ import annotations

import enum
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

from qgis.core import (
    QgsProcessing,
    QgsProcessingParameterBoolean,
    QgsProcessingParameterCrs,
    QgsProcessingParameterDefinition,
    QgsProcessingParameterEnum,
    QgsProcessingParameterFeatureSink,
    QgsProcessingParameterFeatureSource,
    QgsProcessingParameterFile,
    QgsProcessingParameterFileDestination,
    QgsProcessingParameterMultipleLayers,
    QgsProcessingParameterNumber,
    QgsProcessingParameterString,
)

from urban_processing.algorithms import AlgorithmSpec, Input, InputKind, Output, OutputKind
from urban_processing.algorithms.words import column_in_words, limits_in_words
from urban_processing.params import ParamField
from urban_processing.schema import GeometryType, Layer

CRS = "CRS"
"""The CRS to work in, as ``--crs`` on the command line."""

_CRS_HELP = (
    "Projected CRS in metres to work in; the CRS of a layer that has none. By default the layer's "
    "own if it is metric and true to area, else UTM or a local equal-area projection."
)
_SELECTION = " Only the selected features, if the box is ticked."
_LAYERS = {
    InputKind.BOUNDARY: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.CORNER_POINTS: QgsProcessing.SourceType.TypeVectorPoint,
    InputKind.PARCEL_LAYER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.STREET_LAYER: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.FIXED_STREETS: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.OBSTACLES: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.LOCKED_LAND: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.RIM_LINES: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.ENTRY_POINTS: QgsProcessing.SourceType.TypeVectorPoint,
    InputKind.CENTRELINES: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.LAND: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCK_LAYER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCK_STREETS: QgsProcessing.SourceType.TypeVectorLine,
    InputKind.OBSERVED_PARCELS: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.OBSERVED_BLOCKS: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.PARCELS_BEFORE: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.PARCELS_AFTER: QgsProcessing.SourceType.TypeVectorPolygon,
    InputKind.BLOCKS_BEFORE: QgsProcessing.SourceType.TypeVectorAnyGeometry,
    InputKind.BLOCKS_AFTER: QgsProcessing.SourceType.TypeVectorAnyGeometry,
}
"""Inputs that are layers, and their geometry."""

FILES = (InputKind.LAYOUT, InputKind.SUBDIVISION, InputKind.FABRIC)
"""Inputs that are single files."""

_ELSEWHERE = (InputKind.OPEN_STREET_MAP,)
"""Inputs that QGIS has other ways for: a layer of OpenStreetMap is one of streets."""

_SINK_TYPES = {
    GeometryType.NONE: QgsProcessing.SourceType.TypeVector,
    GeometryType.POINT: QgsProcessing.SourceType.TypeVectorPoint,
    GeometryType.LINE: QgsProcessing.SourceType.TypeVectorLine,
    GeometryType.POLYGON: QgsProcessing.SourceType.TypeVectorPolygon,
    GeometryType.ANY: QgsProcessing.SourceType.TypeVectorPoint,
}
"""Geometry of the sink of a layer; places stand for areas where a layer has both."""

_GEOPACKAGE = "GeoPackage (*.gpkg)"
_FILES = {
    OutputKind.LAYOUT: _GEOPACKAGE,
    OutputKind.LAYERS: _GEOPACKAGE,
    OutputKind.MAP: "PNG (*.png);;SVG (*.svg);;PDF (*.pdf)",
    OutputKind.REPORT: "HTML (*.html)",
    OutputKind.JSON: "JSON (*.json)",
    OutputKind.CSV: "CSV (*.csv)",
}
"""Outputs that are single files. An export, a folder of plain files, is none of QGIS's: each
sink goes to a file of its own."""


def is_offered(spec: AlgorithmSpec) -> bool:
    """Whether an algorithm makes layers and is none that QGIS has other ways for.

    QGIS itself writes layers to plain files; sessions are opened in a panel of their own.
    """
    session = any(item.kind is InputKind.EDITS for item in spec.inputs)
    return not session and any(output.kind.is_geopackage for output in spec.outputs)


@dataclass(frozen=True)
class SinkName:
    """A sink: a layer of an output that has several."""

    output: Output
    layer: Layer

    @property
    def parameter(self) -> str:
        """Name of the parameter."""
        return f"{parameter_name(self.output.name)}_{parameter_name(self.layer.name)}"


def parameter_name(name: str) -> str:
    """Return the name in QGIS of what is declared as `name`.

    >>> parameter_name("min_area")
    'MIN_AREA'
    """
    return name.upper()


def is_given(parameters: Mapping[str, Any], name: str) -> bool:
    """Whether the user gave a parameter; forms give None or nothing for what is left empty."""
    return parameters.get(name) not in (None, "")


def sinks(spec: AlgorithmSpec) -> Iterator[SinkName]:
    """Yield the sinks of an algorithm in the order of asking: those made by default first."""
    for output in spec.outputs:
        for layer in sorted(output.layers, key=lambda layer: not layer.shown):
            yield SinkName(output, layer)


def files(spec: AlgorithmSpec) -> Iterator[Output]:
    """Yield the outputs that are single files."""
    return (output for output in spec.outputs if output.kind in _FILES)


def input_of(spec: AlgorithmSpec, kind: InputKind) -> Input | None:
    """Return the input of a kind of which an algorithm has one at most."""
    return next((item for item in spec.inputs if item.kind is kind), None)


def definitions(spec: AlgorithmSpec) -> Iterator[QgsProcessingParameterDefinition]:
    """Yield everything that is asked for: inputs, parameters, sinks, files.

    Inputs that may be left out come after the first panel of parameters where another input is
    required, so that what must be given stands together at the top.
    """
    fields = [field for panel in spec.panels().values() for field in panel]
    plain = [field for field in fields if not field.param.advanced]
    inputs = [item for item in spec.inputs if item.kind not in _ELSEWHERE]
    needed = [item for item in inputs if item.required]
    first = [field for field in plain if needed and field.param.group == plain[0].param.group]
    for item in needed:
        yield _input(item)
    for field in first:
        yield _parameter(field)
    for item in inputs:
        if not item.required:
            yield _input(item)
    for field in plain:
        if field not in first:
            yield _parameter(field)
    if any(item.kind.chooses_crs for item in spec.inputs):
        crs = QgsProcessingParameterCrs(CRS, "CRS to work in", optional=True)
        yield _helped(crs, _CRS_HELP)
    for field in fields:
        if field.param.advanced:
            definition = _parameter(field)
            flag = QgsProcessingParameterDefinition.Flag.FlagAdvanced
            definition.setFlags(definition.flags() | flag)
            yield definition
    for sink in sinks(spec):
        yield _sink(sink)
    for output in files(spec):
        definition = QgsProcessingParameterFileDestination(
            parameter_name(output.name),
            output.label,
            fileFilter=_FILES[output.kind],
            optional=True,
            createByDefault=False,
        )
        yield _helped(definition, output.help)


def _input(item: Input) -> QgsProcessingParameterDefinition:
    """Return the definition of an input: a layer, or the file of a layout."""
    name, optional = parameter_name(item.name), not item.required
    if item.kind in _LAYERS:
        kinds = [_LAYERS[item.kind]]
        source = QgsProcessingParameterFeatureSource(name, item.label, kinds, optional=optional)
        return _helped(source, item.help + _SELECTION)
    if item.kind is InputKind.FABRICS:
        several = QgsProcessingParameterMultipleLayers(
            name, item.label, QgsProcessing.SourceType.TypeFile, optional=optional
        )
        return _helped(several, item.help)
    file = QgsProcessingParameterFile(
        name,
        item.label,
        QgsProcessingParameterFile.Behavior.File,
        fileFilter=_GEOPACKAGE,
        optional=optional,
    )
    return _helped(file, item.help)


def _parameter(field: ParamField) -> QgsProcessingParameterDefinition:
    """Return the definition of a parameter, with its unit in the label."""
    param, name = field.param, parameter_name(field.name)
    label = f"{param.label} [{param.unit}]" if param.unit else param.label
    shared: dict[str, Any] = {"optional": field.optional}
    definition: QgsProcessingParameterDefinition
    if issubclass(field.kind, enum.Enum):
        values = list(field.kind)
        definition = QgsProcessingParameterEnum(
            name,
            label,
            options=[param.labels.get(member.value, member.value) for member in values],
            defaultValue=None if field.default is None else values.index(field.default),
            **shared,
        )
    elif field.kind is bool:
        definition = QgsProcessingParameterBoolean(name, label, field.default, **shared)
    elif field.kind is str:
        definition = QgsProcessingParameterString(name, label, field.default, **shared)
    else:
        definition = _number(field, name, label)
    words = "; ".join(filter(None, (limits_in_words(field), column_in_words(field))))
    return _helped(definition, f"{param.help} ({words})" if words else param.help)


def _number(field: ParamField, name: str, label: str) -> QgsProcessingParameterNumber:
    param, kinds = field.param, QgsProcessingParameterNumber.Type
    least = param.minimum if param.above is None else param.above
    # QGIS knows no open limits: what is `above` is checked with everything else
    limits = {"minValue": least, "maxValue": param.maximum}
    return QgsProcessingParameterNumber(
        name,
        label,
        kinds.Integer if field.kind is int else kinds.Double,
        defaultValue=field.default,
        optional=field.optional,
        **{key: value for key, value in limits.items() if value is not None},
    )


def _sink(sink: SinkName) -> QgsProcessingParameterFeatureSink:
    layer = sink.layer
    definition = QgsProcessingParameterFeatureSink(
        sink.parameter,
        layer.title,
        _SINK_TYPES[layer.geometry],
        optional=True,
        createByDefault=layer.shown,
    )
    columns = ", ".join(column.name for column in layer.columns)
    more = ", and those carried along" if layer.open else ""
    return _helped(definition, f"Layer with the columns {columns}{more}.")


def _helped(
    definition: QgsProcessingParameterDefinition, text: str
) -> QgsProcessingParameterDefinition:
    definition.setHelp(text)
    return definition
