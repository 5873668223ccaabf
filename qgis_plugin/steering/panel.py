"""The second panel: the session's steps, tools, figures and results."""

from __future__ import annotations

from collections.abc import Callable

from qgis.PyQt.QtCore import pyqtSignal
from qgis.PyQt.QtWidgets import (
    QButtonGroup,
    QCheckBox,
    QComboBox,
    QDoubleSpinBox,
    QFormLayout,
    QGridLayout,
    QHBoxLayout,
    QLabel,
    QProgressBar,
    QPushButton,
    QVBoxLayout,
    QWidget,
)

from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.figures import FigureTable
from qgis_plugin.steering.model import View
from qgis_plugin.steering.option_list import OptionList
from qgis_plugin.steering.style import PARK
from qgis_plugin.steering.toolbox import ADD_STREET, CHOOSE, LOCK, TOOLS
from qgis_plugin.steering.widgets import Note, allow, button, tipped
from qgis_plugin.texts import tr

_USES = (PARK, "square", "school", "playground", "water")
_TOOLS_IN_A_ROW = 2


class SteeringPanel(QWidget):
    """What a session can do, and how it stands.

    Parameters
    ----------
    steering
        The session.
    """

    tool_asked = pyqtSignal(str)
    """A tool was picked: its name, empty where it was put away."""

    save_asked = pyqtSignal()
    write_asked = pyqtSignal()
    end_asked = pyqtSignal()

    def __init__(self, steering: Steering) -> None:
        super().__init__()
        self.steering = steering
        self.title = QLabel()
        self._make_buttons()
        self._make_options()
        self.candidates = OptionList()
        self.hint, self.note = Note(), Note()
        self.figures = FigureTable()
        self.branches = tipped(
            QComboBox(), tr("What was undone stays as a branch; choose one to go on from there.")
        )
        self.progress = QProgressBar()
        self.progress.setTextVisible(False)
        self.cancel = QPushButton(tr("Cancel"))
        self.doing = QLabel()
        self._busy = QWidget()
        self._lay_out()
        self._connect()
        self.show_tool("")

    def show_view(self, view: View) -> None:
        """Show how the session stands."""
        stage = tr("finished") if view.complete else tr("level {}").format(view.level)
        self.title.setText(f"<b>{self.steering.name}</b> · {stage}")
        self.figures.show_figures(view.figures)
        self.note.say(view.sentence, "said")
        self._show_branches(view)
        self.candidates.show_hovered(None)
        self.update_state()

    def update_state(self) -> None:
        """Enable what can be used, and have the rest say why it cannot."""
        view, busy = self.steering.view, self.steering.is_busy
        if view is None:
            return
        against = self.steering.why_not()
        done = tr("The layout is finished: there is nothing left to cut.")
        allow(self.step, against or (done if view.complete or view.finished else ""))
        allow(self.finish, against or (done if view.complete else ""))
        allow(self.undo, against or ("" if view.can_undo else tr("Nothing was done yet.")))
        allow(self.redo, against or ("" if view.can_redo else tr("Nothing was undone.")))
        for made in (*self.tools.values(), self.branches, self.save, self.write, self.to_layers):
            allow(made, against)
        waiting = against if busy else ""
        by_hand = self.steering.layers.are_edited
        not_edited = tr("Edit the layers of the group Steering with the tools of QGIS first.")
        for made in (self.adopt, self.discard):
            allow(made, waiting or ("" if by_hand else not_edited))
        allow(self.end, waiting)
        self._by_hand.setVisible(by_hand)
        self._busy.setVisible(self.steering.can_cancel)
        self.doing.setText(self.steering.doing)
        self.doing.setVisible(self.steering.can_cancel)

    def show_progress(self, fraction: float, message: str) -> None:
        """Show how far something has come."""
        self.progress.setValue(round(100 * fraction))
        if message:
            self.doing.setText(message)

    def show_tool(self, name: str) -> None:
        """Show which tool is in use: its hint and its options."""
        for known, made in self.tools.items():
            made.setChecked(known == name)
        hints = {tool.name: tr(tool.hint) for tool in TOOLS}
        self.hint.say(hints.get(name, tr("Go a level on, or pick a tool to change this one.")))
        self.candidates.setVisible(name == CHOOSE)
        self._use_row.setVisible(name == LOCK)
        self._street_row.setVisible(name == ADD_STREET)

    @property
    def land_use(self) -> str:
        """The use that parcels are kept for."""
        return str(self.use.currentText()).strip() or PARK

    @property
    def street_width(self) -> float | None:
        """Width in metres of streets that are drawn; None for that of their class."""
        return float(self.width_m.value()) or None

    def _make_buttons(self) -> None:
        self.undo = button(tr("Undo"), tr("Take back the last edit."), "mActionUndo")
        self.redo = button(tr("Redo"), tr("Do again what was taken back."), "mActionRedo")
        self.step = button(
            tr("Step"),
            tr("Go one level on: cut all large parcels, and reach them by street."),
            "mActionArrowRight",
        )
        self.finish = button(
            tr("Finish"),
            tr("Go through all levels, clean up the streets and smooth the shapes."),
            "mActionDoubleArrowRight",
        )
        self.tools = {
            tool.name: button(tr(tool.label), tr(tool.tip), tool.icon, checkable=True)
            for tool in TOOLS
        }
        self.adopt = button(
            tr("Take over hand edits"),
            tr("Go on with the parcels and streets as they were edited in the layers."),
            "mActionSaveEdits",
        )
        self.discard = button(
            tr("Discard"),
            tr("Show the layers again as the session has them."),
            "mActionCancelEdits",
        )
        self.save = button(
            tr("Save session…"),
            tr("Save the edits, to open and go on another time."),
            "mActionFileSave",
        )
        self.write = button(
            tr("Layout file…"),
            tr("Write this level as a layout file, which the toolbox goes on with."),
            "mActionFileSaveAs",
        )
        self.to_layers = button(
            tr("Finish into layers"),
            tr("Finish the layout, and load parcels, streets and junctions as layers."),
            "mActionAddLayer",
        )
        self.end = button(tr("Close"), tr("Close the session, to begin another."), "mActionRemove")

    def _make_options(self) -> None:
        self.use = tipped(QComboBox(), tr("What the parcel is for; type another use if you like."))
        self.use.setEditable(True)
        self.use.addItems(_USES)
        self.follow = tipped(
            QCheckBox(tr("Along parcel boundaries")),
            tr("The street goes from click to click along the boundaries that are there."),
        )
        self.width_m = tipped(
            QDoubleSpinBox(), tr("Width of the street with its pavements, from side to side.")
        )
        self.width_m.setRange(0, 100)
        self.width_m.setSuffix(" m")
        self.width_m.setSpecialValueText(tr("usual width"))

    def _lay_out(self) -> None:
        self._use_row, self._street_row = QWidget(), QWidget()
        use = QFormLayout(self._use_row)
        use.addRow(tr("Use"), self.use)
        street = QFormLayout(self._street_row)
        street.addRow(self.follow)
        street.addRow(tr("Width"), self.width_m)
        for form in (use, street):
            form.setContentsMargins(0, 0, 0, 0)
        tools = QGridLayout()
        tools.setSpacing(4)
        for i, made in enumerate(self.tools.values()):
            tools.addWidget(made, i // _TOOLS_IN_A_ROW, i % _TOOLS_IN_A_ROW)
        self._by_hand = _row(self.adopt, self.discard)
        self._busy = _row(self.progress, self.cancel)
        whole = QVBoxLayout(self)
        whole.setSpacing(6)
        whole.addWidget(_row(self.title, self.end, stretch=(1, 0)))
        whole.addWidget(_row(self.undo, self.redo, self.step, self.finish))
        whole.addWidget(self.branches)
        whole.addLayout(tools)
        for widget in (
            self.hint,
            self._use_row,
            self._street_row,
            self.candidates,
            self.note,
            self._by_hand,
            self.doing,
            self._busy,
            self.figures,
        ):
            whole.addWidget(widget)
        whole.addStretch(1)
        whole.addWidget(_row(self.save, self.write))
        whole.addWidget(self.to_layers)

    def _connect(self) -> None:
        steering = self.steering
        actions: dict[QWidget, Callable[[], None]] = {
            self.undo: steering.undo,
            self.redo: steering.redo,
            self.step: steering.step,
            self.finish: steering.finish,
            self.adopt: steering.adopt,
            self.discard: steering.discard_hand_edits,
            self.to_layers: steering.to_layers,
            self.cancel: steering.cancel,
            self.save: self.save_asked.emit,
            self.write: self.write_asked.emit,
            self.end: self.end_asked.emit,
        }
        for made, act in actions.items():
            made.clicked.connect(lambda _=False, act=act: act())
        self._group = QButtonGroup(self)
        self._group.setExclusive(False)  # a second click puts a tool away
        for name, made in self.tools.items():
            self._group.addButton(made)
            made.clicked.connect(
                lambda checked, name=name: self.tool_asked.emit(name if checked else "")
            )
        self.branches.activated.connect(lambda index: steering.go_to(self.branches.itemData(index)))
        steering.viewed.connect(self.show_view)
        steering.told.connect(lambda text: self.note.say(text, "said"))
        steering.refused.connect(lambda problems: self.note.say("\n".join(problems), "refused"))
        steering.state_changed.connect(self.update_state)
        steering.progressed.connect(self.show_progress)

    def _show_branches(self, view: View) -> None:
        self.branches.clear()
        for branch in view.branches:
            self.branches.addItem(branch.sentence, branch.number)
            if branch.current:
                self.branches.setCurrentIndex(self.branches.count() - 1)
        self.branches.setVisible(len(view.branches) > 1)


def _row(*widgets: QWidget, stretch: tuple[int, ...] = ()) -> QWidget:
    made = QWidget()
    row = QHBoxLayout(made)
    row.setContentsMargins(0, 0, 0, 0)
    for widget, share in zip(widgets, stretch or [0] * len(widgets), strict=True):
        row.addWidget(widget, share)
    return made
