"""What holds of a transfer for any edit of a street network."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from street_edits import town, turned

from urban_processing.persistence.block_match import NONE, match_blocks
from urban_processing.persistence.keys import fingerprints
from urban_processing.persistence.layers import Change
from urban_processing.persistence.transfer import in_blocks, transfer

BASE = town()
_SETTINGS = settings(max_examples=25, deadline=None)


@st.composite
def edits(draw):
    """The town after some edits."""
    after = BASE
    for node in draw(st.lists(st.sampled_from([5, 6, 9, 10]), max_size=3)):
        after = after.moved(node, draw(st.floats(-30, 30)), draw(st.floats(-25, 25)))
    for street in draw(st.lists(st.sampled_from(BASE.streets), max_size=2, unique=True)):
        after = after.with_width(street, draw(st.floats(4, 30)))
    for street in draw(st.lists(st.sampled_from([(5, 6), (6, 10), (9, 10)]), max_size=1)):
        after = after.without_street(street)
    if draw(st.booleans()):
        after = after.with_lots(draw(st.floats(12, 40)), draw(st.floats(20, 50)))
    return after


def carried(before, after, *, old_id=None):
    old, new = in_blocks(*before), in_blocks(*after)
    number = np.arange(1, len(old.polygons) + 1) if old_id is None else old_id
    return transfer(old, number, new)


def state(t):
    return t.parcels(), t.blocks()


@_SETTINGS
@given(edits())
def test_numbers_are_unique_and_the_log_is_complete(after):
    before = state(BASE)
    number = np.random.default_rng(0).permutation(5 * len(before[0]))[: len(before[0])] + 1
    made = carried(before, state(after), old_id=number)
    assert len(np.unique(made.parcel_id)) == len(made.parcel_id)
    fresh = made.source == NONE
    assert (made.parcel_id[fresh] > number.max()).all()
    assert (made.parcel_id[~fresh] == number[made.source[~fresh]]).all()
    log, m = made.changes, len(made.parcel_id)
    assert log.new[:m].tolist() == list(range(m))  # every new parcel has a row of its own
    ended = np.setdiff1d(np.arange(len(number)), made.source)
    assert log.old[m:].tolist() == ended.tolist()  # and every old one that has no successor
    goes_on = np.isin(log.change, [Change.KEPT, Change.MOVED])
    assert (goes_on[:m] == ~fresh).all()
    assert set(log.change[m:]) <= {Change.MERGED, Change.GONE}
    pair = (log.old != NONE) & (log.new != NONE)
    assert (pair == ~np.isin(log.change, [Change.NEW, Change.GONE])).all()
    for share in (log.overlap_old, log.overlap_new):
        assert (np.isnan(share) == ~pair).all()
        assert ((share[pair] >= 0) & (share[pair] <= 1)).all()
    assert (log.overlap_new[log.change == Change.SPLIT] > 0.5).all()
    assert (log.overlap_old[log.change == Change.MERGED] > 0.5).all()
    assert (made.part_of[~fresh] == made.source[~fresh]).all()


@_SETTINGS
@given(edits(), st.randoms(use_true_random=False))
def test_the_order_of_rows_and_the_starts_of_rings_do_not_matter(after, random):
    (p0, b0), (p1, b1) = state(BASE), state(after)
    made = carried((p0, b0), (p1, b1))
    order = [np.array(random.sample(range(len(a)), len(a))) for a in (p0, b0, p1, b1)]
    again = [
        np.array([restarted(g) for g in a[o]]) for a, o in zip((p0, b0, p1, b1), order, strict=True)
    ]
    other = carried(again[:2], again[2:], old_id=order[0] + 1)
    assert (other.parcel_id == made.parcel_id[order[2]]).all()
    assert (other.changes.change[: len(p1)] == made.changes.change[: len(p1)][order[2]]).all()


def restarted(polygon):
    ring = shapely.get_coordinates(polygon.exterior)[:-1]
    return shapely.Polygon(np.roll(ring, len(ring) // 2, axis=0))


@_SETTINGS
@given(
    edits(),
    st.floats(-180, 180),
    st.floats(0.5, 2),
    st.tuples(st.floats(-1000, 1000), st.floats(-1000, 1000)),
)
def test_moving_turning_and_scaling_both_states_changes_nothing(after, angle, scale, shift):
    before, later = state(BASE), state(after)
    made = carried(before, later)
    move = [
        [turned(g, angle, scale=scale, shift=shift) for g in layers] for layers in (before, later)
    ]
    other = carried(*move)
    assert (made.source == other.source).mean() > 0.98  # but for ties
    assert np.isin(other.parcel_id, made.parcel_id).all()


@_SETTINGS
@given(edits())
def test_the_same_layout_again_is_kept(after):
    layout = state(after)
    made = carried(layout, layout)
    assert (made.changes.change == Change.KEPT).all()
    assert made.parcel_id.tolist() == list(range(1, len(layout[0]) + 1))


@_SETTINGS
@given(edits())
def test_blocks_that_did_not_change_keep_their_parcels(after):
    before, later = state(BASE), state(after)
    made = carried(before, later)
    old, new = fingerprints(before[0]), fingerprints(later[0])
    same = np.isin(new, old)
    assert (made.changes.change[: len(new)][same] == Change.KEPT).all()
    assert (old[made.source[same]] == new[same]).all()


@_SETTINGS
@given(edits(), st.floats(-170, 170), st.floats(0.6, 1.6))
def test_blocks_of_a_layout_moved_as_a_whole_are_found(after, angle, scale):
    blocks = after.blocks()
    there = turned(blocks, angle, scale=scale, shift=(50, -30))
    match = match_blocks(blocks, there)
    assert match.parent.tolist() == list(range(len(blocks)))
