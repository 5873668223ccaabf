"""A session's layout as the layers and the file that the toolbox makes.

`made_layers` and `write_file` run on the thread, after `dependencies.require_engine`.
"""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from qgis.core import (
    QgsApplication,
    QgsProcessing,
    QgsProcessingContext,
    QgsProcessingOutputLayerDefinition,
    QgsProject,
)

from qgis_plugin.definitions import sinks
from qgis_plugin.destinations import Destinations
from qgis_plugin.geopackage import OGR
from qgis_plugin.products import product
from qgis_plugin.run import write_sinks
from urban_processing.algorithms import OutputKind
from urban_processing.layout import Layout
from urban_processing.layout_file.files import as_written, write_layout

if TYPE_CHECKING:
    from qgis_plugin.algorithm import SpecAlgorithm

_OUTPUT = "output"


def made_layers(layout: Layout, algorithm: SpecAlgorithm, title: str) -> QgsProcessingContext:
    """Make temporary layers of a layout: those that co-generation makes unless told otherwise.

    The layers are in the context that is returned, which the window's thread may take over.
    """
    project = QgsProject.instance()
    context = QgsProcessingContext()
    context.setProject(project)
    destinations = Destinations(
        algorithm,
        {
            sink.parameter: QgsProcessingOutputLayerDefinition(
                QgsProcessing.TEMPORARY_OUTPUT, project
            )
            for sink in sinks(algorithm.spec)
            if sink.layer.shown
        },
        context,
    )
    write_sinks({_OUTPUT: product(OutputKind.LAYOUT, layout)}, destinations, title)
    context.pushToThread(QgsApplication.instance().thread())
    return context


def write_file(layout: Layout, path: Path) -> Path:
    """Write a layout file, which the toolbox and the command line read."""
    return write_layout(as_written(layout), path, library=OGR, overwrite=True)
