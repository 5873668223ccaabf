"""Metrics of whole layouts that were counted by hand."""

from __future__ import annotations

import math

import networkx as nx
import numpy as np
import pytest
import shapely
from grid_layouts import SIDE, boxes, cut_square, grid, layout_of

from urban_processing import graphs
from urban_processing.layout import Layout
from urban_processing.metrics.measures import measure
from urban_processing.metrics.registry import INTERIOR, METRICS
from urban_processing.provenance import Step


def values(layout: Layout, part: int | None = None) -> dict[str, float]:
    return {m.metric: m.value for m in measure(layout) if m.part == part}


def test_every_metric_of_the_registry_is_given_once_and_in_order() -> None:
    metrics = measure(grid(2, 2))
    names = [m.metric for m in metrics]
    expected: list[str] = []
    for spec in METRICS:
        expected += [spec.name, spec.name + INTERIOR] if spec.of_parcels else [spec.name]
    assert names == expected
    assert len(set(names)) == len(names)
    assert all(spec.definition.endswith(".") for spec in METRICS)
    units = {m.metric: m.unit for m in metrics}
    assert units["p_angle_deg"] == units["p_angle_deg_interior"] == "°"


def test_table_1_of_a_grid() -> None:
    v = values(grid(4, 4, [(0, 1), (4, 1)], [(2, 1), (2, 3)]))
    assert v["perimeter_m"] == 16 * SIDE
    assert v["area_m2"] == 16 * 400.0
    assert v["min_area_m2"] == 400.0
    assert (v["parcels"], v["parcels_interior"]) == (16, 4)
    assert (v["quads"], v["triangles"], v["pentagons"], v["more_sides"]) == (16, 0, 0, 0)
    assert v["quads_pct"] == 100.0
    assert v["irregularity_max"] == pytest.approx(0.0)
    assert (v["streets"], v["junctions"], v["street_ends"]) == (2, 3, 1)
    assert v["street_length_m"] == 6 * SIDE
    assert v["street_length_mean_m"] == 3 * SIDE
    assert v["junction_deviation_deg"] == pytest.approx(0.0)
    assert v["parcels_per_street"] == 8.0
    assert v["street_length_relative"] == pytest.approx(6 / 16)
    assert v["street_share_pct"] == pytest.approx(100 * 6 / 24)
    assert v["unreached"] == 0
    assert v["frontage_mean_m"] == pytest.approx((16 + 2 * 6) * SIDE / 16)
    assert v["frontage_min_m"] == SIDE
    assert v["through_lots"] == 4  # the southern row


def test_interior_parcels_are_those_off_the_rim() -> None:
    v = values(grid(3, 3))
    assert v["parcels_interior"] == 1
    assert (v["unreached"], v["unreached_interior"]) == (1, 1)
    assert v["frontage_mean_m_interior"] == 0.0


def test_what_is_not_defined_is_nan() -> None:
    v = values(grid(2, 2))
    assert v["parcels_interior"] == 0
    for name in (
        "irregularity_mean_interior",
        "thinness_min_interior",
        "quads_pct_interior",
        "area_cv_interior",
        "area_min_over_mean_interior",
        "parcels_per_street",
        "street_length_mean_m",
        "junction_deviation_deg",
        "junction_deviation_deg_interior",
    ):
        assert math.isnan(v[name]), name
    assert v["street_length_relative"] == 0.0


def test_sides_of_parcels_are_counted() -> None:
    size = 60.0
    hexagon = shapely.Polygon(
        [(math.cos(k * math.pi / 3) * 20, math.sin(k * math.pi / 3) * 20) for k in range(6)]
    )
    hexagon = shapely.set_precision(hexagon, 2.0**-20)
    around = shapely.box(-size, -size, size, size) - hexagon
    v = values(layout_of([hexagon, around]))
    assert (v["hexagons"], v["quads"]) == (1, 1)
    v = values(cut_square(100, [(0, 0), (100, 100)]))
    assert (v["triangles"], v["quads"]) == (2, 0)
    assert v["p_angle_deg"] == pytest.approx(30.0)
    assert v["p_area"] == pytest.approx(2.0)
    assert v["undesirable_pct"] == 100.0


def test_p_angle_is_the_mean_over_corners_not_over_parcels() -> None:
    # a quad of right angles and a right triangle: (4·0 + 0 + 45 + 45) / 7
    square = shapely.box(0, 0, 20, 20)
    triangle = shapely.Polygon([(20, 0), (40, 0), (20, 20)])
    assert values(layout_of([square, triangle]))["p_angle_deg"] == pytest.approx(90 / 7)


def test_spread_of_areas() -> None:
    polygons = [shapely.box(0, 0, 20, 20), shapely.box(20, 0, 30, 20), shapely.box(30, 0, 100, 20)]
    v = values(layout_of(polygons, min_area=200.0))
    areas = np.array([400.0, 200.0, 1400.0])
    assert v["area_mean_m2"] == pytest.approx(areas.mean())
    assert v["area_cv"] == pytest.approx(areas.std() / areas.mean())
    assert v["area_min_over_mean"] == pytest.approx(200 / areas.mean())
    assert v["area_max_over_min_area"] == pytest.approx(7.0)
    assert v["above_2_min_area_pct"] == pytest.approx(100 / 3)  # twice exactly is not above
    assert v["above_3_min_area"] == 1


def test_blocks_are_faces_of_the_street_network() -> None:
    v = values(grid(4, 4, [(0, 1), (4, 1)], [(3, 1), (3, 4)], [(1, 1), (1, 3)]))
    assert v["blocks"] == 3
    assert v["block_parcels_median"] == 4
    assert v["block_parcels_max"] == 9
    assert v["small_blocks_pct"] == pytest.approx(100 / 3)


def test_blocks_agree_with_networkx() -> None:
    layout = grid(5, 4, [(0, 1), (5, 1)], [(3, 1), (3, 4)], [(1, 1), (1, 3), (3, 3)])
    graph = graphs.parcel_graph(layout)
    graph.remove_edges_from([(a, b) for a, b, d in graph.edges(data=True) if d["street_length_m"]])
    blocks = {frozenset(c) for c in nx.connected_components(graph)}
    label = layout.face_block
    found = {frozenset((np.flatnonzero(label == k) + 1).tolist()) for k in np.unique(label)}
    assert found == blocks
    assert len(found) == 4


def test_each_part_of_several_is_measured_apart() -> None:
    polygons = boxes(4, 4) + boxes(2, 2, at=(6, 0))
    layout = layout_of(polygons, [(0, 2), (4, 2)], [(6, 1), (7, 1)], part=[0] * 16 + [1] * 4)
    whole, first, second = values(layout), values(layout, 0), values(layout, 1)
    for name in ("parcels", "perimeter_m", "area_m2", "streets", "junctions", "street_ends"):
        assert whole[name] == first[name] + second[name], name
    assert (first["streets"], second["streets"]) == (1, 1)
    assert (first["junctions"], second["junctions"]) == (2, 1)
    assert (first["street_ends"], second["street_ends"]) == (0, 1)
    assert (first["blocks"], second["blocks"]) == (2, 1)
    assert second["street_share_pct"] == pytest.approx(25.0)
    assert second["street_length_relative"] == pytest.approx(0.25)
    assert "seconds" not in first


def test_deviation_is_given_for_interior_streets_apart() -> None:
    shift = 100 * math.tan(math.radians(20))
    v = values(cut_square(100, [(30, 0), (30 + shift, 100)], [(0, 50), (100, 50)]))
    # slanting at the crossing and at two ends, square at the two others
    assert v["junction_deviation_deg"] == pytest.approx((4 + 4) * 20 / 12, abs=1e-3)
    assert v["junction_deviation_deg_interior"] == pytest.approx(20.0, abs=1e-3)
    assert v["junction_deviation_max_deg"] == pytest.approx(20.0, abs=1e-3)


def test_a_single_part_is_not_repeated() -> None:
    assert {m.part for m in measure(grid(2, 2))} == {None}


def test_perimeter_counts_holes() -> None:
    v = values(layout_of(boxes(3, 3, without=[(1, 1)])))
    assert v["perimeter_m"] == 16 * SIDE
    assert v["area_m2"] == 8 * 400.0


def test_seconds_and_levels_come_from_the_layout() -> None:
    steps = tuple(Step("cogenerate", {}, 0, "1", "", s) for s in (1.5, 0.25))
    level = np.array([1, 2, 3, 3])
    v = values(grid(2, 2).replace(history=steps, face_level=level))
    assert v["seconds"] == 1.75
    assert v["deepest_level"] == 3
