"""Results in the layer tree: one group for each run, and the styles of the layout file."""

from __future__ import annotations

from typing import TYPE_CHECKING

from qgis.core import (
    QgsLayerTreeGroup,
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingLayerPostProcessorInterface,
    QgsProject,
    QgsVectorLayer,
)
from qgis.PyQt.QtXml import QDomDocument

from urban_processing.layout_file.styles import layer_style
from urban_processing.schema import ISSUES, JUNCTIONS, PARCELS, STREETS, Layer

if TYPE_CHECKING:
    from qgis_plugin.provider import UrbanProcessingProvider

_FROM_TOP = (ISSUES, JUNCTIONS, STREETS, PARCELS)
"""Layers from top to bottom; the others lie below in the order of the schema."""


class ResultGroup:
    """The layers of one run in a group of the project's layer tree.

    Parameters
    ----------
    title
        Name of the group.
    """

    def __init__(self, title: str) -> None:
        self.title = title
        self.group: QgsLayerTreeGroup | None = None
        self.placed: list[tuple[int, str]] = []

    def will_load(
        self,
        layer: Layer,
        layer_id: str,
        context: QgsProcessingContext,
        provider: UrbanProcessingProvider,
    ) -> None:
        """Have a layer named, styled and grouped once QGIS has loaded it."""
        details = context.layerToLoadOnCompletionDetails(layer_id)
        details.name = layer.title
        style = ResultStyle(layer, self, provider)
        provider.styles.append(style)
        details.setPostProcessor(style)

    def place(self, layer: Layer, loaded: QgsVectorLayer, project: QgsProject) -> None:
        """Move a loaded layer into the group, in its place from top to bottom."""
        node = project.layerTreeRoot().findLayer(loaded.id())
        if node is None:
            return
        parent = node.parent()
        if self.group is None:
            self.group = parent.insertGroup(0, self.title)
        rank = (_rank(layer), loaded.id())
        self.placed = sorted([*self.placed, rank])
        self.group.insertChildNode(self.placed.index(rank), node.clone())
        parent.removeChildNode(node)


class ResultStyle(QgsProcessingLayerPostProcessorInterface):
    """The style of one result; the provider keeps it alive until it has been used."""

    def __init__(self, layer: Layer, group: ResultGroup, provider: UrbanProcessingProvider) -> None:
        super().__init__()
        self.layer = layer
        self.group = group
        self.provider = provider

    def postProcessLayer(  # noqa: N802
        self,
        loaded: QgsVectorLayer,
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> None:
        """Style and place a layer, once it is in the project."""
        del feedback
        apply_style(self.layer, loaded)
        project = context.project()
        if project is not None:
            self.group.place(self.layer, loaded, project)
        self.provider.styles.remove(self)


def apply_style(layer: Layer, loaded: QgsVectorLayer) -> None:
    """Give a layer the style that the layout file has for it."""
    qml = layer_style(layer.name, aliases={column.name: column.label for column in layer.columns})
    if qml is None:
        return
    document = QDomDocument()
    document.setContent(qml)
    loaded.importNamedStyle(document)
    loaded.triggerRepaint()


def _rank(layer: Layer) -> int:
    return _FROM_TOP.index(layer) if layer in _FROM_TOP else len(_FROM_TOP)
