"""Layers that were made on the thread, into the project."""

from __future__ import annotations

from qgis.core import (
    QgsProcessingContext,
    QgsProcessingFeedback,
    QgsProcessingUtils,
    QgsProject,
)


def load_layers(context: QgsProcessingContext) -> list[str]:
    """Add the layers of a context to the project, styled and grouped; return their ids."""
    loaded = []
    feedback = QgsProcessingFeedback()
    for layer_id, details in context.layersToLoadOnCompletion().items():
        layer = QgsProcessingUtils.mapLayerFromString(layer_id, context)
        details.setOutputLayerName(layer)
        QgsProject.instance().addMapLayer(context.temporaryLayerStore().takeMapLayer(layer))
        details.postProcessor().postProcessLayer(layer, context, feedback)
        loaded.append(layer_id)
    return loaded
