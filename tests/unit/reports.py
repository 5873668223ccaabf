"""Reports on small layouts, and what the HTML of a page says of itself."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
from grid_layouts import grid

from urban_processing.layout import Layout
from urban_processing.metrics.certificate import certificate
from urban_processing.metrics.comparison import Side, compare
from urban_processing.metrics.distributions import Sample
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.provenance import Step
from urban_processing.report.html import Report, ReportSide, report_side
from urban_processing.tables import Table, objects

NASTY = "</title><script>alert(1)</script> \"'&<b> {{ 7 * 7 }}\n\u202eתוכנית\x00"
"""A name that a careless page would fall for."""

VOID = {"link", "meta", "br", "img", "hr", "input"}
STEP = Step("cogenerate", {"min_area": 400.0, "pattern": "loop"}, 7, "1.0", "ab" * 32, 1.5)


def samples_of(known: LayoutMeasures) -> dict[str, Sample]:
    parcels = known.parcels
    lines = known.of_fabric.segments
    return {
        "parcel_area_m2": Sample(parcels.area),
        "parcel_frontage_m": Sample(parcels.frontage),
        "segment_bearing_deg": Sample(lines.bearing, lines.length),
    }


def side_of(layout: Layout, name: str = "grid") -> ReportSide:
    known = LayoutMeasures(layout)
    return report_side(
        known.of_fabric, name=name, samples=samples_of(known), certificate=certificate(layout)
    )


def small_grid(**kwargs: object) -> Layout:
    """A grid of five by four with two streets, one of which ends inside."""
    layout = grid(5, 4, [(0, 2), (5, 2)], [(2, 2), (2, 4)], [(4, 0), (4, 1)], **kwargs)
    return layout.replace(history=(STEP,))


def one_report(name: str = "grid", title: str = "") -> Report:
    return Report((side_of(small_grid(), name),), title=title)


def compared(sides: Sequence[ReportSide], title: str = "") -> Report:
    known = [Side(side.name, side.values, side.samples) for side in sides]
    return Report(tuple(sides), compare(known, resamples=20), title)


def two_reports(first: str = "grid", second: str = "larger") -> Report:
    other = grid(6, 4, [(0, 2), (6, 2)], [(3, 0), (3, 4)], origin=(300.0, 50.0))
    return compared([side_of(small_grid(), first), side_of(other, second)])


def without(side: ReportSide, *layers: str) -> ReportSide:
    """A side that some layers are not known of."""
    tables = {layer: t for layer, t in side.layers.tables.items() if layer.name not in layers}
    return replace(side, layers=replace(side.layers, tables=tables))


def with_column(side: ReportSide, layer: str, column: str, value: object) -> ReportSide:
    """A side that has one value in all rows of a column of a layer."""
    tables: Mapping[object, Table] = side.layers.tables
    new = {
        key: Table({**t.columns, column: objects([value] * len(t))}, t.geometry)
        if getattr(key, "name", "") == layer
        else t
        for key, t in tables.items()
    }
    return replace(side, layers=replace(side.layers, tables=new))  # type: ignore[arg-type]


def with_issues(side: ReportSide, n: int, message: str = "too small") -> ReportSide:
    issues = Table(
        {
            "part": np.full(n, np.nan),
            "parcel_id": np.arange(1.0, n + 1.0),
            "code": objects(["parcel_small", "street_gone"] * n)[:n],
            "message": objects([f"{message} {k}" for k in range(n)]),
            "value": np.full(n, 12.5),
            "limit": np.full(n, np.nan),
        },
        objects([None] * n),
    )
    tables = {layer: t for layer, t in side.layers.tables.items() if layer.name != "issues"}
    layer = next(layer for layer in side.layers.tables if layer.name == "issues")
    return replace(side, layers=replace(side.layers, tables={**tables, layer: issues}))


def undefined(side: ReportSide) -> ReportSide:
    return replace(side, values=dict.fromkeys(side.values, math.nan), samples={})


@dataclass
class Element:
    """One element of a page."""

    tag: str
    attributes: dict[str, str]
    text: str = ""
    above: list[str] = field(default_factory=list)


class Reader(HTMLParser):
    """Reads a page and complains of whatever is not well formed."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[Element] = []
        self._open: list[Element] = []
        self.feed(html)
        self.close()
        assert not self._open, [e.tag for e in self._open]

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        names = [name for name, _ in attrs]
        assert len(set(names)) == len(names), (tag, names)
        element = Element(tag, {name: value or "" for name, value in attrs})
        element.above = [e.tag for e in self._open]
        self.elements.append(element)
        if tag not in VOID:
            self._open.append(element)

    def handle_startendtag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.handle_endtag(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open, f"</{tag}> ends nothing"
        assert self._open[-1].tag == tag, (self._open[-1], tag)
        self._open.pop()

    def handle_data(self, data: str) -> None:
        for element in self._open:
            element.text += data

    def all(self, *tags: str) -> list[Element]:
        return [element for element in self.elements if element.tag in tags]

    def ids(self) -> list[str]:
        return [e.attributes["id"] for e in self.elements if "id" in e.attributes]


def save(html: str, folder: Path, name: str) -> Path:
    path = folder / name
    path.write_text(html, encoding="utf-8")
    return path
