"""The distributions: a chart of all sides, the figures behind it, and the distances."""

from __future__ import annotations

import math
from dataclasses import dataclass

from urban_processing.metrics.distributions import DistributionSpec, Sample
from urban_processing.metrics.histograms import Histogram
from urban_processing.report.html.charts import Chart, chart
from urban_processing.report.html.digits import decimals_for, number, with_unit
from urban_processing.report.html.model import Report
from urban_processing.report.html.sentences import (
    mean,
    of_distance,
    of_distribution,
    quantile,
)

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles that the table of a distribution shows."""


@dataclass(frozen=True)
class SideLine:
    """The values of one side: how many, and their mean and quantiles as text."""

    side: str
    count: str
    figures: tuple[str, ...]


@dataclass(frozen=True)
class DistanceLine:
    """How far a side is from the reference: in words, and both distances with intervals."""

    side: str
    sentence: str
    wasserstein: str
    ks: str


@dataclass(frozen=True)
class DistributionView:
    """One distribution of all sides."""

    spec: DistributionSpec
    chart: Chart
    sentence: str
    tail: str
    sides: tuple[SideLine, ...]
    distances: tuple[DistanceLine, ...]


def distribution_views(report: Report, names: tuple[str, ...]) -> list[DistributionView]:
    """Return what the page shows of each distribution; `names` as they are to be shown."""
    return [_view(report, h, names) for h in report.histograms()]


def _view(report: Report, h: Histogram, names: tuple[str, ...]) -> DistributionView:
    spec = h.distribution
    samples = [side.sample(spec) for side in report.sides]
    said = [of_distribution(h, k, sample) for k, sample in enumerate(samples)]
    if len(names) > 1:
        said = [f"{name}: {text}" for name, text in zip(names, said, strict=True)]
    known = [] if report.comparison is None else report.comparison.distances
    shown = dict(zip(report.names, names, strict=True))
    of = dict(zip(report.names, samples, strict=True))
    return DistributionView(
        spec,
        chart(h),
        " ".join(said),
        _tail(h),
        _side_lines(spec, samples, names),
        tuple(
            DistanceLine(
                shown[d.side],
                of_distance(d, of[d.side], of[d.reference], (shown[d.side], shown[d.reference])),
                interval(d.wasserstein, d.wasserstein_low, d.wasserstein_high, spec.unit),
                interval(d.ks, d.ks_low, d.ks_high, ""),
            )
            for d in known
            if d.distribution == spec
        ),
    )


def _side_lines(
    spec: DistributionSpec, samples: list[Sample], names: tuple[str, ...]
) -> tuple[SideLine, ...]:
    """Figures of all sides with the same decimals; those of directions have no order."""
    figures = [
        () if spec.circular else (mean(s), *(quantile(s, q) for q in QUANTILES)) for s in samples
    ]
    decimals = decimals_for([value for each in figures for value in each])
    return tuple(
        SideLine(name, f"{len(sample):,}", tuple(number(value, decimals) for value in each))
        for name, sample, each in zip(names, samples, figures, strict=True)
    )


def _tail(h: Histogram) -> str:
    """Say which bars hold values beyond them."""
    held = [name for name, there in (("first", h.below), ("last", h.above)) if there]
    if not held:
        return ""
    return f"The {' and the '.join(held)} bar hold{'s' if len(held) == 1 else ''} all beyond."


def interval(value: float, low: float, high: float, unit: str) -> str:
    """Return a value and its confidence interval: ``41 m² (30 to 52)``; nothing if unknown.

    >>> interval(0.1234, 0.1, 0.2, ""), interval(float("nan"), 0.0, 0.0, "m")
    ('0.123 (0.100 to 0.200)', '')
    """
    if math.isnan(value):
        return ""
    decimals = decimals_for([value, high])
    shown = with_unit(value, unit, decimals)
    if math.isnan(low):
        return shown
    return f"{shown} ({number(low, decimals)} to {number(high, decimals)})"
