"""The dock driven as a planner drives it: buttons, clicks on the map, keys."""

from __future__ import annotations

import importlib
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from in_qgis import square
from qgis.core import (
    QgsCoordinateReferenceSystem,
    QgsFeature,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsRectangle,
)
from qgis.PyQt.QtCore import QCoreApplication, QEvent, QPoint, QPointF, Qt
from qgis.PyQt.QtGui import QMouseEvent
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
        return self.rest_on(self.point(x, y))

    def rest_on(self, pixel: QPoint) -> Any:
        """Rest with the cursor on a pixel; QTest moves the real cursor, which is not there."""
        none = Qt.MouseButton.NoButton
        move = QMouseEvent(
            QEvent.Type.MouseMove, QPointF(pixel), none, none, Qt.KeyboardModifier.NoModifier
        )
        QCoreApplication.sendEvent(self.canvas.viewport(), move)
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


@pytest.fixture(autouse=True)
def no_mistakes(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """What Qt calls may not raise; QGIS, too, would show it."""
    raised: list[BaseException] = []
    monkeypatch.setattr(sys, "excepthook", lambda kind, error, trace: raised.append(error))
    yield
    if raised:
        raise raised[0]


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
    qgis_iface.newProject()
    for _ in range(3):
        QCoreApplication.processEvents()


@pytest.fixture
def table(plugin: Any, qgis_iface: Any) -> Table:
    canvas = qgis_iface.mapCanvas()
    canvas.window().show()
    canvas.resize(640, 640)
    QCoreApplication.processEvents()
    assert canvas.viewport().width() > 600
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


def test_opening_the_dock_loads_neither_numpy_nor_shapely(plugins: Path) -> None:
    """In the programs of QGIS their first import must go the plugin's own way."""
    code = f"""
import sys
sys.path[:0] = [{str(plugins)!r}, "/usr/share/qgis/python/plugins"]
import qgis.gui, qgis.PyQt.QtXml, processing.tools.dataobjects
before = set(sys.modules)
import urban_processing_qgis.dock
new = {{name.partition(".")[0] for name in set(sys.modules) - before}}
print(sorted(new & {{"numpy", "scipy", "shapely", "processing"}}))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code], capture_output=True, text=True, check=False
    )
    assert done.stdout.strip().endswith("[]"), done.stdout + done.stderr


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


def test_the_whole_of_figure_15(begun: Table) -> None:
    """Chen 2024, Fig. 15: streets, steps, another cut, a park, another street; then layers."""
    begun.tool("add_street")
    begun.draw((-2, 120), (303, 120))  # clicks next to a boundary are on it
    begun.draw((180, 122), (180, 298))
    assert len(begun.features) == 3, begun.panel.note.text()
    begun.click(begun.panel.step)
    assert begun.view.level == 1

    begun.tool("choose")
    under = begun.rest(60, 60)
    assert under is not None
    assert len(under.options) >= 2
    assert begun.panel.candidates.rowCount() == len(under.options)
    before = set(begun.features)
    QTest.keyClick(begun.canvas, "2")
    begun.wait()
    assert under.parcel not in begun.features
    assert len(set(begun.features) - before) == 2
    begun.click(begun.panel.step)

    begun.tool("undo_cut")
    count = len(begun.features)
    begun.on_map(60, 60)
    assert len(begun.features) < count
    begun.tool("lock")
    begun.on_map(60, 60)
    [park] = [f for f in begun.features.values() if f["land_use"] == "park"]
    assert park["state"] == "locked"
    assert park.geometry().contains(QgsPointXY(X + 60, Y + 60))

    begun.click(begun.panel.step)
    assert park["parcel"] in begun.features
    begun.tool("add_street")
    begun.draw((240, 2), (240, 119))
    assert not begun.panel.note.text().startswith("There"), begun.panel.note.text()

    begun.click(begun.panel.to_layers)
    assert begun.view.complete
    loaded = {made.name(): made for made in QgsProject.instance().mapLayers().values()}
    parcels = loaded["Parcels"]
    assert parcels.featureCount() == len(begun.features)
    assert [f["land_use"] for f in parcels.getFeatures()].count("park") == 1
    assert {f["fixed_id"] for f in loaded["Streets"].getFeatures()} >= {1, 2, 3}
    node = QgsProject.instance().layerTreeRoot().findLayer(parcels.id())
    assert node.parent().name() == "land"
    assert parcels.renderer().type() == "RuleRenderer"


def test_what_is_refused_changes_nothing_and_says_why(begun: Table) -> None:
    begun.tool("lock")
    begun.on_map(-10, -10)
    assert "no parcel" in begun.panel.note.text()
    assert begun.warnings
    begun.tool("remove_street")
    begun.on_map(150, 150)
    begun.tool("undo_cut")
    begun.on_map(150, 150)
    begun.tool("cut")
    begun.draw((2, 150), (5, 150))
    assert len(begun.features) == 1
    assert not begun.view.can_undo
    assert not begun.steering.unsaved


def test_a_drawn_cut_and_a_merge(begun: Table) -> None:
    begun.tool("cut")
    begun.draw((100, -5), (110, 150), (100, 305))
    assert len(begun.features) == 2, begun.panel.note.text()
    tool = begun.tool("merge")
    begun.on_map(50, 150)
    begun.on_map(200, 150)
    assert len(tool.chosen) == 2
    begun.on_map(200, 150)  # a second click takes it out
    assert len(tool.chosen) == 1
    begun.on_map(200, 150)
    QTest.keyClick(begun.canvas, Qt.Key.Key_Return)
    begun.wait()
    assert len(begun.features) == 1, begun.panel.note.text()
    assert not tool.chosen
    [whole] = begun.features.values()
    begun.tool("unlock")
    begun.on_map(150, 150)
    assert begun.features[whole["parcel"]]["state"] == "to cut"


def test_escape_starts_over(begun: Table) -> None:
    tool = begun.tool("cut")
    begun.on_map(100, 5)
    begun.on_map(100, 100)
    QTest.keyClick(begun.canvas, Qt.Key.Key_Backspace)
    assert len(tool.points) == 1
    QTest.keyClick(begun.canvas, Qt.Key.Key_Escape)
    assert not tool.points
    begun.on_map(100, 100, Qt.MouseButton.RightButton)
    assert len(begun.features) == 1


def test_the_nearest_candidate_stands_out_and_a_click_chooses_it(begun: Table) -> None:
    tool = begun.tool("choose")
    under = begun.rest(150, 150)
    last = under.options[-1]
    line = tool.overlay.line_of(last.rank)
    at = line.interpolate(0.3 * line.length()).asPoint()
    begun.rest(at.x() - X, at.y() - Y)
    assert tool.overlay.highlighted == last.rank
    assert begun.panel.candidates.selectedIndexes()[0].row() == last.rank - 1
    begun.on_map(at.x() - X, at.y() - Y)
    areas = sorted(f.geometry().area() for f in begun.features.values())
    assert areas == pytest.approx(sorted(last.areas), rel=1e-6)
    assert tool.overlay.ranks == ()


def test_the_newest_question_wins(begun: Table) -> None:
    begun.click(begun.panel.step)
    begun.tool("choose")
    answers: list[Any] = []
    begun.steering.hovered.connect(answers.append)
    for x in (20, 60, 100, 140, 180, 220, 280):
        begun.steering.hover((X + x, Y + 150.0), with_options=True)
    begun.wait()
    shown = [answer.parcel for answer in answers]
    right = next(n for n, f in begun.features.items() if f.geometry().contains(_at(280, 150)))
    assert shown[-1] == right
    assert len(shown) < 7


def test_branches_are_offered_and_gone_to(begun: Table) -> None:
    begun.click(begun.panel.step)
    steps = set(begun.features)
    assert begun.panel.branches.isHidden()
    begun.click(begun.panel.undo)
    begun.tool("cut")
    begun.draw((100, -5), (100, 305))
    assert not begun.panel.branches.isHidden()
    assert begun.panel.branches.count() == 2
    other = 1 - begun.panel.branches.currentIndex()
    begun.panel.branches.activated.emit(other)
    begun.wait()
    assert set(begun.features) == steps


def test_it_is_saved_and_opened_again(
    begun: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun.click(begun.panel.step)
    begun.tool("lock")
    begun.on_map(60, 60)
    was = {n: (f["land_use"], f.geometry().asWkb()) for n, f in begun.features.items()}
    assert begun.steering.unsaved
    path = tmp_path / "steered"
    _answer_file(monkeypatch, begun, "getSaveFileName", path)
    begun.click(begun.panel.save)
    assert not begun.steering.unsaved
    saved = tmp_path / "steered.json"
    assert saved.is_file()
    begun.click(begun.panel.end)
    assert begun.view is None
    assert not [m for m in QgsProject.instance().mapLayers().values() if "steering" in m.name()]
    _answer_file(monkeypatch, begun, "getOpenFileName", saved)
    begun.click(begun.dock.start_panel.open)
    assert {n: (f["land_use"], f.geometry().asWkb()) for n, f in begun.features.items()} == was


def test_a_session_of_other_land_is_not_opened(
    begun: Table, layer: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun.click(begun.panel.step)
    begun.steering.save(tmp_path / "one.json")
    begun.wait()
    begun.click(begun.panel.end)
    other = layer([square(SIDE + 50, X, Y)], name="other")
    QgsProject.instance().addMapLayer(other)
    begun.dock.start_panel.land.setLayer(other)
    _answer_file(monkeypatch, begun, "getOpenFileName", tmp_path / "one.json")
    begun.click(begun.dock.start_panel.open)
    assert begun.view is None
    assert begun.dock.start_note.text()
    assert begun.warnings


def test_a_layout_file_is_written_and_gone_on_with(
    begun: Table, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun.click(begun.panel.step)
    begun.click(begun.panel.step)
    areas = sorted(round(f["area_m2"], 3) for f in begun.features.values())
    _answer_file(monkeypatch, begun, "getSaveFileName", tmp_path / "level.gpkg")
    begun.click(begun.panel.write)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.Yes)
    begun.click(begun.panel.end)
    start = begun.dock.start_panel
    start.on_file.setChecked(True)
    start.file.setFilePath(str(tmp_path / "level.gpkg"))
    begun.click(start.begin)
    assert begun.view.level == 2, begun.warnings
    assert sorted(round(f["area_m2"], 3) for f in begun.features.values()) == areas
    begun.click(begun.panel.step)
    assert begun.view.level == 3


def test_a_session_with_unsaved_edits_is_not_lost_by_a_slip(
    begun: Table, monkeypatch: pytest.MonkeyPatch
) -> None:
    begun.click(begun.panel.step)
    monkeypatch.setattr(QMessageBox, "question", lambda *_: QMessageBox.StandardButton.No)
    begun.click(begun.panel.end)
    assert begun.view is not None


def test_only_what_changed_is_changed_in_the_layers(begun: Table) -> None:
    for _ in range(3):
        begun.click(begun.panel.step)
    before = {n: f.id() for n, f in begun.features.items()}
    begun.tool("lock")
    begun.on_map(60, 60)
    after = {n: f.id() for n, f in begun.features.items()}
    assert before.keys() == after.keys()
    assert sum(before[n] != after[n] for n in before) == 1


def test_the_map_may_have_another_crs(begun: Table) -> None:
    begun.canvas.setDestinationCrs(QgsCoordinateReferenceSystem("EPSG:4326"))
    layer = begun.steering.layers.parcels.layer
    begun.canvas.setExtent(
        begun.canvas.mapSettings().layerExtentToOutputExtent(layer, layer.extent())
    )
    tool = begun.tool("choose")
    middle = begun.canvas.extent().center()
    at = begun.canvas.getCoordinateTransform().transform(middle)
    pixel = QPoint(round(at.x()), round(at.y()))
    begun.rest_on(pixel)
    assert tool.under is not None
    assert begun.canvas.extent().contains(tool.overlay.line_of(1).boundingBox())
    QTest.mouseClick(begun.canvas.viewport(), Qt.MouseButton.LeftButton, pos=pixel)
    begun.wait()
    assert len(begun.features) == 2


def test_a_run_is_stopped(begun: Table) -> None:
    begun.dock.start_panel.size.setValue(50)
    stopped: list[bool] = []
    begun.steering.progressed.connect(lambda *_: (begun.steering.cancel(), stopped.append(True)))
    QTest.mouseClick(begun.panel.finish, Qt.MouseButton.LeftButton)
    assert not begun.panel.step.isEnabled()
    assert begun.panel.step.toolTip()
    assert not begun.panel.cancel.isHidden()
    begun.steering.cancel()
    begun.wait()
    assert "Stopped" in begun.panel.note.text()
    assert not begun.view.can_undo
    assert begun.panel.step.isEnabled()


def test_layers_that_were_taken_away_come_back(begun: Table) -> None:
    begun.click(begun.panel.step)
    QgsProject.instance().removeMapLayer(begun.steering.layers.parcels.layer.id())
    begun.wait()
    begun.click(begun.panel.step)
    assert len(begun.features) == len(begun.features) == begun.view.parcels
    QgsProject.instance().clear()
    begun.wait()
    begun.click(begun.panel.undo)
    assert len(begun.features) == begun.view.parcels == 2


def test_hand_edits_are_taken_over(begun: Table) -> None:
    begun.click(begun.panel.step)
    assert begun.panel.adopt.isHidden() or not begun.panel.adopt.isVisible()
    layer = begun.steering.layers.parcels.layer
    layer.startEditing()
    assert not begun.panel.step.isEnabled()
    assert "hand" in begun.panel.step.toolTip()
    one, other = begun.features.values()
    joined = one.geometry().combine(other.geometry())
    layer.changeGeometry(one.id(), joined)
    layer.deleteFeature(other.id())
    begun.click(begun.panel.adopt)
    assert not layer.isEditable()
    [whole] = begun.features.values()
    assert whole.geometry().area() == pytest.approx(SIDE**2)
    assert begun.view.can_undo
    begun.click(begun.panel.undo)
    assert len(begun.features) == 2


def test_hand_edits_that_do_not_fit_stay_to_be_corrected(begun: Table) -> None:
    begun.click(begun.panel.step)
    layer = begun.steering.layers.parcels.layer
    layer.startEditing()
    one, other = begun.features.values()
    layer.changeGeometry(one.id(), other.geometry())  # one upon the other
    begun.click(begun.panel.adopt)
    assert begun.panel.note.text()
    assert begun.warnings
    assert layer.isEditable()
    assert begun.features[one["parcel"]].geometry().equals(other.geometry())
    begun.click(begun.panel.discard)
    assert not layer.isEditable()
    assert begun.features[one["parcel"]].geometry().equals(one.geometry())
    assert begun.panel.step.isEnabled()


def test_hand_edits_that_were_saved_in_the_layer_count_as_well(begun: Table) -> None:
    begun.click(begun.panel.step)
    layer = begun.steering.layers.streets.layer
    layer.startEditing()
    drawn = QgsFeature(layer.fields())
    drawn.setGeometry(QgsGeometry.fromPolylineXY([_at(0, 0), _at(SIDE, SIDE)]))
    layer.addFeature(drawn)
    assert layer.commitChanges()
    assert begun.steering.layers.are_edited
    begun.click(begun.panel.discard)
    assert not begun.steering.layers.are_edited
    assert layer.featureCount() == len(begun.steering.layers.streets._ids)


def test_closing_the_dock_keeps_the_session(begun: Table) -> None:
    begun.click(begun.panel.step)
    begun.tool("choose")
    begun.dock.close()
    assert begun.canvas.mapTool() not in begun.dock.tools.values()
    begun.plugin.show_dock(True)
    assert begun.view.level == 1
    begun.click(begun.panel.step)
    assert begun.view.level == 2


def test_unloading_leaves_nothing(begun: Table, qgis_iface: Any) -> None:
    window = qgis_iface.mainWindow()
    items = len(begun.canvas.scene().items())
    begun.tool("choose")
    begun.rest(150, 150)
    for _ in range(2):
        begun.click(begun.panel.step)
    QTest.mouseClick(begun.panel.finish, Qt.MouseButton.LeftButton)  # and it is still going on
    worker = begun.steering.worker
    begun.plugin.provider = None  # other tests go on with it
    begun.plugin.unload()
    for _ in range(5):
        QCoreApplication.processEvents()
    QCoreApplication.sendPostedEvents(None, 52)  # deferred deletes
    assert worker.is_idle
    assert begun.plugin.dock is None
    assert not [
        d for d in window.findChildren(QDockWidget) if d.objectName() == "UrbanProcessingSteering"
    ]
    assert not [m for m in QgsProject.instance().mapLayers().values() if "steering" in m.name()]
    assert QgsProject.instance().layerTreeRoot().findGroup("Steering") is None
    assert len(begun.canvas.scene().items()) < items


def test_disabled_buttons_say_why(table: Table) -> None:
    start = table.dock.start_panel
    assert not start.begin.isEnabled()
    assert "layer" in start.begin.toolTip().lower()
    start.on_file.setChecked(True)
    assert "file" in start.begin.toolTip().lower()


def test_selected_features_alone(table: Table, layer: Callable[..., Any]) -> None:
    land = layer([square(100, X, Y), square(150, X + 200, Y)])
    QgsProject.instance().addMapLayer(land)
    start = table.dock.start_panel
    assert not start.selected.isEnabled()
    land.selectByIds([2])
    assert start.selected.isEnabled()
    start.selected.setChecked(True)
    table.click(start.begin)
    assert sum(f["area_m2"] for f in table.features.values()) == pytest.approx(150**2)


def test_what_is_there_already_is_given(table: Table, layer: Callable[..., Any]) -> None:
    project = QgsProject.instance()
    project.addMapLayer(layer([square(SIDE, X, Y)], name="land"))
    street = f"LINESTRING ({X} {Y + 90}, {X + SIDE} {Y + 90})"
    given = layer([street], kind="LineString", name="road")
    lake = layer([square(60, X + 100, Y + 150)], name="lake")
    project.addMapLayers([given, lake])
    start = table.dock.start_panel
    start.land.setLayer(project.mapLayersByName("land")[0])
    boxes = {kind.name: box for kind, box in start.further.items()}
    boxes["FIXED_STREETS"].setLayer(given)
    boxes["OBSTACLES"].setLayer(lake)
    table.click(start.begin)
    assert table.view is not None, table.warnings
    fixed = [f["fixed_id"] for f in table.steering.layers.streets.layer.getFeatures()]
    assert 1 in fixed
    area = sum(f["area_m2"] for f in table.features.values())
    assert area == pytest.approx(SIDE**2 - 60**2)


def test_drawing_while_the_layout_is_finished_is_refused(begun: Table) -> None:
    begun.tool("cut")
    QTest.mouseClick(begun.panel.finish, Qt.MouseButton.LeftButton)
    begun.steering.cut([(X, Y + 100), (X + SIDE, Y + 100)])
    assert begun.panel.note.text().startswith("Wait")
    begun.wait()
    assert begun.view.complete
    begun.click(begun.panel.undo)
    assert len(begun.features) == 1


def test_what_is_wrong_with_the_land_is_said(table: Table, layer: Callable[..., Any]) -> None:
    QgsProject.instance().addMapLayer(layer([square(10, X, Y)], crs="EPSG:4326"))
    table.click(table.dock.start_panel.begin)
    assert table.view is None
    assert table.dock.start_note.text()
    assert table.dock.start_panel.begin.isEnabled()


def _at(x: float, y: float) -> QgsPointXY:
    return QgsPointXY(X + x, Y + y)


def _answer_file(monkeypatch: pytest.MonkeyPatch, table: Table, ask: str, path: Path) -> None:
    """Answer the dialogs of the plugin that ask for a file."""
    from qgis.PyQt.QtWidgets import QFileDialog

    monkeypatch.setattr(QFileDialog, ask, lambda *_: (str(path), ""))
