"""The table of figures beside the map."""

from __future__ import annotations

from collections.abc import Mapping

from qgis.PyQt.QtCore import QLocale, Qt
from qgis.PyQt.QtGui import QBrush, QColor
from qgis.PyQt.QtWidgets import QAbstractItemView, QHeaderView, QTableWidget, QTableWidgetItem

from qgis_plugin.texts import tr

_ROWS = (
    ("parcels", "Parcels", "", 0),
    ("to_cut", "Still to be cut", "", 0),
    ("unreached", "Without a street", "", 0),
    ("mean_area_m2", "Mean parcel", " m²", 0),
    ("least_area_m2", "Smallest parcel", " m²", 0),
    ("quads_pct", "With four sides", " %", 0),
    ("irregularity_mean", "Irregularity (0 is a square)", "", 3),
    ("street_km", "Streets inside", " km", 2),
    ("junctions", "Junctions", "", 0),
    ("street_ends", "Dead ends", "", 0),
)
"""Name of a figure, what it is called, its unit, and its digits."""


class FigureTable(QTableWidget):
    """Figures, and how the last edit changed each."""

    def __init__(self) -> None:
        super().__init__(len(_ROWS), 3)
        self._last: dict[str, float] = {}
        self.setHorizontalHeaderLabels(["", tr("Now"), tr("Change")])
        self.verticalHeader().setVisible(False)
        self.verticalHeader().setDefaultSectionSize(22)
        self.setEditTriggers(QAbstractItemView.EditTrigger.NoEditTriggers)
        self.setSelectionMode(QAbstractItemView.SelectionMode.NoSelection)
        self.setFocusPolicy(Qt.FocusPolicy.NoFocus)
        self.setShowGrid(False)
        self.setVerticalScrollBarPolicy(Qt.ScrollBarPolicy.ScrollBarAlwaysOff)
        header = self.horizontalHeader()
        header.setSectionResizeMode(0, QHeaderView.ResizeMode.Stretch)
        for column in (1, 2):
            header.setSectionResizeMode(column, QHeaderView.ResizeMode.ResizeToContents)
        for row, (_, label, _, _) in enumerate(_ROWS):
            self.setItem(row, 0, QTableWidgetItem(tr(label)))
        self.setFixedHeight(22 * len(_ROWS) + header.sizeHint().height() + 4)

    def forget(self) -> None:
        """Compare with nothing: another session begins."""
        self._last = {}

    def show_figures(self, figures: Mapping[str, float]) -> None:
        """Show figures, and what differs from those that were shown before."""
        for row, (name, _, unit, digits) in enumerate(_ROWS):
            value = figures[name]
            change = round(value - self._last.get(name, value), digits)
            self._write(row, 1, _number(value, digits) + unit)
            sign = "+" if change > 0 else ""
            self._write(row, 2, sign + _number(change, digits) if change else "")
            self.item(row, 2).setForeground(QBrush(QColor("gray")))
            if name == "unreached" and value:
                self.item(row, 1).setForeground(QBrush(QColor("#b3261e")))
        self._last = dict(figures)

    def shown(self, name: str) -> str:
        """Return what is shown of a figure."""
        row = next(i for i, (known, *_) in enumerate(_ROWS) if known == name)
        return str(self.item(row, 1).text())

    def _write(self, row: int, column: int, text: str) -> None:
        item = QTableWidgetItem(text)
        item.setTextAlignment(Qt.AlignmentFlag.AlignRight | Qt.AlignmentFlag.AlignVCenter)
        self.setItem(row, column, item)


def _number(value: float, digits: int) -> str:
    return str(QLocale().toString(float(value), "f", digits))
