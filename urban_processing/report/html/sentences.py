"""What a report says in words."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from urban_processing.metrics.comparison import DistributionDistance
from urban_processing.metrics.comparison_words import told_by
from urban_processing.metrics.distributions import Sample
from urban_processing.metrics.histograms import Histogram
from urban_processing.metrics.registry import Better
from urban_processing.report.html.digits import (
    counted,
    decimals_for,
    number,
    share,
    with_unit,
)
from urban_processing.report.html.svg import FloatArray

BETTER = {Better.LOW: "lower", Better.HIGH: "higher", Better.NEITHER: ""}
"""Which values of a metric are better, in a word."""

PROMISES = {
    "valid_polygons": "Every parcel is a valid polygon",
    "coverage": "Parcels share their boundaries exactly, without overlaps",
    "land_covered": "Parcels cover the land, without gaps",
    "reached": "A street reaches every parcel",
    "streets_on_boundaries": "Streets run along boundaries of parcels alone",
    "streets_connected": "Each part of the land has one connected street network",
    "min_area": "No parcel is smaller than the smallest area allowed",
    "right_of_way": "Right-of-way and net parcels are the land, without gaps and overlaps",
}
"""What each check of a certificate promises."""

Values = Mapping[str, float]

USES = ("parcels", "streets", "parks", "other")
"""Uses of land, of which metrics tell the shares."""


@dataclass(frozen=True)
class Figure:
    """One of the figures that a planner reads first: what it is about, and a sentence.

    It is said where the metric `needs` is known, and `some`, if given, is above 0.
    """

    about: str
    needs: str
    say: Callable[[Values], str]
    some: str = ""

    def known(self, values: Values) -> bool:
        """Whether there is something to say."""
        there = not self.some or values.get(self.some, math.nan) > 0.0
        return there and math.isfinite(values.get(self.needs, math.nan))


def _area(v: Values) -> str:
    area = v["area_m2"]
    text = with_unit(area / 1e6, "km²", 2) if area >= 1e6 else with_unit(area / 1e4, "ha", 2)
    boundary = v.get("perimeter_m", math.nan) / 1000
    return text if math.isnan(boundary) else f"{text}, with a boundary of {number(boundary, 1)} km"


def _unreached(v: Values) -> str:
    n = int(v["unreached"])
    if n == 0:
        return "a street reaches every parcel"
    return (
        f"{counted(n, 'parcel')} with too little frontage for access (under 3 m, or a quarter of "
        "√area where that is less) or none"
    )


def _uses(v: Values) -> str:
    """Shares of the land that are known, the rest of the land only where there is some."""
    shares = [(use, v.get(f"land_use_{use}_pct", math.nan)) for use in USES]
    shown = [(use, s) for use, s in shares if math.isfinite(s) and (use != "other" or s >= 0.5)]
    return ", ".join(f"{with_unit(value, '%', 0)} {use}" for use, value in shown)


def _of(values: Values, name: str, unit: str = "", decimals: int | None = None) -> str:
    value = values.get(name, math.nan)
    return "not known" if math.isnan(value) else with_unit(value, unit, decimals)


def _blocks(v: Values) -> str:
    n = number(v["blocks"])
    if not math.isfinite(v.get("block_length_median_m", math.nan)):
        return n if v["blocks"] else "none"
    return (
        f"{n}, half of them longer than {_of(v, 'block_length_median_m', 'm', 0)}, the longest "
        f"{_of(v, 'block_length_max_m', 'm', 0)}"
    )


FIGURES: tuple[Figure, ...] = (
    Figure("Land", "area_m2", _area),
    Figure(
        "Use of the land",
        "land_use_streets_pct",
        _uses,
    ),
    Figure(
        "Parcels",
        "parcels",
        lambda v: f"{number(v['parcels'])}, {_of(v, 'area_mean_m2', 'm²', 0)} each on average",
    ),
    Figure(
        "Shape",
        "irregularity_mean",
        lambda v: (
            f"{_of(v, 'quads_pct', '%', 0)} have four sides; mean irregularity "
            f"{_of(v, 'irregularity_mean', '', 3)} (0 is a square)"
        ),
    ),
    Figure(
        "Undesirable parcels",
        "undesirable",
        lambda v: f"{number(v['undesirable'])} ({share(v['undesirable'], v['parcels'])} of all)",
    ),
    Figure(
        "Access",
        "unreached",
        lambda v: f"{_unreached(v)}; {_of(v, 'frontage_mean_m', 'm', 1)} of frontage on average",
    ),
    Figure(
        "Blocks",
        "blocks",
        _blocks,
    ),
    Figure(
        "Streets",
        "street_length_m",
        lambda v: (
            f"{with_unit(v['street_length_m'] / 1000, 'km', 1)} inside the land, "
            f"{_of(v, 'street_km_per_km2', 'km', 1)} for each km²"
            if v["street_length_m"]
            else "none inside the land"
        ),
    ),
    Figure(
        "Intersections",
        "intersections",
        lambda v: (
            f"{counted(int(v['intersections']), 'intersection')} and "
            f"{counted(int(v['dead_ends']), 'dead end')}"
        ),
    ),
    Figure(
        "Ways",
        "network_detour",
        lambda v: (
            f"along streets {_of(v, 'network_detour', '', 2)} times as far as the straight line "
            "between intersections and ends of streets"
        ),
        some="intersections",
    ),
)
"""The ten figures that a planner reads first."""


def first_figures(values: Values) -> list[tuple[str, str]]:
    """Return the figures that are known: what they are about, and a sentence on each."""
    return [(f.about, f.say(values)) for f in FIGURES if f.known(values)]


def quantile(sample: Sample, part: float) -> float:
    """Return the value that a part of all, 0 to 1, is below, weighted where there are weights."""
    if not len(sample):
        return math.nan
    if sample.weights is None:
        return float(np.quantile(sample.values, part))
    order = np.argsort(sample.values, kind="stable")
    below: FloatArray = np.cumsum(sample.weights[order])
    place = int(np.searchsorted(below, part * below[-1]))
    return float(sample.values[order[min(place, len(order) - 1)]])


def of_distribution(histogram: Histogram, k: int, sample: Sample) -> str:
    """Say what the values of side k are."""
    spec = histogram.distribution
    if not len(sample):
        return "No values."
    if spec.circular:
        return f"{counted(len(sample), 'value')}; most point to {_direction(histogram, k)}."
    values = [quantile(sample, q) for q in (0.25, 0.5, 0.75)]
    decimals = decimals_for(values)
    low, middle, high = (number(v, decimals) for v in values)
    unit = "" if not spec.unit else f"\u00a0{spec.unit}"
    return (
        f"{counted(len(sample), 'value')}; median {middle}{unit}, half of them between {low} and "
        f"{high}{unit}."
    )


def _direction(histogram: Histogram, k: int) -> str:
    """Where the longest sector of the first half turn points."""
    half = len(histogram.shares[k]) // 2
    middle = (histogram.edges[:-1] + histogram.edges[1:]) / 2
    bearing = float(middle[int(np.round(histogram.shares[k][:half], 9).argmax())])
    return f"{bearing:.0f}° and {bearing + 180.0:.0f}° from grid north"


def of_distance(
    d: DistributionDistance, side: Sample, reference: Sample, names: tuple[str, str]
) -> str:
    """Say how a distribution differs from that of the reference, and whether it is chance.

    `names` are those of the side and of the reference, as they are to be shown.
    """
    spec = d.distribution
    first, second = names
    by = told_by(d)
    chance = "by more than chance" if d.more_than_noise else "no more than by chance"
    chance += f" ({by})" if by else ""
    if spec.circular:
        return f"Directions of {first} and {second} differ {chance}."
    ends = side.mean, reference.mean
    decimals = decimals_for(ends)
    change = round(ends[0] - ends[1], decimals)
    if change == 0.0:
        moved = f"alike in {first} and {second}"
    else:
        size = with_unit(abs(change), spec.unit, decimals)
        moved = f"{size} {'larger' if change > 0 else 'smaller'} in {first} than in {second}"
    return f"On average {moved}; the distributions differ {chance}."
