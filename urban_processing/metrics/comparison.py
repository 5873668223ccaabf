"""Layouts side by side: their metrics, their distributions, and how far these are apart."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from urban_processing.errors import ParameterError
from urban_processing.metrics.bootstrap import RESAMPLES, Resampling, measure_distances
from urban_processing.metrics.distributions import (
    DISTRIBUTIONS,
    EMPTY,
    DistributionSpec,
    Sample,
)
from urban_processing.metrics.histograms import Histogram, histogram
from urban_processing.metrics.registry import INTERIOR, METRICS, Better, MetricSpec

ALIKE = 1e-6
"""Values this close, absolutely or in proportion, are alike: machines differ by as much."""


@dataclass(frozen=True, eq=False)
class Side:
    """What one layout brings into a comparison.

    Parameters
    ----------
    name
        Its name: any text.
    values
        Metrics of the whole by name, `INTERIOR` variants too; NaN or left out where undefined.
    samples
        Samples by name of the distribution; left out where there is none.
    """

    name: str
    values: Mapping[str, float]
    samples: Mapping[str, Sample]

    def sample(self, distribution: DistributionSpec) -> Sample:
        """Return the sample of a distribution, without weights if it has none; maybe empty."""
        found = self.samples.get(distribution.name, EMPTY)
        return found if distribution.weighted else Sample(found.values)


@dataclass(frozen=True)
class MetricRow:
    """One metric of all sides.

    Parameters
    ----------
    name, unit
        Name and unit of the metric; the name with `INTERIOR` where it is of interior parcels.
    spec
        What the metric is.
    values
        Value of each side, NaN where it is undefined.
    differences
        Value of each side less that of the reference.
    better
        Number of the side whose value is better than that of all others; None if nobody's is.
    """

    name: str
    unit: str
    spec: MetricSpec
    values: tuple[float, ...]
    differences: tuple[float, ...]
    better: int | None


@dataclass(frozen=True)
class DistributionDistance:
    """How far one distribution of a side is from that of the reference.

    Parameters
    ----------
    distribution
        The distribution.
    side, reference
        Names of the sides.
    n_side, n_reference
        Number of values of each.
    median_side, median_reference
        Medians; NaN without values and on circles.
    wasserstein, wasserstein_low, wasserstein_high, wasserstein_noise
        Wasserstein distance of order 1 in the unit of the distribution, with its confidence
        interval and what chance alone makes of it.
    ks, ks_low, ks_high, ks_noise
        The same of the Kolmogorov-Smirnov statistic, of Kuiper's where the distribution is
        circular.
    more_than_noise
        Whether one of both distances is larger than chance alone makes it.
    """

    distribution: DistributionSpec
    side: str
    reference: str
    n_side: int
    n_reference: int
    median_side: float
    median_reference: float
    wasserstein: float
    wasserstein_low: float
    wasserstein_high: float
    wasserstein_noise: float
    ks: float
    ks_low: float
    ks_high: float
    ks_noise: float
    more_than_noise: bool


@dataclass(frozen=True, eq=False)
class Comparison:
    """Sides and what they differ in.

    Parameters
    ----------
    sides
        The sides, their names made unique.
    reference
        Name of the side that the others are held against.
    rows
        Every metric that a side has, in the order of the registry.
    distances
        Every distribution that a side has, in the order of the declaration, and of each every side
        but the reference.
    resampling
        How intervals and noise were found.
    shared_land
        Part of its land that each side shares with the reference, NaN where their coordinate
        systems differ; nothing where lands were not looked at.
    """

    sides: tuple[Side, ...]
    reference: str
    rows: tuple[MetricRow, ...]
    distances: tuple[DistributionDistance, ...]
    resampling: Resampling
    shared_land: tuple[float, ...]

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sides."""
        return tuple(side.name for side in self.sides)

    @property
    def reference_number(self) -> int:
        """Number of the side that is the reference."""
        return self.names.index(self.reference)


def compare(
    sides: Sequence[Side],
    *,
    reference: str | None = None,
    seed: int = 0,
    resamples: int = RESAMPLES,
    confidence: float = 0.95,
    shared_land: Sequence[float] = (),
) -> Comparison:
    """Hold layouts against each other.

    Parameters
    ----------
    sides
        Two layouts or more. Those of a like name are numbered: "layout", "layout (2)".
    reference
        Name of the side that the others are held against; the first one unless told otherwise.
    seed
        Random seed. Intervals depend on it and on the names of side and distribution, not on the
        order of sides, distributions or values.
    resamples
        Times that samples are drawn again.
    confidence
        Share of cases in which an interval is to hold the true distance.
    shared_land
        Part of its land that each side shares with the reference, NaN where their coordinate
        systems differ; by default lands are not looked at, but for their areas.

    Raises
    ------
    ParameterError
        If there are fewer than two sides, or none has the name of the reference, or a number is
        out of range.
    ValueError
        If a side has a metric or distribution that is not declared, or the lands are not as many
        as the sides.
    """
    how = Resampling(seed=seed, resamples=resamples, confidence=confidence)
    if len(sides) < 2:
        raise ParameterError(f"Two layouts or more are needed to compare; there are {len(sides)}.")
    names = unique_names([side.name for side in sides])
    named = tuple(replace(side, name=name) for side, name in zip(sides, names, strict=True))
    if reference is not None and reference not in names:
        raise ParameterError(
            f"There is no layout {reference!r} to compare with; there are {', '.join(names)}."
        )
    chosen = 0 if reference is None else names.index(reference)
    _check_declared(named)
    if len(shared_land) not in (0, len(named)):
        raise ValueError(f"There are {len(shared_land)} shared lands for {len(named)} sides.")
    return Comparison(
        sides=named,
        reference=names[chosen],
        rows=_rows(named, chosen),
        distances=_distances(named, chosen, how),
        resampling=how,
        shared_land=tuple(shared_land),
    )


def unique_names(names: Sequence[str]) -> tuple[str, ...]:
    """Number names that are there already: "layout", "layout (2)".

    >>> unique_names(["layout", "osm", "layout"])
    ('layout', 'osm', 'layout (2)')
    """
    out: list[str] = []
    for k, name in enumerate(names):
        taken = {*out, *names[k + 1 :]}
        number, new = 1, name
        while new in out or (number > 1 and new in taken):
            number += 1
            new = f"{name} ({number})"
        out.append(new)
    return tuple(out)


def histograms(comparison: Comparison) -> tuple[Histogram, ...]:
    """Return one histogram for each distribution that a side has, on bins common to all."""
    found = _distributions(comparison.sides)
    return tuple(histogram(d, [s.sample(d) for s in comparison.sides]) for d in found)


def _metric_names() -> dict[str, MetricSpec]:
    """Names of all metrics in the order of the registry, those of interior parcels after each."""
    out = {}
    for spec in METRICS:
        out[spec.name] = spec
        if spec.of_parcels:
            out[spec.name + INTERIOR] = spec
    return out


def _check_declared(sides: Sequence[Side]) -> None:
    metrics, distributions = set(_metric_names()), {d.name for d in DISTRIBUTIONS}
    for side in sides:
        unknown = (set(side.values) - metrics) | (set(side.samples) - distributions)
        if unknown:
            raise ValueError(f"{side.name} has what is not declared: {', '.join(sorted(unknown))}.")


def _rows(sides: Sequence[Side], reference: int) -> tuple[MetricRow, ...]:
    out = []
    for name, spec in _metric_names().items():
        values = tuple(float(side.values.get(name, math.nan)) for side in sides)
        if all(math.isnan(v) for v in values):
            continue
        differences = tuple(_difference(v, values[reference]) for v in values)
        better = better_side(values, spec.better)
        out.append(MetricRow(name, spec.unit, spec, values, differences, better))
    return tuple(out)


def _difference(value: float, reference: float) -> float:
    return 0.0 if value == reference else value - reference


def better_side(values: Sequence[float], better: Better) -> int | None:
    """Return the number of the value that is better than all others, None if there is none.

    Values that are NaN do not count; alone, a value is better than nobody's. Values that are
    `ALIKE` are not better than each other.
    """
    known = [k for k, v in enumerate(values) if not math.isnan(v)]
    if better is Better.NEITHER or len(known) < 2:
        return None
    sign = 1.0 if better is Better.LOW else -1.0
    best, second = sorted(known, key=lambda k: sign * values[k])[:2]
    alike = math.isclose(values[best], values[second], rel_tol=ALIKE, abs_tol=ALIKE)
    return None if alike else best


def _distributions(sides: Sequence[Side]) -> list[DistributionSpec]:
    """Distributions of which a side has values."""
    return [d for d in DISTRIBUTIONS if any(len(side.sample(d)) for side in sides)]


def _distances(
    sides: Sequence[Side], reference: int, how: Resampling
) -> tuple[DistributionDistance, ...]:
    return tuple(
        _distance(distribution, side, sides[reference], how)
        for distribution in _distributions(sides)
        for k, side in enumerate(sides)
        if k != reference
    )


def _distance(
    distribution: DistributionSpec, side: Side, reference: Side, how: Resampling
) -> DistributionDistance:
    a, b = side.sample(distribution), reference.sample(distribution)
    first, second = measure_distances(
        a,
        b,
        period=distribution.circular,
        resampling=how,
        names=(distribution.name, side.name, reference.name),
    )
    median = [np.nan if distribution.circular else s.median for s in (a, b)]
    return DistributionDistance(
        distribution=distribution,
        side=side.name,
        reference=reference.name,
        n_side=len(a),
        n_reference=len(b),
        median_side=median[0],
        median_reference=median[1],
        wasserstein=first.value,
        wasserstein_low=first.low,
        wasserstein_high=first.high,
        wasserstein_noise=first.noise,
        ks=second.value,
        ks_low=second.low,
        ks_high=second.high,
        ks_noise=second.noise,
        more_than_noise=first.more_than_noise or second.more_than_noise,
    )
