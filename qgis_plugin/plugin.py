"""What QGIS loads and unloads: nothing but the provider."""

from __future__ import annotations

import sys
from typing import TYPE_CHECKING, Any

from qgis.core import Qgis, QgsApplication, QgsMessageLog

if TYPE_CHECKING:
    from qgis_plugin.provider import UrbanProcessingProvider

OLDEST_PYTHON = (3, 11)
TITLE = "Urban processing"


class UrbanProcessingPlugin:
    """The plugin; `iface` is None without a window."""

    def __init__(self, iface: Any) -> None:
        self.iface = iface
        self.provider: UrbanProcessingProvider | None = None

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
        """Offer the algorithms in a QGIS with a window."""
        self.initProcessing()

    def unload(self) -> None:
        """Take the algorithms away."""
        if self.provider is not None:
            QgsApplication.processingRegistry().removeProvider(self.provider)
            self.provider = None

    def _say(self, sentence: str) -> None:
        level = Qgis.MessageLevel.Warning
        QgsMessageLog.logMessage(sentence, TITLE, level)
        if self.iface is not None:
            self.iface.messageBar().pushMessage(TITLE, sentence, level)
