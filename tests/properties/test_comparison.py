"""Properties of distances between distributions, and what they are held against."""

from __future__ import annotations

import itertools
import math
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment
from scipy.stats import ks_2samp, wasserstein_distance

from urban_processing.metrics.bootstrap import Distance, Resampling, measure_distances
from urban_processing.metrics.comparison import Side, compare, histograms
from urban_processing.metrics.distances import kolmogorov_smirnov, wasserstein
from urban_processing.metrics.distributions import DISTRIBUTIONS, Sample

Values = NDArray[np.float64]

FEW = settings(deadline=None, max_examples=60)
PERIOD = 180.0
# eighths are exact, so that equal values stay equal when they are moved
VALUES = st.lists(st.integers(-8000, 8000), min_size=1, max_size=25).map(lambda v: np.array(v) / 8)
WEIGHTED = st.lists(
    st.tuples(st.integers(-800, 800), st.integers(1, 5)), min_size=1, max_size=12
).map(lambda pairs: tuple(np.array(pairs, dtype=float).T))
PERIODS = st.sampled_from([0.0, PERIOD])


def both(a: Values, b: Values, *, period: float = 0.0) -> Values:
    first, second = Sample(a), Sample(b)
    return np.array(
        [
            wasserstein(first, second, period=period),
            kolmogorov_smirnov(first, second, period=period),
        ]
    )


def on_circle(a: Values, b: Values) -> Values:
    """Smallest angles between all values of both."""
    apart = np.abs(a[:, None] - b) % PERIOD
    return np.minimum(apart, PERIOD - apart)


@FEW
@given(a=VALUES, b=VALUES)
def test_distances_on_a_line_are_those_of_scipy(a: Values, b: Values) -> None:
    with warnings.catch_warnings(action="ignore"):  # of p-values, which are not wanted
        statistic = ks_2samp(a, b, method="asymp").statistic
    expected = [wasserstein_distance(a, b), statistic]
    assert both(a, b) == pytest.approx(expected, rel=1e-9, abs=1e-12)


@FEW
@given(a=WEIGHTED, b=WEIGHTED)
def test_weights_count_like_repeated_values(
    a: tuple[Values, Values], b: tuple[Values, Values]
) -> None:
    for period in (0.0, PERIOD):
        repeated = [np.repeat(v, w.astype(int)) for v, w in (a, b)]
        expected = both(*repeated, period=period)
        # only the proportion of weights counts
        first, second = Sample(a[0], 7.5 * a[1]), Sample(b[0], 0.01 * b[1])
        assert wasserstein(first, second, period=period) == pytest.approx(expected[0], abs=1e-9)
        assert kolmogorov_smirnov(first, second, period=period) == pytest.approx(expected[1])
    assert wasserstein(first, second) == pytest.approx(
        wasserstein_distance(a[0], b[0], a[1], b[1]), abs=1e-9
    )


@FEW
@given(a=VALUES, b=VALUES)
def test_the_wasserstein_distance_on_a_circle_is_the_cheapest_assignment(
    a: Values, b: Values
) -> None:
    a, b = a[:8], b[:6]
    common = math.lcm(len(a), len(b))
    cost = on_circle(np.repeat(a, common // len(a)), np.repeat(b, common // len(b)))
    cheapest = cost[linear_sum_assignment(cost)].mean()
    assert both(a, b, period=PERIOD)[0] == pytest.approx(cheapest, abs=1e-9)


@FEW
@given(a=VALUES, b=VALUES)
def test_kuipers_statistic_is_the_largest_difference_over_any_arc(a: Values, b: Values) -> None:
    a, b = np.sort(a % PERIOD)[:9], np.sort(b % PERIOD)[:9]
    ends = np.unique(np.concatenate([a, b]))
    largest = 0.0
    for start, end in itertools.product(ends, ends):
        inside = [(v >= start) & (v <= end) for v in (a, b)]
        largest = max(largest, abs(inside[0].mean() - inside[1].mean()))
    assert both(a, b, period=PERIOD)[1] == pytest.approx(largest, abs=1e-12)


@FEW
@given(a=VALUES, b=VALUES, period=PERIODS)
def test_distances_are_symmetric_nought_for_equals_and_blind_to_order(
    a: Values, b: Values, period: float
) -> None:
    shuffled = np.random.default_rng(len(a)).permutation(a)
    assert both(a, b, period=period) == pytest.approx(both(b, a, period=period), abs=1e-12)
    assert both(a, np.repeat(shuffled, 2), period=period) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert (both(shuffled, b, period=period) == both(a, b, period=period)).all()


@FEW
@given(a=VALUES, b=VALUES, c=VALUES, period=PERIODS)
def test_no_way_round_is_shorter(a: Values, b: Values, c: Values, period: float) -> None:
    direct = both(a, c, period=period)
    assert (direct <= both(a, b, period=period) + both(b, c, period=period) + 1e-9).all()
    largest = (0.5 * period if period else np.ptp(np.concatenate([a, c])), 1.0)
    assert (direct <= np.add(largest, 1e-9)).all()


@FEW
@given(a=VALUES, b=VALUES, shift=st.integers(-4000, 4000), factor=st.floats(0.05, 50.0))
def test_distances_when_values_are_moved_scaled_and_bent(
    a: Values, b: Values, shift: int, factor: float
) -> None:
    distance = both(a, b)
    assert both(a + shift / 8, b + shift / 8) == pytest.approx(distance, abs=1e-9)
    assert both(a, a + shift / 8)[0] == pytest.approx(abs(shift) / 8, abs=1e-9)
    scaled = both(factor * a, factor * b)
    assert scaled == pytest.approx(distance * [factor, 1.0], rel=1e-5, abs=1e-5)
    assert both(a**3 + a, b**3 + b)[1] == pytest.approx(distance[1], abs=1e-12)


@FEW
@given(a=VALUES, b=VALUES, turn=st.integers(-4000, 4000))
def test_distances_on_a_circle_when_both_are_turned(a: Values, b: Values, turn: int) -> None:
    distance = both(a, b, period=PERIOD)
    turned = both(a + turn / 8, b + turn / 8 + PERIOD, period=PERIOD)
    assert turned == pytest.approx(distance, abs=1e-9)


def test_what_machines_differ_in_makes_no_difference() -> None:
    a = np.array([400.0, 1e-17, 123.456, 7e8])
    assert both(a, a * (1 + 1e-15)) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert both(a, a * (1 - 1e-15)) == pytest.approx([0.0, 0.0], abs=1e-12)
    assert both(np.array([1e-14]), np.array([-1e-14]), period=PERIOD).tolist() == [0.0, 0.0]


QUICK = Resampling(resamples=60)


@settings(deadline=None, max_examples=40)
@given(
    a=VALUES,
    b=VALUES,
    period=PERIODS,
    weighted=st.booleans(),
    seed=st.integers(0, 99),
)
def test_intervals_hold_the_distance_and_depend_on_names_alone(
    a: Values, b: Values, period: float, weighted: bool, seed: int
) -> None:
    how = Resampling(seed=seed, resamples=60)

    def sample(v: Values) -> Sample:
        return Sample(v, 1.0 + np.abs(v) % 3 if weighted else None)

    found = measure_distances(
        sample(a), sample(b), period=period, resampling=how, names=("width", "ours", "theirs")
    )
    turned = measure_distances(
        sample(b[::-1]), sample(a), period=period, resampling=how, names=("width", "theirs", "ours")
    )
    for distance, other in zip(found, turned, strict=True):
        assert distance.noise >= 0.0
        assert numbers(distance) == pytest.approx(numbers(other), abs=1e-9, nan_ok=True)
        if min(len(a), len(b)) == 1:
            assert math.isnan(distance.low)
            assert math.isnan(distance.high)
        else:
            assert 0.0 <= distance.low <= distance.value <= distance.high
            if not distance.more_than_noise:
                assert distance.low == 0.0
    assert found[1].value <= 1.0


def numbers(distance: Distance) -> list[float]:
    return [distance.value, distance.low, distance.high, distance.noise]


def test_intervals_depend_on_the_seed_and_on_names() -> None:
    rng = np.random.default_rng(0)
    a, b = Sample(rng.normal(0, 1, 80)), Sample(rng.normal(1, 1, 60))
    first = measure_distances(a, b, resampling=QUICK)
    assert first == measure_distances(a, b, resampling=QUICK)
    assert first != measure_distances(a, b, resampling=Resampling(seed=1, resamples=60))
    assert first != measure_distances(a, b, resampling=QUICK, names=("", "a", "c"))
    assert first != measure_distances(a, b, resampling=QUICK, names=("x", "a", "b"))


def test_the_interval_holds_the_true_distance_about_as_often_as_it_says() -> None:
    rng, how = np.random.default_rng(1), Resampling(resamples=300, confidence=0.9)
    shift, trials = 0.7, 150
    # the largest difference of two normal distribution functions
    truth = shift, math.erf(shift / 2 / math.sqrt(2))
    held = np.zeros(2)
    for _ in range(trials):
        samples = Sample(rng.normal(0, 1, 120)), Sample(rng.normal(shift, 1, 90))
        found = measure_distances(*samples, resampling=how)
        held += [d.low <= t <= d.high for d, t in zip(found, truth, strict=True)]
    assert 0.8 <= held[0] / trials <= 0.96
    assert 0.78 <= held[1] / trials <= 0.96


def test_more_than_noise_is_rare_for_equals_and_sure_for_what_is_far_apart() -> None:
    rng, how = np.random.default_rng(2), Resampling(resamples=200)
    equal = apart = 0
    for _ in range(100):
        a, b, c = rng.exponential(30, 80), rng.exponential(30, 50), rng.exponential(80, 50)
        near = measure_distances(Sample(a), Sample(b), resampling=how)
        equal += any(d.more_than_noise for d in near)
        far = measure_distances(Sample(a), Sample(c), resampling=how)
        apart += any(d.more_than_noise for d in far)
    assert equal <= 11
    assert apart >= 97


@pytest.mark.parametrize("period", [0.0, PERIOD])
def test_many_values_are_drawn_again_on_cells_to_the_same_effect(
    period: float, monkeypatch: pytest.MonkeyPatch
) -> None:
    rng, how = np.random.default_rng(3), Resampling(resamples=400)
    a, b = rng.normal(20, 30, 900), rng.normal(26, 30, 700)
    on_cells = measure_distances(Sample(a), Sample(b), period=period, resampling=how)
    monkeypatch.setattr("urban_processing.metrics.distances.CELLS", 10_000)
    on_all = measure_distances(Sample(a), Sample(b), period=period, resampling=how)
    for few, all_of_them in zip(on_cells, on_all, strict=True):
        assert few.value == all_of_them.value
        assert numbers(few) == pytest.approx(numbers(all_of_them), abs=0.1 * few.value)
        assert numbers(few) != numbers(all_of_them)


NAMES = st.lists(st.text(max_size=4), min_size=2, max_size=4)


@settings(deadline=None, max_examples=25)
@given(
    names=NAMES,
    data=st.data(),
)
def test_sides_of_any_names_and_samples_are_compared(names: list[str], data: st.DataObject) -> None:
    kinds = st.sampled_from([d.name for d in DISTRIBUTIONS])
    numbers_too = st.lists(
        st.one_of(st.floats(-1e12, 1e12), st.just(math.nan), st.just(math.inf)), max_size=12
    ).map(np.array)
    samples = st.dictionaries(kinds, numbers_too.map(Sample), max_size=4)
    sides = [Side(name, {}, data.draw(samples)) for name in names]
    made = compare(sides, resamples=20)
    assert len(set(made.names)) == len(names)
    for distance in made.distances:
        empty = 0 in (distance.n_side, distance.n_reference)
        assert math.isnan(distance.wasserstein) == math.isnan(distance.ks) == empty
        assert not (empty and distance.more_than_noise)
    for drawn in histograms(made):
        assert (np.diff(drawn.edges) > 0).all()
        full = [len(side.sample(drawn.distribution)) > 0 for side in made.sides]
        assert drawn.shares.sum(axis=1) == pytest.approx(np.array(full, dtype=float))
        assert drawn.shares.shape == (len(names), len(drawn.edges) - 1)


def test_the_order_of_sides_changes_no_distance() -> None:
    rng = np.random.default_rng(4)
    sides = [
        Side(name, {}, {"parcel_area_m2": Sample(rng.lognormal(6 + k / 5, 0.4, 70))})
        for k, name in enumerate(("ours", "theirs", "plan"))
    ]
    one = compare(sides, reference="plan", resamples=50)
    other = compare(sides[::-1], reference="plan", resamples=50)
    assert one.distances == other.distances[::-1]
    assert {d.side for d in one.distances} == {"ours", "theirs"}
