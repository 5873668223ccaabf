"""Dimensions: what a block's length is, which streets parcels should front on, mistakes."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
from grid_layouts import SIDE, boxes, grid, layout_of

from urban_processing.layout import Layout
from urban_processing.metrics.measures import LayoutMeasures, measure
from urban_processing.metrics.parcels import measure_parcels, width_and_depth
from urban_processing.params import CogenerateParams
from urban_processing.streets.block_length import longest_sides
from urban_processing.streets.facing import FACING_COST, NARROW_COST, facing_cost
from urban_processing.streets.prune import prune_streets
from urban_processing.streets.shorten import divide_long_blocks


def lengths(layout: Layout) -> list[float]:
    return sorted(LayoutMeasures(layout).block_sides.length.tolist())


def test_length_of_a_block_is_that_of_its_longest_side() -> None:
    assert lengths(grid(6, 2)) == [6 * SIDE]
    assert lengths(grid(6, 2, [(2, 0), (2, 2)])) == [2 * SIDE, 4 * SIDE]
    figures = {m.metric: m.value for m in measure(grid(6, 2, [(2, 0), (2, 2)])) if m.part is None}
    assert figures["block_length_max_m"] == 4 * SIDE
    assert figures["block_length_median_m"] == 3 * SIDE


def test_street_that_meets_a_block_from_outside_does_not_divide_its_side() -> None:
    # two blocks above one another; a street divides the upper one alone
    layout = grid(6, 4, [(0, 2), (6, 2)], [(3, 2), (3, 4)])
    assert lengths(layout) == [3 * SIDE, 3 * SIDE, 6 * SIDE]


def test_street_end_does_not_divide_a_block_and_a_bend_makes_a_corner() -> None:
    assert lengths(grid(6, 2, [(3, 0), (3, 1)])) == [6 * SIDE]
    bent = layout_of(boxes(4, 4, without=[(i, j) for i in (2, 3) for j in (2, 3)]))
    assert lengths(bent) == [4 * SIDE]


def test_curved_sides_are_measured_along_the_curve() -> None:
    t = np.linspace(0, np.pi / 5, 40)
    arc = np.column_stack([np.cos(t), np.sin(t)])
    polygon = shapely.Polygon(np.concatenate([100 * arc, 80 * arc[::-1]]))
    sides = longest_sides(np.array([polygon]), np.array([0]))
    assert sides.length[0] == pytest.approx(20 * np.pi, rel=0.01)
    assert shapely.length(sides.line[0]) == pytest.approx(sides.length[0])


@pytest.mark.parametrize("turn", [0, 37, 90])
def test_a_street_is_laid_across_the_middle_of_a_long_block(turn: float) -> None:
    params = CogenerateParams(min_area=400, max_block_length=5.5 * SIDE)
    cells = [shapely.affinity.rotate(cell, turn, origin=(0, 0)) for cell in boxes(10, 2)]
    layout = divide_long_blocks(layout_of(cells), params)
    assert lengths(layout) == pytest.approx([5 * SIDE] * 2, rel=1e-6)
    # it is not taken back as a street that no parcel needs
    assert lengths(prune_streets(layout, params, keep_ends=False)) == pytest.approx(
        [5 * SIDE] * 2, rel=1e-6
    )
    free = dataclasses.replace(params, max_block_length=None)
    assert lengths(prune_streets(layout, free, keep_ends=False)) == pytest.approx([10 * SIDE])


def test_small_blocks_are_left_whole_unless_the_limit_is_hard() -> None:
    goal = CogenerateParams(min_area=400, max_block_length=2.5 * SIDE)
    hard = dataclasses.replace(goal, hard_block_length=True)
    layout = grid(3, 2)
    assert lengths(divide_long_blocks(layout, goal)) == [3 * SIDE]
    assert max(lengths(divide_long_blocks(layout, hard))) <= 2 * SIDE


def test_width_and_depth_are_the_same_everywhere() -> None:
    layout = grid(5, 3, [(0, 1), (5, 1)])
    width, depth = width_and_depth(layout)
    p = measure_parcels(layout)
    assert np.array_equal(width, p.width, equal_nan=True)
    assert np.array_equal(depth, p.depth, equal_nan=True)


def test_streets_cost_more_along_sides_that_parcels_should_not_front_on() -> None:
    # two parcels of 10 by 20 m side by side
    layout = layout_of([shapely.box(0, 0, 10, 20), shapely.box(10, 0, 20, 20)], min_area=200)
    layout = layout.replace(vertex_corner=np.ones(layout.mesh.n_vertices, dtype=bool))
    graph = layout.corner_graph
    inside = graph.face >= 0
    long = graph.length > 15

    def costs(**values: float) -> tuple[float, float]:
        params = CogenerateParams(min_area=200, **values)
        cost = facing_cost(layout, params, side=20.0)
        assert cost is not None
        assert (cost[~inside] == 0).all()
        return float(cost[inside & long].max()), float(cost[inside & ~long].max())

    along_long, along_short = costs(width_depth=0.5)
    assert along_short == pytest.approx(0)
    assert along_long == pytest.approx(FACING_COST * 0.25 * 0.6**2)
    along_long, along_short = costs(least_frontage=20.0)
    assert along_long == 0
    assert along_short == pytest.approx(NARROW_COST * 0.5 * 0.5)
    assert facing_cost(layout, CogenerateParams(min_area=200), side=20.0) is None


@pytest.mark.parametrize(
    ("values", "words"),
    [
        ({"hard_frontage": True}, "hard-frontage needs a value: give least-frontage (m)."),
        (
            {"hard_block_length": True},
            "hard-block-length needs a value: give max-block-length (m).",
        ),
        (
            {"least_frontage": 30, "width_depth": 0.5},
            "least-frontage 30 m is too much for parcels of 400 to 800 m²: with width-depth 0.5 "
            "they are at most 20 m wide.",
        ),
        (
            {"least_frontage": 60},
            "least-frontage 60 m is too much for parcels of 400 to 800 m²: with 4 times the depth "
            "they are at most 56.57 m wide.",
        ),
        (
            {"max_block_length": 19},
            "max-block-length 19 m is less than the side of the smallest parcel (20 m).",
        ),
        (
            {"max_block_length": 25, "least_frontage": 30},
            "max-block-length 25 m is less than least-frontage 30 m: a block is at least one "
            "parcel long.",
        ),
        ({"width_depth": 0}, "width-depth must be at least 0.1; got 0."),
        ({"least_frontage": -1}, "least-frontage must be above 0 m; got -1."),
    ],
)
def test_mistakes(values: dict[str, float], words: str) -> None:
    assert CogenerateParams.problems_with({"min_area": 400, **values}) == [words]


def test_all_mistakes_are_told_together() -> None:
    found = CogenerateParams.problems_with(
        {"min_area": 400, "hard_block_length": True, "least_frontage": 80, "width_depth": 0.01}
    )
    assert len(found) == 3
