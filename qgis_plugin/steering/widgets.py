"""Small things that the panels are made of."""

from __future__ import annotations

from typing import Any

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QIcon
from qgis.PyQt.QtWidgets import QLabel, QSizePolicy, QToolButton, QWidget

_NOTE = "padding: 6px; border-radius: 4px;"
_STYLES = {
    "hint": _NOTE + "background: palette(alternate-base); color: palette(text);",
    "said": _NOTE + "background: #e7f0e2; color: #234018;",
    "refused": _NOTE + "background: #fbe6df; color: #7a1f10;",
}


def theme_icon(name: str) -> QIcon:
    """Return an icon of QGIS."""
    return QgsApplication.getThemeIcon(f"/{name}.svg")


def button(text: str, tip: str, icon: str = "", *, checkable: bool = False) -> QToolButton:
    """Return a button with a text, and an icon of QGIS before it."""
    made = QToolButton()
    made.setText(text)
    made.setToolTip(tip)
    made.setProperty("tip", tip)
    made.setCheckable(checkable)
    if icon:
        made.setIcon(theme_icon(icon))
    made.setToolButtonStyle(Qt.ToolButtonStyle.ToolButtonTextBesideIcon)
    made.setSizePolicy(QSizePolicy.Policy.Expanding, QSizePolicy.Policy.Fixed)
    return made


def allow(widget: QWidget, reason: str) -> None:
    """Enable a widget where there is no reason against it; else its tooltip gives the reason."""
    widget.setEnabled(not reason)
    widget.setToolTip(reason or widget.property("tip") or "")


class Note(QLabel):
    """A few words in a box: a hint, what was done, or why it was not."""

    def __init__(self) -> None:
        super().__init__()
        self.setWordWrap(True)
        self.setTextFormat(Qt.TextFormat.PlainText)
        self.setTextInteractionFlags(Qt.TextInteractionFlag.TextSelectableByMouse)
        self.setVisible(False)

    def say(self, text: str, kind: str = "hint") -> None:
        """Show a text; nothing where it is empty."""
        self.setText(text)
        self.setStyleSheet(_STYLES[kind])
        self.setVisible(bool(text))


def tipped(widget: Any, tip: str) -> Any:
    """Give a widget a tooltip that `allow` brings back, and return it."""
    widget.setToolTip(tip)
    widget.setProperty("tip", tip)
    return widget
