"""Approximate polygons of the two halves that a candidate cut makes, and their proportions."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.fields.rings import ComplexArray
from urban_processing.mesh.corners import (
    IRREGULARITY_WEIGHTS,
    STRAIGHT_ANGLE,
    side_irregularity,
)
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.subdivision.parcels import Boundary
from urban_processing.subdivision.prospect import (
    prospect_of_area,
    prospect_of_quota,
)

OWN_SHARE, WANTED_OWN_SHARE = 0.2, 0.05
"""Weight of the present proportions of a half that is still to be cut; the second where a ratio of
width and depth is wanted."""


OPEN_SHARE = 0.8
"""The street side of a half is open while two adjacent sides have street, the shorter one at
least this share of the longer one."""


@dataclass(frozen=True, eq=False)
class Ideal:
    """What proportions of parcels count as ideal.

    Parameters
    ----------
    preferred
        (C,) direction of long sides in the frame of each candidate's parcel.
    stretch
        Long over short side that is ideal along `preferred`; 1 where no direction is preferred.
    width_depth
        Width along the street over depth that is ideal; None for parcels as long as wide.
    """

    preferred: ComplexArray
    stretch: float
    width_depth: float | None


@dataclass(frozen=True, eq=False)
class Half:
    """Approximate polygon of one half of each of C candidates.

    Parameters
    ----------
    irregularity
        (C,) Eq. 1 of the polygon.
    by_angle
        (C,) its first term.
    mean_side, least_width
        (C,) mean length of a side; shorter mean of two opposite sides, infinite where the
        polygon is no quadrilateral.
    n
        (C,) number of sides.
    aspects
        (C,) proportions relative to the ideal ones, 1 where they are ideal: the mean of two
        opposite sides over that of the other two; 0 where the polygon is no quadrilateral.
        Where a ratio of width and depth is wanted there are three: two for later cuts, which
        differ where the street side may still be either of two directions, and that of the
        half as it is, by the side with the longest frontage.
    """

    irregularity: FloatArray
    by_angle: FloatArray
    mean_side: FloatArray
    least_width: FloatArray
    n: IntArray
    aspects: tuple[FloatArray, ...]

    def by_proportions(self) -> FloatArray:
        """Irregularity with the deviation from ideal proportions for its second term."""
        own = side_irregularity(_folded(self.aspects[-1]))
        return np.asarray(np.where(self.aspects[0] > 0, self.by_angle + own, self.irregularity))

    def with_prospect(self, content: FloatArray, quota: IntArray, weight: float) -> FloatArray:
        """Irregularity with what later cuts can make of the half in place of its proportions."""
        uncut = np.where(quota > 0, quota < 2, content < 2.0)
        own_share = OWN_SHARE if len(self.aspects) == 1 else WANTED_OWN_SHARE
        later = np.min(
            [_later(_folded(a), content, quota, own_share) for a in self.aspects[:2]], axis=0
        )
        own = side_irregularity(_folded(self.aspects[-1]))
        shown = np.where(uncut, own, later)
        return np.asarray(
            np.where(self.aspects[0] > 0, self.by_angle + weight * shown, self.irregularity)
        )


def _folded(aspect: FloatArray) -> FloatArray:
    """Larger over smaller; 1 where there are no proportions."""
    return np.asarray(np.exp(np.abs(np.log(np.where(aspect > 0, aspect, 1.0)))))


def _later(
    folded: FloatArray, content: FloatArray, quota: IntArray, own_share: float
) -> FloatArray:
    """Deviation from ideal proportions of the parcels that later cuts can make, and its own."""
    later = np.where(
        quota > 0,
        prospect_of_quota(folded, quota),
        prospect_of_area(folded, np.maximum(content, 1.0)),
    )
    return np.asarray(later + own_share * side_irregularity(folded))


def half_polygons(
    boundary: Boundary,
    parcel: IntArray,
    a: ComplexArray,
    b: ComplexArray,
    t_a: FloatArray,
    t_b: FloatArray,
    ideal: Ideal,
) -> Half:
    """Approximate polygon of the half that goes a, b, ring, a.

    The cut counts as one side; corners straighter than 135° are deleted as in the reported
    polygon.
    """
    corner_t, corner_z, number = boundary.corners
    exists = np.isfinite(corner_t)[parcel]
    own = np.where(exists, corner_t[parcel], 0.0)
    perimeter = boundary.perimeter[parcel]
    small = 1e-9 * perimeter[:, None]
    # lengths from b forward; corners strictly between b and a
    ahead = (own - t_b[:, None]) % perimeter[:, None]
    span = ((t_a - t_b) % perimeter)[:, None]
    between = exists & (ahead > small) & (ahead < span - small)
    between &= ahead < perimeter[:, None] - small
    # in ring order the corners between are consecutive but for the wrap
    count = between.sum(axis=1)
    n_own = np.maximum(number[parcel], 1)
    width = int(count.max(initial=0))
    first = _run_start(between, number[parcel], count)
    k = (first[:, None] + np.arange(width)[None]) % n_own[:, None]
    z = np.concatenate(
        [a[:, None], b[:, None], np.take_along_axis(corner_z[parcel], k, axis=1)], axis=1
    )
    z, kept, n = _thinned(z, count + 2)
    if ideal.width_depth is None or z.shape[1] < 4:
        return _measured(z, n, ideal)
    quad = np.flatnonzero(n == 4)
    t = np.column_stack([t_b, t_b, np.take_along_axis(own, k, axis=1)])
    t = np.take_along_axis(t, kept, axis=1)[quad, :4]
    street = np.zeros((len(z), 4))
    street[quad] = _street_of_sides(boundary, parcel[quad], t, t_b[quad], t_a[quad])
    return _measured(z, n, ideal, street)


def _street_of_sides(
    boundary: Boundary, parcel: IntArray, t: FloatArray, t_b: FloatArray, t_a: FloatArray
) -> FloatArray:
    """(Q, 4) street along each side of quadrilaterals.

    `t` is where each corner lies on the ring, between the end `t_b` and the beginning `t_a` of
    the cut, along which there is no street.
    """
    before = boundary.street_between(np.repeat(parcel, 4), np.repeat(t_b, 4), t.ravel()).reshape(
        -1, 4
    )
    whole = boundary.street_between(parcel, t_b, t_a)
    after = np.column_stack([before[:, 1:], whole + before[:, 0]])
    return np.asarray(after - before)


def _run_start(between: BoolArray, number: IntArray, count: IntArray) -> IntArray:
    """First corner of the cyclic run of corners that lie between b and a."""
    rows = np.arange(len(between))
    wraps = between[:, 0] & between[rows, np.maximum(number - 1, 0)] & (count < number)
    # the run continues from the ring's end to its beginning: it starts after the last gap
    columns = np.arange(between.shape[1])[None]
    gap = ~between & (columns < number[:, None])
    last_gap = np.where(gap.any(axis=1), between.shape[1] - 1 - np.argmax(gap[:, ::-1], axis=1), -1)
    plain = np.argmax(between, axis=1)
    return np.asarray(np.where(wraps, last_gap + 1, plain))


def _thinned(z: ComplexArray, n: IntArray) -> tuple[ComplexArray, IntArray, IntArray]:
    """Delete the straightest corner while straighter than 135° and more than three remain.

    Returns the corners that are left, their places among those given, and their number.
    """
    columns = np.arange(z.shape[1])[None]
    kept = np.broadcast_to(columns, z.shape)
    for _ in range(z.shape[1] - 3):
        included = np.pi - np.abs(_turns(z, n))
        included = np.where(columns < n[:, None], included, -1.0)
        worst = included.argmax(axis=1)
        rows = np.flatnonzero((included[np.arange(len(z)), worst] > STRAIGHT_ANGLE) & (n > 3))
        if len(rows) == 0:
            break
        shift = np.minimum(columns + (columns >= worst[rows, None]), z.shape[1] - 1)
        z, kept = z.copy(), kept.copy()
        z[rows] = np.take_along_axis(z[rows], shift, axis=1)
        kept[rows] = np.take_along_axis(kept[rows], shift, axis=1)
        n = n.copy()
        n[rows] -= 1
    return z, kept, n


def _neighbours(z: ComplexArray, n: IntArray) -> tuple[ComplexArray, ComplexArray]:
    columns = np.arange(z.shape[1])[None]
    before = np.where(columns == 0, n[:, None] - 1, columns - 1)
    after = np.where(columns == n[:, None] - 1, 0, np.minimum(columns + 1, z.shape[1] - 1))
    return np.take_along_axis(z, before, axis=1), np.take_along_axis(z, after, axis=1)


def _turns(z: ComplexArray, n: IntArray) -> FloatArray:
    before, after = _neighbours(z, n)
    return np.asarray(np.angle((after - z) * np.conj(z - before)))


def _measured(z: ComplexArray, n: IntArray, ideal: Ideal, street: FloatArray | None = None) -> Half:
    """Eq. 1 and the proportions of padded polygons; `street` (C, 4) lies along sides."""
    _, after = _neighbours(z, n)
    valid = np.arange(z.shape[1])[None] < n[:, None]
    side = np.where(valid, np.abs(after - z), 0.0)
    angle = np.where(valid, np.pi - _turns(z, n), 0.0)
    mean_side, mean_angle = side.sum(axis=1) / n, angle.sum(axis=1) / n
    by_angle = (np.where(valid, angle - mean_angle[:, None], 0.0) ** 2).sum(axis=1) / n
    by_side = (np.where(valid, side - mean_side[:, None], 0.0) ** 2).sum(axis=1) / n
    g_angle, g_side = IRREGULARITY_WEIGHTS
    safe = np.where(mean_side > 0, mean_side, 1.0)
    aspects: tuple[FloatArray, ...] = (np.zeros(len(z)),)
    least_width = np.full(len(z), np.inf)
    if z.shape[1] > 3:
        quad = np.flatnonzero((n == 4) & (side[:, :4].min(axis=1) > 0))
        least_width[quad] = 0.5 * np.minimum(
            side[quad, 0] + side[quad, 2], side[quad, 1] + side[quad, 3]
        )
        # seen in a plane that is stretched across the preferred direction
        turned = (after[quad, :4] - z[quad, :4]) * np.conj(ideal.preferred[quad])[:, None]
        seen = np.hypot(turned.real, ideal.stretch * turned.imag)
        aspects[0][quad] = (seen[:, 0] + seen[:, 2]) / (seen[:, 1] + seen[:, 3])
    if ideal.width_depth is not None and street is not None:
        aspects = _by_street_side(aspects[0], street, ideal.width_depth)
    return Half(
        irregularity=g_angle * by_angle + g_side * by_side / safe**2,
        by_angle=g_angle * by_angle,
        mean_side=mean_side,
        least_width=least_width,
        n=n,
        aspects=aspects,
    )


def _by_street_side(
    aspect: FloatArray, street: FloatArray, width_depth: float
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Width over depth relative to the wanted ratio, as `Half.aspects` has it."""
    quad = aspect > 0
    first = aspect / width_depth
    second = np.where(quad, 1.0 / np.where(quad, aspect, 1.0), 0.0) / width_depth
    on_first = np.maximum(street[:, 0], street[:, 2])
    on_second = np.maximum(street[:, 1], street[:, 3])
    is_first = on_first > 0
    is_first &= on_second < OPEN_SHARE * on_first
    is_second = on_second > 0
    is_second &= on_first < OPEN_SHARE * on_second
    nearer = np.where(_folded(first) <= _folded(second), first, second)
    own = np.select([on_first > on_second, on_second > on_first], [first, second], nearer)
    return np.where(is_second, second, first), np.where(is_first, first, second), own
