"""Measures of single parcels against figures worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from grid_layouts import boxes, grid, layout_of

from urban_processing.access_rule import reached_frontage
from urban_processing.layout import Layout
from urban_processing.metrics.parcels import ParcelMeasures, measure_parcels


def alone(*points: tuple[float, float], rim: bool = True) -> ParcelMeasures:
    return measure_parcels(layout_of([shapely.Polygon(points)], rim=rim))


def rectangle(width: float, depth: float) -> list[shapely.Polygon]:
    """Three lots in a row, streets on the rim."""
    return [shapely.box(width * i, 0, width * (i + 1), depth) for i in range(3)]


def test_a_square() -> None:
    p = alone((0, 0), (20, 0), (20, 20), (0, 20))
    assert p.area.tolist() == [400.0]
    assert p.sides.tolist() == [4]
    assert p.irregularity == pytest.approx([0.0])
    assert p.frontage.tolist() == [80.0]
    assert p.thinness == pytest.approx([1.0], rel=0.01)
    assert p.angle_deviation == pytest.approx([0.0])
    assert p.area_ratio == pytest.approx([1.0])
    assert p.rim.tolist() == p.reached.tolist() == p.through.tolist() == [True]
    assert p.undesirable.tolist() == [False]


@pytest.mark.parametrize(("depth", "thinness"), [(20, 1), (40, 0.7071), (80, 0.5), (160, 0.3536)])
def test_thinness_of_rectangles(depth: float, thinness: float) -> None:
    p = alone((0, 0), (20, 0), (20, depth), (0, depth))
    assert p.thinness == pytest.approx([thinness], rel=0.01)


def test_thinness_of_a_triangle_is_its_incircle() -> None:
    p = alone((0, 0), (30, 0), (0, 40))
    assert p.thinness == pytest.approx([20 / np.sqrt(600)], rel=0.01)


def test_a_right_triangle() -> None:
    p = alone((0, 0), (30, 0), (0, 40))
    assert p.sides.tolist() == [3]
    angles = np.array([np.pi / 2, np.arctan2(4, 3), np.arctan2(3, 4)])
    sides = np.array([30.0, 40.0, 50.0])
    by_hand = 0.75 * angles.var() + 0.25 * sides.var() / sides.mean() ** 2
    assert p.irregularity == pytest.approx([by_hand])
    assert p.angle_deviation == pytest.approx([np.degrees(np.abs(angles - np.pi / 2).mean())])
    assert p.area_ratio == pytest.approx([2.0])
    assert p.undesirable.tolist() == [True]


def test_a_vertex_of_a_neighbour_is_no_corner() -> None:
    p = alone((0, 0), (10, 0), (20, 0.1), (20, 20), (0, 20))
    assert p.sides.tolist() == [4]


def test_width_is_along_the_street_side_and_depth_across() -> None:
    layout = layout_of(rectangle(10, 30), rim=False)
    mesh = layout.mesh
    south = (mesh.xy[mesh.origin].reshape(-1, 2, 2)[:, :, 1] == 0).all(axis=1)
    p = measure_parcels(layout.replace(edge_street=south))
    assert p.frontage.tolist() == [10.0] * 3
    assert p.width == pytest.approx([10.0] * 3)
    assert p.depth == pytest.approx([30.0] * 3)


def test_the_longer_of_two_street_sides_gives_the_width() -> None:
    p = measure_parcels(layout_of(rectangle(10, 30)))
    assert p.width == pytest.approx([30, 10, 30])
    assert p.depth == pytest.approx([10, 30, 10])


def test_frontage_in_two_pieces_of_one_side_adds_up() -> None:
    # the street runs along the first and the last third of the southern side alone
    polygon = shapely.Polygon([(0, 0), (10, 0), (20, 0), (30, 0), (30, 12), (0, 12)])
    layout = layout_of([polygon], rim=False)
    mesh = layout.mesh
    ends = mesh.xy[mesh.origin].reshape(-1, 2, 2)
    south = (ends[:, :, 1] == 0).all(axis=1) & (ends[:, :, 0].mean(axis=1) != 15)
    p = measure_parcels(layout.replace(edge_street=south))
    assert p.frontage.tolist() == [20.0]
    assert p.width == pytest.approx([30.0])
    assert p.depth == pytest.approx([12.0])


def test_without_frontage_there_is_no_width() -> None:
    p = measure_parcels(grid(3, 3))
    assert np.flatnonzero(np.isnan(p.width)).tolist() == [4]
    assert np.flatnonzero(np.isnan(p.depth)).tolist() == [4]
    assert np.flatnonzero(~p.reached).tolist() == [4]
    assert np.flatnonzero(~p.rim).tolist() == [4]


def test_reached_frontage_is_the_binding_rule() -> None:
    assert reached_frontage([400.0, 144.0, 64.0]).tolist() == [3.0, 3.0, 2.0]


def with_street_of(length: float) -> Layout:
    polygon = shapely.Polygon([(0, 0), (length, 0), (20, 0), (20, 20), (0, 20)])
    layout = layout_of([polygon], rim=False)
    mesh = layout.mesh
    ends = mesh.xy[mesh.origin].reshape(-1, 2, 2)
    on = (ends[:, :, 1] == 0).all(axis=1) & (ends[:, :, 0].max(axis=1) == length)
    return layout.replace(edge_street=on)


@pytest.mark.parametrize(("length", "reached"), [(2.5, False), (3.0, True), (4.0, True)])
def test_a_parcel_is_reached_from_three_metres_on(length: float, reached: bool) -> None:
    assert measure_parcels(with_street_of(length)).reached.tolist() == [reached]


def test_only_opposite_street_sides_make_a_through_lot() -> None:
    corner_lots = measure_parcels(grid(2, 2))
    assert not corner_lots.through.any()
    strip = measure_parcels(grid(3, 1))
    assert strip.through.tolist() == [True, True, True]
    triangle = alone((0, 0), (40, 0), (20, 4))
    assert triangle.through.tolist() == [False]


def test_a_hole_is_a_rim() -> None:
    polygons = boxes(5, 5, without=[(2, 2)])
    p = measure_parcels(layout_of(polygons))
    inner_ring = [i for i, q in enumerate(polygons) if not shapely.box(20, 20, 80, 80).disjoint(q)]
    assert len(inner_ring) > 8
    interior = np.flatnonzero(~p.rim)
    assert len(interior) == 4  # the four diagonal neighbours of the hole


def test_a_parcel_with_a_hole_is_measured_by_its_outer_ring() -> None:
    holed = shapely.box(0, 0, 30, 30) - shapely.box(10, 10, 20, 20)
    p = measure_parcels(layout_of([holed]))
    assert p.sides.tolist() == [4]
    assert p.area.tolist() == [800.0]
    assert p.frontage.tolist() == [120.0]
    assert p.thinness[0] < 0.6


def test_measures_do_not_depend_on_where_a_ring_begins() -> None:
    points = [(0, 0), (12, -1), (30, 0), (33, 25), (15, 24), (-2, 22)]
    found = []
    for k in range(len(points)):
        p = alone(*points[k:], *points[:k])
        found.append([p.irregularity[0], p.width[0], p.depth[0], p.angle_deviation[0], p.sides[0]])
    assert np.ptp(np.array(found), axis=0) == pytest.approx(np.zeros(5), abs=1e-9)
