"""Quality of candidate cuts (Chen 2024, Eq. 2, with further terms) and the choice among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.fields.rings import ComplexArray, cross
from urban_processing.hashing import UintArray, uniform
from urban_processing.mesh.corners import IRREGULARITY_WEIGHTS, STRAIGHT_ANGLE
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.subdivision.cuts import AREA_ROUNDING, CLEARANCE, Cuts
from urban_processing.subdivision.parcels import CONTINUES_ANGLE, Boundary
from urban_processing.subdivision.prospect import (
    prospect_of_area,
    prospect_of_quota,
    side_irregularity,
)

ALTERNATIVES = 4
"""Number of ranked cuts kept for each parcel."""

SPREAD = 0.08
"""In √area: of two cuts whose ends are both nearer than this, the better one is kept. It stands
for the spacing d_ε of Yang 2013, section 5, which prunes seeds one streamline at a time; here
all streamlines of all parcels are traced together and pruned afterwards."""


QUOTA_WEIGHT = 2.0
"""Weight, relative to λ1, of parcels of equal size where their number is given."""


BEYOND_CAP = 0.1
"""Share of Qsize that still tells equal halves from those at the cap."""

STRETCH = 2.0
"""A weight w of the orientation makes parcels of 1 + `STRETCH` · w, long over short side, ideal
where their long side lies in the preferred direction."""

OWN_SHARE = 0.2
"""Weight of the present proportions of a half that is still to be cut."""


@dataclass(frozen=True, eq=False)
class ScoredCuts:
    """Candidates after snapping, with their quality; `quality` is -inf where a cut is illegal."""

    cuts: Cuts
    t_a: FloatArray
    t_b: FloatArray
    quality: FloatArray


def score_cuts(
    boundary: Boundary,
    cuts: Cuts,
    *,
    min_share: FloatArray,
    quota: IntArray,
    lineage: UintArray,
    params: CogenerateParams,
    snap: float,
) -> ScoredCuts:
    """Snap the candidates' ends and rate the parcels that they would make.

    Parameters
    ----------
    min_share
        (B,) smallest allowed share of a parcel's area in either half.
    quota
        (B,) number of parcels that a parcel is to become; 0 where there is no such number.
    lineage
        (B,) path of each parcel, which seeds its random numbers.
    snap
        Distance along the ring, in √area, within which an end moves to a mesh corner.
    """
    rules = params.rules
    t_a, node_a = _snapped(boundary, cuts.parcel, cuts.t_a, snap)
    t_b, node_b = _snapped(boundary, cuts.parcel, cuts.t_b, snap)
    a, b = boundary.position(cuts.parcel, t_a), boundary.position(cuts.parcel, t_b)
    ring_part = boundary.twice_area_between(cuts.parcel, t_b, t_a)
    area = 0.5 * (cuts.bulge + cross(a, b) + ring_part)
    smaller, larger = np.minimum(area, 1.0 - area), np.maximum(area, 1.0 - area)
    preferred, stretch = _preferred(boundary, cuts.parcel, params)
    left = _half(boundary, cuts.parcel, a, b, t_a, t_b, preferred, stretch)
    right = _half(boundary, cuts.parcel, b, a, t_b, t_a, preferred, stretch)
    street = np.column_stack(
        [
            boundary.street_between(cuts.parcel, t_b, t_a),
            boundary.street_between(cuts.parcel, t_a, t_b),
        ]
    )
    reached = street >= params.access_ratio * np.column_stack([left.mean_side, right.mean_side])
    w_size, w_shape, w_access = params.weights
    parcel_quota = quota[cuts.parcel]
    shape = [left.irregularity, right.irregularity]
    if rules.prospect > 0:
        left_quota = _left_quota(area, parcel_quota)
        total = area / min_share[cuts.parcel], (1.0 - area) / min_share[cuts.parcel]
        shape = [
            left.with_prospect(total[0], left_quota, rules.prospect),
            right.with_prospect(total[1], parcel_quota - left_quota, rules.prospect),
        ]
    quality = (
        w_size * _balance(smaller / larger, rules.size_cap)
        + w_shape / (1.0 + shape[0] + shape[1])
        + w_access * (1.0 + reached.all(axis=1))
        - rules.clearance * np.clip(1.0 - cuts.clearance / CLEARANCE, 0.0, 1.0)
    )
    quality -= w_size * np.minimum(1.0, QUOTA_WEIGHT * _quota_misfit(area, parcel_quota))
    if params.continuity > 0:
        ends = _continues(boundary, cuts.parcel, node_a, cuts.leaving).astype(np.float64)
        ends += _continues(boundary, cuts.parcel, node_b, -cuts.arriving)
        quality += params.continuity * 0.5 * ends
    if params.orientation is not None and rules.prospect == 0:
        along = _oriented(b - a, preferred)
        quality += params.weight_orientation * along
    if rules.variation > 0:
        quality += rules.variation * _noise(cuts.parcel, lineage, params.seed)
    legal = (
        (smaller >= min_share[cuts.parcel] * (1.0 - AREA_ROUNDING)) & (left.n >= 3) & (right.n >= 3)
    )
    if boundary.has_bare:
        attached = boundary.is_attached(cuts.parcel, t_a) | boundary.is_attached(cuts.parcel, t_b)
        legal &= attached | ~boundary.has_network[cuts.parcel]
    legal &= np.isfinite(quality) & (np.abs(b - a) > 1e-9)
    # rounded, so that ties are broken by index on every machine
    quality = np.where(legal, np.round(quality, 6), -np.inf)
    return ScoredCuts(
        cuts,
        t_a,
        t_b,
        quality,
    )


def _noise(parcel: IntArray, lineage: UintArray, seed: int) -> FloatArray:
    """A random number for each candidate, so that another seed gives another layout."""
    place = np.empty(len(parcel), dtype=np.int64)
    order = np.argsort(parcel, kind="stable")
    start = np.searchsorted(parcel[order], parcel[order])
    place[order] = np.arange(len(parcel)) - start
    draws = uniform(seed + 2, lineage, int(place.max(initial=0)) + 1)
    return np.asarray(draws[parcel, place])


def _balance(ratio: FloatArray, cap: float) -> FloatArray:
    """Qsize of Eq. 2; from the cap on, which is 1 in the paper, it hardly grows."""
    capped = np.minimum(1.0, ratio / cap)
    return np.asarray(capped if cap >= 1 else (1 - BEYOND_CAP) * capped + BEYOND_CAP * ratio)


def _quota_misfit(area: FloatArray, quota: IntArray) -> FloatArray:
    """How far the mean parcel of either half would be from the parcel's own mean, as a share."""
    n = np.maximum(quota, 2)
    left = _left_quota(area, n)
    with np.errstate(divide="ignore", invalid="ignore"):
        ratios = np.stack([area * n / left, (1.0 - area) * n / (n - left)])
        worst = np.maximum(ratios, 1.0 / ratios).max(axis=0) - 1.0
    return np.asarray(np.where(quota >= 2, worst, 0.0))


def _left_quota(area: FloatArray, quota: IntArray) -> IntArray:
    """Number of parcels that the left half is to become, of `quota`; 0 where there is none."""
    left = np.clip(np.round(quota * area), 1, np.maximum(quota - 1, 1))
    return np.asarray(np.where(quota > 0, left, 0), dtype=np.int64)


def _snapped(
    boundary: Boundary, parcel: IntArray, t: FloatArray, tolerance: float
) -> tuple[FloatArray, IntArray]:
    """Move lengths to the nearest mesh corner within the tolerance; -1 where there is none."""
    if tolerance <= 0 or len(t) == 0:
        return t, np.full(len(t), -1)
    number = boundary.node.sum(axis=1)
    order = np.argsort(~boundary.node, axis=1, kind="stable")[:, : max(int(number.max()), 1)]
    node_t = np.take_along_axis(boundary.t[:, :-1], order, axis=1)
    node_t = np.where(np.arange(order.shape[1])[None] < number[:, None], node_t, np.inf)
    perimeter = boundary.perimeter[parcel][:, None]
    away = np.abs(node_t[parcel] - t[:, None])
    away = np.minimum(away, np.abs(perimeter - away))
    nearest = away.argmin(axis=1)
    rows = np.arange(len(t))
    # short rings must not be folded up by the tolerance
    near = away[rows, nearest] <= np.minimum(tolerance, 0.2 * perimeter[:, 0])
    node = np.where(near, order[parcel, nearest], -1)
    return np.where(near, node_t[parcel, nearest], t), node


def _continues(
    boundary: Boundary, parcel: IntArray, node: IntArray, inward: ComplexArray
) -> BoolArray:
    """Whether an end prolongs the cut of the neighbour that ends there."""
    wanted = np.where(node >= 0, boundary.inward[parcel, np.maximum(node, 0)], 0)
    return np.asarray((inward * np.conj(wanted)).real > np.cos(CONTINUES_ANGLE))


def _preferred(
    boundary: Boundary, parcel: IntArray, params: CogenerateParams
) -> tuple[ComplexArray, float]:
    """Preferred direction of long sides in each parcel's frame, and the stretch across it."""
    if params.orientation is None:
        return np.ones(len(parcel), dtype=np.complex128), 1.0
    direction = np.exp(1j * np.radians(params.orientation))
    stretch = 1.0 + STRETCH * params.weight_orientation
    return np.asarray(direction * np.conj(boundary.rings.axis[parcel])), stretch


def _oriented(chord: ComplexArray, preferred: ComplexArray) -> FloatArray:
    """1 where a cut runs along the preferred direction, 0 across (Chen 2024, section 6)."""
    length = np.abs(chord)
    along = (chord * np.conj(preferred)).real / np.where(length > 0, length, 1.0)
    return np.asarray(1.0 - 2.0 / np.pi * np.arccos(np.clip(np.abs(along), 0.0, 1.0)))


@dataclass(frozen=True, eq=False)
class _Half:
    """Approximate polygons of one half of each candidate.

    `aspect` is the mean of two opposite sides over that of the other two, seen with the stretch
    of a preferred orientation; 0 where the polygon is no quadrilateral.
    """

    irregularity: FloatArray
    by_angle: FloatArray
    mean_side: FloatArray
    n: IntArray
    aspect: FloatArray

    def with_prospect(self, content: FloatArray, quota: IntArray, weight: float) -> FloatArray:
        """Irregularity with what later cuts can make of the half in place of its proportions."""
        folded = np.exp(np.abs(np.log(np.where(self.aspect > 0, self.aspect, 1.0))))
        later = np.where(
            quota > 0,
            prospect_of_quota(folded, quota),
            prospect_of_area(folded, np.maximum(content, 1.0)),
        )
        own = side_irregularity(folded)
        uncut = np.where(quota > 0, quota < 2, content < 2.0)
        shown = np.where(uncut, own, later + OWN_SHARE * own)
        return np.asarray(
            np.where(self.aspect > 0, self.by_angle + weight * shown, self.irregularity)
        )


def _half(
    boundary: Boundary,
    parcel: IntArray,
    a: ComplexArray,
    b: ComplexArray,
    t_a: FloatArray,
    t_b: FloatArray,
    preferred: ComplexArray,
    stretch: float,
) -> _Half:
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
    z, n = _thinned(z, count + 2)
    return _measured(z, n, preferred, stretch)


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


def _thinned(z: ComplexArray, n: IntArray) -> tuple[ComplexArray, IntArray]:
    """Delete the straightest corner while straighter than 135° and more than three remain."""
    columns = np.arange(z.shape[1])[None]
    for _ in range(z.shape[1] - 3):
        included = np.pi - np.abs(_turns(z, n))
        included = np.where(columns < n[:, None], included, -1.0)
        worst = included.argmax(axis=1)
        rows = np.flatnonzero((included[np.arange(len(z)), worst] > STRAIGHT_ANGLE) & (n > 3))
        if len(rows) == 0:
            break
        shift = np.minimum(columns + (columns >= worst[rows, None]), z.shape[1] - 1)
        z = z.copy()
        z[rows] = np.take_along_axis(z[rows], shift, axis=1)
        n = n.copy()
        n[rows] -= 1
    return z, n


def _neighbours(z: ComplexArray, n: IntArray) -> tuple[ComplexArray, ComplexArray]:
    columns = np.arange(z.shape[1])[None]
    before = np.where(columns == 0, n[:, None] - 1, columns - 1)
    after = np.where(columns == n[:, None] - 1, 0, np.minimum(columns + 1, z.shape[1] - 1))
    return np.take_along_axis(z, before, axis=1), np.take_along_axis(z, after, axis=1)


def _turns(z: ComplexArray, n: IntArray) -> FloatArray:
    before, after = _neighbours(z, n)
    return np.asarray(np.angle((after - z) * np.conj(z - before)))


def _measured(z: ComplexArray, n: IntArray, preferred: ComplexArray, stretch: float) -> _Half:
    """Eq. 1 and the proportions of padded polygons."""
    _, after = _neighbours(z, n)
    valid = np.arange(z.shape[1])[None] < n[:, None]
    side = np.where(valid, np.abs(after - z), 0.0)
    angle = np.where(valid, np.pi - _turns(z, n), 0.0)
    mean_side, mean_angle = side.sum(axis=1) / n, angle.sum(axis=1) / n
    by_angle = (np.where(valid, angle - mean_angle[:, None], 0.0) ** 2).sum(axis=1) / n
    by_side = (np.where(valid, side - mean_side[:, None], 0.0) ** 2).sum(axis=1) / n
    g_angle, g_side = IRREGULARITY_WEIGHTS
    safe = np.where(mean_side > 0, mean_side, 1.0)
    aspect = np.zeros(len(z))
    if z.shape[1] > 3:
        quad = np.flatnonzero((n == 4) & (side[:, :4].min(axis=1) > 0))
        # seen in a plane that is stretched across the preferred direction
        turned = (after[quad, :4] - z[quad, :4]) * np.conj(preferred[quad])[:, None]
        seen = np.hypot(turned.real, stretch * turned.imag)
        aspect[quad] = (seen[:, 0] + seen[:, 2]) / (seen[:, 1] + seen[:, 3])
    return _Half(
        irregularity=g_angle * by_angle + g_side * by_side / safe**2,
        by_angle=g_angle * by_angle,
        mean_side=mean_side,
        n=n,
        aspect=aspect,
    )


def rank_cuts(boundary: Boundary, scored: ScoredCuts) -> tuple[IntArray, IntArray]:
    """Best legal cuts of each parcel, best first, no two of them almost the same.

    Returns
    -------
    chosen, rank
        Indices of cuts, and the place of each within its parcel (0 = best).
    """
    quality = scored.quality.copy()
    parcel = scored.cuts.parcel
    perimeter = boundary.perimeter[parcel]
    chosen, ranks = [], []
    for rank in range(ALTERNATIVES):
        order = np.lexsort((-quality, parcel))
        order = order[np.isfinite(quality[order])]
        if len(order) == 0:
            break
        best = order[np.flatnonzero(np.diff(parcel[order], prepend=-1))]
        chosen.append(best)
        ranks.append(np.full(len(best), rank))
        of_parcel = np.full(len(boundary.rings.z), -1)
        of_parcel[parcel[best]] = best
        leader = of_parcel[parcel]
        same = leader >= 0
        for start, stop in ((scored.t_a, scored.t_b), (scored.t_b, scored.t_a)):
            near = _apart(scored.t_a[leader], start, perimeter) < SPREAD
            near &= _apart(scored.t_b[leader], stop, perimeter) < SPREAD
            quality[same & near] = -np.inf
    if not chosen:
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    return np.concatenate(chosen), np.concatenate(ranks)


def _apart(s: FloatArray, t: FloatArray, perimeter: FloatArray) -> FloatArray:
    d = np.abs(s - t)
    return np.minimum(d, np.abs(perimeter - d))
