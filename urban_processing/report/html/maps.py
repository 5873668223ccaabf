"""Maps of all sides, drawn at one scale in classes that they have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.report.html.digits import number, share, with_unit
from urban_processing.report.html.model import Report, ReportSide
from urban_processing.report.html.svg import (
    Canvas,
    FloatArray,
    area_paths,
    line_paths,
    stage_of,
)
from urban_processing.report.html.text import isolate, listed
from urban_processing.report.html.themes import HATCHED, IntArray, Theme, themes
from urban_processing.report.palette import OUTLINE, PLAIN_CASING, PLAIN_STREET, SURFACE, Scale
from urban_processing.tables import Table

DRAWN = ("boundary", "parcels", "blocks", "streets", "right_of_way")
"""Layers that maps are drawn of."""

TALLEST_PX = 700.0
"""Height of a map on a screen that is large enough."""

BAR_SHARE = 0.3
"""Largest share of the width of a map that its scale bar takes."""

HATCH_LINES = 110
"""Lines of the hatching along the longer side of a map."""

_LINE = 'fill="none" stroke-linecap="round" stroke-linejoin="round"'
# attributes, as styles of the page do not reach into shapes that are used again

STREET_LINE = 0.3
"""Width of the lines of the map of streets, in sides of parcels."""


@dataclass(frozen=True)
class Panel:
    """The map of one side: its name, what it shows in a sentence, and the shapes as SVG."""

    side: str
    sentence: str
    shapes: str


@dataclass(frozen=True)
class LegendRow:
    """One class: colour, label, and how much of each side is in it."""

    fill: str
    label: str
    amounts: tuple[str, ...]


@dataclass(frozen=True)
class MapGroup:
    """The maps of one theme, with their legend; `counts` says what the legend counts."""

    name: str
    title: str
    note: str
    of_lines: bool
    counts: str
    panels: tuple[Panel, ...]
    legend: tuple[LegendRow, ...]


@dataclass(frozen=True)
class MapSheet:
    """All maps of a report.

    Parameters
    ----------
    width, height
        Size of each drawing in units.
    widest_px
        Width on a screen at which a map is as tall as it is to be.
    bar_label, bar_percent
        Length of the scale bar, and its share of the width of a map.
    hatch
        Distance of the lines of the hatching, in units.
    shared
        Shapes that several maps use, as SVG.
    groups
        The maps.
    """

    width: int
    height: int
    widest_px: int
    bar_label: str
    bar_percent: float
    hatch: float
    shared: str
    groups: tuple[MapGroup, ...]


def map_sheet(report: Report) -> MapSheet | None:
    """Draw every map of a report; None where there is nothing to draw."""
    sides = [_tables(side) for side in report.sides]
    chosen = themes(sides)
    if not chosen:
        return None
    extents = [_extent(side) for side in sides]
    known = [e for e in extents if e is not None]
    size = _typical_side(sides, known)
    stage = stage_of(known, size)
    drawings = [
        _Drawing(k, side, stage.canvas(extent or known[0]), size)
        for k, (side, extent) in enumerate(zip(sides, extents, strict=True))
    ]
    groups = [_group(theme, drawings, report.names) for theme in chosen]
    # what all sides have comes first
    groups.sort(key=lambda group: -len(group.panels))
    bar = _round_down(BAR_SHARE * stage.width_m)
    width, height = round(stage.width_m * stage.factor), round(stage.height_m * stage.factor)
    return MapSheet(
        width=width,
        height=height,
        widest_px=round(TALLEST_PX * width / height),
        bar_label=with_unit(bar / 1000, "km") if bar >= 1000 else with_unit(bar, "m"),
        bar_percent=round(100 * bar / stage.width_m, 2),
        hatch=round(max(width, height) / HATCH_LINES, 1),
        shared="".join(drawing.shared for drawing in drawings),
        groups=tuple(groups),
    )


def _tables(side: ReportSide) -> dict[str, Table]:
    found = {name: side.table(name) for name in DRAWN}
    return {name: table for name, table in found.items() if table is not None}


def _extent(tables: dict[str, Table]) -> tuple[float, float, float, float] | None:
    """Bounds of the land, or else of whatever there is."""
    layers = [tables["boundary"]] if "boundary" in tables else list(tables.values())
    bounds = shapely.total_bounds(np.concatenate([t.shapes for t in layers])) if layers else None
    if bounds is None or not np.isfinite(bounds).all():
        return None
    x0, y0, x1, y1 = bounds.tolist()
    return x0, y0, x1, y1


def _typical_side(
    sides: Sequence[dict[str, Table]], extents: Sequence[tuple[float, float, float, float]]
) -> float:
    """Side of a parcel in metres; a third of that of a block where there are only blocks."""
    for layer, factor in (("parcels", 1.0), ("blocks", 1 / 3)):
        areas = [shapely.area(side[layer].shapes) for side in sides if layer in side]
        if areas:
            return factor * float(np.sqrt(np.median(np.concatenate(areas))))
    x0, y0, x1, y1 = extents[0]
    return max(x1 - x0, y1 - y0) / 30


class _Drawing:
    """The shapes of one side, each worked out once."""

    def __init__(self, k: int, tables: dict[str, Table], canvas: Canvas, side_m: float) -> None:
        self.tables = tables
        self.prefix = f"side{k}"
        self.side = side_m * canvas.factor
        longer = max(canvas.width, canvas.height)
        self.outline = round(float(np.clip(0.03 * self.side, 0.8, longer / 500)), 1)
        self.casing = round(float(np.clip(0.05 * self.side, 0.6, longer / 400)), 1)
        self.paths = {
            name: (line_paths if name == "streets" else area_paths)(table.shapes, canvas)
            for name, table in tables.items()
        }
        self.width = self._street_widths(canvas.factor, side_m)
        self.shared = self._shared()

    def _street_widths(self, factor: float, side_m: float) -> IntArray:
        """(K,) whole units that each street is drawn wide, true to scale as far as that reads."""
        if "streets" not in self.tables:
            return np.empty(0, dtype=np.int64)
        width = np.nan_to_num(np.asarray(self.tables["streets"]["width_m"], dtype=np.float64))
        usual = float(np.median(width[width > 0])) if (width > 0).any() else 0.15 * side_m
        width = np.where(width > 0, width, usual)
        return np.maximum(np.rint(Scale(factor, side_m, 0.0).street(width)), 1).astype(np.int64)

    def _shared(self) -> str:
        """Boundary, right-of-way and streets, which stand on every map."""
        p = self.prefix
        out = [
            f'<path id="{p}-{name}" fill-rule="evenodd" d="{"".join(self.paths.get(name, []))}"/>'
            for name in ("boundary", "right_of_way")
        ]
        widths = np.unique(self.width).tolist()
        out += [
            f'<path id="{p}-w{w}" d="{self._joined("streets", self.width == w)}"/>' for w in widths
        ]
        for kind, more in (("casing", 2 * self.casing), ("street", 0.0)):
            uses = "".join(
                f'<use href="#{p}-w{w}" stroke-width="{round(w + more, 1):g}"/>' for w in widths
            )
            colour = PLAIN_STREET if kind == "street" else PLAIN_CASING
            out.append(f'<g id="{p}-{kind}" {_LINE} stroke="{colour}">{uses}</g>')
        return "".join(out)

    def _joined(self, layer: str, rows: np.typing.NDArray[np.bool_]) -> str:
        paths = self.paths[layer]
        return "".join(paths[i] for i in np.flatnonzero(rows).tolist())

    def shapes(self, theme: Theme) -> str:
        """The map of a theme as SVG."""
        of = theme.class_of(self.tables[theme.layer])
        drawn = self._of_streets if theme.layer == "streets" else self._of_areas
        return drawn(theme, of)

    def _of_areas(self, theme: Theme, of: IntArray) -> str:
        areas = "".join(
            f'<path fill="{c.fill}" d="{d}"/>'
            for k, c in enumerate(theme.classes)
            if (d := self._joined(theme.layer, of == k))
        )
        p, line = self.prefix, self.outline
        return (
            f'<g stroke="{OUTLINE}" stroke-width="{line}" fill-rule="evenodd">{areas}</g>'
            f'<use href="#{p}-right_of_way" fill="{SURFACE}"/>'
            f'<use href="#{p}-boundary" {_LINE} stroke="{PLAIN_CASING}" '
            f'stroke-width="{2 * line:g}"/>'
            f'<use href="#{p}-casing"/><use href="#{p}-street"/>'
        )

    def _of_streets(self, theme: Theme, of: IntArray) -> str:
        ground = "blocks" if "blocks" in self.tables else "parcels"
        shown = "".join(self.paths.get(ground, []))
        usual = float(np.median(self.width))
        width = np.clip(self.width / usual, 0.6, 1.8) * max(STREET_LINE * self.side, usual)
        lines = "".join(
            f'<path stroke="{c.fill}" d="{d}" stroke-width="{np.median(width[of == k]):.1f}"/>'
            for k, c in reversed(list(enumerate(theme.classes)))
            if (d := self._joined("streets", of == k))
        )
        return (
            f'<use href="#{self.prefix}-boundary" fill="{SURFACE}"/>'
            f'<path fill="#faf8f2" d="{shown}"/>'
            f'<use href="#{self.prefix}-boundary" {_LINE} stroke="{PLAIN_CASING}" '
            f'stroke-width="{2 * self.outline:g}"/><g {_LINE}>{lines}</g>'
        )


def _group(theme: Theme, drawings: Sequence[_Drawing], names: Sequence[str]) -> MapGroup:
    panels = []
    amounts = []
    missing = []
    for drawing, name in zip(drawings, names, strict=True):
        table = drawing.tables.get(theme.layer)
        if table is None or not theme.shows(table):
            missing.append(isolate(name))
            continue
        panels.append(Panel(name, theme.sentence(table), drawing.shapes(theme)))
        amounts.append(_amounts(theme, table))
    rows = [
        LegendRow(c.fill, c.label, tuple(texts[k] for texts in amounts))
        for k, c in enumerate(theme.classes)
        if any(texts[k] != "0" for texts in amounts) or c.fill != HATCHED
    ]
    of_lines = theme.layer == "streets"
    note = f"{theme.note} Not known of {listed(missing)}.".strip() if missing else theme.note
    counts = "Length" if of_lines else theme.layer.capitalize()
    return MapGroup(theme.name, theme.title, note, of_lines, counts, tuple(panels), tuple(rows))


def _amounts(theme: Theme, table: Table) -> list[str]:
    """How much of a side is in each class, as text."""
    weight: FloatArray = np.ones(len(table))
    if theme.layer == "streets":
        weight = np.asarray(table["length_m"], dtype=np.float64) / 1000
    n = len(theme.classes)
    amount = np.bincount(theme.class_of(table), weights=weight, minlength=n)
    whole = float(amount.sum())
    texts = []
    for value in amount.tolist():
        shown = with_unit(value, "km", 1) if theme.layer == "streets" else number(value)
        texts.append(f"{shown} ({share(value, whole)})" if value else "0")
    return texts


def _round_down(value: float) -> float:
    """Return the largest number of 1, 2 or 5 times a power of ten that is not larger.

    >>> _round_down(340.0), _round_down(5.0)
    (200.0, 5.0)
    """
    power = 10.0 ** math.floor(math.log10(value) + 1e-9)
    return next(s for s in (5.0, 2.0, 1.0) if s * power <= value * (1 + 1e-9)) * power
