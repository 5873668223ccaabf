"""Results in the layer tree: one group for each run, and the styles of the layout file."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

from processing.core.ProcessingConfig import ProcessingConfig
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
from urban_processing.persistence.layers import CHANGES
from urban_processing.schema import (
    BLOCK_EDGES,
    BLOCKS,
    ISSUES,
    JUNCTIONS,
    LAYERS,
    NET_PARCELS,
    PARCELS,
    RIGHT_OF_WAY,
    STREETS,
    Layer,
)

if TYPE_CHECKING:
    from qgis_plugin.provider import UrbanProcessingProvider

_FROM_TOP = tuple(
    layer.name
    for layer in (
        ISSUES,
        JUNCTIONS,
        STREETS,
        BLOCK_EDGES,
        RIGHT_OF_WAY,
        NET_PARCELS,
        CHANGES,
        PARCELS,
        BLOCKS,
    )
)
"""Layers from top to bottom, by name; the others lie below in the order of the schema."""


class ResultGroup:
    """The layers of one run in a group of the project's layer tree.

    Parameters
    ----------
    title
        Name of the group.
    history
        How the layers came about, one sentence for each step.
    """

    def __init__(self, title: str, history: Sequence[str] = ()) -> None:
        self.title = title
        self.history = tuple(history)
        self.group: QgsLayerTreeGroup | None = None
        self.ranks: dict[str, int] = {}

    def will_load(
        self,
        layer: Layer,
        layer_id: str,
        context: QgsProcessingContext,
        provider: UrbanProcessingProvider,
    ) -> None:
        """Have a layer styled and grouped once QGIS has loaded it."""
        details = context.layerToLoadOnCompletionDetails(layer_id)
        style = ResultStyle(layer, self, provider)
        provider.styles.append(style)
        details.setPostProcessor(style)

    def place(self, layer: Layer, loaded: QgsVectorLayer, project: QgsProject) -> None:
        """Move a loaded layer into the group, in its place from top to bottom."""
        node = project.layerTreeRoot().findLayer(loaded.id())
        if node is None:
            return
        if self.group is None:
            self.group = _results(project).insertGroup(0, self.title)
        self.ranks[loaded.id()] = _rank(layer)
        above = [
            child
            for child in self.group.findLayers()
            if self.ranks.get(child.layerId(), len(LAYERS)) <= _rank(layer) and child != node
        ]
        children = self.group.children()
        place = 1 + children.index(above[-1]) if above else 0
        # a layer that leaves the tree for a moment would leave the project: in first, then out
        self.group.insertChildNode(place, node.clone())
        node.parent().removeChildNode(node)


class ResultStyle(QgsProcessingLayerPostProcessorInterface):
    """The style of one result; the provider keeps it alive until it has been used."""

    def __init__(self, layer: Layer, group: ResultGroup, provider: UrbanProcessingProvider) -> None:
        super().__init__()
        self.layer = layer
        self.group = group
        self.provider = provider

    def postProcessLayer(
        self,
        loaded: QgsVectorLayer,
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
    ) -> None:
        """Style and place a layer, once it is in the project."""
        del feedback
        self.provider.styles.remove(self)
        apply_style(self.layer, loaded)
        describe(self.layer, loaded, self.group.history)
        project = context.project()
        if project is not None:
            self.group.place(self.layer, loaded, project)


def apply_style(layer: Layer, loaded: QgsVectorLayer) -> None:
    """Give a layer readable names of columns, and the style that the layout file has for it."""
    for column in layer.columns:
        loaded.setFieldAlias(loaded.fields().lookupField(column.name), column.label)
    qml = layer_style(layer, places_only=True)
    if qml is None:
        return
    document = QDomDocument()
    document.setContent(qml)
    loaded.importNamedStyle(document)
    loaded.triggerRepaint()


def describe(layer: Layer, loaded: QgsVectorLayer, history: Sequence[str]) -> None:
    """Have a layer's properties say what its columns mean and how it was made."""
    metadata = loaded.metadata()
    metadata.setTitle(layer.title)
    columns = [f"{column.name}: {column.description}" for column in layer.columns]
    metadata.setAbstract("\n".join(columns))
    metadata.setHistory(list(history))
    loaded.setMetadata(metadata)


def _results(project: QgsProject) -> QgsLayerTreeGroup:
    """Where results go: the group that the user's settings name, else the top."""
    root = project.layerTreeRoot()
    name = ProcessingConfig.getSetting(ProcessingConfig.RESULTS_GROUP_NAME)
    return (root.findGroup(name) if name else None) or root


def _rank(layer: Layer) -> int:
    return _FROM_TOP.index(layer.name) if layer.name in _FROM_TOP else len(_FROM_TOP)
