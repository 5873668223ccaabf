"""The one class of all algorithms: what QGIS asks of them, answered by their declaration."""

from __future__ import annotations

import enum
from html import escape
from typing import Any

from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsProcessingAlgorithm,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeedback,
)
from qgis.PyQt.QtGui import QIcon

from qgis_plugin import dependencies
from qgis_plugin.definitions import CRS, definitions, is_given, parameter_name
from qgis_plugin.destinations import Destinations
from qgis_plugin.feedback import errors_as_sentences, progress_to
from qgis_plugin.texts import tr
from urban_processing.algorithms import AlgorithmSpec, OutputKind
from urban_processing.params import ParamField

_QUOTED = "“{}”"


class SpecAlgorithm(QgsProcessingAlgorithm):
    """An algorithm of the registry in the Processing toolbox.

    Parameters
    ----------
    spec
        Its declaration.
    """

    def __init__(self, spec: AlgorithmSpec) -> None:
        super().__init__()
        self.spec = spec

    def createInstance(self) -> SpecAlgorithm:
        """Return a new algorithm of the same kind."""
        return SpecAlgorithm(self.spec)

    def name(self) -> str:
        """Return the stable identifier."""
        return self.spec.name

    def displayName(self) -> str:
        """Return the title."""
        return tr(self.spec.title)

    def group(self) -> str:
        """Return the group in the toolbox."""
        return tr(self.spec.group)

    def groupId(self) -> str:
        """Return the stable identifier of the group."""
        return self.spec.group.lower().replace(" ", "_")

    def tags(self) -> list[str]:
        """Return words to find the algorithm by."""
        words = f"{self.spec.name} {self.spec.summary}".lower().replace(".", "").replace(",", "")
        return sorted({word for word in words.split() if len(word) > 3} | {"urban", "planning"})

    def icon(self) -> QIcon:
        """Return the picture beside the title."""
        return self.provider().icon() if self.provider() else super().icon()

    def shortDescription(self) -> str:
        """Return one sentence."""
        return tr(self.spec.summary)

    def shortHelpString(self) -> str:
        """Return the text beside the dialog: what the algorithm does, and its sources."""
        paragraphs = [self.spec.summary, *self.spec.description.split("\n\n")]
        text = "".join(f"<p>{escape(tr(paragraph))}</p>" for paragraph in paragraphs)
        sources = "".join(f"<li>{escape(source)}</li>" for source in self.spec.references)
        return text + (f"<p><b>{tr('Sources')}</b></p><ul>{sources}</ul>" if sources else "")

    def initAlgorithm(self, configuration: dict[str, Any] | None = None) -> None:
        """Declare parameters and outputs."""
        del configuration
        for definition in definitions(self.spec):
            definition.setDescription(tr(definition.description()))
            self.addParameter(definition)

    def checkParameterValues(
        self, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> tuple[bool, str]:
        """Say all that is wrong with the values, before anything runs."""
        good, message = super().checkParameterValues(parameters, context)
        if not good:
            return good, message
        problems = self._problems(parameters, context)
        problems += Destinations(self, parameters, context).problems()
        return not problems, "\n".join(problems)

    def processAlgorithm(
        self,
        parameters: dict[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> dict[str, Any]:
        """Read the layers, run the engine, and give what it made to sinks and files."""
        destinations = Destinations(self, parameters, context)
        problems = self._problems(parameters, context)  # in a model nobody has looked before
        if problems:
            raise QgsProcessingException("\n".join(problems))
        with errors_as_sentences():
            dependencies.require_engine(
                maps=bool(destinations.of_kind(OutputKind.MAP)),
                reports=bool(destinations.of_kind(OutputKind.REPORT)),
            )
            from qgis_plugin.run import run

            params = self.spec.params.from_values(
                self._values(parameters, context), self._layers(parameters)
            )
            return run(self, params, destinations, progress_to(feedback), feedback)

    def _problems(self, parameters: dict[str, Any], context: QgsProcessingContext) -> list[str]:
        """Say what is wrong with the values, with the names that the dialog shows."""
        values = self._values(parameters, context)
        problems = self.spec.params.problems_with(values, self._label, self._layers(parameters))
        crs = parameters.get(CRS)
        named = is_given(parameters, CRS) and not isinstance(crs, QgsCoordinateReferenceSystem)
        if named and not self.parameterAsCrs(parameters, CRS, context).isValid():
            label = _QUOTED.format(self.parameterDefinition(CRS).description())
            problems.append(f"{label} is not known: {crs!r}. Give a code such as EPSG:32630.")
        return problems

    def _layers(self, parameters: dict[str, Any]) -> list[str]:
        """Names of the layers besides the land that were given."""
        layers = (item.name for item in self.spec.inputs if item.kind.of_site)
        return [name for name in layers if is_given(parameters, parameter_name(name))]

    def _values(self, parameters: dict[str, Any], context: QgsProcessingContext) -> dict[str, Any]:
        """Values of the parameters that were given, as the parameter class takes them."""
        values = {}
        for field in self.spec.params.fields():
            if is_given(parameters, parameter_name(field.name)):
                values[field.name] = self._value(field, parameters, context)
        return values

    def _value(
        self, field: ParamField, parameters: dict[str, Any], context: QgsProcessingContext
    ) -> Any:
        name = parameter_name(field.name)
        if issubclass(field.kind, enum.Enum):
            return list(field.kind)[self.parameterAsEnum(parameters, name, context)]
        if field.kind is bool:
            return self.parameterAsBoolean(parameters, name, context)
        if field.kind is str:
            return self.parameterAsString(parameters, name, context)
        if isinstance(parameters[name], str):
            return parameters[name]  # QGIS would take what is no number for the default
        number = self.parameterAsDouble(parameters, name, context)
        return int(number) if field.kind is int and number.is_integer() else number

    def _label(self, name: str) -> str:
        """Return what a parameter or an input is called in the dialog."""
        labels = {field.name: field.param.label for field in self.spec.params.fields()}
        labels |= {item.name: item.label for item in self.spec.inputs}
        return _QUOTED.format(labels[name])
