"""What the parcels of a block are like, and the bounds of subdivision that follow from it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import FloatArray, IntArray

SLACK = 0.1
"""Bounds lie at least this share of the mean below and above it: subdivision aims to stay as far
within them, so that parcels that are all alike can be made again."""

LEAST_SHARE = 0.25
"""Lower bounds are at least this share of the mean; the paper does not say what holds where the
mean less k standard deviations is no area or length. With a quarter, real blocks come back with
about as many parcels as they had."""


@dataclass(frozen=True, eq=False)
class Statistics:
    """Statistics of a measure of the parcels, block by block; NaN for blocks without parcels.

    Parameters
    ----------
    count
        (B,) number of parcels.
    mean, deviation
        (B,) mean, and standard deviation of the block's parcels as the whole population.
    """

    count: IntArray
    mean: FloatArray
    deviation: FloatArray


def statistics_of(values: FloatArray, block: IntArray, n_blocks: int) -> Statistics:
    """Return the statistics of (n,) values in the blocks of (n,) parcels."""
    count = np.bincount(block, minlength=n_blocks)
    some = count > 0
    number = np.where(some, count, np.nan)
    mean = np.bincount(block, weights=values, minlength=n_blocks) / number
    squares = (values - mean[block]) ** 2
    deviation = np.sqrt(np.bincount(block, weights=squares, minlength=n_blocks) / number)
    return Statistics(count, mean, deviation)


def bounds_of(statistics: Statistics, *, spread: float) -> tuple[FloatArray, FloatArray]:
    """Return the lower and the upper bound of each block (Vanegas 2012, section 6).

    They are the mean less and plus `spread` standard deviations: A_min = Ā - k·s_A and
    A_max = Ā + k·s_A, and likewise for widths. Both are at least `SLACK` of the mean away from
    it, and lower bounds are no less than `LEAST_SHARE` of it. Blocks without parcels get the
    median of each bound over the blocks with several parcels, or if there is none, over all that
    have one.

    Parameters
    ----------
    statistics
        Of one measure.
    spread
        k, a number of standard deviations.
    """
    mean = statistics.mean
    away = np.maximum(spread * statistics.deviation, SLACK * mean)
    low, high = np.maximum(mean - away, LEAST_SHARE * mean), mean + away
    empty = statistics.count == 0
    typical = statistics.count > 1 if (statistics.count > 1).any() else ~empty
    if empty.any():
        low[empty], high[empty] = np.median(low[typical]), np.median(high[typical])
    return low, high
