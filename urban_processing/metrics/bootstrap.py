"""How sure distances between distributions are, and how much of them is chance."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urban_processing.errors import ParameterError
from urban_processing.mesh.planar import FloatArray
from urban_processing.metrics.distances import Pool, distances_of, pool_of
from urban_processing.metrics.distributions import Sample

RESAMPLES = 1000
"""Times that samples are drawn again."""

_BATCH = 1 << 16  # shares worked on at a time: they stay in the processor's cache
_ROUNDING = 1e-9


@dataclass(frozen=True, kw_only=True)
class Resampling:
    """How samples are drawn again.

    Parameters
    ----------
    seed
        Random seed.
    resamples
        Times that they are drawn, at least 1.
    confidence
        Share of cases in which an interval is to hold the true value, between 0 and 1.

    Raises
    ------
    ParameterError
        If a number is out of range.
    """

    seed: int = 0
    resamples: int = RESAMPLES
    confidence: float = 0.95

    def __post_init__(self) -> None:
        """Check the numbers."""
        problems = []
        if self.resamples < 1:
            problems.append(f"resamples is {self.resamples}, but must be at least 1.")
        if not 0.0 < self.confidence < 1.0:
            problems.append(f"confidence is {self.confidence:g}, but must lie between 0 and 1.")
        if problems:
            raise ParameterError(problems)

    def stream(self, *names: str) -> np.random.Generator:
        """Return random numbers that depend on the seed and on names alone."""
        words = [name.encode("utf-8", "surrogatepass") for name in names]
        lengths = [len(word) for word in words]
        return np.random.default_rng([self.seed % 2**64, *lengths, *b"".join(words)])


@dataclass(frozen=True)
class Distance:
    """A distance, and how sure it is.

    Parameters
    ----------
    value
        The distance of the samples; NaN if one of them is empty.
    low, high
        Confidence interval; NaN if a sample has fewer than two values.
    noise
        What two samples of these sizes are apart by chance, both drawn from all values together,
        in all but (1 - confidence) / 2 of cases; NaN if one of them is empty.
    """

    value: float
    low: float
    high: float
    noise: float

    @property
    def more_than_noise(self) -> bool:
        """Whether the distance is larger than chance alone makes it."""
        return self.value > self.noise + _ROUNDING * abs(self.noise)


UNKNOWN = Distance(np.nan, np.nan, np.nan, np.nan)


def measure_distances(
    a: Sample,
    b: Sample,
    *,
    period: float = 0.0,
    resampling: Resampling | None = None,
    names: tuple[str, str, str] = ("", "a", "b"),
) -> tuple[Distance, Distance]:
    """Return both distances of two samples with their confidence intervals and their noise.

    Any distance of samples is larger in the mean than the true one, and that of samples drawn
    again larger still, so that their percentiles alone miss small distances. The interval
    reaches up from the distance by as much as the percentile of the distances drawn again lies
    above their mean. It reaches down by as much from the distance less its bias, which is the
    lower end of the basic bootstrap interval (Davison and Hinkley 1997, section 5.2); the bias of
    samples lies between nought and that of samples drawn again, and each end takes the safe one.
    The lower end is 0 where the distance is no more than noise.

    Samples of more than `CELLS` different values are drawn again on so many cells, each a
    like number of neighbouring values.

    Parameters
    ----------
    a, b
        The samples.
    period
        Length of the circle that values lie on, 0 for a line.
    resampling
        How they are drawn again.
    names
        Names of the distribution and of the samples; random numbers depend on them.

    Returns
    -------
    wasserstein, kolmogorov_smirnov
    """
    if not len(a) or not len(b):
        return UNKNOWN, UNKNOWN
    how = Resampling() if resampling is None else resampling
    pool = pool_of(a, b, period)
    value = distances_of(pool.shares, pool)[:, 0]
    cells = pool.coarse()
    shift = value - distances_of(cells.shares, cells)[:, 0]
    distribution, *sides = names
    streams = [how.stream(distribution, side) for side in sides]
    again = _drawn_again(cells, how.resamples, streams) + shift[:, None]
    # the pair has one stream for each side too, whichever of the two is the reference
    streams = [how.stream(distribution, side, "noise", *sorted(sides)) for side in sides]
    chance = _drawn_again(cells.as_one(), how.resamples, streams)
    # two distances are held against it: each has half of the error
    noise = np.quantile(chance, 0.5 + 0.5 * how.confidence, axis=1)
    known = min(len(a), len(b)) > 1
    greatest = (0.5 * period if period > 0.0 else np.inf, 1.0)
    first, second = (
        _with_interval(value[k], again[k] if known else None, noise[k], greatest[k], how.confidence)
        for k in (0, 1)
    )
    return first, second


def _with_interval(
    value: float, again: FloatArray | None, noise: float, greatest: float, confidence: float
) -> Distance:
    """Return a distance with the interval that distances of samples drawn again make of it."""
    bare = Distance(float(value), np.nan, np.nan, float(noise))
    if again is None:
        return bare
    mean = float(again.mean())
    bias = max(mean - value, 0.0)
    reach = max(float(np.quantile(again, 0.5 + 0.5 * confidence)) - mean, 0.0)
    lower = max(value - bias - reach, 0.0) if bare.more_than_noise else 0.0
    upper = max(min(value + reach, greatest), value)
    return replace(bare, low=float(lower), high=float(upper))


def _drawn_again(pool: Pool, resamples: int, streams: list[np.random.Generator]) -> FloatArray:
    """(2, resamples) distances of samples that are drawn again from those of a pool."""
    batch = max(1, _BATCH // len(pool.position))
    out = []
    for start in range(0, resamples, batch):
        rows = min(batch, resamples - start)
        shares = pool.drawn(0, rows, streams[0]), pool.drawn(1, rows, streams[1])
        out.append(distances_of(shares, pool))
    return np.concatenate(out, axis=1)
