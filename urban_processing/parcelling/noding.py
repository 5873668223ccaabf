"""Give every ring the vertices that its neighbours have on it.

Every edge of a ring lies on a numbered segment, an edge of the contour or a cut, and every vertex
that lies on a segment is the end of an edge there. So what lies between the ends of an edge is
found by numbers and places along the segment, without a search among coordinates.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.boxes.line_cuts import TOUCH
from urban_processing.parcelling.rings import Rings, ranges, starts


@dataclass(frozen=True, eq=False)
class Segments:
    """S straight segments: where each begins (S, 2), its direction (S, 2) and length (S,).

    Those of cuts may be longer than what is used of them.
    """

    origin: FloatArray
    direction: FloatArray
    length: FloatArray

    def places(self, segment: IntArray, xy: FloatArray) -> FloatArray:
        """Places along segments of points near them."""
        direction = self.direction[segment]
        at = xy - self.origin[segment]
        return np.asarray(at[:, 0] * direction[:, 0] + at[:, 1] * direction[:, 1])


def node_rings(
    rings: Rings, xy: FloatArray, segments: Segments, *, n_fixed: int
) -> tuple[Rings, IntArray]:
    """Return the rings with all vertices on them; those of a place become one.

    Cuts of the faces on both sides of a segment may meet it at the same place but for rounding:
    vertices there that are no farther apart than `TOUCH` become that with the lowest number. The
    first `n_fixed` vertices stay what they are.

    Returns
    -------
    rings
        The noded rings.
    source
        Edge of the rings given that each edge is, or is a part of.
    """
    source = np.arange(len(rings.vertex))
    base = np.append(0.0, np.cumsum(segments.length + 1.0))
    key = base[rings.segment] + segments.places(rings.segment, xy[rings.vertex])
    order = np.argsort(key, kind="stable")
    same = _near_vertices(rings.vertex[order], key[order], len(xy), n_fixed)
    if same is not None:
        rings, source = _renamed(rings, same)
        key = base[rings.segment] + segments.places(rings.segment, xy[rings.vertex])
        order = np.argsort(key, kind="stable")
    vertex, key_there = rings.vertex[order], key[order]
    # on each segment every vertex once
    once = np.append(True, (np.diff(vertex) != 0) | (np.diff(key_there) > TOUCH))
    vertex, key_there = vertex[once], key_there[once]
    end = xy[rings.vertex[rings.following]]
    end = base[rings.segment] + segments.places(rings.segment, end)
    low, high = np.minimum(key, end), np.maximum(key, end)
    first = np.searchsorted(key_there, low + TOUCH, side="right")
    count = np.maximum(np.searchsorted(key_there, high - TOUCH, side="left") - first, 0)
    noded, edge = _with_vertices(rings, (vertex, first, count), backward=end < key)
    return noded, source[edge]


def _near_vertices(
    vertex: IntArray, key: FloatArray, n_vertices: int, n_fixed: int
) -> IntArray | None:
    """(V,) vertex that each one becomes, None where all stay, from vertices along segments."""
    near = (np.diff(key) <= TOUCH) & (np.diff(vertex) != 0)
    near &= (vertex[1:] >= n_fixed) | (vertex[:-1] >= n_fixed)
    if not near.any():
        return None
    a, b = vertex[:-1][near], vertex[1:][near]
    same = np.arange(n_vertices)
    while True:
        least = np.minimum(same[a], same[b])
        before = same.copy()
        np.minimum.at(same, a, least)
        np.minimum.at(same, b, least)
        if (same == before).all():
            return same


def _renamed(rings: Rings, same: IntArray) -> tuple[Rings, IntArray]:
    """Return the rings with other vertices, without edges that thereby have no length."""
    vertex = same[rings.vertex]
    kept = vertex != vertex[rings.following]
    offsets = starts(kept)[rings.offsets]
    return Rings(vertex[kept], rings.segment[kept], offsets, rings.face), kept.nonzero()[0]


def _with_vertices(
    rings: Rings, found: tuple[IntArray, IntArray, IntArray], *, backward: BoolArray
) -> tuple[Rings, IntArray]:
    """Insert runs of vertices after nodes, and say which edge each edge is of.

    `found`: all vertices, where the run of each node begins among them, and its length.
    """
    vertex, first, count = found
    node = np.repeat(np.arange(len(count)), count + 1)
    step = ranges(np.zeros(len(count), dtype=np.int64), count + 1)
    inserted = np.flatnonzero(step > 0)
    of, nth = node[inserted], step[inserted] - 1
    new = rings.vertex[node]
    new[inserted] = vertex[first[of] + np.where(backward[of], count[of] - 1 - nth, nth)]
    return Rings(new, rings.segment[node], starts(count + 1)[rings.offsets], rings.face), node
