"""What QGIS loads and unloads: the provider, and the dock once it is asked for."""

from __future__ import annotations

import sys
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import Qgis, QgsApplication, QgsMessageLog
from qgis.PyQt.QtCore import QCoreApplication, Qt
from qgis.PyQt.QtGui import QIcon

try:
    from qgis.PyQt.QtGui import QAction  # Qt 6, and later QGIS with Qt 5
except ImportError:
    from qgis.PyQt.QtWidgets import QAction

if TYPE_CHECKING:
    from qgis_plugin.dock import SteeringDock
    from qgis_plugin.provider import UrbanProcessingProvider

OLDEST_PYTHON = (3, 11)
TITLE = "Urban processing"
ICON = Path(__file__).with_name("icon.svg")


class UrbanProcessingPlugin:
    """The plugin; `iface` is None without a window."""

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: UrbanProcessingProvider | None = None
        self.dock: SteeringDock | None = None
        self.action: Any = None

    def initProcessing(self) -> None:
        """Offer the algorithms; all that there is to do without a window."""
        if sys.version_info < OLDEST_PYTHON:
            self._say(
                "Urban processing needs Python {}.{} or newer, and this QGIS has {}.{}: "
                "update QGIS (on Windows and macOS from 3.40 on).".format(
                    *OLDEST_PYTHON, *sys.version_info[:2]
                )
            )
            return
        from qgis_plugin.provider import UrbanProcessingProvider

        self.provider = UrbanProcessingProvider()
        QgsApplication.processingRegistry().addProvider(self.provider)

    def initGui(self) -> None:
        """Offer the algorithms in a QGIS with a window, and the dock."""
        self.initProcessing()
        if self.provider is None:
            return
        text = QCoreApplication.translate("UrbanProcessing", "Steer a layout")
        self.action = QAction(QIcon(str(ICON)), text, self.iface.mainWindow())
        self.action.setCheckable(True)
        self.action.setToolTip(
            QCoreApplication.translate(
                "UrbanProcessing", "Lay out parcels and streets level by level, on the map"
            )
        )
        self.action.triggered.connect(self.show_dock)
        self.iface.addToolBarIcon(self.action)
        self.iface.addPluginToMenu(TITLE, self.action)

    def show_dock(self, shown: bool = True) -> None:
        """Show the dock, or hide it; it is made when it is shown for the first time."""
        if self.dock is None and shown:
            from qgis_plugin.dock import SteeringDock

            self.dock = SteeringDock(self.iface)
            self.iface.addDockWidget(Qt.DockWidgetArea.RightDockWidgetArea, self.dock)
            self.dock.visibilityChanged.connect(self._dock_shown)
        if self.dock is not None:
            self.dock.setUserVisible(shown)

    def unload(self) -> None:
        """Take the dock and the algorithms away."""
        if self.dock is not None:
            self.dock.visibilityChanged.disconnect(self._dock_shown)
            self.dock.dispose()
            self.dock = None
        if self.action is not None:
            self.iface.removeToolBarIcon(self.action)
            self.iface.removePluginMenu(TITLE, self.action)
            self.action.deleteLater()
            self.action = None
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None

    def _dock_shown(self, _: bool) -> None:
        # of docks in tabs only the one in front is visible, and the others are not closed
        if self.dock is not None and self.action is not None:
            self.action.setChecked(not self.dock.isHidden())

    def _say(self, sentence: str) -> None:
        level = Qgis.MessageLevel.Warning
        QgsMessageLog.logMessage(sentence, TITLE, level)
        if self.iface is not None:
            self.iface.messageBar().pushMessage(TITLE, sentence, level)
