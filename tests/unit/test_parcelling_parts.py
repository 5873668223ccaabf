"""The parts of subdivision by boxes: boxes, sweeps, cuts by lines, noding, pieces put together."""

import numpy as np
import pytest
import shapely
import shapely.ops
from hypothesis import given, settings
from hypothesis import strategies as st
from parcel_grounds import (
    assert_tiled,
    frontage_of,
    ground_of,
    rectilinear,
    rules_of,
    star,
    with_holes,
)

from urban_processing.parcelling.boxes import divide
from urban_processing.parcelling.boxes.divide import divide_by_boxes
from urban_processing.parcelling.boxes.line_cuts import THE_CUT, Lines, cut
from urban_processing.parcelling.boxes.oriented import smallest_boxes
from urban_processing.parcelling.boxes.sweep import sweep_along
from urban_processing.parcelling.compose import ground_of_faces, replace_faces
from urban_processing.parcelling.noding import Segments, node_rings
from urban_processing.parcelling.rings import Rings


def rings_of_shapes(shapes):
    ground = ground_of(shapes)
    edge = np.arange(len(ground.rings.xy))
    return Rings(edge, edge, ground.rings.offsets, ground.rings.block), ground.rings.xy


def many_shapes(n=40, seed=0):
    rng = np.random.default_rng(seed)
    shapes = [star(rng, int(rng.integers(3, 60))) for _ in range(n)]
    shapes += [rectilinear(rng, int(rng.integers(1, 20))) for _ in range(n)]
    shapes += [with_holes(rng, int(rng.integers(1, 5))) for _ in range(n // 2)]
    return shapes


def smallest_along_edges(shape):
    xy = shapely.get_coordinates(shape.exterior)
    edge = np.diff(xy, axis=0)
    edge /= np.hypot(*edge.T)[:, None]
    along, across = edge @ xy.T, np.column_stack([-edge[:, 1], edge[:, 0]]) @ xy.T
    return (np.ptp(along, axis=1) * np.ptp(across, axis=1)).min()


def test_boxes_are_the_smallest_along_an_edge():
    shapes = many_shapes()
    rings, xy = rings_of_shapes(shapes)
    boxes = smallest_boxes(rings, xy)
    area = boxes.length * boxes.width
    known = np.array([smallest_along_edges(shape) for shape in shapes])
    assert (area >= known * (1 - 1e-9)).all()
    assert (area <= known * (1 + 1.001e-3)).all()
    assert (boxes.length >= boxes.width * (1 - 1e-6)).all()
    across = np.column_stack([-boxes.axis[:, 1], boxes.axis[:, 0]])
    u, v = boxes.axis * boxes.length[:, None] / 2, across * boxes.width[:, None] / 2
    corners = np.stack([-u - v, u - v, u + v, -u + v], axis=1) + boxes.centre[:, None]
    covered = shapely.covers(shapely.buffer(shapely.polygons(corners), 1e-6), np.array(shapes))
    assert covered.all()


def test_a_triangle_stands_on_its_longest_side():
    corners = np.array([(0.0, 0.0), (10.0, 0.0), (4.0, 6.0)])
    for first in range(3):
        rings, xy = rings_of_shapes([shapely.Polygon(np.roll(corners, first, axis=0))])
        boxes = smallest_boxes(rings, xy)
        np.testing.assert_allclose([boxes.length[0], boxes.width[0]], [10.0, 6.0])


def test_boxes_turned_are_the_same_boxes():
    rings, xy = rings_of_shapes([shapely.box(0, 0, 30, 10), shapely.box(0, 0, 10, 30)])
    boxes = smallest_boxes(rings, xy)
    np.testing.assert_array_equal(boxes.axis, [[1, 0], [0, 1]])
    turned = boxes.turned(np.array([True, False]))
    np.testing.assert_array_equal(turned.axis, [[0, 1], [0, 1]])
    np.testing.assert_array_equal(turned.length, [10, 30])


def test_sweeps_measure_and_find_areas():
    shapes = many_shapes(seed=4)
    rings, xy = rings_of_shapes(shapes)
    boxes = smallest_boxes(rings, xy)
    sweep = sweep_along(rings, xy, boxes)
    whole = shapely.area(shapes)
    for share in (0.0, 0.03, 0.5, 0.8):
        place = sweep.places(share * whole, np.zeros(len(whole)))
        np.testing.assert_allclose(sweep.areas(place), share * whole, atol=1e-9 * whole.max())
        far = 500.0
        u = boxes.axis
        v = np.column_stack([-u[:, 1], u[:, 0]])
        at = boxes.centre + place[:, None] * u
        half = np.stack([at - far * v, at + far * v, at - far * u + far * v], axis=1)
        half = np.concatenate([half, (at - far * u - far * v)[:, None]], axis=1)
        before = shapely.area(shapely.intersection(shapes, shapely.polygons(half)))
        np.testing.assert_allclose(before, share * whole, atol=1e-6)


def cut_by_shapely(shape, line):
    (px, py), (nx, ny) = line.point[0], line.normal[0]
    far = 1000.0
    ends = [(px - far * ny, py + far * nx), (px + far * ny, py - far * nx)]
    parts = shapely.ops.split(shape, shapely.LineString(ends)).geoms
    return sorted(shapely.area(part) for part in parts)


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(3, 40), kind=st.integers(0, 2))
def test_lines_cut_as_shapely_does(seed, n, kind):
    rng = np.random.default_rng(seed)
    make = (star, rectilinear, lambda rng, n: with_holes(rng, n % 4 + 1))[kind]
    shape = make(rng, n)
    rings, xy = rings_of_shapes([shape])
    turn = rng.uniform(0, np.pi)
    line = Lines(rng.uniform(-20, 20, (1, 2)), np.array([[np.cos(turn), np.sin(turn)]]))
    found = cut(rings, xy, line)
    points = np.concatenate([xy, found.added])
    pieces = found.pieces.polygons(points)
    assert shapely.is_valid(pieces).all()
    assert shapely.coverage_is_valid(pieces)
    np.testing.assert_allclose(sorted(shapely.area(pieces)), cut_by_shapely(shape, line), atol=1e-5)


@settings(max_examples=150, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(2, 25), flip=st.booleans(), row=st.integers(0, 30))
def test_lines_along_edges_and_through_corners_leave_valid_pieces(seed, n, flip, row):
    shape = rectilinear(np.random.default_rng(seed), n)
    rings, xy = rings_of_shapes([shape])
    normal = np.array([[0.0, -1.0 if flip else 1.0]])
    line = Lines(xy[[row % len(xy)]], normal)
    found = cut(rings, xy, line)
    pieces = found.pieces.polygons(np.concatenate([xy, found.added]))
    assert shapely.is_valid(pieces).all()
    assert (shapely.area(pieces) > 100.0).all()
    np.testing.assert_allclose(sorted(shapely.area(pieces)), cut_by_shapely(shape, line), atol=1e-6)
    # edges of the contour keep their segments, whole or in parts
    named = found.pieces.segment != THE_CUT
    points = np.concatenate([xy, found.added])[found.pieces.vertex]
    length = np.abs(points[found.pieces.following] - points).sum(axis=1)
    np.testing.assert_allclose(length[named].sum(), shapely.length(shape), rtol=1e-12)


def test_pieces_are_ordered_along_the_line_before_it_and_beyond():
    teeth = [shapely.box(x, 0, x + 10, 20) for x in (0, 20, 40)]
    comb = shapely.union_all([*teeth, shapely.box(0, 0, 50, 5)])
    rings, xy = rings_of_shapes([comb])
    line = Lines(np.array([[0.0, 10.0]]), np.array([[0.0, 1.0]]))
    found = cut(rings, xy, line)
    middle = shapely.centroid(found.pieces.polygons(np.concatenate([xy, found.added])))
    assert shapely.get_y(middle[0]) < 10
    # the normal points up, so that right is east
    np.testing.assert_allclose(shapely.get_x(middle[1:]), [45, 25, 5])


def test_rings_get_the_vertices_of_their_neighbours_and_share_those_of_a_place():
    # two squares side by side; on their common side the left one has a vertex in the middle,
    # the right one has the same but for rounding, and another one
    near = 2.0**-24
    xy = np.array(
        [(0, 0), (4, 0), (4, 2), (4, 4), (0, 4), (8, 0), (8, 4), (4, 2 + near), (4, 3)], dtype=float
    )
    rings = Rings(
        vertex=np.array([0, 1, 2, 3, 4, 1, 5, 6, 3, 8, 7]),
        segment=np.array([0, 6, 6, 1, 2, 3, 4, 5, 6, 6, 6]),
        offsets=np.array([0, 5, 11]),
        face=np.array([0, 1]),
    )
    direction = np.array([(1, 0), (1, 0), (0, 1), (1, 0), (0, 1), (1, 0), (0, 1)], dtype=float)
    origin = np.array([(0, 0), (0, 4), (0, 0), (4, 0), (8, 0), (4, 4), (4, 0)], dtype=float)
    segments = Segments(origin, direction, np.full(7, 4.0))
    noded, source = node_rings(rings, xy, segments, n_fixed=2)
    np.testing.assert_array_equal(noded.vertex, [0, 1, 2, 8, 3, 4, 1, 5, 6, 3, 8, 2])
    np.testing.assert_array_equal(source, [0, 1, 2, 2, 3, 4, 5, 6, 7, 8, 9, 10])
    assert shapely.coverage_is_valid(noded.polygons(xy))


def test_faces_that_noding_breaks_are_taken_back(monkeypatch):
    ground = ground_of([shapely.box(0, 0, 100, 80), shapely.box(200, 0, 300, 60)])
    rules = rules_of(2)
    plain = divide_by_boxes(ground, rules, seed=3)
    asked = []

    def broken_once(noded, xy):
        asked.append(noded.n_faces)
        return np.arange(noded.n_faces) == (2 if len(asked) == 1 else -1)

    monkeypatch.setattr(divide, "_broken", broken_once)
    mended = divide_by_boxes(ground, rules, seed=3)
    assert_tiled(mended, ground)
    assert mended.n_faces < plain.n_faces == asked[0]
    other = plain.block == 1
    np.testing.assert_array_equal(plain.lineage[other], mended.lineage[mended.block == 1])


@pytest.mark.parametrize("seed", range(4))
def test_faces_divided_further_stay_noded_with_their_neighbours(seed):
    rng = np.random.default_rng(seed)
    shapes = [shapely.box(0, 0, 120, 100), with_holes(rng, 2), star(rng, 12)]
    ground = ground_of(shapes)
    coarse = divide_by_boxes(ground, rules_of(3, 900.0), seed=seed)
    faces = np.flatnonzero(rng.random(coarse.n_faces) < 0.5)
    part = ground_of_faces(coarse, faces)
    fine = divide_by_boxes(part, rules_of(len(faces), 60.0, street_access=0.0), seed=seed)
    together = replace_faces(coarse, faces, fine)
    assert_tiled(together, ground)
    kept = np.setdiff1d(np.arange(coarse.n_faces), faces)
    assert together.n_faces == len(kept) + fine.n_faces
    assert set(together.lineage) == set(coarse.lineage[kept]) | set(fine.lineage)
    np.testing.assert_allclose(frontage_of(together).sum(), frontage_of(coarse).sum())
    assert together.level.max() > coarse.level.max()


def test_no_face_divided_changes_nothing_but_the_order_of_rings():
    ground = ground_of(shapely.box(0, 0, 120, 100))
    coarse = divide_by_boxes(ground, rules_of(1, 900.0), seed=0)
    faces = np.array([2, 0])
    whole = divide_by_boxes(ground_of_faces(coarse, faces), rules_of(2, 9000.0), seed=0)
    same = replace_faces(coarse, faces, whole)
    np.testing.assert_array_equal(same.lineage, coarse.lineage)
    np.testing.assert_array_equal(same.level, coarse.level)
    assert shapely.equals(same.polygons(), coarse.polygons()).all()


def test_two_divided_neighbours_share_what_meets_at_one_place():
    ground = ground_of(shapely.box(0, 0, 60, 40))
    rules = rules_of(1, 1000.0, irregularity=0.0, max_area=2000.0)
    coarse = divide_by_boxes(ground, rules, seed=0)
    assert coarse.n_faces == 2
    faces = np.arange(2)
    part = ground_of_faces(coarse, faces)
    halves = rules_of(2, 500.0, irregularity=0.0, max_area=1100.0, street_access=0.0)
    together = replace_faces(coarse, faces, divide_by_boxes(part, halves, seed=0))
    assert_tiled(together, ground)
    assert together.n_faces == 4
    assert (together.xy[together.vertex] == [30.0, 20.0]).all(axis=1).sum() == 4
    assert len(np.unique(together.vertex)) == 9
