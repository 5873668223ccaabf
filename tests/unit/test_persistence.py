from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from street_edits import rows_of_lots, town, turned

from urban_processing.blocks.model import Blocks, plain_blocks
from urban_processing.errors import BoundaryError
from urban_processing.persistence.block_match import NONE, carry_block_columns, match_blocks
from urban_processing.persistence.contours import corners_of
from urban_processing.persistence.keys import block_key, block_keys
from urban_processing.persistence.layers import Change
from urban_processing.persistence.relative import assign, relative_coordinates
from urban_processing.persistence.transfer import ParcelsInBlocks, in_blocks, labelled, transfer
from urban_processing.site import Frame


def grid(columns, rows, *, width=20.0, depth=30.0, at=(0.0, 0.0)):
    """Parcels of a block, row by row."""
    x, y = at
    return np.array(
        [
            shapely.box(x + i * width, y + j * depth, x + (i + 1) * width, y + (j + 1) * depth)
            for j in range(rows)
            for i in range(columns)
        ],
        dtype=object,
    )


def restarted(polygon, steps):
    """The same polygon from another starting vertex."""
    ring = shapely.get_coordinates(polygon.exterior)[:-1]
    return shapely.Polygon(np.roll(ring, steps, axis=0), polygon.interiors)


def with_collinear(polygon):
    """The same polygon with a vertex more in the middle of each edge."""
    return shapely.segmentize(polygon, polygon.length / len(polygon.exterior.coords) / 3)


def codes(changes):
    return {c.value: changes.count(c) for c in Change if changes.count(c)}


# --- contours and keys ---------------------------------------------------------------------


def rings(polygon):
    return plain_blocks(np.array([polygon], dtype=object)).rings


@pytest.mark.parametrize("steps", range(5))
def test_corners_leave_out_collinear_vertices_wherever_the_ring_starts(steps):
    block = restarted(with_collinear(town().blocks()[4]), steps)
    found = rings(block).xy[corners_of(rings(block), 0.01)]
    want = shapely.get_coordinates(town().blocks()[4])[:-1]
    assert {tuple(p) for p in found} == {tuple(p) for p in want}


def test_a_gentle_curve_keeps_its_shape():
    circle = shapely.Point(0, 0).buffer(100, quad_segs=500)  # each vertex 2 mm off its neighbours
    ring = rings(circle)
    corner = corners_of(ring, 0.05)
    assert 40 < len(corner) < 400
    thin = shapely.Polygon(ring.xy[corner])
    assert shapely.hausdorff_distance(thin, circle) < 0.5


def test_a_spike_is_no_collinear_vertex():
    spike = shapely.Polygon([(0, 0), (10, 0), (10, 5), (30, 5), (10, 5.0001), (10, 10), (0, 10)])
    assert len(corners_of(rings(spike), 0.01)) >= 5
    assert [30, 5] in rings(spike).xy[corners_of(rings(spike), 0.01)].tolist()


def test_a_flat_ring_keeps_three_vertices():
    flat = shapely.Polygon([(0, 0), (50, 0), (100, 0), (50, 0.0001)])
    assert len(corners_of(rings(flat), 0.01)) == 3


def test_the_key_of_a_block_does_not_depend_on_start_direction_and_collinear_vertices():
    for block in town().blocks():
        key = block_key(block, {"min_area": 400.0})
        for other in (restarted(block, 2), block.reverse(), with_collinear(block)):
            assert block_key(other, {"min_area": 400}) == key


def test_the_key_of_a_block_changes_with_contour_and_attributes():
    block = shapely.box(0, 0, 100, 80)
    hole = block.difference(shapely.box(20, 20, 30, 30))
    other_hole = block.difference(shapely.box(20, 20, 30, 31))
    values = [{}, {"a": 1}, {"a": 2}, {"a": "1"}, {"a": True}, {"b": 1}]
    keys = {block_key(block, v) for v in values}
    keys |= {block_key(b, {}) for b in (hole, other_hole, shapely.box(0, 0, 100, 80.01))}
    assert len(keys) == 9
    assert block_key(block, {"a": None}) == block_key(block, {"a": float("nan")})
    assert block_key(shapely.box(-0.0, 0, 1, 1), {}) == block_key(shapely.box(0, -0.0, 1, 1), {})


def with_edges(blocks, **values):
    return Blocks(**{**{k: getattr(blocks, k) for k in blocks.__dataclass_fields__}, **values})


def test_keys_tell_of_streets_by_place_not_by_number():
    polygons = np.array([shapely.box(0, 0, 100, 80), shapely.box(120, 0, 220, 80)], dtype=object)
    plain = plain_blocks(shapely.orient_polygons(polygons))
    street = np.array([5, 5, 9, 7, 5, 1, 2, 3])
    keys = block_keys(with_edges(plain, edge_street=street))
    again = np.array([1, 1, 4, 2, 8, 5, 6, 7])
    assert (block_keys(with_edges(plain, edge_street=again)) == keys).all()
    other = np.array([1, 1, 1, 2, 8, 5, 6, 7])  # two streets have become one
    assert (block_keys(with_edges(plain, edge_street=other)) != keys).tolist() == [True, False]
    width = np.array([12.0, 12, 12, 12, 12, 12, 12, 9])
    changed = block_keys(with_edges(plain, edge_street=street, edge_width=width))
    assert (changed != keys).all()


def test_a_collinear_vertex_where_the_street_changes_belongs_to_the_key():
    ring = [(0, 0), (50, 0), (100, 0), (100, 80), (0, 80)]
    plain = plain_blocks(np.array([shapely.Polygon(ring)], dtype=object))
    same = with_edges(plain, edge_width=np.array([12.0, 12, 9, 9, 9]))
    less = plain_blocks(np.array([shapely.Polygon([ring[0], *ring[2:]])], dtype=object))
    less = with_edges(less, edge_width=np.array([12.0, 9, 9, 9]))
    assert block_keys(same)[0] == block_keys(less)[0]
    other = with_edges(plain, edge_width=np.array([12.0, 9, 9, 9, 9]))
    assert block_keys(other)[0] != block_keys(less)[0]


def test_keys_are_of_the_place_on_the_map():
    polygon = np.array([shapely.box(0, 0, 100, 80)], dtype=object)
    moved = np.array([shapely.box(-1000, 500, -900, 580)], dtype=object)
    here = plain_blocks(polygon, frame=Frame("EPSG:32630", (500_000.0, 4_000_000.0)))
    there = plain_blocks(moved, frame=Frame("EPSG:32630", (501_000.0, 3_999_500.0)))
    assert block_keys(here)[0] == block_keys(there)[0]
    assert block_keys(plain_blocks(polygon))[0] != block_keys(here)[0]


def test_keys_of_five_thousand_blocks_take_less_than_a_second():
    polygons = np.array([shapely.box(0, y, 90, y + 60) for y in range(0, 400_000, 80)])
    blocks = plain_blocks(polygons, columns={"min_area": np.full(5000, 400.0)})
    start = time.perf_counter()
    assert len(set(block_keys(blocks).tolist())) == 5000
    assert time.perf_counter() - start < 1.0


# --- positions ------------------------------------------------------------------------------


def test_relative_coordinates_add_up_to_one_and_know_no_motion():
    rng = np.random.default_rng(0)
    points, vertices = rng.uniform(0, 100, (20, 2)), rng.uniform(0, 100, (5, 2))
    found = relative_coordinates(points, vertices)
    assert found.sum(axis=1) == pytest.approx(1)
    turn = 3.0 * np.array([[0.6, -0.8], [0.8, 0.6]])
    again = relative_coordinates(points @ turn.T + 500, vertices @ turn.T + 500)
    assert again == pytest.approx(found)


def test_what_is_farther_than_the_next_parcel_is_another_one():
    corners = np.array([[0.0, 0], [100, 0], [100, 50], [0, 50]])
    row = np.array([[x, 25.0] for x in (10, 20, 30, 40, 50)])
    new = np.array([[x, 25.0] for x in (12, 65, 75, 85)])
    a, b, d = assign(relative_coordinates(row, corners), relative_coordinates(new, corners))
    assert (a.tolist(), b.tolist()) == ([0], [0])
    assert 0 < d[0] < 0.1


def test_many_parcels_are_matched_like_few(monkeypatch):
    rng = np.random.default_rng(3)
    corners = np.array([[0.0, 0], [300, 0], [320, 200], [0, 180]])
    x, y = np.meshgrid(np.arange(10, 300, 15), np.arange(10, 180, 20))
    old = np.column_stack([x.ravel(), y.ravel()])
    new = old[rng.permutation(len(old))[:140]] + rng.normal(0, 4, (140, 2))
    positions = relative_coordinates(old, corners), relative_coordinates(new, corners)
    dense = assign(*positions)
    monkeypatch.setattr("urban_processing.persistence.relative._DENSE", 1)
    sparse = assign(*positions)
    assert len(dense[0]) > 100
    assert dict(zip(*dense[:2], strict=True)) == dict(zip(*sparse[:2], strict=True))
    assert np.sort(dense[2]) == pytest.approx(np.sort(sparse[2]))


# --- transfer -------------------------------------------------------------------------------


def test_a_block_extracted_again_matches_itself():
    blocks, parcels = town().blocks(), town().parcels()
    again = np.array([with_collinear(restarted(b, 1)) for b in blocks], dtype=object)
    others = np.array([with_collinear(restarted(p, 2)) for p in parcels], dtype=object)
    number = np.random.default_rng(1).permutation(len(parcels)) + 1
    made = transfer(in_blocks(parcels, blocks), number, in_blocks(others, again))
    assert (made.parcel_id == number).all()
    assert codes(made.changes) == {"kept": len(parcels)}
    assert (made.changes.distance == 0).all()
    match = match_blocks(blocks, again)
    assert match.parent.tolist() == list(range(len(blocks)))


@pytest.mark.parametrize("start", range(4))
def test_the_starting_vertex_of_a_changed_block_does_not_matter(start):
    old, new = shapely.box(0, 0, 120, 60), shapely.box(0, 0, 132, 63)
    cells = grid(6, 2), grid(6, 2, width=22, depth=31.5)
    made = transfer(
        in_blocks(cells[0], np.array([old])),
        np.arange(1, 13),
        in_blocks(cells[1], np.array([with_collinear(restarted(new, start))])),
    )
    assert made.parcel_id.tolist() == list(range(1, 13))
    assert codes(made.changes) == {"moved": 12}


def test_every_kind_of_change_is_told():
    old = np.concatenate([grid(3, 1), grid(2, 1, at=(200, 0)), grid(1, 1, at=(400, 0))])
    new = np.concatenate(
        [
            [shapely.box(0, 0, 20, 30)],  # kept
            [shapely.box(20, 0, 32, 30), shapely.box(32, 0, 40, 30)],  # split in two
            [shapely.box(40, 0, 60, 28)],  # another shape
            [shapely.box(200, 0, 240, 30)],  # merged of two
            grid(1, 1, at=(600, 0)),  # new; that at 400 is gone
        ]
    )
    number = np.array([1, 2, 3, 4, 5, 6])
    made = transfer(in_blocks(old), number, in_blocks(new))
    log = made.changes
    rows = [
        (c, number[a] if a != NONE else None, int(made.parcel_id[b]) if b != NONE else None)
        for c, a, b in zip(log.change, log.old, log.new, strict=True)
    ]
    assert rows == [
        ("kept", 1, 1),
        ("moved", 2, 2),
        ("split", 2, 7),
        ("moved", 3, 3),
        ("moved", made.parcel_id[4], made.parcel_id[4]),
        ("new", None, 8),
        ("merged", 9 - made.parcel_id[4], made.parcel_id[4]),
        ("gone", 6, None),
    ]
    assert log.overlap_old[:4] == pytest.approx([1, 0.6, 0.4, 28 / 30])
    assert log.overlap_new[:4] == pytest.approx([1, 1, 1, 1])
    assert log.overlap_old[6] == pytest.approx(1)
    assert log.overlap_new[6] == pytest.approx(0.5)
    assert np.isnan(log.overlap_old[[5, 7]]).all()


def test_parcels_without_counterpart_still_say_where_they_would_inherit_from():
    old, new = grid(3, 1), grid(6, 1, width=10)
    made = transfer(in_blocks(old), np.array([1, 2, 3]), in_blocks(new))
    assert sorted(made.parcel_id.tolist()) == [1, 2, 3, 4, 5, 6]
    assert made.part_of.tolist() == [0, 0, 1, 1, 2, 2]
    assert made.nearest.tolist() == [0, 0, 1, 1, 2, 2]


def test_numbers_are_unique_and_new_ones_above_all_old_ones():
    old, new = grid(3, 2), grid(5, 2, width=12)
    number = np.array([40, 7, 1000, 3, 2, 900])
    made = transfer(in_blocks(old), number, in_blocks(new))
    assert len(np.unique(made.parcel_id)) == 10
    fresh = made.parcel_id[made.source == NONE]
    assert sorted(fresh.tolist()) == list(range(1001, 1001 + len(fresh)))
    assert (made.parcel_id[made.source != NONE] == number[made.source[made.source != NONE]]).all()


def test_layers_of_different_places_have_nothing_in_common():
    old, new = town(3).parcels(), grid(4, 1, at=(1e5, 1e5))
    made = transfer(in_blocks(old), np.arange(1, len(old) + 1), in_blocks(new))
    fates = codes(made.changes)
    assert sum(fates.values()) == fates["gone"] + fates.get("moved", 0) + fates.get("new", 0)


def test_no_parcels_before_or_after():
    some, none = grid(2, 1), np.empty(0, dtype=object)
    made = transfer(in_blocks(none), np.empty(0, dtype=np.int64), in_blocks(some))
    assert made.parcel_id.tolist() == [1, 2]
    assert codes(made.changes) == {"new": 2}
    made = transfer(in_blocks(some), np.array([5, 6]), in_blocks(none))
    assert codes(made.changes) == {"gone": 2}


def test_parcels_outside_all_blocks_make_blocks_of_their_own():
    inside, outside = grid(3, 1), grid(2, 1, at=(100, 0))
    found = in_blocks(np.concatenate([inside, outside]), np.array([shapely.box(0, 0, 60, 30)]))
    assert found.block.tolist() == [0, 0, 0, 1, 1]
    assert found.blocks[1].equals(shapely.box(100, 0, 140, 30))


def test_labels_are_as_good_as_polygons_of_blocks():
    before, after = town(), town().moved(6, 10, 4)
    number = np.arange(1, len(before.parcels()) + 1)
    with_blocks = transfer(
        in_blocks(before.parcels(), before.blocks()),
        number,
        in_blocks(after.parcels(), after.blocks()),
    )
    label = [in_blocks(t.parcels(), t.blocks()).block for t in (before, after)]
    with_labels = transfer(
        labelled(before.parcels(), label[0]), number, labelled(after.parcels(), label[1])
    )
    touching = transfer(in_blocks(before.parcels()), number, in_blocks(after.parcels()))
    assert (with_blocks.parcel_id == with_labels.parcel_id).all()
    assert (with_blocks.parcel_id == touching.parcel_id).all()


def test_parcels_that_do_not_fit_exactly_have_an_outline():
    apart = np.array([shapely.box(20 * i + 0.004 * (i % 2), 0, 20 * i + 20, 30) for i in range(5)])
    found = in_blocks(apart)
    assert (found.block == 0).all()
    outline = found.outlines(np.array([0]))[0]
    assert outline.area == pytest.approx(3000, rel=1e-3)


def test_a_whole_land_of_touching_parcels_is_one_block():
    blocks = rows_of_lots(shapely.box(0, 0, 1500, 1200), 30, 40)
    new = blocks.copy()
    a, b = 700, 701
    new = np.append(np.delete(new, [a, b]), [shapely.union(blocks[a], blocks[b])])
    assert len(blocks) > 1000
    made = transfer(in_blocks(blocks), np.arange(1, len(blocks) + 1), in_blocks(new))
    assert codes(made.changes) == {"kept": len(blocks) - 2, "moved": 1, "merged": 1}


# --- blocks ---------------------------------------------------------------------------------


def test_columns_of_blocks_go_to_both_parts_and_own_values_stay():
    whole = np.array([shapely.box(0, 0, 100, 60), shapely.box(120, 0, 200, 60)], dtype=object)
    parts = np.array(
        [
            shapely.box(0, 0, 45, 60),
            shapely.box(55, 0, 100, 60),
            shapely.box(120, 0, 200, 66),
            shapely.box(500, 0, 600, 60),
        ],
        dtype=object,
    )
    old = plain_blocks(
        whole,
        block_id=np.array([11, 12]),
        columns={
            "min_area": np.array([300.0, 500.0]),
            "strategy": np.array(["obb", "skeleton"], dtype=object),
            "seed": np.array([1, 2]),
        },
    )
    own = {"min_area": np.array([np.nan, 250.0, np.nan, np.nan])}
    columns, source = carry_block_columns(old, plain_blocks(parts, columns=own))
    assert source.tolist() == [11, 11, 12, NONE]
    assert columns["min_area"][:3].tolist() == [300, 250, 500]
    assert np.isnan(columns["min_area"][3])
    assert columns["strategy"].tolist() == ["obb", "obb", "skeleton", None]
    assert columns["seed"].tolist() == [1, 1, 2, None]


def test_blocks_of_other_origins_are_compared_on_the_map_and_of_other_crs_not_at_all():
    polygon = np.array([shapely.box(0, 0, 100, 60)], dtype=object)
    value = {"min_area": np.array([300.0])}
    old = plain_blocks(polygon, frame=Frame("EPSG:32630", (100.0, 0.0)), columns=value)
    moved = shapely.transform(polygon, lambda xy: xy + np.array([100, 0]))
    columns, source = carry_block_columns(old, plain_blocks(moved, frame=Frame("EPSG:32630")))
    assert source.tolist() == [1]
    assert columns["min_area"].tolist() == [300]
    with pytest.raises(BoundaryError, match="different CRSs"):
        carry_block_columns(old, plain_blocks(moved, frame=Frame("EPSG:32631")))


def test_a_merged_block_inherits_from_the_larger():
    old = np.array([shapely.box(0, 0, 40, 60), shapely.box(50, 0, 150, 60)], dtype=object)
    match = match_blocks(old, np.array([shapely.box(0, 0, 150, 60)], dtype=object))
    assert match.parent.tolist() == [1]
    assert match.old.tolist() == [1, 0]


def test_a_single_block_turned_and_moved_is_followed():
    block = shapely.Polygon([(0, 0), (120, 10), (110, 70), (40, 90), (-10, 50)])
    cells = rows_of_lots(block, 18, 30)
    there = turned(cells, 50, scale=1.3, shift=(900, 300))
    made = transfer(
        in_blocks(cells, np.array([block])),
        np.arange(1, len(cells) + 1),
        in_blocks(there, turned([block], 50, scale=1.3, shift=(900, 300))),
    )
    assert made.parcel_id.tolist() == list(range(1, len(cells) + 1))
    assert made.changes.distance == pytest.approx(0, abs=1e-6)


def test_a_block_of_a_hundred_parcels_takes_some_milliseconds():
    old, new = grid(50, 2, width=10), grid(50, 2, width=10.3, depth=31)
    state = [
        ParcelsInBlocks(p, np.zeros(100, dtype=np.int64), np.array([b]))
        for p, b in ((old, shapely.box(0, 0, 500, 60)), (new, shapely.box(0, 0, 515, 62)))
    ]
    seconds = []
    for _ in range(10):
        start = time.perf_counter()
        made = transfer(state[0], np.arange(1, 101), state[1])
        seconds.append(time.perf_counter() - start)
    assert made.parcel_id.tolist() == list(range(1, 101))
    assert min(seconds) < 0.05  # some 10 ms on an idle core
