"""Comparisons: rows of metrics, who is better, names, degenerate samples, histograms, tables."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest
import shapely
from grid_layouts import grid
from hypothesis import given
from hypothesis import strategies as st

from urban_processing.errors import ParameterError
from urban_processing.fabric.comparison_layers import COMPARISON, DISTANCES
from urban_processing.metrics import comparison as comparison_module
from urban_processing.metrics.bootstrap import Resampling
from urban_processing.metrics.common_land import shared_land
from urban_processing.metrics.comparison import (
    Comparison,
    Side,
    better_side,
    compare,
    histograms,
    unique_names,
)
from urban_processing.metrics.comparison_notes import notes
from urban_processing.metrics.comparison_tables import comparison_layers
from urban_processing.metrics.comparison_words import words
from urban_processing.metrics.distributions import DISTRIBUTIONS, Sample
from urban_processing.metrics.histograms import FEWEST, MOST, MOST_WHOLE, Histogram, histogram
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.metrics.registry import Better, MetricSpec
from urban_processing.site import Frame

NAN = math.nan
SPECS = {d.name: d for d in DISTRIBUTIONS}
REGISTRY = (
    MetricSpec("parcels", "", "", "Number.", of_parcels=True),
    MetricSpec("irregularity", "", "", "Mean.", of_parcels=True, better=Better.LOW),
    MetricSpec("meshedness", "", "", "Loops.", better=Better.HIGH),
    MetricSpec("area_m2", "m²", "", "Area."),
)


@pytest.fixture(autouse=True)
def _few_metrics(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(comparison_module, "METRICS", REGISTRY)


def side(name: str, values: Mapping[str, float] = {}, **samples: list[float]) -> Side:
    return Side(name, values, {k: Sample(np.array(v, dtype=float)) for k, v in samples.items()})


def compared(*sides: Side, reference: str | None = None) -> Comparison:
    return compare(sides, reference=reference, resamples=40)


def test_every_metric_of_a_side_has_a_row_in_the_order_of_the_registry() -> None:
    made = compared(
        side("a", {"area_m2": 5.0, "irregularity_interior": 0.1, "irregularity": 0.3}),
        side("b", {"meshedness": NAN, "irregularity": 0.2, "parcels": NAN, "area_m2": 2.0}),
    )
    assert [r.name for r in made.rows] == ["irregularity", "irregularity_interior", "area_m2"]
    first, interior, area = made.rows
    assert first.values == (0.3, 0.2)
    assert first.differences == (0.0, pytest.approx(-0.1))
    assert first.better == 1
    assert interior.values[0] == 0.1
    assert math.isnan(interior.values[1])
    assert math.isnan(interior.differences[1])
    assert interior.spec.name == "irregularity"
    assert interior.better is None
    assert (area.unit, area.differences, area.better) == ("m²", (0.0, -3.0), None)


def test_differences_are_those_from_the_reference() -> None:
    sides = [side(name, {"area_m2": v}) for name, v in (("a", 1.0), ("b", 4.0), ("c", 9.0))]
    made = compared(*sides, reference="b")
    assert made.reference_number == 1
    assert made.rows[0].differences == (-3.0, 0.0, 5.0)
    infinite = [side("a", {"area_m2": math.inf}), side("b", {"area_m2": math.inf})]
    assert compared(*infinite).rows[0].differences == (0.0, 0.0)


@pytest.mark.parametrize(
    ("values", "better", "expected"),
    [
        ((1.0, 2.0), Better.LOW, 0),
        ((1.0, 2.0), Better.HIGH, 1),
        ((1.0, 2.0), Better.NEITHER, None),
        ((2.0, 1.0, 1.0), Better.LOW, None),
        ((2.0, 1.0, 1.0), Better.HIGH, 0),
        ((100.0, 100.00001), Better.HIGH, None),
        ((100.0, 100.1), Better.HIGH, 1),
        ((0.0, 1e-9), Better.LOW, None),
        ((NAN, 3.0), Better.LOW, None),
        ((NAN, 3.0, 2.0), Better.LOW, 2),
        ((math.inf, 3.0), Better.HIGH, 0),
    ],
)
def test_the_better_side_is_better_than_all_others(
    values: tuple[float, ...], better: Better, expected: int | None
) -> None:
    assert better_side(values, better) == expected


def test_names_of_sides_become_unique() -> None:
    assert unique_names(["x", "x", "x (2)", "x"]) == ("x", "x (3)", "x (2)", "x (4)")
    assert unique_names(["", ""]) == ("", " (2)")
    made = compared(side("layout"), side("layout"), reference="layout (2)")
    assert made.names == ("layout", "layout (2)")
    assert made.reference_number == 1


def test_mistakes_are_told() -> None:
    with pytest.raises(ParameterError, match="there are 1"):
        compare([side("a")])
    with pytest.raises(ParameterError, match=r"no layout 'c'.*a, b"):
        compare([side("a"), side("b")], reference="c")
    with pytest.raises(ParameterError, match=r"resamples is 0(.|\n)*confidence is 1"):
        compare([side("a"), side("b")], resamples=0, confidence=1.0)
    with pytest.raises(ValueError, match="b has what is not declared: heights, width"):
        compare([side("a"), side("b", {"width": 1.0}, heights=[1.0])])


def test_samples_drop_what_cannot_be_counted() -> None:
    sample = Sample(np.array([1.0, NAN, 3.0, 4.0, math.inf]), np.array([1.0, 1.0, 0.0, NAN, 1.0]))
    assert sample.values.tolist() == [1.0]
    assert not len(Sample(np.ones(3), np.zeros(3)))
    assert Sample(np.array([1.0, 2.0]), np.array([1e-300, 1e300])).values.tolist() == [2.0]
    with pytest.raises(ValueError, match="2 weights for 1 values"):
        Sample(np.ones(1), np.ones(2))
    with pytest.raises(ValueError, match="negative"):
        Sample(np.ones(2), np.array([1.0, -1.0]))
    with pytest.raises(ValueError, match="read-only"):
        sample.values[0] = 2.0


def test_medians() -> None:
    assert Sample(np.array([4.0, 1.0, 2.0, 9.0])).median == 3.0
    assert Sample(np.array([4.0, 1.0, 2.0, 9.0]), np.full(4, 0.3)).median == 3.0
    assert Sample(np.array([4.0, 1.0]), np.array([5.0, 1.0])).median == 4.0
    assert math.isnan(Sample(np.empty(0)).median)


@pytest.mark.parametrize(
    ("a", "b", "distance", "statistic"),
    [
        ([5.0], [5.0], 0.0, 0.0),
        ([5.0], [7.5], 2.5, 1.0),
        ([5.0] * 9, [5.0] * 4, 0.0, 0.0),
        ([5.0] * 9, [7.0] * 4, 2.0, 1.0),
        ([1e300, -1e300], [0.0], 1e300, 0.5),
        ([0.0], [0.0, 0.0, 1e-300], 0.0, 0.0),
    ],
)
def test_degenerate_samples(
    a: list[float], b: list[float], distance: float, statistic: float
) -> None:
    (found,) = compared(side("a", parcel_width_m=a), side("b", parcel_width_m=b)).distances
    assert (found.side, found.reference, found.n_side, found.n_reference) == (
        "b",
        "a",
        len(b),
        len(a),
    )
    assert found.wasserstein == pytest.approx(distance)
    assert found.ks == pytest.approx(statistic)
    assert math.isnan(found.wasserstein_low) == (min(len(a), len(b)) == 1)
    if len(set(a)) == len(set(b)) == 1 < min(len(a), len(b)):
        assert found.wasserstein_low == found.wasserstein_high == pytest.approx(distance)
        assert found.more_than_noise == (distance > 0.0)
    else:
        assert not found.more_than_noise


def test_an_empty_sample_has_no_distance() -> None:
    made = compared(
        side("a", parcel_width_m=[1.0, 2.0]), side("b", parcel_width_m=[NAN]), side("c")
    )
    assert [d.side for d in made.distances] == ["b", "c"]
    for d in made.distances:
        assert (d.n_side, d.n_reference, d.more_than_noise) == (0, 2, False)
        assert d.median_reference == 1.5
        unknown = (d.wasserstein, d.wasserstein_low, d.wasserstein_noise, d.ks, d.ks_high)
        assert all(map(math.isnan, (*unknown, d.median_side)))
    assert compared(side("a"), side("b")).distances == ()


def test_bearings_are_weighted_on_their_circle_and_nothing_else_is() -> None:
    values, weights = np.array([1.0, 50.0]), np.array([3.0, 1.0])
    samples = {n: Sample(values, weights) for n in ("segment_bearing_deg", "segment_length_m")}
    other = {n: Sample(np.array([179.0])) for n in samples}
    length, bearing = compared(Side("a", {}, samples), Side("b", {}, other)).distances
    assert bearing.distribution.name == "segment_bearing_deg"
    assert bearing.wasserstein == pytest.approx((3 * 2 + 51) / 4)
    assert bearing.ks == pytest.approx(1.0)
    assert math.isnan(bearing.median_side)
    assert length.wasserstein == pytest.approx((178 + 129) / 2)
    assert length.median_reference == 25.5


def test_random_numbers_do_not_depend_on_what_else_is_compared() -> None:
    rng = np.random.default_rng(0)
    a, b, c = (rng.normal(k, 1, 50).tolist() for k in range(3))
    alone = compared(side("a", parcel_width_m=a), side("b", parcel_width_m=b))
    among = compared(
        side("a", parcel_area_m2=c, parcel_width_m=a),
        side("c", parcel_area_m2=a, parcel_width_m=c),
        side("b", parcel_width_m=b),
    )
    assert alone.distances[0] in among.distances
    assert alone.resampling == Resampling(resamples=40)


def drawn(name: str, *samples: list[float]) -> Histogram:
    return histogram(SPECS[name], [Sample(np.array(s, dtype=float)) for s in samples])


def test_bins_are_round_and_hold_all_values() -> None:
    rng = np.random.default_rng(0)
    a, b = rng.normal(20, 4, 400), rng.normal(25, 4, 900)
    made = drawn("parcel_width_m", a.tolist(), [*b.tolist(), 1e6])
    step = np.diff(made.edges)
    assert step == pytest.approx(step[0])
    assert step[0] in (0.5, 1.0, 2.0)
    assert FEWEST <= len(step) <= 1.5 * MOST
    assert made.edges[-1] < 60.0
    assert made.above
    assert not made.logarithmic
    assert made.shares.sum(axis=1) == pytest.approx([1.0, 1.0])
    inside = (a >= made.edges[3]) & (a < made.edges[4])
    assert made.shares[0, 3] == pytest.approx(inside.mean())
    assert made.shares[1, -1] >= 1 / 901


def test_areas_over_decades_have_logarithmic_bins() -> None:
    wide = np.geomspace(100.0, 1e5, 300).tolist()
    made = drawn("block_area_m2", wide, wide)
    assert made.logarithmic
    assert np.diff(np.log10(made.edges)) == pytest.approx(np.log10(made.edges[1] / made.edges[0]))
    assert not drawn("block_area_m2", np.linspace(100.0, 900.0, 90).tolist()).logarithmic
    assert not drawn("block_length_m", wide).logarithmic
    assert not drawn("block_area_m2", [0.0, *wide]).edges[0] < 0.0


def test_whole_numbers_stand_in_the_middle_of_their_bins() -> None:
    made = drawn("parcel_neighbours", [3, 4, 4, 6], [4, 5], [])
    assert made.edges.tolist() == [2.5, 3.5, 4.5, 5.5, 6.5]
    assert made.shares.tolist() == [[0.25, 0.5, 0.0, 0.25], [0.0, 0.5, 0.5, 0.0], [0.0] * 4]
    many = drawn("parcel_neighbours", list(range(400)))
    assert len(many.edges) - 1 <= MOST_WHOLE
    assert many.shares.sum() == pytest.approx(1.0)


def test_bearings_stand_around_the_compass_and_point_both_ways() -> None:
    spec = SPECS["segment_bearing_deg"]
    sample = Sample(np.array([1.0, 178.0, 90.0, 40.0]), np.array([2.0, 2.0, 3.0, 1.0]))
    made = histogram(spec, [sample, Sample(np.empty(0))])
    assert len(made.edges) == 37
    assert (made.edges[0], made.edges[-1]) == (-5.0, 355.0)
    shares = {k * 10: s for k, s in enumerate(made.shares[0].tolist()) if s}
    # halves at either end: nought and half a turn are the same direction
    assert shares == pytest.approx(
        {0: 0.25, 180: 0.25, 90: 0.1875, 270: 0.1875, 40: 0.0625, 220: 0.0625}
    )
    assert not made.shares[1].any()


@pytest.mark.parametrize("value", [0.0, 7.0, -3.0, 1e12, 1e-9])
@pytest.mark.parametrize("name", ["parcel_width_m", "block_area_m2", "parcel_neighbours"])
def test_constants_have_a_bin(value: float, name: str) -> None:
    made = drawn(name, [value] * 5, [value])
    assert made.shares.max(axis=1) == pytest.approx([1.0, 1.0])
    assert (np.diff(made.edges) > 0).all()


def test_histograms_are_those_of_all_distributions_that_a_side_has() -> None:
    made = compared(side("a", parcel_width_m=[1.0, 2.0]), side("b", parcel_neighbours=[3.0]))
    names = [h.distribution.name for h in histograms(made)]
    assert names == ["parcel_width_m", "parcel_neighbours"]
    assert [d.distribution.name for d in made.distances] == names


def three_sides() -> Comparison:
    rng = np.random.default_rng(1)
    widths = [rng.normal(20 + 3 * k, 3, 90).tolist() for k in range(3)]
    metrics = [(0.3, 0.1), (0.2, 0.1), (0.4, NAN)]
    return compared(
        *(
            side(name, {"irregularity": i, "meshedness": m, "area_m2": 4.0}, parcel_width_m=w)
            for name, (i, m), w in zip(("a", "b", "c <&>"), metrics, widths, strict=True)
        ),
        reference="b",
    )


def test_tables_have_a_row_for_each_side_but_the_reference() -> None:
    tables = comparison_layers(three_sides())
    assert list(tables) == [COMPARISON, DISTANCES]
    for layer, table in tables.items():
        assert tuple(table.columns) == layer.column_names
        assert table.geometry is None
    rows, distances = tables.values()
    assert rows["metric"].tolist() == ["irregularity"] * 2 + ["meshedness"] * 2 + ["area_m2"] * 2
    assert rows["side"].tolist() == ["a", "c <&>"] * 3
    assert set(rows["reference"]) == {"b"}
    assert rows["value"][:3].tolist() == [0.3, 0.4, 0.1]
    assert rows["reference_value"][:2].tolist() == [0.2, 0.2]
    assert rows["difference"][:2] == pytest.approx([0.1, 0.2])
    assert rows["better"].tolist() == ["b", "b", None, None, None, None]
    assert rows["unit"].tolist()[-1] == "m²"
    assert distances["distribution"].tolist() == ["parcel_width_m"] * 2
    assert distances["n_side"].tolist() == [90, 90]
    assert distances["more_than_noise"].dtype == bool
    assert (distances["wasserstein_low"] < distances["wasserstein"]).all()


def test_a_comparison_of_nothing_has_empty_tables() -> None:
    tables = comparison_layers(compared(side("a"), side("b")))
    assert [len(t) for t in tables.values()] == [0, 0]


def test_words_say_who_is_better_and_what_differs_most() -> None:
    told = words(three_sides())
    assert told[-1] == (
        "better",
        "a in 0, b in 1, c <&> in 0 of 2 metrics, by what is commonly wanted (right angles, four "
        "sides, short detours); 1 alike",
    )
    assert told[0] == ("distributions", "2 of 2 differ by more than chance")
    (name, text), other = told[1:-1]
    assert name == other[0] == "width of parcels"
    assert "m apart on average (" in text
    assert "median" in text
    two = words(compared(side("a", {"area_m2": 2.0}), side("b", {"area_m2": 2.0})))
    assert two == (
        ("distributions", "0 of 0 differ by more than chance"),
        ("better", "no metric that two sides have tells better from worse"),
    )


def test_words_of_a_single_value_name_no_interval() -> None:
    many = list(np.linspace(10.0, 20.0, 60))
    told = dict(words(compared(side("a", parcel_width_m=many), side("b", parcel_width_m=[90.0]))))
    assert told["width of parcels"] == ("median 90.0 m in b, 15.0 m in a; 75.0 m apart on average")


def test_words_do_not_count_interior_parcels_twice() -> None:
    values = {"irregularity": 0.3, "irregularity_interior": 0.3}
    worse = {"irregularity": 0.5, "irregularity_interior": 0.5}
    name, text = words(compared(side("a", values), side("b", worse)))[-1]
    assert name == "better"
    assert text.startswith("a in 1, b in 0 of 1 metrics, by what is commonly wanted")


def lands(*shared: float, areas: tuple[float, float] = (2e6, 1e6)) -> list[tuple[str, str]]:
    sides = [side(name, {"area_m2": a}) for name, a in zip("ab", areas, strict=True)]
    return notes(compare(sides, resamples=2, shared_land=shared))


def test_other_lands_are_told() -> None:
    sizes = "The lands are not the same (1.0 km² in b, 2.0 km² in a): "
    assert lands(1.0, 0.5) == [("lands", f"{sizes}they share 50 % of their area.")]
    assert lands(1.0, 0.004) == [("lands", f"{sizes}they share under 1 % of their area.")]
    assert lands(1.0, 0.0) == [("lands", f"{sizes}they lie apart.")]
    assert lands(1.0, 0.95) == []
    assert lands() == [("lands", f"{sizes}how much they share is not known.")]
    ((_, said),) = lands(1.0, NAN)
    assert said == f"{sizes}how much they share is not known, for their coordinate systems differ."
    ((_, said),) = lands(1.0, NAN, areas=(2e5, 2e5))
    assert said == "It is not known whether the lands are the same: coordinate systems differ."
    assert lands(areas=(2e5, 2e5)) == lands(1.0, 1.0, areas=(2e5, 2e5)) == []
    ((_, said),) = lands(1.0, 0.9, areas=(2e5, NAN))
    assert said == "The lands are not the same: they share 90 % of their area."
    with pytest.raises(ValueError, match="1 shared lands for 2 sides"):
        lands(1.0)


def test_another_density_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    a, b = side("a", block_area_m2=[100.0, 100.0, 900.0]), side("b", block_area_m2=[2500.0])
    (told,) = notes(compared(a, b))
    assert told == (
        "density",
        "Blocks are 25 times as large (median) in b as in a: another density; figures of size "
        "differ by that already.",
    )
    assert words(compared(a, b))[0] == told
    assert notes(compared(a, side("b", block_area_m2=[150.0]))) == []
    assert notes(compared(a, side("b"))) == []
    spec = MetricSpec("area_mean_m2", "m²", "", "Mean.", of_parcels=True)
    monkeypatch.setattr(comparison_module, "METRICS", (spec,))
    sides = [side("a", {"area_mean_m2": 400.0}), side("b", {"area_mean_m2": 250.0})]
    ((_, said),) = notes(compared(*sides), ("A", "B"))
    assert said.startswith("Parcels are 1.6 times as large (mean) in A as in B: another density")


FABRIC = LayoutMeasures(grid(2, 2)).of_fabric.fabric


@given(st.floats(0.0, 30.0), st.floats(0.0, 30.0))
def test_shared_land_is_that_of_two_boxes(dx: float, dy: float) -> None:
    fabric, (x, y) = FABRIC, FABRIC.frame.origin
    box = shapely.union_all(fabric.land)
    x0, y0, x1, y1 = box.bounds
    moved = replace(fabric, frame=Frame(fabric.frame.crs, (x + dx, y + dy)))
    common = max(x1 - x0 - dx, 0.0) * max(y1 - y0 - dy, 0.0)
    share = common / (2 * box.area - common)
    assert shared_land(fabric, moved) == pytest.approx(share, abs=1e-9)
    assert shared_land(moved, fabric) == pytest.approx(share, abs=1e-9)
    assert math.isnan(shared_land(fabric, replace(fabric, frame=Frame("EPSG:2056"))))


def test_declarations_are_in_good_order() -> None:
    assert len(SPECS) == len(DISTRIBUTIONS) == 12
    for spec in DISTRIBUTIONS:
        assert spec.definition.endswith(".")
        suffix = {"m²": "_m2", "m": "_m", "°": "_deg"}.get(spec.unit)
        assert suffix is None or spec.name.endswith(suffix)
    circular = [d for d in DISTRIBUTIONS if d.circular]
    assert [(d.name, d.circular, d.weighted) for d in circular] == [
        ("segment_bearing_deg", 180.0, True)
    ]
