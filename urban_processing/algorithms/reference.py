"""Reference pages in Markdown, made from the declarations."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from urban_processing.algorithms.spec import AlgorithmSpec, Input, Output, OutputKind
from urban_processing.algorithms.words import (
    column_in_words,
    default_in_words,
    kind_in_words,
    limits_in_words,
)
from urban_processing.metrics.registry import METRICS
from urban_processing.params.base import ParamField
from urban_processing.schema import LAYERS, GeometryType, Layer


def algorithm_page(spec: AlgorithmSpec) -> str:
    """Return the reference page of an algorithm."""
    parts = [f"# {spec.title}", f"`{spec.name}`: {spec.summary}", spec.description, "## Reads"]
    parts.append(_table(("input", "kind", "what it is"), _items(spec.inputs)))
    parts += ["## Makes", _table(("output", "kind", "what it is"), _items(spec.outputs))]
    for panel, fields in spec.panels().items():
        rows = [
            (
                f"`{field.name}`",
                _kind(field),
                limits_in_words(field),
                default_in_words(field),
                field.param.help,
            )
            for field in fields
        ]
        heading = ("parameter", "value", "limits", "default", "what it means")
        parts += [f"## Parameters: {panel}", _table(heading, rows)]
    parts += [part for output in spec.outputs for part in _layers(output)]
    if spec.references:
        parts += ["## Sources", "\n".join(f"- {source}" for source in spec.references)]
    return "\n\n".join(parts) + "\n"


def layout_file_page() -> str:
    """Return the reference page of the layout file: its layers, columns and metrics."""
    parts = [
        "# The layout file",
        "A GeoPackage. Lengths are in metres, areas in m², angles in degrees, all in the "
        "projected CRS of the file. Extra columns may follow in later versions; these stay. "
        "Layers without content are left out.",
    ]
    for layer in LAYERS:
        parts += _columns(layer, "##")
    parts += [
        "## The metrics",
        "Those marked * are given twice: for all parcels, and with `_interior` at the end of the "
        "name for the parcels that do not touch the rim.",
        _table(
            ("metric", "unit", "definition", "source"),
            [
                (f"`{m.name}`{' *' if m.of_parcels else ''}", m.unit, m.definition, m.source)
                for m in METRICS
            ],
        ),
    ]
    return "\n\n".join(parts) + "\n"


def _kind(field: ParamField) -> str:
    words = (kind_in_words(field), column_in_words(field))
    return ", ".join(word for word in words if word)


def _layers(output: Output) -> list[str]:
    """What stands in the file of an output, layer by layer; a layout has a page of its own."""
    if output.kind is OutputKind.LAYOUT:
        return [
            f"## Layers of `{output.name}`",
            "All layers and columns of a layout: [layout_file.md](layout_file.md).",
        ]
    if output.kind is not OutputKind.LAYERS:
        return []
    parts = [
        f"## Layers of `{output.name}`",
        "A GeoPackage. Lengths are in metres, areas in m², angles in degrees, all in the projected "
        "CRS of the file. Extra columns may follow in later versions; these stay.",
    ]
    for layer in output.layers:
        parts += _columns(layer, "###")
    return parts


def _columns(layer: Layer, rank: str) -> list[str]:
    """A layer with all its columns, under a heading of some rank."""
    kind = layer.geometry.value if layer.geometry is not GeometryType.NONE else "no geometry"
    more = " Columns of the input follow." if layer.open else ""
    rows = [
        (
            f"`{column.name}`",
            column.dtype.value,
            column.unit,
            "yes" if column.nullable else "",
            column.description,
        )
        for column in layer.columns
    ]
    heading = ("column", "type", "unit", "may be empty", "what it means")
    return [f"{rank} `{layer.name}`", f"{layer.title} ({kind}).{more}", _table(heading, rows)]


def _items(items: Iterable[Input | Output]) -> list[tuple[str, str, str]]:
    return [
        (f"`{item.name}`{'' if item.required else ' (optional)'}", item.kind.value, item.help)
        for item in items
    ]


def _table(heading: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    lines = [heading, ["---"] * len(heading), *rows]
    return "\n".join(
        "| " + " | ".join(cell.replace("|", "\\|") for cell in line) + " |" for line in lines
    )
