"""Straight skeletons: exact partitions, true heights, one face for each merged edge."""

from __future__ import annotations

import importlib.util
import math
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from skeleton_oracle import skeletons_by_cgal
from skeleton_polygons import polygon_of, random_polygons, rings_of_polygon

from urban_processing.errors import ParameterError, TopologyError
from urban_processing.io.boundaries import read_boundary
from urban_processing.site import FINE_GRID
from urban_processing.skeleton.straight import Skeleton, cut_at_depth, straight_skeleton

SHAPES = {
    "square": [(0, 0), (10, 0), (10, 10), (0, 10)],
    "rectangle": [(0, 0), (20, 0), (20, 14), (0, 14)],
    "ell": [(0, 0), (10, 0), (10, 4), (4, 4), (4, 10), (0, 10)],
    "plus": [
        *((4, 0), (8, 0), (8, 4), (12, 4), (12, 8), (8, 8)),
        *((8, 12), (4, 12), (4, 8), (0, 8), (0, 4), (4, 4)),
    ],
    "slot": [(0, 0), (5, 0), (10, 0), (10, 10), (6, 10), (6, 14), (4, 14), (4, 10), (0, 10)],
}
INNER_NODES = {
    "square": [(5, 5)],
    "rectangle": [(7, 7), (13, 7)],
    "ell": [(2, 2), (2, 8), (8, 2)],
    "plus": [(2, 6), (6, 2), (6, 6), (6, 10), (10, 6)],
    "slot": [(5, 5), (5, 9), (5, 13)],
}


def skeleton_of(polygon: shapely.Polygon) -> Skeleton:
    return straight_skeleton(*rings_of_polygon(polygon))


def polygons_of(xy: np.ndarray, faces: tuple[np.ndarray, ...]) -> list[shapely.Polygon]:
    return [shapely.Polygon(xy[face]) for face in faces]


def touches_between_vertices(xy: np.ndarray, offsets: np.ndarray) -> bool:
    """Whether a ring touches, or almost, the inside of an edge."""
    following = np.arange(1, len(xy) + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    edges = shapely.linestrings(np.stack([xy, xy[following]], axis=1))
    near = shapely.distance(edges[:, None], shapely.points(xy)) < 1e-6
    ends = np.stack([xy, xy[following]], axis=1)[:, :, None]
    return bool((near & ~(ends == xy).all(axis=3).any(axis=1)).any())


def assert_partition(parts: list[shapely.Polygon], whole: shapely.Polygon) -> None:
    assert shapely.is_valid(parts).all()
    assert shapely.coverage_is_valid(parts)
    assert math.isclose(shapely.area(parts).sum(), whole.area, rel_tol=1e-9)
    assert shapely.area(parts).min() > 0


def assert_skeleton(skeleton: Skeleton, xy: np.ndarray, offsets: np.ndarray) -> None:
    """All that the class promises, told from the arrays alone."""
    n = len(xy)
    assert np.array_equal(skeleton.xy[:n], xy)
    assert not skeleton.height[:n].any()
    assert np.array_equal(np.unique(skeleton.edge_face), np.arange(len(skeleton.faces)))
    assert np.array_equal(skeleton.xy[n:] / FINE_GRID, np.round(skeleton.xy[n:] / FINE_GRID))
    following = np.arange(1, n + 1)
    following[offsets[1:] - 1] = offsets[:-1]
    assert np.array_equal(xy[skeleton.following], xy[following])
    following = skeleton.following
    # faces share their vertices by number
    edges = {
        (u, v) for face in skeleton.faces for u, v in zip(face, np.roll(face, -1), strict=True)
    }
    assert {(u, v) for u, v in edges if (v, u) not in edges} == set(enumerate(following))
    for k, face in enumerate(skeleton.faces):
        run = np.flatnonzero(skeleton.edge_face == k)
        count = len(run) + 1
        assert set(face[: count - 1]) == set(run)
        assert np.array_equal(following[face[: count - 1]], face[1:count])
        assert (face[count:] >= n).all()
        assert len(set(face.tolist())) == len(face)
        assert_lies_over_edge(skeleton, face, skeleton.xy[face[[0, count - 1]]])


def assert_lies_over_edge(skeleton: Skeleton, face: np.ndarray, edge: np.ndarray) -> None:
    """Vertices are as high as they are far from the edge, and monotone along it."""
    along = (edge[1] - edge[0]) / np.hypot(*(edge[1] - edge[0]))
    local = skeleton.xy[face] - edge[0]
    far = local[:, 1] * along[0] - local[:, 0] * along[1]
    assert np.abs(far - skeleton.height[face]).max() < 3e-5
    step = np.diff(local @ along, append=0.0)
    way = np.sign(step[np.abs(step) > 3e-5])
    assert (way != np.roll(way, 1)).sum() <= 2


@pytest.mark.parametrize("name", SHAPES)
def test_regular_shapes_have_exact_nodes(name: str) -> None:
    xy = np.array(SHAPES[name], dtype=float)
    skeleton = straight_skeleton(xy, np.array([0, len(xy)]))
    nodes = sorted(map(tuple, skeleton.xy[len(xy) :].tolist()))
    assert nodes == INNER_NODES[name]
    assert_skeleton(skeleton, xy, np.array([0, len(xy)]))


@pytest.mark.parametrize("turn", [0.0, 0.3, 1.0])
@pytest.mark.parametrize("n", [3, 4, 5, 8, 12, 60])
def test_a_regular_polygon_has_one_node(n: int, turn: float) -> None:
    angle = turn + 2 * np.pi * np.arange(n) / n
    xy = 40 * np.column_stack([np.cos(angle), np.sin(angle)]) + (412345.0, 5512345.0)
    xy = np.round(xy * 2**20) / 2**20
    skeleton = straight_skeleton(xy, np.array([0, n]))
    assert len(skeleton.xy) == n + 1
    assert math.isclose(skeleton.height[-1], 40 * math.cos(math.pi / n), rel_tol=1e-7)


def test_a_turned_rectangle_on_the_grid_has_two_nodes() -> None:
    box = np.array(SHAPES["rectangle"], dtype=float)
    for angle in np.linspace(0, np.pi, 40):
        turned = box @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        skeleton = straight_skeleton(np.round(turned * 2**20) / 2**20, np.array([0, 4]))
        assert len(skeleton.xy) == 6
        assert np.allclose(skeleton.height[4:], 7, atol=1e-5)


def test_an_island_in_the_middle_has_symmetric_arcs() -> None:
    ring = shapely.box(0, 0, 20, 20).difference(shapely.box(6, 6, 14, 14))
    xy, offsets = rings_of_polygon(ring)
    skeleton = straight_skeleton(xy, offsets)
    assert sorted(map(tuple, skeleton.xy[8:].tolist())) == [(3, 3), (3, 17), (17, 3), (17, 17)]
    assert_skeleton(skeleton, xy, offsets)


@pytest.mark.parametrize("angle", np.linspace(0, 3, 7))
def test_islands_that_touch_at_a_corner(angle: float) -> None:
    islands = shapely.union_all([shapely.box(5, 5, 8, 8), shapely.box(8, 8, 11, 11)])
    upright = shapely.box(0, 0, 20, 14).difference(islands)
    xy, offsets = rings_of_polygon(upright)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    skeleton = straight_skeleton(xy @ turn, offsets)
    assert_skeleton(skeleton, xy @ turn, offsets)
    assert_partition(polygons_of(skeleton.xy, skeleton.faces), polygon_of(xy @ turn, offsets))


@pytest.mark.parametrize("noise", [1e-10, 1e-9, 1e-8, 1e-7, 1e-6, 1e-5])
def test_shapes_that_are_nearly_regular(noise: float) -> None:
    rng = np.random.default_rng(7)
    for name in ["slot", "plus", "ell"] * 5:
        xy = np.array(SHAPES[name], dtype=float) * 10
        xy += rng.normal(0, noise, xy.shape)
        angle = rng.uniform(0, 6)
        xy = xy @ [[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]]
        offsets = np.array([0, len(xy)])
        skeleton = straight_skeleton(xy, offsets)
        assert_skeleton(skeleton, xy, offsets)
        assert_partition(polygons_of(skeleton.xy, skeleton.faces), shapely.Polygon(xy))


def test_an_edge_too_short_for_the_grid_belongs_to_the_one_before() -> None:
    xy = np.array([(0, 0), (10, 0), (10, 1e-9), (10, 10), (0, 10), (-1e-9, 10 - 1e-9)])
    skeleton = straight_skeleton(xy, np.array([0, 6]))
    assert_partition(polygons_of(skeleton.xy, skeleton.faces), shapely.Polygon(xy))


def test_an_island_that_touches_a_notch_at_its_tip() -> None:
    shell = [(0, 0), (50, 0), (58, 30), (66, 0), (120, 0), (120, 90), (0, 90)]
    block = shapely.Polygon(shell, [[(58, 30), (40, 60), (57, 70)]])
    xy, offsets = rings_of_polygon(block)
    skeleton = straight_skeleton(xy, offsets)
    assert_skeleton(skeleton, xy, offsets)
    assert_partition(polygons_of(skeleton.xy, skeleton.faces), block)


def test_an_island_that_touches_an_edge_between_vertices_is_refused() -> None:
    block = shapely.Polygon([(0, 0), (9, 0), (9, 9), (0, 9)], [[(4, 0), (3, 2), (5, 2)]])
    with pytest.raises(TopologyError, match="touch"):
        skeleton_of(block)
    xy, offsets = rings_of_polygon(block)
    noded = np.insert(xy, 1 + int(np.flatnonzero((xy == 0).all(axis=1))[0]), (4, 0), axis=0)
    skeleton = straight_skeleton(noded, offsets + np.array([0, 1, 1]))
    assert_partition(polygons_of(skeleton.xy, skeleton.faces), block)


def test_random_polygons_of_all_families() -> None:
    for _, polygon in random_polygons(0.1, seed=4):
        xy, offsets = rings_of_polygon(polygon)
        skeleton = straight_skeleton(xy, offsets)
        assert_skeleton(skeleton, xy, offsets)
        assert_partition(polygons_of(skeleton.xy, skeleton.faces), polygon)


@pytest.mark.parametrize("name", ["mauren", "planken", "schellenberg", "wyoming"])
def test_real_lands(name: str, sample: Callable[[str], Path]) -> None:
    for polygon in read_boundary(sample(name)).parts:
        xy, offsets = rings_of_polygon(polygon)
        skeleton = straight_skeleton(xy, offsets)
        assert_skeleton(skeleton, xy, offsets)
        lower, patios = cut_at_depth(skeleton, 30.0)
        parts = [shapely.Polygon(lower.xy[r[0]], [lower.xy[h] for h in r[1:]]) for r in patios]
        assert_partition(polygons_of(lower.xy, lower.faces) + parts, polygon)


@settings(max_examples=150, deadline=None)
@given(
    st.lists(st.tuples(st.integers(0, 12), st.integers(0, 12)), min_size=3, max_size=14),
    st.sampled_from([1.0, 10.0, 1 / 3]),
)
def test_polygons_through_grid_points(points: list[tuple[int, int]], scale: float) -> None:
    polygon = shapely.Polygon(np.array(points, dtype=float) * scale).buffer(0)
    for part in shapely.get_parts(polygon):
        if part.is_empty:
            continue
        whole = shapely.remove_repeated_points(part)
        xy, offsets = rings_of_polygon(whole)
        if touches_between_vertices(xy, offsets):
            continue
        skeleton = straight_skeleton(xy, offsets)
        assert_skeleton(skeleton, xy, offsets)
        assert_partition(polygons_of(skeleton.xy, skeleton.faces), whole)


def test_where_rings_begin_does_not_matter() -> None:
    rng = np.random.default_rng(3)
    for _, polygon in random_polygons(0.03, seed=8):
        xy, offsets = rings_of_polygon(polygon)
        order = np.concatenate(
            [np.roll(np.arange(a, b), rng.integers(b - a)) for a, b in pairwise(offsets)]
        )
        one, other = straight_skeleton(xy, offsets), straight_skeleton(xy[order], offsets)
        assert np.array_equal(one.xy[len(xy) :], other.xy[len(xy) :])
        assert np.array_equal(one.height, other.height)
        number = np.append(order, np.arange(len(xy), len(one.xy)))
        mine = {frozenset(face.tolist()) for face in one.faces}
        assert mine == {frozenset(number[face].tolist()) for face in other.faces}


def test_faces_turn_with_the_polygon() -> None:
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    for family, polygon in random_polygons(0.05, seed=9):
        if family == "nasty":
            continue
        xy, offsets = rings_of_polygon(polygon)
        one = straight_skeleton(xy, offsets)
        other = straight_skeleton(xy @ turn, offsets)
        area = [shapely.Polygon(one.xy[face]).area for face in one.faces]
        turned = [shapely.Polygon(other.xy[face]).area for face in other.faces]
        assert np.allclose(area, turned, atol=1e-5 * polygon.area)


def test_cut_faces_and_patios_tile_the_polygon() -> None:
    rng = np.random.default_rng(5)
    for _, polygon in random_polygons(0.06, seed=6):
        skeleton = skeleton_of(polygon)
        inner = skeleton.height[len(skeleton.edge_face) :]
        for depth in (rng.uniform(0.01, 1) * inner.max(), rng.choice(inner)):
            lower, patios = cut_at_depth(skeleton, float(depth))
            assert lower.height.max() <= depth + 1e-5
            parts = [
                shapely.Polygon(lower.xy[rings[0]], [lower.xy[ring] for ring in rings[1:]])
                for rings in patios
            ]
            for rings in patios:
                assert shapely.is_ccw(shapely.linearrings(lower.xy[rings[0]]))
                assert np.allclose(lower.height[np.concatenate(rings)], depth, atol=1e-5)
            assert_partition(polygons_of(lower.xy, lower.faces) + parts, polygon)


def test_the_offset_contour_is_that_of_a_mitred_buffer() -> None:
    for name, points in SHAPES.items():
        polygon = shapely.Polygon(points)
        for depth in (0.5, 1.0, 1.5, 3.0):
            lower, patios = cut_at_depth(skeleton_of(polygon), depth)
            inside = shapely.union_all([shapely.Polygon(lower.xy[rings[0]]) for rings in patios])
            offset = polygon.buffer(-depth, join_style="mitre", mitre_limit=1000)
            assert inside.symmetric_difference(offset).area < 1e-6, (name, depth)


def test_a_patio_around_an_island_has_a_hole() -> None:
    ring = shapely.box(0, 0, 20, 20).difference(shapely.box(8, 8, 12, 12))
    lower, patios = cut_at_depth(skeleton_of(ring), 2.0)
    assert [len(rings) for rings in patios] == [2]
    assert len(lower.faces) == 8


def test_infinite_depth_cuts_nothing() -> None:
    skeleton = skeleton_of(shapely.box(0, 0, 9, 5))
    assert cut_at_depth(skeleton, math.inf) == (skeleton, ())


@pytest.mark.parametrize("depth", [0.0, -1.0, math.nan])
def test_a_depth_that_is_none_is_refused(depth: float) -> None:
    with pytest.raises(ParameterError, match="positive"):
        cut_at_depth(skeleton_of(shapely.box(0, 0, 9, 5)), depth)


@pytest.mark.parametrize(
    "points", [[(0, 0), (1, 0), (2, 0)], [(0, 0), (0, 0), (1, 0), (1, 1)], [(0, 0), (4, 0)]]
)
def test_what_is_no_ring_is_refused(points: list[tuple[int, int]]) -> None:
    with pytest.raises(TopologyError):
        straight_skeleton(np.array(points, dtype=float), np.array([0, len(points)]))


@pytest.mark.skipif(
    importlib.util.find_spec("pysfcgal") is None, reason="pysfcgal (CGAL) is not installed"
)
def test_arcs_are_those_of_cgal() -> None:
    from tests.benchmarks.skeleton import SAME, arcs_of, difference

    polygons = [p for family, p in random_polygons(0.05, seed=2) if family == "star"]
    for polygon, theirs in zip(polygons, skeletons_by_cgal(polygons), strict=True):
        assert theirs is not None
        assert difference(arcs_of(skeleton_of(polygon)), theirs) < SAME
        assert polygon_of(*rings_of_polygon(polygon)).is_valid
