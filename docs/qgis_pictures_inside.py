"""What `qgis_pictures` has QGIS do: the steps, and a picture after each."""

from __future__ import annotations

import os
import traceback
from collections.abc import Callable, Iterator
from pathlib import Path

from processing.gui.AlgorithmDialog import AlgorithmDialog
from qgis.core import QgsApplication, QgsPointXY, QgsProject, QgsRectangle, QgsVectorLayer
from qgis.PyQt.QtCore import QLocale, QPoint, Qt, QTimer
from qgis.PyQt.QtGui import QCursor
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QDockWidget, QTreeView, QWidget
from qgis.utils import iface, plugins

SAMPLES = Path(os.environ["URBAN_PROCESSING_SAMPLES"])
IMAGES = Path(os.environ["URBAN_PROCESSING_IMAGES"])
ONLY = os.environ["URBAN_PROCESSING_ONLY"]


def go_through() -> None:
    """Go through the steps, each after a pause in which QGIS draws; end QGIS after the last."""
    QLocale.setDefault(QLocale("en_GB"))
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
    if ONLY != "steering":
        yield from _toolbox_pictures()
    if ONLY != "toolbox":
        QgsProject.instance().clear()
        yield from _steering_picture()


def _toolbox_pictures() -> Iterator[float]:
    window = iface.mainWindow()
    for dock in window.findChildren(QDockWidget):
        dock.setVisible(dock.objectName() in ("Layers", "ProcessingToolbox"))
    window.showMaximized()
    land = _load("schellenberg", "boundary")
    toolbox = window.findChild(QDockWidget, "ProcessingToolbox")
    tree = toolbox.findChild(QTreeView)
    yield 2

    toolbox.searchBox.setText("urban planning")
    tree.expandAll()
    yield 2
    toolbox.setFloating(True)
    toolbox.resize(420, 260)
    yield 1
    _save(toolbox, IMAGES / "qgis_toolbox.png")

    dialog = _dialog("cogenerate", {"BOUNDARY": land.id(), "PARCELS": 500, "PATTERN": 1})
    dialog.resize(1000, 820)
    dialog.show()
    yield 2
    _save(dialog, IMAGES / "qgis_dialog.png")
    yield from _run(dialog, "Parcels")
    toolbox.setVisible(False)
    yield from _show("Parcels", hidden=[land])
    _save(window, IMAGES / "qgis_result.png")

    QgsProject.instance().clear()
    streets = _load("streets_auckland", "streets")
    yield from _run(_dialog("blocks", {"STREETS": streets.id()}), "Blocks")
    blocks, edges = (
        QgsProject.instance().mapLayersByName(n)[0] for n in ("Blocks", "Edges of blocks")
    )
    given = {"BLOCKS": blocks.id(), "STREETS": edges.id(), "MIN_AREA": 400}
    yield from _run(_dialog("subdivide", given), "Parcels")
    yield from _show("Parcels", hidden=[streets, blocks, edges])
    _save(window, IMAGES / "qgis_subdivide.png")


def _steering_picture() -> Iterator[float]:
    """A session on a sample: a street, a park, and the candidates of a parcel."""
    window = iface.mainWindow()
    for dock in window.findChildren(QDockWidget):
        dock.setVisible(dock.objectName() == "Layers")
    window.showMaximized()
    land = _load("wandsworth", "boundary")
    plugin = plugins["urban_processing_qgis"]
    plugin.show_dock(True)
    dock, steering = plugin.dock, plugin.dock.steering
    canvas = iface.mapCanvas()
    dock.start_panel.size_kind.setCurrentIndex(1)
    dock.start_panel.size.setValue(500)
    yield 2
    dock.start_panel.begin.click()
    yield from _until(lambda: steering.view is not None)
    QgsProject.instance().layerTreeRoot().findLayer(land.id()).setItemVisibilityChecked(False)
    QgsProject.instance().setCrs(steering.crs)
    parcels = steering.layers.parcels.layer

    def idle() -> bool:
        return not steering.is_busy and steering.worker.is_idle

    def pixel(point: QgsPointXY) -> QPoint:
        at = canvas.getCoordinateTransform().transform(point)
        return QPoint(round(at.x()), round(at.y()))

    def click(point: QgsPointXY, button: Qt.MouseButton = Qt.MouseButton.LeftButton) -> None:
        QTest.mouseClick(canvas.viewport(), button, pos=pixel(point))

    for _ in range(LEVELS):
        dock.panel.step.click()
        yield from _until(idle)
    canvas.setExtent(_share_of(parcels.extent(), *AROUND))
    yield 2
    park, look, *street = (_share_of(canvas.extent(), *at, *at).center() for at in PLACES)
    canvas.setExtent(_share_of(canvas.extent(), *ZOOM))
    yield 3
    dock.panel.tools["lock"].click()
    click(park)
    yield from _until(idle)
    dock.panel.tools["add_street"].click()
    dock.panel.follow.setChecked(True)
    for at in street:
        click(at)
        yield 0.3
    click(street[-1], Qt.MouseButton.RightButton)
    yield from _until(idle)
    dock.panel.tools["choose"].click()
    for shift in (QPoint(0, 0), QPoint(4, 3)):
        QCursor.setPos(canvas.viewport().mapToGlobal(pixel(look) + shift))
        yield 3
    _save(window, IMAGES / "qgis_steering.png")
    steering.unsaved = False


LEVELS = 6
AROUND, ZOOM = (0.4, 0.05, 0.95, 0.75), (0.18, 0.2, 0.74, 0.76)
PLACES = ((0.546, 0.487), (0.4, 0.45), (0.31, 0.632), (0.476, 0.667), (0.612, 0.689))
"""Boxes and places: shares of width and height, from the south-west to the north-east."""


def _share_of(
    box: QgsRectangle, west: float, south: float, east: float, north: float
) -> QgsRectangle:
    x, y = box.xMinimum(), box.yMinimum()
    width, height = box.width(), box.height()
    return QgsRectangle(x + west * width, y + south * height, x + east * width, y + north * height)


def _load(sample: str, layer: str) -> QgsVectorLayer:
    """Load a layer of a sample, and zoom to it."""
    loaded = QgsVectorLayer(f"{SAMPLES / sample}.gpkg|layername={layer}", sample)
    QgsProject.instance().addMapLayer(loaded)
    QgsProject.instance().setCrs(loaded.crs())
    iface.zoomToActiveLayer()
    return loaded


def _dialog(name: str, parameters: dict[str, object]) -> AlgorithmDialog:
    registry = QgsApplication.processingRegistry()
    algorithm = registry.createAlgorithmById(f"urban_processing:{name}")
    dialog = AlgorithmDialog(algorithm, parent=iface.mainWindow())
    dialog.setParameters(parameters)
    return dialog


def _run(dialog: AlgorithmDialog, layer: str) -> Iterator[float]:
    """Run an algorithm and wait for one of its layers."""
    dialog.show()
    yield 1
    dialog.runButton().click()
    yield from _until(lambda: bool(QgsProject.instance().mapLayersByName(layer)))
    dialog.close()


def _show(name: str, *, hidden: list[QgsVectorLayer]) -> Iterator[float]:
    """Fill the map with a layer, without some others."""
    root = QgsProject.instance().layerTreeRoot()
    for layer in hidden:
        root.findLayer(layer.id()).setItemVisibilityChecked(False)
    shown = QgsProject.instance().mapLayersByName(name)[0]
    QgsProject.instance().setCrs(shown.crs())
    canvas = iface.mapCanvas()
    canvas.setExtent(canvas.mapSettings().layerExtentToOutputExtent(shown, shown.extent()))
    canvas.zoomByFactor(1.05)
    canvas.refresh()
    yield 4


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
