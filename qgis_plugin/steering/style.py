"""How the map shows a session: parcels by what becomes of them, streets by their class."""

from __future__ import annotations

from qgis.core import QgsFillSymbol, QgsMapLayer, QgsRuleBasedRenderer, QgsVectorLayer
from qgis.PyQt.QtXml import QDomDocument

from qgis_plugin.steering.fields import DONE, LAND_USE, LOCKED, STATE, TO_CUT
from qgis_plugin.texts import tr
from urban_processing.schema import STREETS

PARK = "park"
"""The land use that is offered first, and drawn green."""

_STATE_WITHOUT_PARK = f"\"{STATE}\" = '{{}}' AND \"{LAND_USE}\" <> '{PARK}'"
_OUTLINE = "120,114,104,255"
_COLOURS = {
    "park": "172,209,146,235",
    "other": "190,205,222,235",
    "to_cut": "255,252,240,215",
    "done": "233,228,214,225",
}
CANDIDATE_COLOURS = ("#0072b2", "#d55e00", "#009e73", "#cc79a7", "#56b4e9", "#8a6d00")
"""Colours of candidates by rank, from the palette of Okabe and Ito, that all eyes tell apart."""


def style_parcels(layer: QgsVectorLayer) -> None:
    """Draw parcels by what becomes of them."""
    root = QgsRuleBasedRenderer.Rule(None)
    for colour, label, condition in (
        ("park", tr("Park"), f"\"{LAND_USE}\" = '{PARK}'"),
        ("other", tr("Other use, or kept"), _STATE_WITHOUT_PARK.format(LOCKED)),
        ("to_cut", tr("Large enough to be cut"), _STATE_WITHOUT_PARK.format(TO_CUT)),
        ("done", tr("Not cut any more"), _STATE_WITHOUT_PARK.format(DONE)),
    ):
        symbol = QgsFillSymbol.createSimple(
            {"color": _COLOURS[colour], "outline_color": _OUTLINE, "outline_width": "0.2"}
        )
        root.appendChild(QgsRuleBasedRenderer.Rule(symbol, 0, 0, condition, label))
    layer.setRenderer(QgsRuleBasedRenderer(root))


def style_streets(layer: QgsVectorLayer) -> None:
    """Draw streets as the layers of results are drawn."""
    from urban_processing.layout_file.styles import layer_style  # needs what the engine needs

    document = QDomDocument()
    document.setContent(layer_style(STREETS))
    layer.importNamedStyle(document, QgsMapLayer.StyleCategory.Symbology)
