"""A comparison in a few words."""

from __future__ import annotations

import math

from urban_processing.metrics.comparison import Comparison, DistributionDistance, MetricRow
from urban_processing.metrics.registry import INTERIOR, Better

LARGEST = 3
"""Differences of distributions that a summary tells."""


def judged_rows(comparison: Comparison) -> list[MetricRow]:
    """Return the metrics that tell better from worse and that two sides have a value of.

    Those of interior parcels are left out, which would count twice.
    """
    return [
        r
        for r in comparison.rows
        if r.spec.better is not Better.NEITHER
        and not r.name.endswith(INTERIOR)
        and sum(not math.isnan(v) for v in r.values) > 1
    ]


def largest_distances(comparison: Comparison) -> list[DistributionDistance]:
    """Return the distributions that differ most, of those that differ by more than chance."""
    real = [d for d in comparison.distances if d.more_than_noise]
    return sorted(real, key=lambda d: -round(d.ks, 6))[:LARGEST]


def words(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    """Return what to say of a comparison: names, and values as text.

    Which side is better in how many metrics, those of interior parcels left out, and the largest
    differences of distributions that are more than noise.
    """
    judged = judged_rows(comparison)
    counts = [sum(r.better == k for r in judged) for k in range(len(comparison.sides))]
    parts = [f"{name} in {n}" for name, n in zip(comparison.names, counts, strict=True)]
    nobody = len(judged) - sum(counts)
    better = "no metric that two sides have tells better from worse"
    if judged:
        better = f"{', '.join(parts)} of {len(judged)} metrics that tell better from worse"
    if nobody:
        better += f", {nobody} alike"
    real = sum(d.more_than_noise for d in comparison.distances)
    known = sum(not math.isnan(d.ks) for d in comparison.distances)
    return (
        ("better", better),
        ("distributions", f"{real} of {known} differ by more than chance"),
        *(
            (d.distribution.label.lower(), _in_words(d, len(comparison.sides)))
            for d in largest_distances(comparison)
        ),
    )


def _in_words(d: DistributionDistance, n_sides: int) -> str:
    """Say how far a distribution is from the reference."""
    unit = (
        f" {d.distribution.unit}" if d.distribution.unit not in ("", "°") else d.distribution.unit
    )
    sure = ""
    if not math.isnan(d.wasserstein_low):
        sure = f" ({_short(d.wasserstein_low)} to {_short(d.wasserstein_high)})"
    apart = f"{_short(d.wasserstein)}{unit} apart on average{sure}"
    if math.isnan(d.median_side):
        return f"{d.side}: {apart}" if n_sides > 2 else apart
    return (
        f"median {_short(d.median_side)}{unit} in {d.side}, {_short(d.median_reference)}{unit} in "
        f"{d.reference}; {apart}"
    )


def _short(value: float) -> str:
    """Return three digits of a number, all digits before the point."""
    if value == 0.0 or abs(value) >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.{2 - math.floor(math.log10(abs(value)))}f}"
