"""All faces there were while blocks were cut again and again, and which of them are left."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import BoolArray, IntArray
from urban_processing.parcelling.ground import UintArray
from urban_processing.parcelling.rings import Rings, join_rings, starts


@dataclass(frozen=True, eq=False)
class Level:
    """Faces made by the same number of cuts, in the order of those they come from."""

    rings: Rings
    block: IntArray
    lineage: UintArray
    parent: IntArray
    """Face of the level before."""


@dataclass(frozen=True, eq=False)
class Tree:
    """All faces there were, level by level, and for each level those that stayed whole."""

    levels: list[Level]
    leaves: list[BoolArray]


def leaves_in_order(tree: Tree) -> tuple[IntArray, IntArray]:
    """Level and number of the faces that stayed whole, as if pieces replaced what was cut."""
    levels = tree.levels
    sizes = [leaf.astype(np.int64) for leaf in tree.leaves]
    for n in range(len(levels) - 1, 0, -1):
        np.add.at(sizes[n - 1], levels[n].parent, sizes[n])
    first = starts(sizes[0])[:-1]
    position = [first[tree.leaves[0]]]
    for n in range(1, len(levels)):
        parent, before = levels[n].parent, starts(sizes[n])[:-1]
        eldest = np.searchsorted(parent, parent)
        first = first[parent] + before - before[eldest]
        position.append(first[tree.leaves[n]])
    order = np.argsort(np.concatenate(position))
    face = [leaf.nonzero()[0] for leaf in tree.leaves]
    depth = np.repeat(np.arange(len(levels)), [len(part) for part in face])
    return depth[order], np.concatenate(face)[order]


def collected(tree: Tree, depth: IntArray, face: IntArray) -> Rings:
    """Return the rings of faces of different levels."""
    order = np.argsort(depth, kind="stable")
    cuts = np.searchsorted(depth[order], np.arange(len(tree.levels) + 1))
    parts = [
        level.rings.take(face[order[a:b]])
        for level, a, b in zip(tree.levels, cuts[:-1], cuts[1:], strict=True)
    ]
    back = np.empty_like(order)
    back[order] = np.arange(len(order))
    return join_rings(parts).take(back)


def taken_back(tree: Tree, depth: IntArray, face: IntArray) -> Tree:
    """Return the tree in which the faces that given ones come from stayed whole."""
    leaves = [leaf.copy() for leaf in tree.leaves]
    within = [np.zeros(len(leaf), dtype=bool) for leaf in leaves]
    for n in range(1, len(leaves)):
        parent = tree.levels[n].parent
        whole = parent[face[depth == n]]
        leaves[n - 1][whole] = True
        within[n - 1][whole] = True
    for n in range(1, len(leaves)):
        parent = tree.levels[n].parent
        gone = within[n - 1][parent]
        leaves[n][gone] = False
        within[n] |= gone
    return Tree(tree.levels, leaves)
