"""Blocks to parcels by oriented boxes: what must hold for every block."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from parcel_grounds import (
    REAL,
    assert_tiled,
    blocks_of_network,
    frontage_of,
    ground_of,
    polygons_of,
    rectilinear,
    rules_of,
    star,
    with_holes,
    with_tiny_edges,
)

from urban_processing.access_rule import reached_frontage
from urban_processing.parcelling.boxes import divide
from urban_processing.parcelling.boxes.divide import divide_by_boxes
from urban_processing.parcelling.ground import join_parts

NETWORKS = Path(__file__).parents[3] / "shared" / "data" / "redistributable" / "networks"
SHAPES = {
    "star": star,
    "rectilinear": rectilinear,
    "with_holes": lambda rng, n: with_holes(rng, n % 5 + 1),
    "with_tiny_edges": lambda rng, n: with_tiny_edges(rng, n % 4 + 1),
}
WHOLE = 1 - 1e-9


def same_shapes(one, other, *, within):
    """Whether two divisions of the same land are the same but for the order."""
    a, b = one.polygons(), other.polygons()
    if len(a) != len(b):
        return False
    tree = shapely.STRtree(b)
    i, j = tree.query(a, predicate="intersects")
    both = shapely.area(shapely.intersection(a[i], b[j]))
    best = np.zeros(len(a))
    np.maximum.at(best, i, both)
    return bool((shapely.area(a) - best <= within * shapely.length(a)).all())


@settings(max_examples=80, deadline=None)
@given(
    kind=st.sampled_from(sorted(SHAPES)),
    seed=st.integers(0, 10**6),
    n=st.integers(3, 24),
    min_area=st.sampled_from([100.0, 200.0, 400.0]),
    irregularity=st.sampled_from([0.0, 0.3, 1.0]),
    street_access=st.sampled_from([0.0, 0.5, 1.0]),
)
def test_every_shape_is_tiled_and_no_parcel_too_small(
    kind, seed, n, min_area, irregularity, street_access
):
    ground = ground_of(SHAPES[kind](np.random.default_rng(seed), n))
    rules = rules_of(1, min_area, irregularity=irregularity, street_access=street_access)
    pieces = divide_by_boxes(ground, rules, seed=seed)
    assert_tiled(pieces, ground)
    area = shapely.area(pieces.polygons())
    if len(area) > 1:
        assert area.min() >= min_area * WHOLE
    else:
        assert pieces.lineage[0] == ground.lineage[0]
    if street_access == 1.0:
        assert (frontage_of(pieces) >= reached_frontage(area) - 2e-6).all()


@settings(max_examples=60, deadline=None)
@given(seed=st.integers(0, 10**6), n=st.integers(3, 12), share=st.sampled_from([2.0, 2.5, 4.0]))
def test_without_wishes_for_width_and_access_a_convex_block_keeps_the_largest_area(seed, n, share):
    block = shapely.convex_hull(star(np.random.default_rng(seed), n))
    rules = rules_of(1, 100.0, max_area=100.0 * share, min_width=0.0, street_access=0.0)
    pieces = divide_by_boxes(ground_of(block), rules, seed=seed)
    area = shapely.area(pieces.polygons())
    assert area.max() <= 100.0 * share * (1 + 1e-8)


def test_a_front_wider_than_allowed_is_halved():
    ground = ground_of(shapely.box(0, 0, 64, 30))
    given = {"max_area": 5000.0, "min_width": 5.0, "irregularity": 0.0}
    wide = divide_by_boxes(ground, rules_of(1, 100.0, max_width=100.0, **given), seed=0)
    assert wide.n_faces == 1
    fronts = divide_by_boxes(ground, rules_of(1, 100.0, max_width=33.0, **given), seed=0)
    assert fronts.n_faces == 2
    np.testing.assert_allclose(shapely.area(fronts.polygons()), 960.0)


def test_parcels_at_the_back_are_made_only_where_access_does_not_matter():
    ground = ground_of([shapely.box(0, 0, 160, 120), shapely.box(200, 0, 330, 140)])
    none, half, all_ = (
        divide_by_boxes(ground, rules_of(2, street_access=xi, min_width=1.0), seed=4)
        for xi in (0.0, 0.5, 1.0)
    )
    back = [np.mean(frontage_of(pieces) == 0) for pieces in (none, half, all_)]
    assert back[2] == 0
    assert back[0] > 0.25
    assert back[0] > back[1] > back[2]


def test_inside_a_block_without_streets_access_plays_no_role():
    box = shapely.box(0, 0, 80, 80)
    ground = ground_of(box, access=np.zeros(4, dtype=bool))
    pieces = divide_by_boxes(ground, rules_of(1, irregularity=0.0), seed=0)
    assert pieces.n_faces == 8
    assert not pieces.access.any()


def test_a_deep_parcel_that_no_cut_gives_access_stays_whole():
    # reached by a short side alone, and too narrow for two fronts
    ground = ground_of(shapely.box(0, 0, 8, 100), access=np.array([True, False, False, False]))
    assert ground.rings.xy[0].tolist() == [0.0, 0.0]
    rules = rules_of(1, 100.0, min_width=1.0, max_width=20.0)
    narrow = divide_by_boxes(ground, replace(rules, min_width=np.array([12.0])), seed=0)
    assert narrow.n_faces == 1
    free = divide_by_boxes(ground, replace(rules, street_access=np.array([0.0])), seed=0)
    assert free.n_faces > 1
    strips = divide_by_boxes(ground, rules, seed=0)
    assert strips.n_faces > 1
    assert (frontage_of(strips) > 0).all()


def test_blocks_smaller_than_two_smallest_parcels_stay_whole():
    ground = ground_of([shapely.box(0, 0, 10, 10), shapely.box(50, 0, 75, 30)])
    pieces = divide_by_boxes(ground, rules_of(2, max_area=401.0), seed=0)
    np.testing.assert_array_equal(pieces.block, [0, 1])
    np.testing.assert_array_equal(pieces.level, [0, 0])
    np.testing.assert_array_equal(pieces.lineage, ground.lineage)


def test_a_block_of_twice_the_smallest_area_is_halved():
    ground = ground_of(shapely.box(0, 0, 40, 20))
    pieces = divide_by_boxes(ground, rules_of(1, 400.0, max_area=500.0, irregularity=1.0), seed=0)
    np.testing.assert_array_equal(shapely.area(pieces.polygons()), [400.0, 400.0])


def test_cuts_go_through_a_near_corner_of_the_contour():
    notched = shapely.Polygon([(0, 0), (51, 0), (52, 2), (53, 0), (100, 0), (100, 40), (0, 40)])
    given = {"irregularity": 0.0, "max_area": 3500.0, "max_width": 1000.0}
    snapped = divide_by_boxes(ground_of(notched), rules_of(1, snap=1.5, **given), seed=0)
    plain = divide_by_boxes(ground_of(notched), rules_of(1, snap=0.5, **given), seed=0)
    np.testing.assert_array_equal(snapped.xy[7:], [[51.0, 40.0]])
    assert sorted(plain.xy[7:].tolist()) == [[50.0, 0.0], [50.0, 40.0]]


def test_holes_are_opened_by_the_first_cuts():
    ring = shapely.box(0, 0, 100, 60).difference(shapely.box(60, 25, 70, 35))
    ground = ground_of(ring)
    for seed in range(5):
        pieces = divide_by_boxes(ground, rules_of(1), seed=seed)
        assert_tiled(pieces, ground)
        assert (shapely.get_num_interior_rings(pieces.polygons()) == 0).all()


def test_streets_along_a_cut_belong_to_the_piece_they_bound():
    # the middle cut runs along the street at (30, 45) and leaves the land west of it without
    step = shapely.Polygon([(0, 0), (60, 0), (60, 60), (30, 60), (30, 30), (0, 30)])
    rings = ground_of(step).rings
    middle = ((rings.xy + rings.xy[rings.following]) / 2).tolist()
    access = np.array([side in ([30.0, 45.0], [60.0, 30.0]) for side in middle])
    assert access.sum() == 2
    rules = rules_of(1, 500.0, irregularity=0.0, min_width=1.0)
    pieces = divide_by_boxes(ground_of(step, access=access), rules, seed=0)
    assert pieces.n_faces > 1
    assert (frontage_of(pieces) > 0).all()


def test_a_hole_that_touches_the_contour_leaves_valid_parcels():
    shell = [(0, 0), (60, 0), (120, 0), (120, 70), (0, 70)]
    touching = shapely.Polygon(shell, [[(60, 0), (50, 30), (70, 30)]])
    assert shapely.is_valid(touching)
    ground = ground_of(touching)
    for xi in (0.0, 1.0):
        pieces = divide_by_boxes(ground, rules_of(1, 200.0, street_access=xi), seed=1)
        assert_tiled(pieces, ground)
        assert pieces.n_faces > 10


def some_blocks():
    rng = np.random.default_rng(5)
    shapes = [kind(rng, n) for n in (5, 9, 14) for _, kind in sorted(SHAPES.items())]
    return [shape for shape in shapes if shapely.area(shape) > 500]


def test_the_same_seed_gives_the_same_bytes_and_another_one_other_parcels():
    ground = ground_of(some_blocks())
    rules = rules_of(len(ground), 100.0)
    one, two, other = (divide_by_boxes(ground, rules, seed=seed) for seed in (1, 1, 2))
    for name in ("xy", "vertex", "offsets", "face", "access", "block", "lineage", "level"):
        np.testing.assert_array_equal(getattr(one, name), getattr(two, name))
    assert not same_shapes(one, other, within=1e-3)


def test_blocks_are_divided_apart_as_together():
    ground = ground_of(some_blocks())
    rules = rules_of(len(ground), 100.0, street_access=0.5)
    whole = divide_by_boxes(ground, rules, seed=1)
    parts = [
        (rows, divide_by_boxes(ground.of(rows), rules.of(rows), seed=1))
        for rows in np.array_split(np.arange(len(ground)), 3)
    ]
    joined = join_parts(parts, ground)
    assert_tiled(joined, ground)
    np.testing.assert_array_equal(joined.lineage, whole.lineage)
    np.testing.assert_array_equal(joined.level, whole.level)
    np.testing.assert_array_equal(joined.offsets, whole.offsets)
    np.testing.assert_array_equal(joined.xy[joined.vertex], whole.xy[whole.vertex])


def test_how_many_are_worked_on_at_once_does_not_matter(monkeypatch):
    ground = ground_of(some_blocks())
    rules = rules_of(len(ground), 100.0)
    one = divide_by_boxes(ground, rules, seed=1)
    monkeypatch.setattr(divide, "PARCELS_AT_ONCE", 100)
    two = divide_by_boxes(ground, rules, seed=1)
    assert_tiled(two, ground)
    np.testing.assert_array_equal(one.lineage, two.lineage)
    np.testing.assert_array_equal(one.xy[one.vertex], two.xy[two.vertex])


def test_where_a_ring_starts_does_not_matter():
    ground = ground_of(some_blocks())
    rules = rules_of(len(ground), 100.0, street_access=0.5)
    turned = []
    for polygon in polygons_of(ground):
        rings = [np.roll(np.array(polygon.exterior.coords)[:-1], 2, axis=0)]
        rings += [np.roll(np.array(hole.coords)[:-1], 1, axis=0) for hole in polygon.interiors]
        turned.append(shapely.Polygon(rings[0], rings[1:]))
    other = ground_of(turned, keep_order=True)
    assert not np.array_equal(other.rings.xy, ground.rings.xy)
    one = divide_by_boxes(ground, rules, seed=1)
    two = divide_by_boxes(other, rules, seed=1)
    np.testing.assert_array_equal(one.lineage, two.lineage)
    np.testing.assert_array_equal(one.xy[one.vertex], two.xy[two.vertex])


@pytest.mark.parametrize("street_access", [0.0, 0.5, 1.0])
def test_a_vertex_more_on_a_straight_side_does_not_matter(street_access):
    ground = ground_of([shape for shape in some_blocks() if not len(shape.interiors)])
    rules = rules_of(len(ground), 100.0, street_access=street_access)
    denser = []
    for polygon in polygons_of(ground):
        points = np.array(polygon.exterior.coords)
        middle = np.round((points[0] * 0.7 + points[1] * 0.3) * 2**20) / 2**20
        denser.append(shapely.Polygon(np.insert(points, 1, middle, axis=0)))
    one = divide_by_boxes(ground, rules, seed=1)
    two = divide_by_boxes(ground_of(denser), rules, seed=1)
    np.testing.assert_array_equal(one.lineage, two.lineage)
    assert same_shapes(one, two, within=1e-5)


@pytest.mark.parametrize("quarters", [1, 2, 3])
def test_turned_blocks_have_turned_parcels(quarters):
    rng = np.random.default_rng(8)
    shapes = [star(rng, 9) for _ in range(12)]
    rules = rules_of(12, 100.0, irregularity=0.0)
    one = divide_by_boxes(ground_of(shapes), rules, seed=1)
    turn = np.linalg.matrix_power(np.array([[0.0, -1.0], [1.0, 0.0]]), quarters)
    turned = [shapely.transform(shape, lambda xy: xy @ turn.T) for shape in shapes]
    two = divide_by_boxes(ground_of(turned), rules, seed=1)
    back = replace(two, xy=two.xy @ turn)
    assert same_shapes(one, back, within=1e-6)


def test_blocks_turned_by_any_angle_have_about_as_many_parcels():
    rng = np.random.default_rng(3)
    shapes = [star(rng, 8) for _ in range(40)]
    rules = rules_of(40, 60.0)
    count = []
    for angle in (0.0, 17.0, 45.0, 101.0):
        turned = [shapely.affinity.rotate(shape, angle, origin=(0, 0)) for shape in shapes]
        count.append(divide_by_boxes(ground_of(turned), rules, seed=1).n_faces)
    assert max(count) <= 1.06 * min(count)


def test_an_edit_changes_parcels_nearby_alone():
    corners = [(0, 0), (140, 0), (150, 0), (160, 0), (200, 0), (200, 90), (100, 91), (0, 90)]
    edited = [(0, 0), (140, 0), (150, 2), (160, 0), (200, 0), (200, 90), (100, 91), (0, 90)]
    rules = rules_of(1)
    one, two = (
        divide_by_boxes(ground_of(shapely.Polygon(points)), rules, seed=6)
        for points in (corners, edited)
    )
    before, after = one.polygons(), two.polygons()
    kept = [bool((shapely.hausdorff_distance(after, face) < 1e-6).any()) for face in before]
    moved = before[~np.array(kept)]
    assert one.n_faces > 20
    assert 0 < len(moved) < 0.5 * len(before)
    assert shapely.bounds(moved)[:, 0].min() > 90


@pytest.mark.parametrize("name", REAL)
def test_blocks_of_real_networks(name):
    if not (NETWORKS / f"{name}.gpkg").exists():
        pytest.skip("no such network here")
    ground = ground_of(blocks_of_network(name, NETWORKS))
    for xi, above in ((1.0, 0.03), (0.0, 0.005)):
        pieces = divide_by_boxes(ground, rules_of(len(ground), street_access=xi), seed=2)
        assert_tiled(pieces, ground)
        area = shapely.area(pieces.polygons())
        assert area.min() >= 400.0 * WHOLE
        assert np.mean(area > 1000.0) <= above
        reached = frontage_of(pieces) >= reached_frontage(area) - 2e-6
        assert reached.all() if xi == 1.0 else not reached.all()
