"""A comparison in a few words."""

from __future__ import annotations

import math

from urban_processing.metrics.comparison import Comparison, DistributionDistance
from urban_processing.metrics.registry import INTERIOR, Better

LARGEST = 3
"""Differences of distributions that a summary tells."""


def words(comparison: Comparison) -> tuple[tuple[str, str], ...]:
    """Return what to say of a comparison: names, and values as text.

    Which side is better in how many metrics, those of interior parcels left out, and the largest
    differences of distributions that are more than noise.
    """
    judged = [
        r
        for r in comparison.rows
        if r.spec.better is not Better.NEITHER
        and not r.name.endswith(INTERIOR)
        and sum(not math.isnan(v) for v in r.values) > 1
    ]
    counts = [sum(r.better == k for r in judged) for k in range(len(comparison.sides))]
    parts = [f"{name} in {n}" for name, n in zip(comparison.names, counts, strict=True)]
    nobody = len(judged) - sum(counts)
    better = f"{', '.join(parts)} of {len(judged)} metrics" + (
        f", {nobody} alike" if nobody else ""
    )
    real = [d for d in comparison.distances if d.more_than_noise]
    largest = sorted(real, key=lambda d: -round(d.ks, 6))[:LARGEST]
    known = sum(not math.isnan(d.ks) for d in comparison.distances)
    return (
        ("better", better),
        ("distributions", f"{len(real)} of {known} differ by more than chance"),
        *((d.distribution.label.lower(), _in_words(d, len(comparison.sides))) for d in largest),
    )


def _in_words(d: DistributionDistance, n_sides: int) -> str:
    """Say how far a distribution is from the reference."""
    unit = (
        f" {d.distribution.unit}" if d.distribution.unit not in ("", "°") else d.distribution.unit
    )
    who = f"{d.side}: " if n_sides > 2 else ""
    sure = ""
    if not math.isnan(d.wasserstein_low):
        sure = f" ({_short(d.wasserstein_low)} to {_short(d.wasserstein_high)})"
    text = f"{who}{_short(d.wasserstein)}{unit} apart{sure}"
    if math.isnan(d.median_side):
        return text
    return (
        f"{text}, median {_short(d.median_side)} in {d.side}, {_short(d.median_reference)} in "
        f"{d.reference}"
    )


def _short(value: float) -> str:
    """Return three digits of a number, all digits before the point."""
    if value == 0.0 or abs(value) >= 100.0:
        return f"{value:,.0f}"
    return f"{value:.{2 - math.floor(math.log10(abs(value)))}f}"
