"""Where the results of a run go, and what is wrong with that."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from qgis.core import (
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProperty,
    QgsProviderRegistry,
    QgsVectorLayer,
)

from qgis_plugin.definitions import SinkName, files, parameter_name, sinks
from urban_processing.algorithms import InputKind, Output, OutputKind
from urban_processing.paths import file_problems, geopackage_problems


class Destinations:
    """The sinks and files that a user asked for.

    Parameters
    ----------
    algorithm
        The algorithm, a `SpecAlgorithm`.
    parameters, context
        As QGIS gives them.
    """

    def __init__(
        self,
        algorithm: QgsProcessingAlgorithm,
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
            sink
            for sink in sinks(self.algorithm.spec)
            if self.parameters.get(sink.parameter) not in (None, "")
        ]

    @property
    def files(self) -> dict[str, tuple[Output, Path]]:
        """The files that are to be written, by parameter."""
        return {
            parameter_name(output.name): (output, self._file(output))
            for output in files(self.algorithm.spec)
            if self.parameters.get(parameter_name(output.name)) not in (None, "")
        }

    def of_kind(self, kind: OutputKind) -> list[Path]:
        """Return the files of one kind that are to be written."""
        return [path for output, path in self.files.values() if output.kind is kind]

    def problems(self) -> list[str]:
        """Return one sentence for each reason why a result cannot go where it is to."""
        problems: list[str] = []
        taken: dict[Path, str] = dict.fromkeys(self._read(), "the input")
        layouts = self.of_kind(OutputKind.LAYOUT)
        written = {name: path for name, (_, path) in self.files.items()}
        for name, path in {**self._sink_files(), **written}.items():
            label = self.algorithm.parameterDefinition(name).description()
            check = geopackage_problems if path in layouts else file_problems
            problems += [f"{label}: {problem}" for problem in check(path)]
            place = path.resolve()
            if place in taken:
                problems.append(f"{label} would replace {taken[place]} {path}: choose another.")
            taken.setdefault(place, label)
        return problems

    def _file(self, output: Output) -> Path:
        name = parameter_name(output.name)
        return Path(self.algorithm.parameterAsFileOutput(self.parameters, name, self.context))

    def _sink_files(self) -> dict[str, Path]:
        """Files of the sinks that go to a file of their own, by parameter."""
        found = {}
        for sink in self.sinks:
            value = self.parameters[sink.parameter]
            if isinstance(value, QgsProcessingOutputLayerDefinition):
                value = value.sink
            if isinstance(value, QgsProperty):
                value = value.valueAsString(self.context.expressionContext(), "")[0]
            text = str(value)
            if Path(text).suffix and ":" not in text[2:]:  # no `memory:`, `ogr:`, `postgis:`
                found[sink.parameter] = Path(text)
        return found

    def _read(self) -> set[Path]:
        """Files that the run reads."""
        found = set()
        for item in self.algorithm.spec.inputs:
            value = self.parameters.get(parameter_name(item.name))
            if value in (None, ""):
                continue
            if item.kind is InputKind.LAYOUT:
                found.add(Path(str(value)).resolve())
                continue
            layer = self.algorithm.parameterAsVectorLayer(
                self.parameters, parameter_name(item.name), self.context
            )
            if isinstance(layer, QgsVectorLayer):
                uri = QgsProviderRegistry.instance().decodeUri(layer.providerType(), layer.source())
                if uri.get("path"):
                    found.add(Path(uri["path"]).resolve())
        return found
