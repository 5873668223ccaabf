"""The numbers of parcels carried over from one state of a layout to the next."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.persistence.block_match import NONE, match_blocks, same_shape
from urban_processing.persistence.changes import Changes, Overlaps, changes_of, overlaps
from urban_processing.persistence.dissolve import dissolved, touching
from urban_processing.persistence.keys import fingerprints
from urban_processing.persistence.landmarks import landmarks_of
from urban_processing.persistence.motion import Motion
from urban_processing.persistence.relative import (
    assign,
    position_distances,
    relative_coordinates,
)

ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class ParcelsInBlocks:
    """One state of a layout: n parcels in B blocks.

    Parameters
    ----------
    polygons
        (n,) valid polygons or multipolygons.
    block
        (n,) row of the block that each lies in, 0 to B - 1.
    blocks
        (B,) polygons of the blocks; None where they are to be made of the parcels.
    """

    polygons: ObjectArray
    block: IntArray
    blocks: ObjectArray | None = None

    def outlines(self, rows: IntArray) -> ObjectArray:
        """Polygons of some blocks."""
        if self.blocks is not None:
            return self.blocks[rows]
        made = [dissolved(self.polygons[self.members([row])]) for row in rows.tolist()]
        return np.array(made, dtype=object)

    def members(self, rows: Iterable[int]) -> IntArray:
        """Parcels of some blocks."""
        order, first = self._by_block
        return np.concatenate([order[first[row] : first[row + 1]] for row in rows])

    @cached_property
    def _by_block(self) -> tuple[IntArray, IntArray]:
        """Parcels block by block, and where each block begins."""
        order = np.argsort(self.block, kind="stable")
        last = self.block[order[-1]] if len(order) else -1
        return order, np.searchsorted(self.block[order], np.arange(last + 2))

    def taken(self, rows: IntArray) -> ParcelsInBlocks:
        """Some of the parcels, in the order of `rows`."""
        return ParcelsInBlocks(self.polygons[rows], self.block[rows], self.blocks)


def in_blocks(polygons: ObjectArray, blocks: ObjectArray | None = None) -> ParcelsInBlocks:
    """Find the block of each parcel.

    Parameters
    ----------
    polygons
        (n,) parcels.
    blocks
        Polygons of blocks. Parcels whose inner point lies in none of them, or all where none
        are given, make blocks of their own with those that they touch.
    """
    if blocks is None:
        return ParcelsInBlocks(polygons, touching(polygons))
    block = np.full(len(polygons), NONE)
    inner = shapely.point_on_surface(polygons)
    parcel, row = shapely.STRtree(blocks).query(inner, predicate="within")
    block[parcel[::-1]] = row[::-1]
    outside = np.flatnonzero(block == NONE)
    if not len(outside):
        return ParcelsInBlocks(polygons, block, blocks)
    group = touching(polygons[outside])
    block[outside] = len(blocks) + group
    more = ParcelsInBlocks(polygons[outside], group).outlines(np.arange(group.max() + 1))
    return ParcelsInBlocks(polygons, block, np.append(blocks, more))


def labelled(polygons: ObjectArray, label: npt.NDArray[np.generic]) -> ParcelsInBlocks:
    """Take parcels with the same label as one block."""
    return ParcelsInBlocks(polygons, np.unique(label, return_inverse=True)[1].ravel())


@dataclass(frozen=True, eq=False)
class Transfer:
    """What was carried over; n old and m new parcels.

    Parameters
    ----------
    parcel_id
        (m,) numbers of the new parcels, each there once; new numbers are above all old ones.
    source
        (m,) row of the old parcel whose number each has; `NONE` for a new one.
    part_of
        (m,) the same, and for a new one the old parcel that it was part of, if any.
    nearest
        (m,) the same, and for a new one the old parcel with the least distance d in the block
        (the rule of the paper); `NONE` where the block has no counterpart.
    changes
        The log; its rows are those of the parcels as given.
    motion
        How the layout as a whole was moved.
    """

    parcel_id: IntArray
    source: IntArray
    part_of: IntArray
    nearest: IntArray
    changes: Changes
    motion: Motion


def transfer(old: ParcelsInBlocks, old_id: IntArray, new: ParcelsInBlocks) -> Transfer:
    """Carry the numbers of parcels over to the parcels after an edit (Vanegas 2012, section 5).

    1. Parcels of the same shape in the same place are the same.
    2. The blocks of all others are matched (`match_blocks`).
    3. Within blocks that belong together, positions relative to the corners of the block
       (`landmarks_of`, `relative_coordinates`) say which parcel is which (`assign`).
    4. What is left is the same where it has more than half in common, of both together.
    5. All other new parcels get new numbers, from west to east.

    The answer depends neither on the order of rows nor on where rings start.

    Parameters
    ----------
    old, new
        The two states, in the same coordinates; metres.
    old_id
        (n,) numbers of the old parcels, unique.

    Examples
    --------
    >>> row = np.array([shapely.box(x, 0, x + 20, 30) for x in (0, 20, 40)])
    >>> wider = np.array([shapely.box(x, 0, x + 22, 30) for x in (0, 22, 44)])
    >>> transfer(in_blocks(row), np.array([7, 8, 9]), in_blocks(wider)).parcel_id.tolist()
    [7, 8, 9]
    """
    centres = _centres(old.polygons), _centres(new.polygons)
    a, b = _from_west(old.polygons, centres[0]), _from_west(new.polygons, centres[1])
    state = _State(old.taken(a), new.taken(b), (centres[0][a], centres[1][b]))
    state.match_same()
    state.match_in_blocks()
    common = state.match_in_place()
    changes = changes_of(state.source, state.same, state.distance, common)
    part_of = np.full(len(b), NONE)
    part_of[b] = changes.old[: len(b)]
    source, nearest = np.full(len(b), NONE), np.full(len(b), NONE)
    source[b] = _rows_given(state.source, a)
    nearest[b] = _rows_given(np.where(state.source == NONE, state.nearest, state.source), a)
    return Transfer(
        _numbers(source, old_id, b),
        source,
        _rows_given(part_of, a),
        nearest,
        _as_given(changes, a, b),
        state.motion,
    )


class _State:
    """Matching under way; parcels stand in the order of their places."""

    def __init__(
        self, old: ParcelsInBlocks, new: ParcelsInBlocks, centres: tuple[FloatArray, FloatArray]
    ) -> None:
        self.old, self.new, self.centres = old, new, centres
        m = len(new.polygons)
        self.source = np.full(m, NONE)
        self.nearest = np.full(m, NONE)
        self.same = np.zeros(m, dtype=bool)
        self.distance = np.full(m, np.nan)
        self.motion = Motion(np.eye(2), np.zeros(2))
        self.moved = old.polygons.copy()
        self.still = np.ones(len(old.polygons), dtype=bool)
        self.used = np.zeros(len(old.polygons), dtype=bool)
        self.unsettled = np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)

    @property
    def free_old(self) -> IntArray:
        """Old parcels whose number nobody has yet."""
        return np.flatnonzero(~self.used)

    @property
    def free_new(self) -> IntArray:
        """New parcels without a number."""
        return np.flatnonzero(self.source == NONE)

    def match_same(self) -> None:
        """Pair parcels of the same shape in the same place."""
        a, b = same_shape(fingerprints(self.old.polygons), fingerprints(self.new.polygons))
        self._carry(a, b)
        self.same[b], self.distance[b] = True, 0.0

    def match_in_blocks(self) -> None:
        """Pair parcels by their positions in blocks that belong together."""
        free = self.unsettled = self.free_old, self.free_new
        rows = np.unique(self.old.block[free[0]]), np.unique(self.new.block[free[1]])
        if not len(rows[0]) or not len(rows[1]):
            return
        match = match_blocks(
            self.old.outlines(rows[0]), self.new.outlines(rows[1]), in_place=bool(self.same.any())
        )
        self.motion = match.motions[0]
        self.moved[:] = self.motion.geometry(self.old.polygons)
        self.still[:] = self.motion.is_none
        for a, b, motion in match.groups():
            points = landmarks_of(match.shapes[0].rows(a), match.shapes[1].rows(b), motion)
            here_old = np.sort(self.old.members(rows[0][a]))
            here_new = np.sort(self.new.members(rows[1][b]))
            if motion is not self.motion:
                self.moved[here_old] = motion.geometry(self.old.polygons[here_old])
                self.still[here_old] = motion.is_none
            before = relative_coordinates(motion.points(self.centres[0][here_old]), points[0])
            after = relative_coordinates(self.centres[1][here_new], points[1])
            self._pair(here_old, here_new, before, after)

    def _pair(
        self, here_old: IntArray, here_new: IntArray, before: FloatArray, after: FloatArray
    ) -> None:
        """Pair the parcels of blocks that belong together, by their relative coordinates."""
        open_old = ~self.used[here_old]
        open_new = self.source[here_new] == NONE
        i, j, d = assign(before[open_old], after[open_new])
        rows = here_new[open_new]
        self._carry(here_old[open_old][i], rows[j])
        self.distance[rows[j]] = d
        alone = self.source[here_new] == NONE
        if len(here_old) and alone.any():
            step = max(1, 1_000_000 // len(here_old))
            at = np.flatnonzero(alone)
            for k in range(0, len(at), step):
                some = at[k : k + step]
                least = position_distances(after[some], before).argmin(axis=1)
                self.nearest[here_new[some]] = here_old[least]

    def _carry(self, old: IntArray, new: IntArray) -> None:
        self.source[new], self.used[old] = old, True

    def match_in_place(self) -> Overlaps:
        """Pair what is left where it is in place; return what parcels have in common."""
        common = overlaps(self.moved, self.new.polygons, self.unsettled, still=self.still)
        a, b = common.most_of_both()
        free = (self.source[b] == NONE) & ~self.used[a]
        self._carry(a[free], b[free])
        return common


def _centres(polygons: ObjectArray) -> FloatArray:
    return np.asarray(shapely.get_coordinates(shapely.centroid(polygons)))


def _from_west(polygons: ObjectArray, centre: FloatArray) -> IntArray:
    """Rows from west to east, of equal ones from south to north: an order of their own."""
    x, y = np.round(centre, 3).T
    return np.lexsort((np.round(shapely.area(polygons), 3), y, x))


def _rows_given(rows: IntArray, order: IntArray) -> IntArray:
    """Rows of sorted parcels as rows of the parcels as given."""
    return np.where(rows == NONE, NONE, np.append(order, NONE)[rows])


def _as_given(changes: Changes, a: IntArray, b: IntArray) -> Changes:
    """The log with the rows of the parcels as given, new parcels in their order."""
    m = len(b)
    ended = m + np.argsort(a[changes.old[m:]], kind="stable")
    order = np.append(np.argsort(b), ended)
    return Changes(
        changes.change[order],
        _rows_given(changes.old, a)[order],
        _rows_given(changes.new, b)[order],
        changes.overlap_old[order],
        changes.overlap_new[order],
        changes.distance[order],
    )


def _numbers(source: IntArray, old_id: IntArray, order: IntArray) -> IntArray:
    """(m,) numbers: that of the source, or one above all old ones."""
    out = np.zeros(len(source), dtype=np.int64)
    out[source != NONE] = old_id[source[source != NONE]]
    fresh = order[source[order] == NONE]
    out[fresh] = old_id.max(initial=0) + 1 + np.arange(len(fresh))
    return out
