"""The dock driven as a planner drives it: buttons, clicks on the map, keys."""

from __future__ import annotations

import importlib
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from in_qgis import shapes, square
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsRectangle,
)
from qgis.PyQt.QtCore import QCoreApplication, QPoint, Qt
from qgis.PyQt.QtTest import QTest
from qgis.PyQt.QtWidgets import QAbstractButton, QDockWidget, QMessageBox

SIDE, X, Y = 300.0, 690_000.0, 5_700_000.0
"""The square of land that most tests steer on."""


class Table:
    """The window as a planner has it before them: the plugin's dock and the map."""

    def __init__(self, iface: Any, plugin: Any) -> None:
        self.iface, self.plugin = iface, plugin
        self.dock = plugin.dock
        self.canvas = iface.mapCanvas()

    @property
    def panel(self) -> Any:
        return self.dock.panel

    @property
    def steering(self) -> Any:
        return self.dock.steering

    @property
    def view(self) -> Any:
        return self.steering.view

    @property
    def features(self) -> dict[int, Any]:
        """Parcels of the layer by number."""
        return {f["parcel"]: f for f in self.steering.layers.parcels.layer.getFeatures()}

    def click(self, button: QAbstractButton) -> None:
        """Click a button and wait for what it does."""
        assert button.isEnabled(), button.toolTip()
        QTest.mouseClick(button, Qt.MouseButton.LeftButton)
        self.wait()

    def tool(self, name: str) -> Any:
        """Pick a tool."""
        if not self.panel.tools[name].isChecked():
            self.click(self.panel.tools[name])
        assert self.canvas.mapTool() is self.dock.tools[name]
        return self.dock.tools[name]

    def point(self, x: float, y: float) -> QPoint:
        """Pixel of a place, given from the corner of the land."""
        at = self.canvas.getCoordinateTransform().transform(QgsPointXY(X + x, Y + y))
        return QPoint(round(at.x()), round(at.y()))

    def on_map(
        self, x: float, y: float, button: Qt.MouseButton = Qt.MouseButton.LeftButton
    ) -> None:
        """Click on the map."""
        QTest.mouseClick(self.canvas.viewport(), button, pos=self.point(x, y))
        self.wait()

    def draw(self, *places: tuple[float, float]) -> None:
        """Draw a line, and end it with the right button."""
        for x, y in places:
            self.on_map(x, y)
        self.on_map(*places[-1], Qt.MouseButton.RightButton)

    def rest(self, x: float, y: float) -> Any:
        """Rest with the cursor on a place until the map shows what is there."""
        QTest.mouseMove(self.canvas.viewport(), self.point(x, y))
        QTest.qWait(130)
        self.wait()
        return self.canvas.mapTool().under

    def wait(self, seconds: float = 60) -> None:
        """Wait until nothing is being done."""
        until = time.monotonic() + seconds
        while True:
            QCoreApplication.processEvents()
            if not self.steering.is_busy and self.steering.worker.is_idle:
                break
            assert time.monotonic() < until, "the session takes too long"
            time.sleep(0.002)
        for _ in range(3):
            QCoreApplication.processEvents()

    @property
    def warnings(self) -> list[str]:
        """What the message bar has said."""
        return [str(m) for m in self.iface.messageBar().messages]


@pytest.fixture
def plugin(provider: Any, qgis_iface: Any, qgis_new_project: None) -> Iterator[Any]:
    package = importlib.import_module("urban_processing_qgis")
    made = package.classFactory(qgis_iface)
    made.provider = provider  # registered for the whole run
    made.initProcessing = lambda: None
    made.initGui()
    yield made
    made.provider = None
    made.unload()
    for _ in range(3):
        QCoreApplication.processEvents()


@pytest.fixture
def table(plugin: Any, qgis_iface: Any) -> Table:
    canvas = qgis_iface.mapCanvas()
    canvas.resize(640, 640)
    canvas.setDestinationCrs(QgsCoordinateReferenceSystem("EPSG:32630"))
    canvas.setExtent(QgsRectangle(X - 20, Y - 20, X + SIDE + 20, Y + SIDE + 20))
    plugin.show_dock(True)
    return Table(qgis_iface, plugin)


@pytest.fixture
def begun(table: Table, layer: Callable[..., Any]) -> Table:
    """A session on a square, before its first level."""
    QgsProject.instance().addMapLayer(layer([square(SIDE, X, Y)]))
    table.dock.start_panel.size.setValue(2000)
    table.click(table.dock.start_panel.begin)
    assert table.view is not None, table.warnings
    return table


def test_a_session_begins_with_the_land_as_one_parcel(begun: Table) -> None:
    assert begun.view.level == 0
    [land] = begun.features.values()
    assert land.geometry().area() == pytest.approx(SIDE**2)
    assert land["state"] == "to cut"
    assert begun.panel.figures.shown("parcels") == "1"
    assert begun.panel.step.isEnabled()
    assert not begun.panel.undo.isEnabled()
    assert begun.panel.undo.toolTip()


def test_a_step_cuts_and_is_undone(begun: Table) -> None:
    begun.click(begun.panel.step)
    two = begun.features
    assert len(two) == 2
    assert begun.view.level == 1
    begun.click(begun.panel.undo)
    assert len(begun.features) == 1
    begun.click(begun.panel.redo)
    again = begun.features
    assert set(again) == set(two)
    assert all(again[n].geometry().asWkb() == two[n].geometry().asWkb() for n in two)
