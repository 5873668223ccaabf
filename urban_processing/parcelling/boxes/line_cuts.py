"""Cut many polygons at once, each by a line of its own.

The crossings of a line with the rings of its polygon, sorted along the line, pair up: the line
runs within the polygon between the two of a pair. The rings fall into arcs between crossings, and
arcs linked by pairs are the rings of the pieces, however many those are.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.rings import Rings, changes, ranges, starts
from urban_processing.site import FINE_GRID

TOUCH = 2.0**-20
"""A line within this distance of a vertex, in metres, goes through it."""

THE_CUT = -1
"""Segment of edges that lie on the line that cut a face."""


@dataclass(frozen=True, eq=False)
class Lines:
    """K lines, each through a `point` (K, 2) and across a `normal` (K, 2), a unit vector."""

    point: FloatArray
    normal: FloatArray


@dataclass(frozen=True, eq=False)
class Cut:
    """What lines made of faces: P pieces.

    Parameters
    ----------
    pieces
        Their rings. New edges lie on the segment `THE_CUT`; vertices from `n_vertices` on are
        those in `added`.
    parent
        (P,) face that a piece is of, not decreasing. Pieces of a face are in order: first those
        before the line, seen along its normal, then those beyond it, each from right to left.
    added
        (A, 2) new vertices, on `FINE_GRID`.
    n_vertices
        Number of vertices there were.
    """

    pieces: Rings
    parent: IntArray
    added: FloatArray
    n_vertices: int

    def select(self, pieces: IntArray) -> Cut:
        """Return some of the pieces, and the vertices these need."""
        rings = self.pieces.take(pieces)
        is_new = rings.vertex >= self.n_vertices
        used, place = np.unique(rings.vertex[is_new] - self.n_vertices, return_inverse=True)
        vertex = rings.vertex.copy()
        vertex[is_new] = self.n_vertices + place
        return Cut(
            pieces=Rings(vertex, rings.segment, rings.offsets, rings.face),
            parent=self.parent[pieces],
            added=self.added[used],
            n_vertices=self.n_vertices,
        )


@dataclass(frozen=True, eq=False)
class _Crossings:
    """C crossings of lines and rings, in the order of the rings."""

    edge: IntArray
    """(C,) edge crossed, by its first node."""
    place: FloatArray
    """(C,) place along the line."""
    partner: IntArray
    """(C,) crossing at the other end of the piece of line within the face."""
    after: IntArray
    """(C,) next crossing in the ring."""
    vertex: IntArray
    """(C,) vertex there."""


def cut(rings: Rings, xy: FloatArray, lines: Lines) -> Cut:
    """Cut each face by its line; faces that a line misses are one piece."""
    face = rings.edge_face
    at = xy[rings.vertex] - lines.point[face]
    normal = lines.normal[face]
    across = at[:, 0] * normal[:, 0] + at[:, 1] * normal[:, 1]
    along = at[:, 1] * normal[:, 0] - at[:, 0] * normal[:, 1]
    beyond = _sides(across, along, rings.following)
    crossings, added = _crossings(rings, xy, (across, along, beyond))
    shells, shell_face, side, order = _joined_arcs(rings, crossings, beyond, face)
    pieces, parent = _with_uncut_rings(
        rings, xy=np.concatenate([xy, added]), beyond=beyond, shells=shells,
        known=(shell_face, side, order), crossed=crossings.edge,
    )  # fmt: skip
    return Cut(pieces, parent, added, len(xy))


def _sides(across: FloatArray, along: FloatArray, following: IntArray) -> BoolArray:
    """(N,) nodes beyond the line.

    Those on it are where no piece gets an edge without width and none touches itself: ends of
    an edge along the line are on the side of the edge's face. A vertex with both neighbours on
    one side is on that side too, unless it is reflex: then the line passes behind it.
    """
    beyond = across > TOUCH
    on = np.flatnonzero(np.abs(across) <= TOUCH)
    if not len(on):
        return beyond
    previous = np.empty_like(following)
    previous[following] = np.arange(len(following))
    before, after = previous[on], following[on]
    far = across[after] > 0.0
    one_side = far == (across[before] > 0.0)
    turn = (along[on] - along[before]) * (across[after] - across[on])
    turn -= (across[on] - across[before]) * (along[after] - along[on])
    reflex = turn > 0.0  # along the line and across it is a left-handed frame
    beyond[on] = one_side & (far != reflex)
    # neighbours on the line as well
    lies = np.abs(across[after]) <= TOUCH
    follows = np.abs(across[before]) <= TOUCH
    beyond[on[lies]] = (along[after] < along[on])[lies]
    beyond[on[follows]] = (along[on] < along[before])[follows]
    return beyond


def _crossings(
    rings: Rings, xy: FloatArray, sides: tuple[FloatArray, FloatArray, BoolArray]
) -> tuple[_Crossings, FloatArray]:
    """Find where rings cross their lines, pair the crossings and make their vertices."""
    across, along, beyond = sides
    i = np.flatnonzero(beyond != beyond[rings.following])
    j = rings.following[i]
    at_j = np.abs(across[j]) <= TOUCH
    at_i = ~at_j & (np.abs(across[i]) <= TOUCH)
    new = ~(at_i | at_j)
    share = np.where(at_j, 1.0, 0.0)
    share[new] = across[i[new]] / (across[i[new]] - across[j[new]])
    place = along[i] + share * (along[j] - along[i])
    vertex = np.where(at_j, rings.vertex[j], rings.vertex[i])
    vertex[new] = len(xy) + np.arange(np.count_nonzero(new))
    tail, head = xy[rings.vertex[i[new]]], xy[rings.vertex[j[new]]]
    added = np.round((tail + share[new, None] * (head - tail)) / FINE_GRID) * FINE_GRID

    face = rings.edge_face[i]
    # along the line a face is entered where its ring comes to the far side, and left again
    enters = np.flatnonzero(beyond[j])
    leaves = np.flatnonzero(beyond[i])
    enters = enters[np.lexsort((place[enters], face[enters]))]
    leaves = leaves[np.lexsort((place[leaves], face[leaves]))]
    partner = np.empty(len(i), dtype=np.int64)
    partner[enters], partner[leaves] = leaves, enters

    ring = np.searchsorted(rings.offsets, i, side="right") - 1
    after = np.arange(1, len(i) + 1)
    first = changes(ring).nonzero()[0]
    after[np.append(first[1:], len(i))[: len(first)] - 1] = first
    return _Crossings(i, place, partner, after, vertex), added


def _joined_arcs(
    rings: Rings, crossings: _Crossings, beyond: BoolArray, face: IntArray
) -> tuple[Rings, IntArray, BoolArray, FloatArray]:
    """Join arcs to shells of pieces; with the face, the side and the place of each."""
    leader, step = _cycles(crossings.partner[crossings.after])
    arc = np.lexsort((step, leader))
    edge, end = crossings.edge[arc], crossings.after[arc]
    ring = np.searchsorted(rings.offsets, edge, side="right") - 1
    begin, size = rings.offsets[ring], rings.size[ring]
    inner = (crossings.edge[end] - edge) % size
    inner[inner == 0] = size[inner == 0]
    # an arc: its first crossing, the nodes of the ring up to the last crossing, and that one
    node = ranges(edge - begin, inner + 2)
    node = np.repeat(begin, inner + 2) + node % np.repeat(size, inner + 2)
    first = starts(inner + 2)
    vertex, segment = rings.vertex[node], rings.segment[node]
    vertex[first[:-1]] = crossings.vertex[arc]
    vertex[first[1:] - 1] = crossings.vertex[end]
    segment[first[1:] - 1] = THE_CUT

    begins = np.flatnonzero(step[arc] == 0)
    place = np.minimum(crossings.place[arc], crossings.place[end])
    place = np.minimum.reduceat(place, begins) if len(begins) else place
    side = beyond[rings.following[edge[begins]]]
    vertex, segment, offsets = _without_repeats(
        vertex, segment, np.append(first[begins], first[-1])
    )
    kept = np.diff(offsets) >= 3
    shells = Rings(vertex, segment, offsets, np.arange(len(begins)))
    if not kept.all():
        shells = _some_rings(shells, np.flatnonzero(kept))
    return shells, face[edge[begins]][kept], side[kept], place[kept]


def _cycles(after: IntArray) -> tuple[IntArray, IntArray]:
    """First member of the cycle that each element is in, and the steps from it."""
    leader = np.arange(len(after))
    jump = after
    while (leader[after] != leader).any():
        leader = np.minimum(leader, leader[jump])
        jump = jump[jump]
    step = np.zeros(len(after), dtype=np.int64)
    here, n = np.flatnonzero(leader == np.arange(len(after))), 0
    while len(here):
        step[here] = n
        here, n = after[here], n + 1
        here = here[leader[here] != here]
    return leader, step


def _without_repeats(
    vertex: IntArray, segment: IntArray, offsets: IntArray
) -> tuple[IntArray, IntArray, IntArray]:
    """Drop nodes whose edge has no length from rings."""
    after = np.arange(1, len(vertex) + 1)
    after[offsets[1:] - 1] = offsets[:-1]
    kept = vertex != vertex[after]
    if kept.all():
        return vertex, segment, offsets
    return vertex[kept], segment[kept], starts(kept)[offsets]


def _some_rings(rings: Rings, chosen: IntArray) -> Rings:
    """Return rings by number, each a face of its own."""
    node = ranges(rings.offsets[chosen], rings.size[chosen])
    return Rings(
        rings.vertex[node],
        rings.segment[node],
        starts(rings.size[chosen]),
        np.arange(len(chosen)),
    )


def _with_uncut_rings(
    rings: Rings,
    *,
    xy: FloatArray,
    beyond: BoolArray,
    shells: Rings,
    known: tuple[IntArray, BoolArray, FloatArray],
    crossed: IntArray,
) -> tuple[Rings, IntArray]:
    """Add shells that were not cut, give pieces the holes in them, and sort all by place."""
    uncut = np.ones(len(rings.face), dtype=bool)
    uncut[np.searchsorted(rings.offsets, crossed, side="right") - 1] = False
    left = np.flatnonzero(uncut & rings.is_shell)
    holes = np.flatnonzero(uncut & ~rings.is_shell)
    lone = _some_rings(rings, np.concatenate([left, holes]))
    face = np.concatenate([known[0], rings.face[left]])
    side = np.concatenate([known[1], beyond[rings.offsets[left]]])
    place = np.concatenate([known[2], np.zeros(len(left))])
    order = np.lexsort((place, side, face))
    position = np.empty(len(order), dtype=np.int64)
    position[order] = np.arange(len(order))
    owner = np.empty(0, dtype=np.int64)
    everything = Rings(
        np.concatenate([shells.vertex, lone.vertex]),
        np.concatenate([shells.segment, lone.segment]),
        starts(np.concatenate([shells.size, lone.size])),
        np.arange(len(order) + len(holes)),
    )
    if len(holes):
        key = 2 * rings.face[holes] + beyond[rings.offsets[holes]]
        owner = _owners(everything, xy, 2 * face + side, key)
    piece = np.concatenate([position, position[owner]])
    sort = np.argsort(piece, kind="stable")
    placed = _some_rings(everything, sort)
    return Rings(placed.vertex, placed.segment, placed.offsets, piece[sort]), face[order]


def _owners(everything: Rings, xy: FloatArray, shell_key: IntArray, key: IntArray) -> IntArray:
    """Shell around each hole: one with its `key`, and where there are several the one it is in."""
    n = len(shell_key)
    order = np.argsort(shell_key, kind="stable")
    low = np.searchsorted(shell_key[order], key)
    count = np.searchsorted(shell_key[order], key, side="right") - low
    owner = order[np.minimum(low, n - 1)]
    for hole in np.flatnonzero(count > 1):
        around = order[low[hole] : low[hole] + count[hole]]
        shapes = everything.take(np.append(around, n + hole)).polygons(xy)
        inside = shapely.contains_properly(shapes[:-1], shapely.point_on_surface(shapes[-1]))
        owner[hole] = around[np.argmax(inside)]
    return owner
