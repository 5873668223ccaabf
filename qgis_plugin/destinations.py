"""Where the results of a run go, and what is wrong with that."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import (
    QgsMapLayer,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProcessingParameterFeatureSink,
    QgsProperty,
    QgsProviderRegistry,
    QgsVectorFileWriter,
    QgsVectorLayer,
)

from qgis_plugin.definitions import FILES, SinkName, files, is_given, parameter_name, sinks
from urban_processing.algorithms import InputKind, Output, OutputKind
from urban_processing.paths import ending_problems, file_problems, geopackage_problems

if TYPE_CHECKING:
    from qgis_plugin.algorithm import SpecAlgorithm

_TABLE = re.compile(r"""ogr:dbname='([^']+)'\s+table="([^"]+)\"""")
"""A table of a GeoPackage, as QGIS names a sink into it."""


@dataclass(frozen=True)
class Place:
    """A file, or a table in it."""

    path: Path
    table: str | None = None

    def replaces(self, other: Place) -> bool:
        """Whether writing here destroys what is there."""
        tables = {self.table, other.table}
        return self.path == other.path and (None in tables or len(tables) == 1)


class Destinations:
    """The sinks and files that a user asked for.

    Parameters
    ----------
    algorithm, parameters, context
        As QGIS gives them.
    """

    def __init__(
        self,
        algorithm: SpecAlgorithm,
        parameters: Mapping[str, Any],
        context: QgsProcessingContext,
    ) -> None:
        self.algorithm = algorithm
        self.parameters = dict(parameters)
        self.context = context

    @property
    def sinks(self) -> list[SinkName]:
        """The layers that are to be made."""
        return [
            sink for sink in sinks(self.algorithm.spec) if is_given(self.parameters, sink.parameter)
        ]

    @property
    def files(self) -> dict[str, tuple[Output, Path]]:
        """The files that are to be written, by parameter."""
        return {
            parameter_name(output.name): (output, self._file(output))
            for output in files(self.algorithm.spec)
            if is_given(self.parameters, parameter_name(output.name))
        }

    def of_kind(self, kind: OutputKind) -> list[Path]:
        """Return the files of one kind that are to be written."""
        return [path for output, path in self.files.values() if output.kind is kind]

    def problems(self) -> list[str]:
        """Return one sentence for each reason why a result cannot go where it is to."""
        problems: list[str] = []
        taken = [(place, "the input") for place in self._read()]
        for name, place in self._sink_places().items():
            label = self._label(name)
            if place.table is None:
                problems += [f"{label}: {problem}" for problem in file_problems(place.path)]
            problems += _collisions(label, place, taken)
        for name, (output, path) in self.files.items():
            label = self._label(name)
            problems += [f"{label}: {problem}" for problem in _file_problems(output.kind, path)]
            problems += _collisions(label, Place(path.resolve()), taken)
            if output.kind.is_geopackage and path.resolve() in self._loaded():
                problems.append(
                    f"{label}: {path} is open in this project: remove its layers from it, or "
                    "choose another name."
                )
        return problems

    def _label(self, name: str) -> str:
        return str(self.algorithm.parameterDefinition(name).description())

    def _file(self, output: Output) -> Path:
        name = parameter_name(output.name)
        return Path(self.algorithm.parameterAsFileOutput(self.parameters, name, self.context))

    def _sink_places(self) -> dict[str, Place]:
        """Where the sinks go that go to files, by parameter."""
        found = {}
        for sink in self.sinks:
            value = self.parameters[sink.parameter]
            if isinstance(value, QgsProcessingOutputLayerDefinition):
                value = value.sink
            if isinstance(value, QgsProperty):
                value = value.valueAsString(self.context.expressionContext(), "")[0]
            text = str(value)
            table = _TABLE.match(text)
            if table:
                found[sink.parameter] = Place(Path(table[1]).resolve(), table[2])
            elif text != QgsProcessing.TEMPORARY_OUTPUT and ":" not in text[2:]:
                definition = self.algorithm.parameterDefinition(sink.parameter)
                found[sink.parameter] = Place(_with_suffix(text, definition).resolve())
        return found

    def _read(self) -> set[Place]:
        """What the run reads from files."""
        found = set()
        for item in self.algorithm.spec.inputs:
            name = parameter_name(item.name)
            if not is_given(self.parameters, name):
                continue
            if item.kind in FILES:
                found.add(Place(Path(str(self.parameters[name])).resolve()))
                continue
            if item.kind is InputKind.FABRICS:
                paths = self.algorithm.parameterAsFileList(self.parameters, name, self.context)
                found |= {Place(Path(path).resolve()) for path in paths}
                continue
            layer = self.algorithm.parameterAsVectorLayer(self.parameters, name, self.context)
            found |= _places_of(layer)
        return found

    def _loaded(self) -> set[Path]:
        """Files of the layers of the project."""
        project = self.context.project()
        layers = [] if project is None else project.mapLayers().values()
        return {place.path for layer in layers for place in _places_of(layer)}


def _file_problems(kind: OutputKind, path: Path) -> list[str]:
    if kind.is_geopackage:
        return geopackage_problems(path)
    return ending_problems(path, kind.value, kind.endings)


def _places_of(layer: QgsMapLayer | None) -> set[Place]:
    if not isinstance(layer, QgsVectorLayer):
        return set()
    uri = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
    if not uri.get("path"):
        return set()
    return {Place(Path(uri["path"]).resolve(), uri.get("layerName") or None)}


def _with_suffix(text: str, definition: QgsProcessingParameterFeatureSink) -> Path:
    """Return the file that QGIS makes of a name: with its default suffix where it knows none."""
    suffix = Path(text).suffix.lstrip(".")
    if suffix and QgsVectorFileWriter.driverForExtension(suffix):
        return Path(text)
    return Path(f"{text}.{definition.defaultFileExtension()}")


def _collisions(label: str, place: Place, taken: list[tuple[Place, str]]) -> list[str]:
    """Say what a result would replace, and add it to what is taken."""
    found = [what for other, what in taken if place.replaces(other)]
    taken.append((place, label))
    return [f"{label} would replace {what} {place.path}: choose another." for what in found[:1]]
