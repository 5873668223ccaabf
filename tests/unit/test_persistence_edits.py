"""The six edits of Vanegas 2012, Fig. 7: each parcel stays where a person would look for it."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from street_edits import Town, town

from urban_processing.persistence.block_match import NONE, match_blocks
from urban_processing.persistence.layers import Change
from urban_processing.persistence.transfer import Transfer, in_blocks, transfer

BASE = town()
MIDDLE = np.mean([BASE.nodes[k] for k in (5, 6, 9, 10)], axis=0)
SOUTH = np.mean([BASE.nodes[5], BASE.nodes[6]], axis=0)
NORTH = np.mean([BASE.nodes[9], BASE.nodes[10]], axis=0)


class Edit:
    """A town before and after, and what was carried over."""

    def __init__(self, before: Town, after: Town) -> None:
        self.old, self.new = before.parcels(), after.parcels()
        self.blocks = before.blocks(), after.blocks()
        self.old_id = np.arange(101, 101 + len(self.old))
        self.made: Transfer = transfer(
            in_blocks(self.old, self.blocks[0]), self.old_id, in_blocks(self.new, self.blocks[1])
        )

    def id_at(self, x, y):
        """Number of the old parcel at a place."""
        return self.old_id[shapely.contains_xy(self.old, x, y)][0]

    def now(self, number):
        """The new parcel of a number, or the one that it was merged into."""
        log = self.made.changes
        row = np.flatnonzero((self.old_id[log.old] == number) & (log.change != Change.SPLIT))[0]
        assert log.new[row] != NONE, f"{number} is {log.change[row]}"
        return self.new[log.new[row]]

    def touched(self):
        """Old parcels in blocks whose contour changed."""
        clean = [any(a.equals(b) for b in self.blocks[1]) for a in self.blocks[0]]
        block = shapely.union_all(self.blocks[0][~np.array(clean)])
        return shapely.contains_properly(block.buffer(0.01), self.old)

    def carried(self, rows):
        """Share of some old parcels whose number goes on, of as many as there can be."""
        count = min(rows.sum(), rows.sum() + len(self.new) - len(self.old))
        return np.isin(self.old_id[rows], self.made.parcel_id).sum() / count

    def check_rest_is_kept(self):
        """Nothing changes in blocks that nobody touched."""
        rest = self.old_id[~self.touched()]
        assert len(rest) > 0
        kept = self.made.changes.change == Change.KEPT
        assert set(rest) <= set(self.old_id[self.made.changes.old[kept]])


def test_a_street_vertex_is_moved_to_enclose_a_block():
    with_end = (
        BASE.without_street((5, 6))
        .with_node(16, *SOUTH)
        .with_node(17, *MIDDLE)
        .with_street((5, 16), (6, 16), (16, 17))
    )
    enclosed = with_end.without_street((9, 10)).with_node(17, *NORTH).with_street((9, 17), (10, 17))
    edit = Edit(with_end, enclosed)
    assert [len(blocks) for blocks in edit.blocks] == [9, 10]
    edit.check_rest_is_kept()
    for west in (True, False):  # a house in each of the corners of the block
        for corner in np.array([BASE.nodes[5 if west else 6], BASE.nodes[9 if west else 10]]):
            x, y = corner + 0.3 * (MIDDLE - corner)
            assert edit.now(edit.id_at(x, y)).distance(shapely.Point(x, y)) < BASE.lot[0]
    assert edit.carried(edit.touched()) >= 0.9


def test_b_an_edge_is_moved():
    edit = Edit(BASE, BASE.moved(6, 12, 3).moved(10, 12, -2))
    edit.check_rest_is_kept()
    house = edit.id_at(*(MIDDLE + (0.75 * (np.array(BASE.nodes[6]) - MIDDLE))))
    old, new = edit.old[edit.old_id == house][0].centroid, edit.now(house).centroid
    assert 0 <= new.x - old.x <= 15
    assert abs(new.y - old.y) < 3
    assert edit.carried(edit.touched()) >= 0.9


def curved(base, street, height):
    """A town where a street is an arc."""
    a, b = (np.array(base.nodes[k]) for k in street)
    normal = np.array([-(b - a)[1], (b - a)[0]]) / np.hypot(*(b - a))
    steps = np.linspace(0, 1, 10)[1:-1]
    return base.with_bends(
        street, [tuple(a + s * (b - a) + 4 * s * (1 - s) * height * normal) for s in steps]
    )


@pytest.mark.parametrize("back", [False, True])
def test_c_the_curve_of_two_edges_is_edited(back):
    bent = curved(curved(BASE, (5, 6), 9), (6, 10), 9)
    edit = Edit(bent, BASE) if back else Edit(BASE, bent)
    edit.check_rest_is_kept()
    house = edit.id_at(*(MIDDLE + 0.6 * (np.array(BASE.nodes[9]) - MIDDLE)))
    old = edit.old[edit.old_id == house][0]
    assert edit.now(house).contains(old.centroid)
    assert edit.carried(edit.touched()) >= 0.9


def test_c_one_curve_becomes_another():
    edit = Edit(curved(BASE, (5, 6), 9), curved(BASE, (5, 6), -7).with_bends((6, 10), ()))
    assert edit.carried(edit.touched()) >= 0.9


def test_d_the_width_of_a_street_is_changed():
    wide = BASE.with_width((5, 6), 18).with_width((4, 5), 18).with_width((6, 7), 18)
    edit = Edit(BASE, wide)
    edit.check_rest_is_kept()
    for number in edit.old_id[edit.touched()]:
        if number in edit.made.parcel_id:
            old = edit.old[edit.old_id == number][0]
            assert edit.now(number).centroid.distance(old.centroid) < 18
    assert edit.carried(edit.touched()) >= 0.9


def test_e_the_style_of_subdivision_is_changed():
    edit = Edit(BASE, BASE.with_lots(24, 30))
    corner = np.array(BASE.nodes[5]) + 0.25 * (MIDDLE - np.array(BASE.nodes[5]))
    house = edit.id_at(*corner)
    assert edit.now(house).contains(shapely.Point(corner))
    numbers = np.isin(edit.made.parcel_id, edit.old_id)
    for block in edit.blocks[1]:  # each stays in its block
        inside = shapely.within(shapely.centroid(edit.new), block)
        of_old = edit.made.source[inside & numbers]
        assert shapely.within(shapely.centroid(edit.old[of_old]), block).all()
        count = min(inside.sum(), shapely.within(shapely.centroid(edit.old), block).sum())
        assert (inside & numbers).sum() >= 0.8 * count


@pytest.mark.parametrize(("scale", "angle"), [(1.5, 0), (0.7, 0), (1.2, 35), (1, 90), (1.1, 170)])
def test_f_the_street_network_is_scaled(scale, angle):
    c, s = scale * np.cos(np.radians(angle)), scale * np.sin(np.radians(angle))

    def where(x, y):
        return c * x - s * y + 300, s * x + c * y - 120

    edit = Edit(BASE, BASE.mapped(where).with_lots(18 * scale, 35 * scale))
    assert edit.made.motion.scale == pytest.approx(scale, rel=0.05)
    rows = np.flatnonzero(edit.made.source != NONE)
    assert len(rows) >= 0.9 * min(len(edit.old), len(edit.new))
    old = shapely.get_coordinates(shapely.centroid(edit.old[edit.made.source[rows]]))
    new = shapely.get_coordinates(shapely.centroid(edit.new[rows]))
    off = np.hypot(*(np.column_stack(where(*old.T)) - new).T)
    assert np.quantile(off, 0.95) < 18 * scale  # no farther than the next parcel


def test_f_the_network_is_stretched_one_way():
    edit = Edit(BASE, BASE.mapped(lambda x, y: (1.6 * x, y)).with_lots(18 * 1.6, 35))
    rows = np.flatnonzero(edit.made.source != NONE)
    assert len(rows) >= 0.9 * len(edit.old)
    old = shapely.get_coordinates(shapely.centroid(edit.old[edit.made.source[rows]]))
    new = shapely.get_coordinates(shapely.centroid(edit.new[rows]))
    assert np.abs(1.6 * old[:, 0] - new[:, 0]).max() < 30


def test_a_block_is_split_by_a_new_street():
    split = (
        BASE.without_street((5, 6), (9, 10))
        .with_node(16, *SOUTH)
        .with_node(17, *NORTH)
        .with_street((5, 16), (6, 16), (16, 17), (9, 17), (10, 17))
    )
    edit = Edit(BASE, split)
    edit.check_rest_is_kept()
    rows = np.flatnonzero(shapely.within(shapely.Point(MIDDLE), edit.blocks[0]))
    match = match_blocks(*edit.blocks)
    parts = np.flatnonzero(match.parent == rows[0])
    assert len(parts) == 2
    assert (match.share[match.old == rows[0]] > 0.99).all()
    moved = np.flatnonzero(edit.made.changes.change[: len(edit.new)] == Change.MOVED)
    inside = [edit.new[i].intersects(edit.old[edit.made.source[i]]) for i in moved]
    assert np.mean(inside) >= 0.9
    assert edit.carried(edit.touched()) >= 0.9


def test_two_blocks_are_merged():
    edit = Edit(BASE, BASE.without_street((6, 10)))
    edit.check_rest_is_kept()
    match = match_blocks(*edit.blocks)
    assert sorted(np.bincount(match.new).tolist()) == [1] * 7 + [2]
    touched = edit.touched()
    assert np.isin(edit.old_id[touched], edit.made.parcel_id).mean() >= 0.9
    rows = np.flatnonzero(edit.made.source != NONE)
    inside = shapely.intersects(edit.new[rows], edit.old[edit.made.source[rows]])
    assert inside.mean() >= 0.95


def test_a_neighbourhood_moves_away_while_the_rest_stays():
    rest, part = town(4).blocks(), town(2, wobble=14).blocks()

    def beside(x):
        return np.append(rest, shapely.transform(part, lambda xy: xy + np.array([x, 40.0])))

    match = match_blocks(beside(700), beside(1500))
    assert match.parent.tolist() == list(range(20))
    assert len(match.motions) == 2
    assert match.motions[1].points(np.zeros((1, 2)))[0] == pytest.approx([800, 0], abs=1e-6)
