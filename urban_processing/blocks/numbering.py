"""Numbers of streets: which segments of centrelines are one street."""

from __future__ import annotations

import numpy as np

from urban_processing.blocks.model import UNKNOWN_STREET
from urban_processing.blocks.noding import Centrelines
from urban_processing.blocks.streets import StrArray
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.straight import go_on_straight, included_angle, pairs_at_nodes


def street_numbers(work: Centrelines, name: StrArray, given: IntArray) -> IntArray:
    """(S,) number of the street that each segment is part of.

    Numbers that are given stay; the others follow them, by place. Segments of one name are one
    street. Where there is none, a street goes on at a node with the segment that continues it most
    nearly straight, as strokes do (Thomson and Richardson 1999).

    Parameters
    ----------
    work
        Segments.
    name
        (n,) names of their lines, empty where there is none.
    given
        (n,) numbers of their lines, `UNKNOWN_STREET` where there is none.
    """
    numbers, names = given[work.line], name[work.line]
    known = numbers != UNKNOWN_STREET
    named = (names != "") & ~known
    pairs = [_same_name(names, named), _straight_on(work, named | known)]
    found = components(len(work.line), np.concatenate(pairs))
    _, place = np.unique(found[~known], return_inverse=True)
    out = numbers.copy()
    out[~known] = numbers.max(initial=0) + 1 + place.ravel()
    return out


def _same_name(names: StrArray, named: BoolArray) -> IntArray:
    """Pairs that chain the segments of each name."""
    at = np.flatnonzero(named)
    at = at[np.argsort(names[at], kind="stable")]
    same = names[at[1:]] == names[at[:-1]]
    return np.asarray(np.column_stack([at[:-1], at[1:]])[same])


def _straight_on(work: Centrelines, named: BoolArray) -> IntArray:
    """Pairs of segments without a name that continue each other at a node."""
    n = len(work.line)
    arm_segment = np.tile(np.arange(n), 2)
    arms = np.flatnonzero(~named[arm_segment])
    node = work.ends.T.ravel()
    arms = arms[np.lexsort((arms, node[arms]))]
    local = pairs_at_nodes(node[arms])
    pairs = arms[local]
    direction = _directions(work.segments)
    angle = included_angle(direction[pairs[:, 0]], direction[pairs[:, 1]])
    on = go_on_straight(pairs, angle, n_arms=2 * n)
    return np.asarray(arm_segment[pairs[on]])


def _directions(segments: FloatArray) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    """(2S,) vectors of the segments from their first end, then from their second."""
    d = segments[:, 1] - segments[:, 0]
    z = d[:, 0] + 1j * d[:, 1]
    return np.concatenate([z, -z])
