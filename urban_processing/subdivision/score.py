"""Quality of candidate cuts (Chen 2024, Eq. 2, with further terms) and the choice among them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.fields.rings import ComplexArray, cross
from urban_processing.hashing import UintArray, uniform
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.site import AREA_ROUNDING
from urban_processing.subdivision.cuts import CLEARANCE, Cuts
from urban_processing.subdivision.halves import Ideal, half_polygons
from urban_processing.subdivision.parcels import CONTINUES_ANGLE, Boundary

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


WANTED_WEIGHT = 2.0
"""Proportions count so many times as much where their ratio is given."""


TERMS = (
    *("size", "shape", "access", "clearance", "count", "frontage", "continuity"),
    *("orientation", "variation"),
)
"""What the quality of a cut is the sum of: Qsize, Qregu and Qacce of Chen 2024, Eq. 2, then terms
of the preset and of what was wished for; those that speak against a cut are negative."""


FRONTAGE_WEIGHT = 1.0
"""Weight of halves without any of the least frontage; in proportion below."""


@dataclass(frozen=True, eq=False)
class ScoredCuts:
    """Candidates after snapping, with their quality.

    Parameters
    ----------
    t_a, t_b
        (C,) where the ends lie along the ring.
    quality
        (C,) sum of the terms; -inf where a cut is illegal.
    terms
        (C, T) what each of `TERMS` adds to the quality.
    """

    cuts: Cuts
    t_a: FloatArray
    t_b: FloatArray
    quality: FloatArray
    terms: FloatArray


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
    ideal = _ideal(boundary, cuts.parcel, params)
    left = half_polygons(boundary, cuts.parcel, a, b, t_a, t_b, ideal)
    right = half_polygons(boundary, cuts.parcel, b, a, t_b, t_a, ideal)
    street = np.column_stack(
        [
            boundary.street_between(cuts.parcel, t_b, t_a),
            boundary.street_between(cuts.parcel, t_a, t_b),
        ]
    )
    wanted = params.access_ratio * np.column_stack([left.mean_side, right.mean_side])
    if params.least_frontage is not None:
        least = params.least_frontage / boundary.rings.scale[cuts.parcel][:, None]
        wanted = np.maximum(wanted, least)
    reached = street >= wanted
    w_size, w_shape, w_access = params.weights
    parcel_quota = quota[cuts.parcel]
    shape = [left.irregularity, right.irregularity]
    if rules.prospect > 0:
        prospect = rules.prospect * (1.0 if params.width_depth is None else WANTED_WEIGHT)
        left_quota = _left_quota(area, parcel_quota)
        total = area / min_share[cuts.parcel], (1.0 - area) / min_share[cuts.parcel]
        shape = [
            left.with_prospect(total[0], left_quota, prospect),
            right.with_prospect(total[1], parcel_quota - left_quota, prospect),
        ]
    elif params.width_depth is not None:
        shape = [left.by_proportions(), right.by_proportions()]
    terms = {
        "size": w_size * _balance(smaller / larger, rules.size_cap),
        "shape": w_shape / (1.0 + shape[0] + shape[1]),
        "access": w_access * (1.0 + reached.all(axis=1)),
        "clearance": -rules.clearance * np.clip(1.0 - cuts.clearance / CLEARANCE, 0.0, 1.0),
        "count": -w_size * np.minimum(1.0, QUOTA_WEIGHT * _quota_misfit(area, parcel_quota)),
    }
    if params.least_frontage is not None:
        # what has no street yet will have one along its shorter sides, as a rule
        later = np.column_stack([left.least_width, right.least_width])
        short = 1.0 - np.where(street > 0, street, later) / least
        terms["frontage"] = -FRONTAGE_WEIGHT * np.clip(short, 0.0, 1.0).sum(axis=1)
    if params.continuity > 0:
        ends = _continues(boundary, cuts.parcel, node_a, cuts.leaving).astype(np.float64)
        ends += _continues(boundary, cuts.parcel, node_b, -cuts.arriving)
        terms["continuity"] = params.continuity * 0.5 * ends
    if params.orientation is not None and rules.prospect == 0:
        along = _oriented(b - a, ideal.preferred)
        terms["orientation"] = params.weight_orientation * along
    if rules.variation > 0:
        terms["variation"] = rules.variation * _noise(cuts.parcel, lineage, params.seed)
    by_term = np.column_stack([terms.get(name, np.zeros(len(area))) for name in TERMS])
    quality = by_term.sum(axis=1)
    legal = (
        (smaller >= min_share[cuts.parcel] * (1.0 - AREA_ROUNDING)) & (left.n >= 3) & (right.n >= 3)
    )
    if params.frontage_limit > 0:
        legal &= _possible_frontage(boundary, cuts.parcel, t_a, t_b, b - a) >= least[:, 0]
    if boundary.has_bare:
        attached = boundary.is_attached(cuts.parcel, t_a) | boundary.is_attached(cuts.parcel, t_b)
        legal &= attached | ~boundary.has_network[cuts.parcel]
    legal &= np.isfinite(quality) & (np.abs(b - a) > 1e-9)
    # rounded, so that ties are broken by index on every machine
    quality = np.where(legal, np.round(quality, 6), -np.inf)
    return ScoredCuts(cuts, t_a, t_b, quality, by_term)


def _possible_frontage(
    boundary: Boundary, parcel: IntArray, t_a: FloatArray, t_b: FloatArray, chord: ComplexArray
) -> FloatArray:
    """(C,) length that is or could be street around the half that has less of it."""
    left = boundary.usable_between(parcel, t_b, t_a)
    right = boundary.usable_between(parcel, t_a, t_b)
    return np.asarray(np.minimum(left, right) + np.abs(chord))


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


def _ideal(boundary: Boundary, parcel: IntArray, params: CogenerateParams) -> Ideal:
    """Ideal proportions of the halves of each candidate, in the frame of its parcel."""
    preferred, stretch = np.ones(len(parcel), dtype=np.complex128), 1.0
    if params.orientation is not None:
        direction = np.exp(1j * np.radians(params.orientation))
        preferred = np.asarray(direction * np.conj(boundary.rings.axis[parcel]))
        stretch = 1.0 + STRETCH * params.weight_orientation
    return Ideal(preferred, stretch, params.width_depth)


def _oriented(chord: ComplexArray, preferred: ComplexArray) -> FloatArray:
    """1 where a cut runs along the preferred direction, 0 across (Chen 2024, section 6)."""
    length = np.abs(chord)
    along = (chord * np.conj(preferred)).real / np.where(length > 0, length, 1.0)
    return np.asarray(1.0 - 2.0 / np.pi * np.arccos(np.clip(np.abs(along), 0.0, 1.0)))


def rank_cuts(
    boundary: Boundary, scored: ScoredCuts, alternatives: int = ALTERNATIVES
) -> tuple[IntArray, IntArray]:
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
    for rank in range(alternatives):
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
