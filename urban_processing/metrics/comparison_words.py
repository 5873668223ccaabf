"""A comparison in a few words."""

from __future__ import annotations

import math

from urban_processing.metrics.comparison import Comparison, DistributionDistance, MetricRow
from urban_processing.metrics.comparison_notes import notes
from urban_processing.metrics.registry import INTERIOR, Better

LARGEST = 3
"""Differences of distributions that a summary tells."""

WANTED = "by what is commonly wanted (right angles, four sides, short detours)"
"""What better and worse of a metric mean."""


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


def middles(comparison: Comparison, d: DistributionDistance) -> tuple[str, float, float]:
    """Return ``mean`` or ``median``, and that of the side and of the reference.

    Whole numbers have means: their medians are often alike where they differ. NaN where there are
    no values, and on circles.
    """
    if not d.distribution.whole:
        return "median", d.median_side, d.median_reference
    of = {side.name: side.sample(d.distribution).mean for side in comparison.sides}
    return "mean", of[d.side], of[d.reference]


def told_by(d: DistributionDistance) -> str:
    """Return by which distance more than chance is said, where the other one could be nought.

    Nothing where the interval of Wasserstein's distance does not begin at 0, or nothing is said.
    """
    if not d.more_than_noise or math.isnan(d.wasserstein_low) or round(d.wasserstein_low, 9) > 0.0:
        return ""
    if d.wasserstein > d.wasserstein_noise:
        return f"by their distance, above the {_short(d.wasserstein_noise)} of chance"
    what = "Kuiper's" if d.distribution.circular else "the Kolmogorov-Smirnov"
    return f"by {what} statistic, {_short(d.ks)} where chance makes {_short(d.ks_noise)}"


def words(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    """Return what to say of a comparison: names, and values as text.

    First what is to be known of lands and density, then the largest differences of distributions
    that are more than noise, last which side is better in how many metrics, those of interior
    parcels left out.
    """
    real = sum(d.more_than_noise for d in comparison.distances)
    known = sum(not math.isnan(d.ks) for d in comparison.distances)
    return (
        *notes(comparison),
        ("distributions", f"{real} of {known} differ by more than chance"),
        *(
            (d.distribution.label.lower(), _in_words(comparison, d))
            for d in largest_distances(comparison)
        ),
        ("better", _better(comparison)),
    )


def _better(comparison: Comparison) -> str:
    judged = judged_rows(comparison)
    if not judged:
        return "no metric that two sides have tells better from worse"
    counts = [sum(r.better == k for r in judged) for k in range(len(comparison.sides))]
    parts = [f"{name} in {n}" for name, n in zip(comparison.names, counts, strict=True)]
    alike = len(judged) - sum(counts)
    return f"{', '.join(parts)} of {len(judged)} metrics, {WANTED}" + (
        f"; {alike} alike" if alike else ""
    )


def _in_words(comparison: Comparison, d: DistributionDistance) -> str:
    """Say how far a distribution is from the reference."""
    unit = (
        f" {d.distribution.unit}" if d.distribution.unit not in ("", "°") else d.distribution.unit
    )
    sure = ""
    if not math.isnan(d.wasserstein_low):
        sure = f" ({_short(d.wasserstein_low)} to {_short(d.wasserstein_high)})"
    by = told_by(d)
    apart = f"{_short(d.wasserstein)}{unit} apart on average{sure}"
    apart += f"; more than chance {by}" if by else ""
    middle, of_side, of_reference = middles(comparison, d)
    if math.isnan(of_side):
        return f"{d.side}: {apart}" if len(comparison.sides) > 2 else apart
    return (
        f"{middle} {_short(of_side)}{unit} in {d.side}, {_short(of_reference)}{unit} in "
        f"{d.reference}; {apart}"
    )


def _short(value: float) -> str:
    """Return three digits of a number, all digits before the point."""
    if value == 0.0 or abs(value) >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.{2 - math.floor(math.log10(abs(value)))}f}"
