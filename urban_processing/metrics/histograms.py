"""Histograms of one distribution on bins that all sides have in common."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import FloatArray
from urban_processing.metrics.distances import rounded
from urban_processing.metrics.distributions import DistributionSpec, Sample

SECTORS = 36
"""Bins of bearings around the whole compass, as in Boeing 2019."""

FEWEST, MOST = 8, 30
"""About so many bins at least and at most, by the width before it is rounded."""

TAIL = 0.005
"""Share of values at either end that never widen the bins, but are counted in the last ones."""

FAR = 3.0
"""Bins do not reach farther beyond the middle 80 % of values than this times their width."""

DECADES = 1.5
"""Powers of ten from which on areas have logarithmic bins."""

MOST_WHOLE = 40
"""Most bins of whole numbers."""

_STEPS = np.array([1.0, 2.0, 2.5, 5.0, 10.0])


@dataclass(frozen=True, eq=False)
class Histogram:
    """Shares of the values of each side in bins that all have in common.

    Parameters
    ----------
    distribution
        What is counted.
    edges
        (k + 1,) ends of the bins. Those of bearings are `SECTORS` around the whole compass, the
        first about north: from -5° to 355°. A line points both ways, and counts half in each.
    shares
        (sides, k) share of each side in each bin: 1 in all, or 0 where a side has no values.
    logarithmic
        Whether bins are alike on a logarithmic axis.
    below, above
        Whether the first and the last bin hold values beyond the edges.
    """

    distribution: DistributionSpec
    edges: FloatArray
    shares: FloatArray
    logarithmic: bool = False
    below: bool = False
    above: bool = False


def histogram(distribution: DistributionSpec, samples: Sequence[Sample]) -> Histogram:
    """Count the values of each sample; at least one of them must have some.

    Bins are as wide as Freedman and Diaconis (1981) say, in the geometric mean of the sides,
    rounded to 1, 2, 2.5 or 5 times a power of ten; those of areas over `DECADES` powers of ten are
    so in logarithms; those of whole numbers have them in their middle; those of circles are
    `SECTORS`.

    Parameters
    ----------
    distribution
        What the values are.
    samples
        One for each side.
    """
    if distribution.circular:
        return _of_bearings(distribution, samples)
    present = [rounded(s.values) for s in samples if len(s)]
    ends = [_range(values) for values in present]
    low, high = min(a for a, _ in ends), max(b for _, b in ends)
    logarithmic = (
        distribution.unit == "m²" and low > 0.0 and math.log10(high) - math.log10(low) > DECADES
    )
    if distribution.whole:
        edges = _whole_edges(low, high)
    elif logarithmic:
        logs = [np.log10(v[v > 0.0]) for v in present]
        edges = 10.0 ** _even_edges(logs, math.log10(low), math.log10(high))
    else:
        edges = _even_edges(present, low, high)
    return Histogram(
        distribution,
        edges,
        np.array([_shares(s, edges) for s in samples]),
        logarithmic,
        any(bool((v < edges[0]).any()) for v in present),
        any(bool((v > edges[-1]).any()) for v in present),
    )


def _range(values: FloatArray) -> tuple[float, float]:
    """Ends of what bins are to show of some values."""
    least, low, high, most = np.quantile(values, (TAIL, 0.1, 0.9, 1.0 - TAIL)).tolist()
    reach = FAR * (high - low) if high > low else math.inf
    return max(least, low - reach), min(most, high + reach)


def _shares(sample: Sample, edges: FloatArray) -> FloatArray:
    """(k,) shares of the bins; values beyond the edges are in the first and the last one."""
    inside = np.clip(sample.values, edges[0], edges[-1])
    weights = None if sample.weights is None else sample.weights / sample.weights.max(initial=0.0)
    count = np.histogram(inside, edges, weights=weights)[0]
    return np.asarray(count / count.sum() if len(sample) else np.zeros(len(edges) - 1))


def _of_bearings(distribution: DistributionSpec, samples: Sequence[Sample]) -> Histogram:
    width = 360.0 / SECTORS
    edges = (np.arange(SECTORS + 1) * width - 0.5 * width).astype(np.float64)
    period, turns = distribution.circular, round(360.0 / distribution.circular)
    first = edges[edges <= period - 0.4 * width]
    shares = []
    for sample in samples:
        turned = np.mod(sample.values - edges[0], period) + edges[0]
        once = _shares(Sample(turned, sample.weights), first)
        shares.append(np.tile(once, turns) / turns)
    return Histogram(distribution, edges, np.array(shares))


def _whole_edges(low: float, high: float) -> FloatArray:
    """Edges halfway between whole numbers."""
    first, last = math.floor(low), math.ceil(high)
    step = -(-(last - first + 1) // MOST_WHOLE)
    bins = -(-(last - first + 1) // step)
    return np.asarray(first - 0.5 + step * np.arange(bins + 1), dtype=np.float64)


def _even_edges(samples: Sequence[FloatArray], low: float, high: float) -> FloatArray:
    """Edges at multiples of a round number, from `low` to `high` at least."""
    span = high - low
    if span <= 1e-9 * max(abs(low), abs(high)):
        step = _round_step(0.1 * abs(high)) if high else 1.0
    else:
        widths = [w for w in map(_width, samples) if w > 0.0]
        wanted = float(np.exp(np.mean(np.log(widths)))) if widths else span / FEWEST
        step = _round_step(min(max(wanted, span / MOST), span / FEWEST))
    first = math.floor(low / step + 1e-9)
    last = max(math.ceil(high / step - 1e-9), first + 1)
    return np.asarray(np.arange(first, last + 1) * step, dtype=np.float64)


def _width(values: FloatArray) -> float:
    """Width of bins after Freedman and Diaconis (1981)."""
    low, high = np.quantile(values, (0.25, 0.75)) if len(values) else (0.0, 0.0)
    return float(2.0 * (high - low) / max(len(values), 1) ** (1 / 3))


def _round_step(width: float) -> float:
    """Return the number of 1, 2, 2.5 or 5 times a power of ten that is nearest in proportion."""
    power = math.floor(math.log10(width))
    step = _STEPS[np.abs(np.log(_STEPS) - math.log(width) + power * math.log(10.0)).argmin()]
    # powers of ten that are whole are exact
    return float(step * 10.0**power if power >= 0 else step / 10.0**-power)
