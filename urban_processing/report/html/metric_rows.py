"""The table of metrics: rows in groups, a column for each side."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from urban_processing.metrics.comparison import MetricRow
from urban_processing.metrics.registry import MetricSpec
from urban_processing.report.html.digits import MOST_DECIMALS, decimals_for, number, signed
from urban_processing.report.html.labels import GROUPS, group, is_interior, label
from urban_processing.report.html.model import Report

PART_METRICS = (
    "area_m2",
    "parcels",
    "area_mean_m2",
    "irregularity_mean",
    "unreached",
    "blocks",
    "street_length_m",
    "intersections",
    "dead_ends",
)
"""Metrics that the table of the parts of a land shows."""

MOST_PARTS = 50
"""Parts that it shows at most."""


@dataclass(frozen=True)
class MetricLine:
    """One metric as a row: values as text, differences, and the side that is better.

    A difference is a text and the same in percent of the reference, where that makes sense.
    """

    term: str
    label: str
    unit: str
    values: tuple[str, ...]
    differences: tuple[tuple[str, str], ...]
    better: int | None


@dataclass(frozen=True)
class MetricGroup:
    """Rows under a heading."""

    title: str
    lines: tuple[MetricLine, ...]

    @property
    def differs(self) -> bool:
        """Whether a difference is known: none is where the reference has no values."""
        return any(text for line in self.lines for text, _ in line.differences)


@dataclass(frozen=True)
class OneSided:
    """The metrics that a single side of several has a value of."""

    side: str
    groups: tuple[MetricGroup, ...]


@dataclass(frozen=True)
class PartTable:
    """Some metrics of each part of the land of one side, and how many parts are left out."""

    side: str
    heads: tuple[tuple[str, str, str], ...]
    rows: tuple[tuple[int, tuple[str, ...]], ...]
    more: int


def metric_rows(report: Report) -> tuple[MetricRow, ...]:
    """Return every metric that a side has a value of; a single side is not compared."""
    if report.comparison is not None:
        return report.comparison.rows
    values = report.sides[0].values
    return tuple(
        MetricRow(name, spec.unit, spec, (float(values[name]),), (0.0,), None)
        for name, spec in report.metric_specs().items()
        if math.isfinite(values.get(name, math.nan))
    )


def metric_groups(report: Report) -> list[MetricGroup]:
    """Return the rows by group, of several sides those that two of them have a value of."""
    rows = metric_rows(report)
    if report.comparison is not None:
        rows = tuple(row for row in rows if len(_known(row)) > 1)
    return _grouped(rows, report.reference)


def one_sided(report: Report) -> list[OneSided]:
    """Return, for each side of several, what nobody else has a value of; nothing of others."""
    if report.comparison is None:
        return []
    found = []
    for k, name in enumerate(report.names):
        alone = [
            replace(row, values=(row.values[k],), better=None)
            for row in report.comparison.rows
            if _known(row) == [k]
        ]
        if alone:
            found.append(OneSided(name, tuple(_grouped(alone, None))))
    return found


def _known(row: MetricRow) -> list[int]:
    """Numbers of the sides that have a value."""
    return [k for k, value in enumerate(row.values) if not math.isnan(value)]


def _grouped(rows: Sequence[MetricRow], reference: int | None) -> list[MetricGroup]:
    """Rows by group; last those of interior parcels alone."""
    whole = [r for r in rows if not is_interior(r.name, r.spec)]
    inner = [r for r in rows if is_interior(r.name, r.spec)]
    found = [(title, [r for r in whole if group(r.name) == title]) for title in GROUPS]
    found.append(("Interior parcels alone", inner))
    return [MetricGroup(t, tuple(_lines(chosen, reference))) for t, chosen in found if chosen]


def _lines(rows: Iterable[MetricRow], reference: int | None) -> Iterable[MetricLine]:
    for row in rows:
        decimals = _decimals(row)
        yield MetricLine(
            row.spec.name,
            label(row.name),
            row.unit,
            tuple(number(v, decimals) for v in row.values),
            tuple(
                (signed(d, decimals), _relative(row, d, reference))
                for k, d in enumerate(row.differences)
                if reference is not None and k != reference
            ),
            row.better,
        )


def _decimals(row: MetricRow) -> int:
    """So many that what is better looks different from the rest, as far as that goes."""
    decimals = decimals_for(row.values)
    if row.better is None:
        return decimals
    best, *rest = row.values[row.better], *row.values[: row.better], *row.values[row.better + 1 :]
    while decimals < MOST_DECIMALS and number(best, decimals) in [
        number(v, decimals) for v in rest
    ]:
        decimals += 1
    return decimals


def _relative(row: MetricRow, difference: float, reference: int) -> str:
    """A difference in percent of the reference; that of shares is told in points instead."""
    base = row.values[reference]
    if math.isnan(difference) or round(difference, MOST_DECIMALS) == 0.0:
        return ""
    if row.unit == "%":
        return "points"
    if base == 0.0:
        return ""
    percent = 100.0 * difference / abs(base)
    return f"{signed(percent, 0 if abs(percent) >= 9.95 else 1)}\u00a0%"


def part_tables(report: Report) -> list[PartTable]:
    """Return the metrics of the parts of each land that has several."""
    specs = report.metric_specs()
    return [
        _part_table(name, parts, specs)
        for name, side in zip(report.names, report.sides, strict=True)
        if (parts := side.parts())
    ]


def _part_table(
    side: str, parts: dict[int, dict[str, float]], specs: dict[str, MetricSpec]
) -> PartTable:
    known = [
        m
        for m in PART_METRICS
        if any(math.isfinite(values.get(m, math.nan)) for values in parts.values())
    ]
    columns = []
    for metric in known:
        values = [part.get(metric, math.nan) for part in parts.values()]
        decimals = decimals_for(values)
        columns.append([number(v, decimals) for v in values])
    rows = list(zip(parts, zip(*columns, strict=True), strict=True)) if columns else []
    heads = tuple((m, label(m), specs[m].unit) for m in known)
    return PartTable(side, heads, tuple(rows[:MOST_PARTS]), max(len(rows) - MOST_PARTS, 0))
