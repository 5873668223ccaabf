"""What a comparison comes to, in plain words."""

from __future__ import annotations

import math

from urban_processing.metrics.comparison import Comparison, DistributionDistance
from urban_processing.metrics.comparison_notes import DENSITY, LANDS, notes
from urban_processing.metrics.comparison_words import (
    WANTED,
    judged_rows,
    largest_distances,
    middles,
    told_by,
)
from urban_processing.report.html.digits import decimals_for, number, with_unit
from urban_processing.report.html.labels import label
from urban_processing.report.html.text import listed

ABOUT = {LANDS: "Not the same land", DENSITY: "Another density"}
"""Headings of notes."""

MOST_NAMED = 6
"""Metrics that are named of a side; of the others it is said how many there are."""


def verdict(comparison: Comparison, names: tuple[str, ...]) -> list[tuple[str, str]]:
    """Return what each sentence is about, and the sentence; `names` as they are to be shown.

    First what is to be known of lands and density, then what differs most, and how far, last who is
    better and in what.
    """
    return [
        *((ABOUT[about], text) for about, text in notes(comparison, names)),
        *_distributions(comparison, names),
        *_better(comparison, names),
    ]


def _better(comparison: Comparison, names: tuple[str, ...]) -> list[tuple[str, str]]:
    judged = judged_rows(comparison)
    if not judged:
        return [("Better", "No metric that two sides have tells better from worse.")]
    won = [[label(r.name) for r in judged if r.better == k] for k in range(len(names))]
    order = sorted(range(len(names)), key=lambda k: -len(won[k]))
    counts = listed([f"{names[k]} in {len(won[k])}" for k in order])
    alike = len(judged) - sum(map(len, won))
    lines = [
        (
            "Better",
            f"{counts} of the {len(judged)} metrics that "
            f"{'both' if len(names) == 2 else 'two or more'} sides have a value of, {WANTED}"
            f"{f'; {alike} alike' if alike else ''}.",
        )
    ]
    for k in order:
        if won[k]:
            more = len(won[k]) - MOST_NAMED
            named = won[k][:MOST_NAMED] + ([f"{more} more"] if more > 0 else [])
            lines.append((f"Better in {names[k]}", f"{listed(named)}."))
    return lines


def _distributions(comparison: Comparison, names: tuple[str, ...]) -> list[tuple[str, str]]:
    known = [d for d in comparison.distances if d.n_side and d.n_reference]
    if not known:
        return [("Distributions", "Two sides have no values in common that could be compared.")]
    real = sum(d.more_than_noise for d in known)
    most = largest_distances(comparison)
    # several sides may differ in the same
    labels = list(dict.fromkeys(d.distribution.label for d in most))
    lead = f"{listed([labels[0], *map(str.lower, labels[1:])])}. " if labels else ""
    text = f"{lead}{real} of {len(known)} distributions differ by more than chance."
    shown = dict(zip(comparison.names, names, strict=True))
    return [
        ("Differs most" if labels else "Distributions", text),
        *((d.distribution.label, _apart(comparison, d, shown)) for d in most),
    ]


def _apart(comparison: Comparison, d: DistributionDistance, shown: dict[str, str]) -> str:
    unit, side, reference = d.distribution.unit, shown[d.side], shown[d.reference]
    distance = f"distance {interval(d.wasserstein, d.wasserstein_low, d.wasserstein_high, unit)}"
    by = told_by(d)
    distance += f"; more than chance {by}" if by else ""
    middle, *values = middles(comparison, d)
    if math.isnan(sum(values)):
        return f"{side} and {reference}: {distance}."
    decimals = decimals_for(values)
    first, second = (with_unit(value, unit, decimals) for value in values)
    return f"{middle} {first} in {side}, {second} in {reference}; {distance}."


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
