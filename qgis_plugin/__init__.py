"""QGIS plugin: every algorithm of urban_processing in the Processing toolbox.

This module and `plugin` are read by any Python that a QGIS may have; all others need the Python
that the engine needs.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from qgis_plugin.plugin import UrbanProcessingPlugin


def classFactory(iface: Any) -> UrbanProcessingPlugin:
    """Return the plugin; QGIS calls this."""
    from qgis_plugin.plugin import UrbanProcessingPlugin

    return UrbanProcessingPlugin(iface)
