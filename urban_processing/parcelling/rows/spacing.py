"""Where along its front a strip is divided: widths at random, within the bounds of parcels."""

from __future__ import annotations

import bisect
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import accumulate, pairwise
from statistics import NormalDist

SPREAD = 1.0 / 3.0
"""Standard deviation of widths over the mean width where ω is 1. The paper prints σ² = 3ω, in
m², which has another meaning for each mean width."""

MARGIN = 1.1
"""Parcels are meant to be this much above the smallest area, and below the largest."""

CLEARANCE = 1.01
"""Least factor by which parcels keep away from the bounds of areas: a profile is a little off."""

WIDER = 1.001
"""Least width over the smallest one."""

END = 1e-4
"""Share of a front within which area counts as that of an end that leans outwards."""

_NORMAL = NormalDist()


@dataclass(frozen=True)
class Bounds:
    """Bounds of the parcels of one block, lengths in metres and areas in m²; ω is a number."""

    min_area: float
    max_area: float
    min_width: float
    max_width: float
    irregularity: float
    snap: float

    @property
    def mean_width(self) -> float:
        """Width aimed at."""
        return 0.5 * (self.min_width + self.max_width)


class Profile:
    """Area of a strip up to each length along its front, and how many parcels are aimed at there.

    Both are measured at some places and taken as linear between them.

    Parameters
    ----------
    spots
        Lengths along the front, increasing; the first is 0, the last the whole front. Two may be
        the same where the end of a strip leans outwards.
    areas
        Area up to each, not decreasing.
    bounds
        Bounds of the parcels.
    """

    def __init__(self, spots: Sequence[float], areas: Sequence[float], bounds: Bounds) -> None:
        self.spots, self.areas, self.bounds = list(spots), list(areas), bounds
        self.length = self.spots[-1]
        depth = self.areas[-1] / self.length
        self.numbers = [0.0]
        for (s, t), (low, high) in zip(pairwise(spots), pairwise(areas), strict=True):
            length, area = t - s, high - low
            thin = length < END * self.length
            number = (
                area / self._area_aimed_at(depth) if thin else length / self._width(area / length)
            )
            self.numbers.append(self.numbers[-1] + number)

    def _width(self, depth: float) -> float:
        """Width of parcels aimed at where the strip has a depth."""
        b = self.bounds
        if depth <= 0.0:
            return math.inf
        width = min(b.mean_width, b.max_area / MARGIN / depth)
        return max(width, b.min_width, b.min_area * MARGIN / depth)

    def _area_aimed_at(self, depth: float) -> float:
        return self._width(depth) * depth

    def area_at(self, s: float) -> float:
        """Area up to a length along the front."""
        return _interpolated(s, self.spots, self.areas)

    def spot_of(self, area: float) -> float:
        """Length along the front up to which there is so much area."""
        return _interpolated(area, self.areas, self.spots)

    def number(self) -> int:
        """Return how many parcels are aimed at."""
        b = self.bounds
        least = sum(
            max((t - s) / b.max_width, (high - low) / b.max_area)
            for (s, t), (low, high) in zip(pairwise(self.spots), pairwise(self.areas), strict=True)
        )
        number = max(math.floor(self.numbers[-1] + 0.5), math.ceil(least - 1e-6))
        return max(min(number, self._most()), 1)

    def _most(self) -> int:
        """Number of parcels if each is as small as it may be."""
        b = self.bounds
        width, area = b.min_width * WIDER, b.min_area * CLEARANCE
        count, s = 0, 0.0
        while s < self.length and self.areas[-1] - (before := self.area_at(s)) >= area:
            s = max(s + width, self.spot_of(before + area))
            count += s <= self.length + 1e-6
        return count

    def ends(
        self,
        shares: Sequence[float],
        move: Callable[[float], float],
        *,
        margin: float,
    ) -> list[float] | None:
        """Return where parcels end along the front, but for the last; None if they are too many.

        Each end is put at its share of the parcels aimed at, moved, and then as near to that as
        the bounds allow, of this parcel and of those to come.

        Parameters
        ----------
        shares
            Share of the whole at which each parcel is to end, the last included.
        move
            Moves an end to a place that suits better, if it is near.
        margin
            How far from the bounds of areas parcels are kept, as a factor.
        """
        b = self.bounds
        count = len(shares)
        area, width = b.min_area * margin, b.min_width * WIDER
        most = b.max_area / margin
        latest = [self.length]
        for _ in range(count):
            s = latest[-1]
            latest.append(min(s - width, self.spot_of(self.area_at(s) - area)))
            if latest[-1] < -1e-6:
                return None
        earliest = [self.length]
        for _ in range(count - 1):
            s = earliest[-1]
            earliest.append(max(s - b.max_width, self.spot_of(self.area_at(s) - most)))
        ends: list[float] = []
        at = 0.0
        for k, share in enumerate(shares[:-1]):
            aim = _interpolated(share * self.numbers[-1], self.numbers, self.spots)
            before = self.area_at(at)
            low = max(at + width, self.spot_of(before + area))
            high = latest[count - 1 - k]
            if low > high + 1e-9:
                return None
            largest = min(at + b.max_width, self.spot_of(before + most))
            low = max(low, min(earliest[count - 1 - k], high))
            high = max(min(high, largest), low)
            moved = move(aim)
            at = moved if low <= moved <= high else min(max(aim, low), high)
            ends.append(at)
        return ends


def shares_of(draws: Sequence[float], irregularity: float, bounds: Bounds) -> list[float]:
    """Share of a whole at which each of its parcels ends: normally distributed widths.

    Parameters
    ----------
    draws
        One number in [0, 1) for each parcel.
    irregularity
        ω, 0 to 1: the standard deviation is ω·`SPREAD` of the mean.
    bounds
        Bounds that widths are clamped to.
    """
    low, high = bounds.min_width / bounds.mean_width, bounds.max_width / bounds.mean_width
    deviation = SPREAD * irregularity
    widths = [
        min(max(1.0 + deviation * _NORMAL.inv_cdf(min(max(u, 1e-9), 1.0 - 1e-9)), low), high)
        for u in draws
    ]
    total = sum(widths)
    return [at / total for at in accumulate(widths)]


def _interpolated(value: float, values: Sequence[float], spots: Sequence[float]) -> float:
    k = min(max(bisect.bisect_right(values, value) - 1, 0), len(values) - 2)
    rise = values[k + 1] - values[k]
    share = (value - values[k]) / rise if rise > 0.0 else 0.0
    return spots[k] + share * (spots[k + 1] - spots[k])
