"""QGIS styles of the layers of a layout file, as QML, on white and on a street map alike."""

from __future__ import annotations

import xml.etree.ElementTree as ET  # nosec B405: written here, never parsed
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from urban_processing.calibration.layers import OBSERVED_PARCELS
from urban_processing.metrics.subdivisions import PATIO_USE
from urban_processing.parcelling.layers import SUBDIVIDED_PARCELS
from urban_processing.schema import GeometryType, Layer

QML_VERSION = "3.22.0"
_LARGEST = 6
"""Markers are no larger than so many millimetres."""

_METRES, _MILLIMETRES = "RenderMetersInMapUnits", "MM"

_PAPER = "246,244,238,215"
_OUTLINE = "140,134,124,255"
_SURFACE = "217,213,203,255"
_GREEN = "213,227,198,255"
_TRIANGLE = "182,160,214,230"
_REDS = ("247,200,186,230", "238,140,116,230", "214,69,56,235")
_STREET, _CASING = "255,204,70,255", "133,102,26,255"
_STREETS = {
    "rim": ("Rim street", "240,158,56,255"),
    "fixed": ("Given street", "150,178,200,255"),
    "collector": ("Collector", _STREET),
    "local": ("Local street", "255,232,160,255"),
    "cul_de_sac": ("Cul-de-sac", "255,253,246,255"),
}
"""Label and fill of each class of streets: the more a street carries, the stronger."""
_DARK, _ALERT = "70,66,58,255", "200,30,40,255"


@dataclass(frozen=True)
class _Rule:
    """One entry of a legend: the features that pass `filter` (all others for ELSE)."""

    label: str
    filter: str
    layers: Sequence[ET.Element]
    symbol: str


def layer_style(layer: Layer, *, places_only: bool = False) -> str | None:
    """Return the QML of a layer, None for layers that have no style.

    Parameters
    ----------
    layer
        The layer.
    places_only
        Whether a layer of places and areas has nothing but places, where it is shown.
    """
    name = layer.name
    if name not in _RULES:
        return None
    rules = list(_RULES[name]())
    if layer == SUBDIVIDED_PARCELS:  # over what the other rules draw of an irregular patio
        rules.append(_Rule("Patio", f"\"land_use\" = '{PATIO_USE}'", [_fill(_GREEN)], "fill"))
    if name == "streets" and "fixed_id" not in layer.column_names:
        rules = _measured_streets()
    if name == "parcels" and "change" in layer.column_names:
        rules = _changed()
    if name == "parcels" and set(OBSERVED_PARCELS.column_names) <= set(layer.column_names):
        rules = _observed()
    if places_only and layer.geometry is GeometryType.ANY:
        rules = [rule for rule in rules if rule.symbol == "marker"]
    root = ET.Element(
        "qgis", version=QML_VERSION, styleCategories="Symbology|Fields|Rendering|MapTips"
    )
    root.append(_renderer(rules, symbol_levels=name == "streets"))
    _add_aliases(root, {column.name: column.label for column in layer.columns})
    ET.indent(root, " ")
    return ET.tostring(root, encoding="unicode")


def _renderer(rules: Sequence[_Rule], *, symbol_levels: bool) -> ET.Element:
    """Draw by rules; with symbol levels all casings lie below all fills."""
    renderer = ET.Element(
        "renderer-v2",
        type="RuleRenderer",
        symbollevels=str(int(symbol_levels)),
        forceraster="0",
        enableorderby="0",
    )
    tree = ET.SubElement(renderer, "rules", key="{0}")
    symbols = ET.SubElement(renderer, "symbols")
    for number, rule in enumerate(rules):
        attributes = {"key": f"{{{number + 1}}}", "symbol": str(number), "label": rule.label}
        if rule.filter:
            attributes["filter"] = rule.filter
        ET.SubElement(tree, "rule", attributes)
        symbol = ET.SubElement(
            symbols,
            "symbol",
            name=str(number),
            type=rule.symbol,
            alpha="1",
            clip_to_extent="1",
            force_rhr="0",
        )
        symbol.extend(rule.layers)
    return renderer


def _layer(
    kind: str,
    options: Mapping[str, str],
    *,
    level: int = 0,
    data_defined: Mapping[str, str] | None = None,
) -> ET.Element:
    """One symbol layer; `data_defined` gives expressions for properties."""
    layer = ET.Element("layer", {"class": kind, "enabled": "1", "locked": "0", "pass": str(level)})
    table = ET.SubElement(layer, "Option", type="Map")
    for key, value in options.items():
        ET.SubElement(table, "Option", name=key, value=value, type="QString")
    for key, value in options.items():
        ET.SubElement(layer, "prop", k=key, v=value)
    if data_defined:
        properties = ET.SubElement(layer, "data_defined_properties")
        outer = ET.SubElement(properties, "Option", type="Map")
        ET.SubElement(outer, "Option", name="name", value="", type="QString")
        inner = ET.SubElement(outer, "Option", name="properties", type="Map")
        for key, expression in data_defined.items():
            entry = ET.SubElement(inner, "Option", name=key, type="Map")
            ET.SubElement(entry, "Option", name="active", value="true", type="bool")
            ET.SubElement(entry, "Option", name="expression", value=expression, type="QString")
            ET.SubElement(entry, "Option", name="type", value="3", type="int")
        ET.SubElement(outer, "Option", name="type", value="collection", type="QString")
    return layer


def _fill(
    color: str, *, outline: str = _OUTLINE, width: float = 0.1, dash: str = "solid"
) -> ET.Element:
    return _layer(
        "SimpleFill",
        {
            "color": color,
            "style": "solid" if color else "no",
            "outline_color": outline,
            "outline_style": dash,
            "outline_width": str(width),
            "outline_width_unit": _MILLIMETRES,
            "joinstyle": "round",
        },
    )


def _line(color: str, *, factor: float, at_least: float, level: int) -> ET.Element:
    """Draw a line as wide as the street, no thinner on the map than `at_least` mm."""
    return _layer(
        "SimpleLine",
        {
            "line_color": color,
            "line_style": "solid",
            "line_width": str(12 * factor),
            "line_width_unit": _METRES,
            "width_map_unit_scale": f"3x:0,0,1,{at_least},0,0",
            "capstyle": "round",
            "joinstyle": "round",
        },
        level=level,
        data_defined={"outlineWidth": f'{factor} * "width_m"'},
    )


def _street(color: str, factor: float) -> list[ET.Element]:
    casing = _line(_CASING, factor=1.4 * factor, at_least=0.85, level=0)
    return [casing, _line(color, factor=factor, at_least=0.5, level=1)]


def _marker(
    shape: str, color: str, *, metres: float, at_least: float, outline: str = _CASING
) -> ET.Element:
    """Draw a marker of a size on the ground, within what reads well; small in a legend."""
    return _layer(
        "SimpleMarker",
        {
            "name": shape,
            "color": color,
            "outline_color": outline,
            "outline_width": "0.15",
            "outline_width_unit": _MILLIMETRES,
            "size": str(max(at_least, 1.2)),
            "size_unit": _MILLIMETRES,
        },
        data_defined={"size": f"clamp({at_least}, {1000 * metres:g} / @map_scale, {_LARGEST})"},
    )


def _parcels() -> list[_Rule]:
    irregular = '"sides" <> 3 AND "irregularity" > '
    return [
        _Rule("Triangle", '"sides" = 3', [_fill(_TRIANGLE)], "fill"),
        _Rule("Irregularity above 0.4", irregular + "0.4", [_fill(_REDS[2])], "fill"),
        _Rule(
            "Irregularity 0.2 to 0.4",
            irregular + '0.2 AND "irregularity" <= 0.4',
            [_fill(_REDS[1])],
            "fill",
        ),
        _Rule(
            "Irregularity 0.1 to 0.2",
            irregular + '0.1 AND "irregularity" <= 0.2',
            [_fill(_REDS[0])],
            "fill",
        ),
        _Rule("Parcel", "ELSE", [_fill(_PAPER)], "fill"),
    ]


def _streets() -> list[_Rule]:
    # given streets keep the classes of the user, whatever they are
    given = '"fixed_id" IS '
    label, color = _STREETS["fixed"]
    rules = [_Rule(label, f"{given}NOT NULL", _street(color, 0.6), "line")]
    for name, (label, color) in _STREETS.items():
        if name != "fixed":
            own = f"\"class\" = '{name}' AND {given}NULL"
            rules.append(_Rule(label, own, _street(color, 0.6), "line"))
    return rules


def _measured_streets() -> list[_Rule]:
    """Streets of any origin: by the classes of layouts, all others alike."""
    own = [
        _Rule(label, f"\"class\" = '{name}'", _street(color, 0.6), "line")
        for name, (label, color) in _STREETS.items()
        if name != "fixed"
    ]
    return [*own, _Rule("Street", "ELSE", _street(_STREET, 0.6), "line")]


def _junctions() -> list[_Rule]:
    small = _marker("circle", "255,255,255,255", metres=4, at_least=0.35)
    end = _marker("circle", _STREET, metres=14, at_least=1.3)
    entry = _marker("triangle", "255,255,255,255", metres=14, at_least=1.4)
    return [
        _Rule("Junction", "\"kind\" = 'junction'", [small], "marker"),
        _Rule("Street end", "\"kind\" = 'end'", [end], "marker"),
        _Rule("Entry", "\"kind\" = 'entry'", [entry], "marker"),
    ]


def _block_edges() -> list[_Rule]:
    def edge(color: str, dash: str) -> list[ET.Element]:
        options = {"line_color": color, "line_style": dash, "line_width": "0.5"}
        return [_layer("SimpleLine", {**options, "line_width_unit": _MILLIMETRES})]

    return [
        _Rule("Street side", '"access"', edge(_CASING, "solid"), "line"),
        _Rule("No street", "ELSE", edge(_OUTLINE, "dash"), "line"),
    ]


def _issues() -> list[_Rule]:
    alert = _marker("diamond", "255,255,255,255", metres=1, at_least=2.4, outline=_ALERT)
    area = _fill("200,30,40,30", outline=_ALERT, width=0.4)
    kind = "geometry_type($geometry) = "
    return [
        _Rule("Issue at a place", kind + "'Point'", [alert], "marker"),
        _Rule("Issue of an area", kind + "'Polygon'", [area], "fill"),
    ]


def _observed() -> list[_Rule]:
    """Parcels that count, and those that are left out."""
    return [
        _Rule("Parcel", '"block_id" IS NOT NULL', [_fill(_PAPER)], "fill"),
        _Rule("Left out", "ELSE", [_fill(_SURFACE)], "fill"),
    ]


def _changed() -> list[_Rule]:
    """Colour parcels by what became of them."""
    return [
        _Rule(label, f"\"change\" = '{change}'", [_fill(colour)], "fill")
        for change, label, colour in (
            ("kept", "Kept", _PAPER),
            ("moved", "Moved", "250,226,160,255"),
            ("split", "Split off", "244,190,112,255"),
            ("new", "New", "226,125,85,255"),
            ("merged", "Merged", "178,178,190,140"),
            ("gone", "Gone", "120,120,130,140"),
        )
    ]


_RULES = {
    "changes": _changed,
    "parcels": _parcels,
    "streets": _streets,
    "junctions": _junctions,
    "boundary": lambda: [_Rule("Land", "", [_fill("", outline=_DARK, width=0.3)], "fill")],
    "input_boundary": lambda: [
        _Rule("Boundary as given", "", [_fill("", outline=_DARK, width=0.2, dash="dash")], "fill")
    ],
    "obstacles": lambda: [_Rule("Obstacle", "", [_fill("198,216,222,230")], "fill")],
    "right_of_way": lambda: [
        _Rule("Right-of-way", "", [_fill(_SURFACE, outline=_SURFACE)], "fill")
    ],
    "net_parcels": lambda: [_Rule("Net parcel", "", [_fill(_PAPER)], "fill")],
    "blocks": lambda: [_Rule("Block", "", [_fill(_PAPER, outline=_DARK, width=0.2)], "fill")],
    "block_edges": _block_edges,
    "issues": _issues,
}


def _add_aliases(root: ET.Element, aliases: Mapping[str, str]) -> None:
    table = ET.SubElement(root, "aliases")
    for index, (field, name) in enumerate(aliases.items()):
        ET.SubElement(table, "alias", index=str(index + 1), field=field, name=name)
