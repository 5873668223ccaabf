"""What `qgis_pictures` has QGIS do: the steps, and a picture after each."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from processing.gui.AlgorithmDialog import AlgorithmDialog
from qgis.core import QgsApplication, QgsProject, QgsVectorLayer
from qgis.PyQt.QtCore import QTimer
from qgis.PyQt.QtWidgets import QDockWidget, QTreeView, QWidget
from qgis.utils import iface

SAMPLES = Path(os.environ["URBAN_PROCESSING_SAMPLES"])
IMAGES = Path(os.environ["URBAN_PROCESSING_IMAGES"])


def go_through() -> None:
    """Go through the steps, each after a pause in which QGIS draws; end QGIS after the last."""
    steps = _steps()

    def go_on() -> None:
        try:
            pause = next(steps)
        except StopIteration:
            os._exit(0)
        except Exception:  # inside a timer nobody else would say it
            traceback.print_exc()
            os._exit(1)
        QTimer.singleShot(int(1000 * pause), go_on)

    QTimer.singleShot(3000, go_on)


def _steps() -> Iterator[float]:
    """Yield the seconds to wait after each step."""
    window = iface.mainWindow()
    for dock in window.findChildren(QDockWidget):
        dock.setVisible(dock.objectName() in ("Layers", "ProcessingToolbox"))
    window.showMaximized()
    land = QgsVectorLayer(str(SAMPLES / "schellenberg.gpkg"), "schellenberg")
    QgsProject.instance().addMapLayer(land)
    QgsProject.instance().setCrs(land.crs())
    iface.zoomToActiveLayer()
    toolbox = window.findChild(QDockWidget, "ProcessingToolbox")
    tree = toolbox.findChild(QTreeView)
    yield 2

    toolbox.searchBox.setText("parcels")
    tree.expandAll()
    yield 2
    toolbox.setFloating(True)
    toolbox.resize(420, 260)
    yield 1
    _save(toolbox, IMAGES / "qgis_toolbox.png")

    algorithm = QgsApplication.processingRegistry().createAlgorithmById(
        "urban_processing:cogenerate"
    )
    dialog = AlgorithmDialog(algorithm, parent=window)
    dialog.setParameters({"BOUNDARY": land.id(), "PARCELS": 500, "PATTERN": 1})
    dialog.resize(1000, 820)
    dialog.show()
    yield 2
    _save(dialog, IMAGES / "qgis_dialog.png")

    dialog.runButton().click()
    yield from _until(lambda: len(QgsProject.instance().mapLayers()) > 4)
    dialog.close()
    toolbox.setVisible(False)
    QgsProject.instance().layerTreeRoot().findLayer(land.id()).setItemVisibilityChecked(False)
    parcels = QgsProject.instance().mapLayersByName("Parcels")[0]
    QgsProject.instance().setCrs(parcels.crs())
    canvas = iface.mapCanvas()
    canvas.setExtent(canvas.mapSettings().layerExtentToOutputExtent(parcels, parcels.extent()))
    canvas.zoomByFactor(1.05)
    canvas.refresh()
    yield 4
    _save(window, IMAGES / "qgis_result.png")


def _until(true: Callable[[], bool], seconds: float = 60) -> Iterator[float]:
    waited = 0.0
    while not true():
        if waited > seconds:
            raise TimeoutError("QGIS did not finish in time.")
        waited += 0.5
        yield 0.5
    yield 2


def _save(widget: QWidget, path: Path) -> None:
    if not widget.grab().save(str(path)):
        raise OSError(f"{path} could not be written.")


go_through()
