"""The candidates of a parcel as a list beside the map."""

from __future__ import annotations

from qgis.PyQt.QtCore import QLocale, Qt, pyqtSignal
from qgis.PyQt.QtGui import QColor, QIcon, QPixmap
from qgis.PyQt.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from qgis_plugin.steering.model import Hovered
from qgis_plugin.steering.overlay import candidate_colour
from qgis_plugin.texts import tr

_ROW, _MOST = 22, 6


class OptionList(QTableWidget):
    """Rank, score and areas of each candidate; its reason is the tooltip."""

    chosen = pyqtSignal(int)
    """A candidate was clicked: its rank."""

    pointed = pyqtSignal(int)
    """The cursor is over a candidate."""

    def __init__(self) -> None:
        super().__init__(0, 3)
        self.setHorizontalHeaderLabels([tr("Cut"), tr("Score"), tr("Halves [m²]")])
        self.verticalHeader().setVisible(False)
        self.verticalHeader().setDefaultSectionSize(_ROW)
        header = self.horizontalHeader()
        header.setSectionResizeMode(2, QHeaderView.ResizeMode.Stretch)
        for column in (0, 1):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionBehavior(QAbstractItemView.SelectionBehavior.SelectRows)
        self.setSelectionMode(QAbstractItemView.SelectionMode.SingleSelection)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setShowGrid(False)
        self.setMouseTracking(True)
        self.setFixedHeight(_ROW * _MOST + header.sizeHint().height() + 4)
        self.cellClicked.connect(lambda row, _: self.chosen.emit(row + 1))
        self.cellEntered.connect(lambda row, _: self.pointed.emit(row + 1))

    def show_hovered(self, hovered: Hovered | None) -> None:
        """List the candidates of a parcel."""
        self.clearSelection()
        options = () if hovered is None else hovered.options
        self.setRowCount(len(options))
        for row, option in enumerate(options):
            areas = " + ".join(QLocale().toString(area, "f", 0) for area in option.areas)
            for column, text in enumerate((str(option.rank), f"{option.score:.2f}", areas)):
                item = QTableWidgetItem(text)
                item.setToolTip(option.reason)
                if column == 0:
                    item.setIcon(_chip(candidate_colour(option.rank)))
                self.setItem(row, column, item)

    def highlight(self, rank: int) -> None:
        """Have a candidate stand out; none for 0."""
        if rank:
            self.selectRow(rank - 1)
        else:
            self.clearSelection()


def _chip(colour: QColor) -> QIcon:
    made = QPixmap(12, 12)
    made.fill(colour)
    return QIcon(made)
