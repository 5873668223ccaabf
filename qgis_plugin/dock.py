"""The dock that steers a layout level by level (Chen 2024, section 6: local control)."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from qgis.core import Qgis
from qgis.gui import QgsDockWidget
from qgis.PyQt.QtCore import QEvent, Qt
from qgis.PyQt.QtWidgets import (
    QFileDialog,
    QMessageBox,
    QProgressBar,
    QPushButton,
    QScrollArea,
    QStackedWidget,
    QVBoxLayout,
    QWidget,
)

from qgis_plugin.plugin import TITLE
from qgis_plugin.steering.choose_tool import ChooseTool
from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.model import Hovered
from qgis_plugin.steering.panel import SteeringPanel
from qgis_plugin.steering.start_panel import LAYOUT_FILES, SESSIONS, StartPanel
from qgis_plugin.steering.toolbox import CHOOSE, TOOLS, Options, map_tools
from qgis_plugin.steering.widgets import Note
from qgis_plugin.texts import tr

NAME = "UrbanProcessingSteering"
"""Name by which QGIS remembers where the dock stood."""

_SCROLL_BAR = 18


class SteeringDock(QgsDockWidget):
    """The dock: first what to begin with, then the session.

    Parameters
    ----------
    iface
        The window of QGIS.
    """

    def __init__(self, iface: Any) -> None:
        super().__init__(tr("Steer a layout"), iface.mainWindow())
        self.setObjectName(NAME)
        self._iface = iface
        self._canvas = iface.mapCanvas()
        self.steering = Steering()
        self.start_panel = StartPanel()
        self.panel = SteeringPanel(self.steering)
        self.start_note = Note()
        options = Options(
            land_use=lambda: self.panel.land_use,
            follow=lambda: bool(self.panel.follow.isChecked()),
            width=lambda: self.panel.street_width,
            highlighted=self.panel.candidates.highlight,
        )
        self.tools = map_tools(self._canvas, self.steering, options)
        self._lay_out()
        self._connect()

    def dispose(self) -> None:
        """Stop what is being done and take everything away, for good."""
        self._canvas.mapToolSet.disconnect(self._tool_set)
        for tool in self.tools.values():
            tool.dispose()
        self.steering.close()
        self._iface.removeDockWidget(self)
        self.deleteLater()

    def closeEvent(self, event: QEvent) -> None:
        """Put the tool away; the session stays, for when the dock is opened again."""
        self.pick_tool("")
        super().closeEvent(event)

    def pick_tool(self, name: str) -> None:
        """Have the map use a tool, none for an empty name."""
        if name:
            self._canvas.setMapTool(self.tools[name])
            self._canvas.setFocus()
            return
        for tool in self.tools.values():
            if self._canvas.mapTool() is tool:
                self._canvas.unsetMapTool(tool)

    def _lay_out(self) -> None:
        first = QWidget()
        column = QVBoxLayout(first)
        column.setContentsMargins(0, 0, 0, 0)
        column.addWidget(self.start_panel)
        column.addWidget(self.start_note)
        self.start_bar, self.start_cancel = QProgressBar(), QPushButton(tr("Cancel"))
        self.start_bar.setTextVisible(False)
        for widget in (self.start_bar, self.start_cancel):
            widget.setVisible(False)
            column.addWidget(widget)
        column.addStretch(1)
        self.pages = QStackedWidget()
        for page in (first, self.panel):
            area = QScrollArea()
            area.setWidgetResizable(True)
            area.setFrameShape(QScrollArea.Shape.NoFrame)
            area.setHorizontalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
            area.setWidget(page)
            area.setMinimumWidth(page.minimumSizeHint().width() + _SCROLL_BAR)
            self.pages.addWidget(area)
        self.setWidget(self.pages)

    def _connect(self) -> None:
        steering, panel = self.steering, self.panel
        self.start_panel.begin_asked.connect(steering.begin)
        self.start_panel.open_asked.connect(steering.open)
        self.start_cancel.clicked.connect(lambda: steering.cancel())
        panel.tool_asked.connect(self.pick_tool)
        panel.save_asked.connect(self._ask_where_to_save)
        panel.write_asked.connect(self._ask_where_to_write)
        panel.end_asked.connect(self._ask_whether_to_end)
        choose = self.tools[CHOOSE]
        if isinstance(choose, ChooseTool):
            panel.candidates.chosen.connect(choose.choose)
            panel.candidates.pointed.connect(choose.highlight)
        steering.began.connect(self._begun)
        steering.ended.connect(self._ended)
        steering.refused.connect(self._refused)
        steering.hovered.connect(self._hovered)
        steering.state_changed.connect(self._state_changed)
        steering.progressed.connect(lambda part, _: self.start_bar.setValue(round(100 * part)))
        self._canvas.mapToolSet.connect(self._tool_set)

    def _begun(self) -> None:
        self.start_note.say("")
        self.panel.figures.forget()
        self.pages.setCurrentIndex(1)

    def _ended(self) -> None:
        self.pick_tool("")
        self.pages.setCurrentIndex(0)
        self.start_panel.update_state()

    def _refused(self, problems: list[str]) -> None:
        text = "\n".join(problems)
        if self.steering.view is None:
            self.start_note.say(text, "refused")
        self._iface.messageBar().pushMessage(
            TITLE, " ".join(problems), Qgis.MessageLevel.Warning, 8
        )

    def _hovered(self, hovered: Hovered | None) -> None:
        if self._canvas.mapTool() is not self.tools[CHOOSE]:
            return
        self.panel.candidates.show_hovered(hovered)
        hint = next(tr(tool.hint) for tool in TOOLS if tool.name == CHOOSE)
        reason = "" if hovered is None else hovered.reason
        self.panel.hint.say(reason or hint)

    def _state_changed(self) -> None:
        steering = self.steering
        starting = steering.is_busy and steering.view is None
        self.start_panel.update_state(steering.why_not() if starting else "")
        for widget in (self.start_bar, self.start_cancel):
            widget.setVisible(starting)
        if starting:
            self.start_note.say(steering.doing)
        if steering.layers.are_edited:
            self.pick_tool("")  # it would work on what is not there any more

    def _tool_set(self, tool: Any, before: Any = None) -> None:
        del before
        name = next((name for name, ours in self.tools.items() if ours is tool), "")
        self.panel.show_tool(name)

    def _ask_where_to_save(self) -> None:
        path, _ = QFileDialog.getSaveFileName(self, tr("Save session"), "", SESSIONS)
        if path:
            self.steering.save(_ending(path, ".json"))

    def _ask_where_to_write(self) -> None:
        path, _ = QFileDialog.getSaveFileName(self, tr("Write layout file"), "", LAYOUT_FILES)
        if path:
            self.steering.write_layout(_ending(path, ".gpkg"))

    def _ask_whether_to_end(self) -> None:
        if self.steering.unsaved:
            buttons = QMessageBox.StandardButton
            answer = QMessageBox.question(
                self,
                tr("Close session"),
                tr("The edits of this session are not saved. Close it all the same?"),
                buttons.Yes | buttons.No,
                buttons.No,
            )
            if answer != buttons.Yes:
                return
        self.steering.end()


def _ending(path: str, ending: str) -> Path:
    return Path(path) if path.lower().endswith(ending) else Path(path + ending)
