"""The distributions: a chart of all sides, the figures behind it, and the distances."""

from __future__ import annotations

from dataclasses import dataclass

from urban_processing.metrics.distributions import DistributionSpec, Sample
from urban_processing.metrics.histograms import Histogram
from urban_processing.report.html.charts import Chart, chart
from urban_processing.report.html.digits import decimals_for, number
from urban_processing.report.html.model import Report
from urban_processing.report.html.sentences import (
    of_distance,
    of_distribution,
    quantile,
)
from urban_processing.report.html.summary import interval

QUANTILES = (0.1, 0.5, 0.9)
"""Quantiles that the table of a distribution shows."""


@dataclass(frozen=True)
class SideLine:
    """The values of side `number`: how many, and their mean and quantiles as text."""

    number: int
    side: str
    count: str
    figures: tuple[str, ...]


@dataclass(frozen=True)
class DistanceLine:
    """How far a side is from the reference: in words, and both distances with intervals."""

    sentence: str
    wasserstein: str
    ks: str


@dataclass(frozen=True)
class DistributionView:
    """One distribution of all sides; `alone` is the only one of several that has values."""

    spec: DistributionSpec
    chart: Chart
    sentence: str
    tail: str
    sides: tuple[SideLine, ...]
    distances: tuple[DistanceLine, ...]
    alone: str


def distribution_views(report: Report, names: tuple[str, ...]) -> list[DistributionView]:
    """Return what the page shows of each distribution; `names` as they are to be shown."""
    return [_view(report, h, names) for h in report.histograms()]


def _view(report: Report, h: Histogram, names: tuple[str, ...]) -> DistributionView:
    spec = h.distribution
    samples = [side.sample(spec) for side in report.sides]
    said = [of_distribution(h, k, sample) for k, sample in enumerate(samples)]
    if len(names) > 1:
        said = [f"{name}: {text}" for name, text in zip(names, said, strict=True)]
    known = () if report.comparison is None else report.comparison.distances
    there = [k for k, sample in enumerate(samples) if len(sample)]
    shown = dict(zip(report.names, names, strict=True))
    of = dict(zip(report.names, samples, strict=True))
    return DistributionView(
        spec,
        chart(h),
        " ".join(said),
        _tail(h),
        _side_lines(spec, [samples[k] for k in there], [(k, names[k]) for k in there]),
        tuple(
            DistanceLine(
                of_distance(d, of[d.side], of[d.reference], (shown[d.side], shown[d.reference])),
                interval(d.wasserstein, d.wasserstein_low, d.wasserstein_high, spec.unit),
                interval(d.ks, d.ks_low, d.ks_high, ""),
            )
            for d in known
            if d.distribution == spec and d.n_side and d.n_reference
        ),
        names[there[0]] if len(there) == 1 < len(names) else "",
    )


def _side_lines(
    spec: DistributionSpec, samples: list[Sample], sides: list[tuple[int, str]]
) -> tuple[SideLine, ...]:
    """Figures of all sides with the same decimals; those of directions have no order."""
    figures = [
        () if spec.circular else (s.mean, *(quantile(s, q) for q in QUANTILES)) for s in samples
    ]
    decimals = decimals_for([value for each in figures for value in each])
    return tuple(
        SideLine(k, name, f"{len(sample):,}", tuple(number(value, decimals) for value in each))
        for (k, name), sample, each in zip(sides, samples, figures, strict=True)
    )


def _tail(h: Histogram) -> str:
    """Say which bars hold values beyond them."""
    held = [name for name, there in (("first", h.below), ("last", h.above)) if there]
    if not held:
        return ""
    one = len(held) == 1
    return (
        f"The {' and the '.join(held)} bar also hold{'s' if one else ''} the values beyond "
        f"{'it' if one else 'them'}."
    )
