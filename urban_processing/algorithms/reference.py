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
from urban_processing.network_files.tags import DEAD_END_TAGS, PARCEL_TAGS, STREET_TAGS
from urban_processing.params.base import ParamField
from urban_processing.schema import LAYERS, GeometryType, Layer
from urban_processing.street_rules import (
    ANY_HIGHWAY,
    HIGHWAYS,
    LANE_WIDTH,
    LEAST_CARRIAGEWAY,
    LEAST_LANE,
    OWN_TAGS,
    TRAFFIC,
    VERGES,
)


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
    if output.kind is OutputKind.EXPORT and not output.of:
        return _formats()
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


def _formats() -> list[str]:
    """What stands in files of OpenStreetMap and SUMO, from the declarations that write them."""
    own = f"Keys that begin with `{OWN_TAGS}` are this library's own; the others are in common use."
    parts = ["## Tags in `layout.osm` and `streets.osm`", own]
    for title, tags in (
        ("Streets (ways)", STREET_TAGS),
        ("Street ends inside the land (nodes)", DEAD_END_TAGS),
        ("Parcels (closed ways, or multipolygons where there are holes)", PARCEL_TAGS),
    ):
        rows = [(f"`{tag.key}`", tag.meaning) for tag in tags]
        parts += [f"### {title}", _table(("key", "value"), rows)]
    parts += [
        "## Classes of streets",
        f"A class that is none of these becomes `{ANY_HIGHWAY}`; it is kept in `{OWN_TAGS}class`. "
        f"Verges and pavements take {VERGES:g} m of the right-of-way; where less than "
        f"{LEAST_CARRIAGEWAY:g} m are left, no carriageway is said. A lane takes at least "
        f"{LEAST_LANE:g} m. Streets have an even number of lanes, or one that both directions "
        "share. In SUMO each direction has half of them, of the width that the carriageway gives "
        f"them, {LANE_WIDTH:g} m at most.",
        _table(
            ("class", "`highway`", "km/h", "lanes at most", "priority in SUMO", "only for"),
            [_traffic(name, highway) for name, highway in HIGHWAYS.items()],
        ),
        "50 km/h is the general limit in built-up areas in most countries; 30 km/h is what the "
        "Stockholm Declaration on road safety (2020, resolution 11) asks for where people live. "
        "On ways with an entry in the last column the speed is that of those who use them, and "
        "is written for SUMO alone. Priorities are those of SUMO's own table for OpenStreetMap.",
    ]
    return parts


def _traffic(name: str, highway: str) -> tuple[str, ...]:
    traffic = TRAFFIC[highway]
    lanes = "" if traffic.users else str(traffic.lanes)
    return (
        f"`{name}`",
        f"`{highway}`",
        f"{traffic.speed:g}",
        lanes,
        str(traffic.priority),
        traffic.users,
    )


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
