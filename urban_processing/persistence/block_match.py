"""Which blocks after an edit were which before it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks, rings_of
from urban_processing.errors import BoundaryError
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.persistence.contours import corners_of
from urban_processing.persistence.keys import fingerprints
from urban_processing.persistence.motion import IN_PLACE, Motion, Shapes, find_motion

ObjectArray = npt.NDArray[np.object_]

NONE = -1
"""Stands for no block and no parcel."""

RELATED = 0.5
"""Blocks are related where they have this share of the smaller one in common."""

COLLINEAR = 2e-3
"""A vertex this near to the line between its neighbours, relative to √area, is no corner."""

_BETTER = 0.1
"""By how much more of the blocks a motion must cover to be believed, rather than that all
stayed in place."""

_FORMATION = 3
"""So many blocks must have moved together for a part of a layout to be followed elsewhere."""

_ROUNDS = 4
"""Parts of a layout that are followed at most."""


@dataclass(frozen=True, eq=False)
class BlockMatch:
    """Pairs of related blocks; P pairs of n old and m new blocks.

    A block that stayed one has one pair; a block that was split has one for each part of it, a
    block that was merged one for each block that went into it.

    Parameters
    ----------
    old, new
        (P,) rows of the blocks of a pair; sorted by the new one, the largest share first.
    share
        (P,) area in common over the area of the smaller, after the old one was moved.
    motion
        (P,) number in `motions` of what the old block was moved by.
    motions
        How the layout or parts of it were moved; the first is that of most blocks.
    shapes
        Old and new blocks with their corners.
    """

    old: IntArray
    new: IntArray
    share: FloatArray
    motion: IntArray
    motions: tuple[Motion, ...]
    shapes: tuple[Shapes, Shapes]

    @cached_property
    def parent(self) -> IntArray:
        """(m,) old block that each new one inherits from, that with most in common; or `NONE`."""
        out = np.full(len(self.shapes[1].polygons), NONE)
        new, first = np.unique(self.new, return_index=True)
        out[new] = self.old[first]
        return out

    def groups(self) -> list[tuple[IntArray, IntArray, Motion]]:
        """Blocks that belong together: rows of old ones, of new ones, and how they moved.

        One old and one new block as a rule, more where blocks were split or merged.
        """
        n = len(self.shapes[0].polygons)
        label = components(n + len(self.shapes[1].polygons), np.c_[self.old, n + self.new])
        order = np.argsort(label[self.old], kind="stable")
        cuts = np.flatnonzero(np.diff(label[self.old[order]])) + 1
        return [
            (np.unique(self.old[k]), np.unique(self.new[k]), self.motions[self.motion[k[0]]])
            for k in np.split(order, cuts)
            if len(k)
        ]


def match_blocks(old: ObjectArray, new: ObjectArray, *, in_place: bool = False) -> BlockMatch:
    """Match the blocks before an edit with those after it.

    Blocks whose contour is the same are pairs at once. The others are pairs where they have at
    least half of the smaller one in common (`RELATED`): so both parts of a block that a new
    street splits, and all blocks that were merged. Where the layout as a whole was moved,
    turned, scaled or stretched (Vanegas 2012, Fig. 7f), which is looked for only if no contour
    is the same, the old blocks are moved along first. What is left over on both sides is
    searched for parts that moved by themselves, three blocks or more in the same formation.

    Parameters
    ----------
    old, new
        (n,) and (m,) valid polygons in the same coordinates.
    in_place
        Whether it is known that the layout as a whole has not moved.

    References
    ----------
    Vanegas et al. (2012), section 5.2, takes the pairs of blocks as known from its editor.
    """
    shapes = blocks_as_shapes(old), blocks_as_shapes(new)
    same_old, same_new = same_shape(fingerprints(old), fingerprints(new))
    found = [_pairs(same_old, same_new, shapely.area(new[same_new]), 0)]
    left = _left(len(old), same_old), _left(len(new), same_new)
    motions = [IN_PLACE]
    if not in_place and len(same_old) == 0 and len(old) and len(new):
        motions = [_as_a_whole(*shapes)]
    for number in range(_ROUNDS):
        if number > 0:
            motion = _of_a_part(shapes[0].rows(left[0]), shapes[1].rows(left[1]))
            if motion is None:
                break
            motions.append(motion)
        pairs = _related(motions[-1], old, new, left)
        found.append(_pairs(*pairs, number))
        left = np.setdiff1d(left[0], pairs[0]), np.setdiff1d(left[1], pairs[1])
    whole = np.concatenate(found)
    order = np.lexsort((whole["old"], -np.round(whole["common"], 3), whole["new"]))
    whole = whole[order]
    return BlockMatch(
        whole["old"],
        whole["new"],
        _shares(whole, motions, old, new),
        whole["motion"],
        tuple(motions),
        shapes,
    )


def carry_block_columns(
    old: Blocks, new: Blocks
) -> tuple[Mapping[str, npt.NDArray[Any]], IntArray]:
    """Carry the columns of blocks to the blocks after an edit.

    Both parts of a block that was split get its values; a block merged from several those of
    the one with most in common. Values that the new blocks have already stay.

    Parameters
    ----------
    old, new
        Blocks before and after, in the same CRS.

    Returns
    -------
    columns
        (m,) values by name for the new blocks; None, or NaN in a column of numbers, where there
        is nothing to inherit.
    old_block_id
        (m,) number of the block that each inherits from; `NONE` for none.

    Raises
    ------
    BoundaryError
        If the blocks are in different CRSs.
    """
    if old.frame.crs != new.frame.crs:
        raise BoundaryError("The blocks before and after are in different CRSs: reproject one.")
    shift = np.subtract(old.frame.origin, new.frame.origin)
    moved = shapely.transform(old.polygons, lambda xy: xy + shift)
    parent = match_blocks(moved, new.polygons).parent
    columns = dict(new.columns)
    for name, values in old.columns.items():
        inherited = taken(values, parent)
        own = new.columns.get(name)
        columns[name] = inherited if own is None else _filled(own, inherited)
    return columns, np.where(parent == NONE, NONE, np.append(old.block_id, NONE)[parent])


def taken(values: npt.NDArray[Any], rows: IntArray) -> npt.NDArray[Any]:
    """Take values by row; where the row is `NONE` they are missing."""
    gap = rows == NONE
    if not gap.any():
        return np.asarray(values[rows])
    kind = values.dtype if values.dtype.kind == "f" else np.dtype(object)
    out = np.full(len(rows), np.nan if kind.kind == "f" else None, dtype=kind)
    out[~gap] = values[rows[~gap]]
    return out


def _filled(own: npt.NDArray[Any], inherited: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Own values, and inherited ones where these are missing."""
    gap = np.array([value is None or value != value for value in own.tolist()], dtype=bool)
    if not gap.any():
        return own
    if own.dtype.kind == "f" and inherited.dtype.kind in "fiu":
        return np.where(gap, inherited, own)
    out = own.astype(object)
    out[gap] = inherited[gap]
    return out


def same_shape(
    old: npt.NDArray[np.uint64], new: npt.NDArray[np.uint64]
) -> tuple[IntArray, IntArray]:
    """Rows of old and new fingerprints that are equal, each there once before and after."""
    kinds = []
    for values in (old, new):
        unique, first, count = np.unique(values, return_index=True, return_counts=True)
        kinds.append((unique[count == 1], first[count == 1]))
    _, a, b = np.intersect1d(kinds[0][0], kinds[1][0], assume_unique=True, return_indices=True)
    return kinds[0][1][a], kinds[1][1][b]


def blocks_as_shapes(polygons: ObjectArray) -> Shapes:
    """Polygons with the corners of their shells, counter-clockwise."""
    rings = rings_of(shapely.orient_polygons(polygons))
    tolerance = COLLINEAR * np.sqrt(shapely.area(polygons))
    corner = corners_of(rings, tolerance[rings.edge_block])
    ring = rings.edge_ring[corner]
    corner, ring = corner[rings.is_shell[ring]], ring[rings.is_shell[ring]]
    cuts = np.flatnonzero(np.diff(ring)) + 1
    corners = np.split(rings.xy[corner], cuts) if len(polygons) else []
    return Shapes(polygons, list(corners))


def _as_a_whole(old: Shapes, new: Shapes) -> Motion:
    motion, score, in_place = find_motion(old, new)
    return motion if score > in_place + _BETTER else IN_PLACE


def _of_a_part(old: Shapes, new: Shapes) -> Motion | None:
    """How a part of what has no counterpart yet was moved; None where nothing tells."""
    if min(len(old.polygons), len(new.polygons)) < _FORMATION:
        return None
    motion, score, _ = find_motion(old, new)
    return motion if score * len(old.polygons) >= _FORMATION * 0.8 else None


_PAIR = np.dtype([("old", "i8"), ("new", "i8"), ("common", "f8"), ("motion", "i8")])


def _pairs(old: IntArray, new: IntArray, common: FloatArray, motion: int) -> npt.NDArray[Any]:
    out = np.empty(len(old), dtype=_PAIR)
    out["old"], out["new"], out["common"], out["motion"] = old, new, common, motion
    return out


def _left(n: int, used: IntArray) -> IntArray:
    return np.setdiff1d(np.arange(n), used)


def _related(
    motion: Motion, old: ObjectArray, new: ObjectArray, left: tuple[IntArray, IntArray]
) -> tuple[IntArray, IntArray, FloatArray]:
    """Rows of related blocks among those left, and the area that they have in common."""
    moved, target = motion.geometry(old[left[0]]), new[left[1]]
    a, b = shapely.STRtree(target).query(moved)
    common = shapely.area(shapely.intersection(moved[a], target[b]))
    smaller = np.minimum(shapely.area(moved)[a], shapely.area(target)[b])
    near = common >= RELATED * smaller
    return left[0][a[near]], left[1][b[near]], common[near]


def _shares(
    pairs: npt.NDArray[Any], motions: list[Motion], old: ObjectArray, new: ObjectArray
) -> FloatArray:
    """(P,) area in common over that of the smaller block."""
    scale = np.array([motion.scale for motion in motions])[pairs["motion"]]
    area_old = shapely.area(old)[pairs["old"]] * scale**2
    smaller = np.minimum(area_old, shapely.area(new)[pairs["new"]])
    return np.asarray(np.minimum(pairs["common"] / smaller, 1.0))
