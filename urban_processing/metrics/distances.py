"""Distances between two distributions.

On a line: the Wasserstein distance of order 1, the area between the distribution functions, in
the unit of the values; and the Kolmogorov-Smirnov statistic, their largest difference. On a
circle: the same area at the best level, which is the weighted median of the difference (Rabin,
Delon and Gousseau 2011, "Transportation distances on the circle"), and Kuiper's
statistic, the largest difference above plus the largest below, which depends on no starting
point.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.metrics.distributions import Sample

CELLS = 256
"""Most places on which samples that are drawn again are held against each other."""

_FINEST, _DIGITS = -20, 30  # values are told apart at 2⁻²⁰ and at 30 binary digits


def wasserstein(a: Sample, b: Sample, *, period: float = 0.0) -> float:
    """Return the Wasserstein distance of order 1 of two samples; NaN if one is empty.

    Parameters
    ----------
    a, b
        The samples.
    period
        Length of the circle that values lie on, 0 for a line.

    Examples
    --------
    >>> wasserstein(Sample(np.array([1.0, 2.0])), Sample(np.array([4.0])))
    2.5
    >>> wasserstein(Sample(np.array([179.0])), Sample(np.array([1.0])), period=180.0)
    2.0
    """
    return _of_samples(a, b, period)[0]


def kolmogorov_smirnov(a: Sample, b: Sample, *, period: float = 0.0) -> float:
    """Return the Kolmogorov-Smirnov statistic, on a circle Kuiper's; NaN if a sample is empty.

    Parameters
    ----------
    a, b
        The samples.
    period
        Length of the circle that values lie on, 0 for a line.
    """
    return _of_samples(a, b, period)[1]


def _of_samples(a: Sample, b: Sample, period: float) -> tuple[float, float]:
    if not len(a) or not len(b):
        return np.nan, np.nan
    pool = pool_of(a, b, period)
    first, second = distances_of(pool.shares, pool)[:, 0].tolist()
    return first, second


@dataclass(frozen=True, eq=False)
class Pool:
    """Two samples on the m different values that both have together, in order.

    Parameters
    ----------
    position
        (m,) the values.
    closed
        Length from the last value on to the first on a circle, 0 on a line.
    at
        For each sample, (n,) number of the position of each value.
    weight
        For each sample, (n,) weights whose mean is 1, or None if all are alike.
    size
        For each sample, how many values are drawn.
    circle
        Whether values lie on a circle.
    """

    position: FloatArray
    closed: float
    at: tuple[IntArray, IntArray]
    weight: tuple[FloatArray | None, FloatArray | None]
    size: tuple[int, int]
    circle: bool

    @cached_property
    def gaps(self) -> FloatArray:
        """(m,) length from each position to the next."""
        return np.append(np.diff(self.position), self.closed)

    @cached_property
    def shares(self) -> tuple[FloatArray, FloatArray]:
        """For each sample, (m,) share of it at each position."""
        first, second = (
            np.bincount(at, weight, len(self.position))
            / (len(at) if weight is None else weight.sum())
            for at, weight in zip(self.at, self.weight, strict=True)
        )
        return first, second

    def drawn(self, k: int, rows: int, stream: np.random.Generator) -> FloatArray:
        """(rows, m) shares of a sample when values are drawn with replacement.

        Each count of a position is one of a multinomial distribution; values that have weights
        are drawn one by one.
        """
        at, weight = self.at[k], self.weight[k]
        if weight is None:
            count = stream.multinomial(self.size[k], self.shares[k], size=rows)
            return np.asarray(count / self.size[k])
        out = np.empty((rows, len(self.position)))
        for row in out:
            draw = stream.integers(0, len(at), self.size[k])
            row[:] = np.bincount(at[draw], weight[draw], len(row))
        return np.asarray(out / out.sum(axis=1, keepdims=True))

    def coarse(self) -> Pool:
        """Put neighbouring positions together so that at most `CELLS` are left."""
        if len(self.position) <= CELLS:
            return self
        count = np.bincount(np.concatenate(self.at))
        before = np.cumsum(count) - count
        cell = np.unique(before * CELLS // count.sum(), return_inverse=True)[1].ravel()
        centre = np.bincount(cell, count * self.position) / np.bincount(cell, count)
        closed = self.closed + self.position[-1] - centre[-1] + centre[0] - self.position[0]
        return replace(
            self,
            position=centre,
            closed=closed if self.circle else 0.0,
            at=(cell[self.at[0]], cell[self.at[1]]),
        )

    def as_one(self) -> Pool:
        """Let both samples be drawn from all values together."""
        at, weight = np.concatenate(self.at), None
        if any(w is not None for w in self.weight):
            pairs = zip(self.at, self.weight, strict=True)
            weight = np.concatenate([np.ones(len(p)) if w is None else w for p, w in pairs])
        at, weight = _in_order(at, weight)
        return replace(self, at=(at, at), weight=(weight, weight))


def pool_of(a: Sample, b: Sample, period: float) -> Pool:
    """Put two samples, neither of them empty, on their common values, whatever their order."""
    values = rounded(np.concatenate([a.values, b.values]))
    if period > 0.0:
        values = np.mod(values, period)
    position, at = np.unique(values, return_inverse=True)
    first, second = np.split(at.ravel(), [len(a)])
    (first, weight), (second, other) = (
        _in_order(first, a.weights),
        _in_order(second, b.weights),
    )
    return Pool(
        position=position,
        closed=float(position[0] + period - position[-1]) if period > 0.0 else 0.0,
        at=(first, second),
        weight=(_scaled(weight), _scaled(other)),
        size=(len(a), len(b)),
        circle=period > 0.0,
    )


def rounded(values: FloatArray) -> FloatArray:
    """Values without the digits in which machines differ, so that equal ones are equal."""
    digit = np.maximum(np.frexp(values)[1] - _DIGITS, _FINEST)
    return np.asarray(np.ldexp(np.rint(np.ldexp(values, -digit)), digit))


def _in_order(at: IntArray, weight: FloatArray | None) -> tuple[IntArray, FloatArray | None]:
    if weight is None:
        return np.sort(at), None
    order = np.lexsort((weight, at))
    return at[order], weight[order]


def _scaled(weight: FloatArray | None) -> FloatArray | None:
    """Weights whose mean is 1."""
    if weight is None:
        return None
    relative = weight / weight.max()
    return np.asarray(relative / relative.mean())


def distances_of(shares: tuple[FloatArray, FloatArray], pool: Pool) -> FloatArray:
    """(2, r) Wasserstein distance and Kolmogorov-Smirnov or Kuiper statistic.

    Parameters
    ----------
    shares
        (r, m) shares of both samples at each position of the pool.
    pool
        The positions.
    """
    # functions after each position; (m,) shares are one row
    difference = np.cumsum(np.atleast_2d(shares[0] - shares[1]), axis=1)
    if not pool.circle:
        apart = np.abs(difference)
        return np.stack([apart @ pool.gaps, np.minimum(apart.max(axis=1), 1.0)])
    order = np.argsort(difference, axis=1)
    below = np.cumsum(pool.gaps[order], axis=1)
    middle = (below >= 0.5 * below[:, -1:]).argmax(axis=1)[:, None]
    level = np.take_along_axis(difference, np.take_along_axis(order, middle, axis=1), axis=1)
    kuiper = np.minimum(difference.max(axis=1) - difference.min(axis=1), 1.0)
    return np.stack([np.abs(difference - level) @ pool.gaps, kuiper])
