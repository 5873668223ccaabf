"""Removing short edges of the parcel mesh (Chen 2024, section 4.1 and Fig. 7)."""

from __future__ import annotations

import math
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
import shapely

from urban_processing.layout import NOT_FIXED, Layout
from urban_processing.mesh.corners import (
    mean_side_length,
    polygon_irregularity,
    reported_corners,
    reported_polygons,
    ring_areas,
)
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, linear_rings

SHORT_SHARE = 0.2
"""An edge is short below this share of the mean side of either parcel (Chen 2024, 4.1)."""

IRREGULARITY_RISE = 0.03
"""A merge may raise the irregularity of the parcels around it by this much each."""

STRAIGHT_RIM = 1e-6
"""Sine of the largest bend of the rim that a vertex may slide along."""


@dataclass(frozen=True, eq=False)
class _Merge:
    """A short chain to be merged into one vertex.

    `chain` runs from the vertex that stays to the one that goes; `moves` are new positions.
    """

    chain: list[int]
    moves: dict[int, tuple[float, float]]
    faces: list[int]


def remove_short_edges(layout: Layout, *, min_area: float, faces: IntArray | None = None) -> Layout:
    """Merge the ends of short parcel sides; the sides that meet there follow.

    A merge is done only if all parcels around stay simple, at or above `min_area`, no less
    regular by more than `IRREGULARITY_RISE` each, and the rim of the land keeps its shape.

    Parameters
    ----------
    layout
        Parcels and streets.
    min_area
        Smallest area in m² that a merge may leave of a parcel that is not smaller.
    faces
        Parcels whose sides are looked at; by default all.
    """
    chains = _short_chains(layout, faces)
    if not chains:
        return layout
    merger = _Merger(layout, min_area)
    while chains:
        batch, chains = merger.independent(chains)
        merger.apply(batch)
    if not merger.changed:
        return layout
    return layout.with_mesh(*merger.editor.commit())


def _short_chains(layout: Layout, faces: IntArray | None) -> list[list[int]]:
    """Chains of half-edges around some faces that are too short, the shortest first."""
    graph = layout.corner_graph
    sides = graph.face.reshape(-1, 2)
    among = np.arange(len(sides))
    beside = np.arange(layout.mesh.n_faces)
    if faces is not None:
        among = np.flatnonzero(np.isin(sides, faces).any(axis=1))
        beside = np.setdiff1d(sides[among], [OUTSIDE])
    if not len(among):
        return []
    corners, corner_offsets = reported_corners(layout.mesh, beside)
    side = np.full(layout.mesh.n_faces + 1, np.inf)
    side[beside] = mean_side_length(layout.mesh.xy[corners], corner_offsets)
    ratio = graph.length[0::2][among] / side[sides[among]].min(axis=1)
    short = np.flatnonzero(ratio < SHORT_SHARE)
    short = short[np.argsort(np.round(ratio[short], 9), kind="stable")]
    o = graph.offsets
    return [graph.half_edges[o[2 * i] : o[2 * i + 1]].tolist() for i in among[short].tolist()]


class _Merger:
    """The editor, and what is known of the faces while merges are made."""

    def __init__(self, layout: Layout, min_area: float) -> None:
        self.editor = MeshEditor(layout.mesh)
        self.min_area = min_area
        # these stay where they are: corners, entries, and all of the streets that were given
        fixed = layout.edge_fixed != NOT_FIXED
        at_fixed = np.bincount(
            layout.mesh.origin, weights=np.repeat(fixed, 2), minlength=layout.mesh.n_vertices
        )
        node = layout.vertex_corner | layout.vertex_entry
        self.corner: list[bool] = (node | (at_fixed > 0)).tolist()
        # what follows a vertex that moves ends where a given street begins
        node |= (at_fixed > 0) & (at_fixed < layout.mesh.valence)
        self.node: list[bool] = node.tolist()
        self.on_rim: list[bool] = layout.mesh.vertex_is_boundary.tolist()
        self.locked: list[bool] = layout.face_locked.tolist()
        loops = layout.mesh.loops
        self.starts: list[int] = loops.half_edges[loops.offsets[layout.mesh.face_loop]].tolist()
        self.changed = False

    def independent(self, chains: list[list[int]]) -> tuple[list[_Merge], list[list[int]]]:
        """Merges that share no face with one another, and the chains left for later."""
        taken: set[int] = set()
        batch, later = [], []
        for chain in chains:
            if not self._intact(chain):
                continue
            merge = self._plan(chain)
            if merge is None:
                continue
            if taken.isdisjoint(merge.faces):
                taken.update(merge.faces)
                batch.append(merge)
            else:
                later.append(chain)
        return batch, later

    def _is_node(self, vertex: int) -> bool:
        return self.editor.valence[vertex] > 2 or self.node[vertex]

    def _intact(self, chain: list[int]) -> bool:
        """Whether a chain still runs from node to node as it did."""
        e = self.editor
        if not all(e.is_edge(h) for h in chain):
            return False
        ends = e.origin[chain[0]], e.origin[chain[-1] ^ 1]
        inner = [e.origin[h] for h in chain[1:]]
        linked = all(e.next[a] == b for a, b in pairwise(chain))
        return (
            linked
            and ends[0] != ends[1]
            and all(map(self._is_node, ends))
            and not any(map(self._is_node, inner))
        )

    def _plan(self, chain: list[int]) -> _Merge | None:
        """Where everything would go, or None where the rim or the topology forbids it."""
        e = self.editor
        stays, goes = e.origin[chain[0]], e.origin[chain[-1] ^ 1]
        sides = e.face[chain[0]], e.face[chain[0] ^ 1]
        at_rim = OUTSIDE in sides
        if self._rank(goes) > self._rank(stays):
            chain = [h ^ 1 for h in reversed(chain)]
            stays, goes = goes, stays
        if self.corner[goes]:
            return None
        if at_rim:
            if not self._slides(goes, chain):
                return None
        elif self.on_rim[goes]:
            return None  # both ends lie on the rim: the land would be pinched
        if any(f != OUTSIDE and self._n_nodes(f, chain) <= 3 for f in sides):
            return None
        faces = {e.face[h] for v in (stays, goes) for h in e.outgoing(v)} - {OUTSIDE}
        if any(self.locked[f] for f in faces):
            return None
        fixed = self.on_rim[stays] or self.corner[stays]
        x0, y0 = e.x[stays], e.y[stays]
        x1, y1 = e.x[goes], e.y[goes]
        target = (x0, y0) if fixed else (0.5 * (x0 + x1), 0.5 * (y0 + y1))
        moves = {e.origin[h]: target for h in chain[1:]}
        own = {h >> 1 for h in chain}
        for vertex in (stays, goes):
            moves[vertex] = target
            shift = target[0] - e.x[vertex], target[1] - e.y[vertex]
            self._follow(vertex, shift, own, moves)
        return _Merge(chain, moves, sorted(faces))

    def _rank(self, vertex: int) -> int:
        """Corners of the land stay before rim vertices, those before inner ones."""
        return 2 if self.corner[vertex] else int(self.on_rim[vertex])

    def _slides(self, vertex: int, chain: list[int]) -> bool:
        """Whether the rim is straight at the vertex that goes, and along the chain."""
        e = self.editor
        if len(chain) > 1 or not self.on_rim[vertex]:
            return False
        rim = [h for h in e.outgoing(vertex) if OUTSIDE in (e.face[h], e.face[h ^ 1])]
        if len(rim) != 2:
            return False
        (ax, ay), (bx, by) = (
            (e.x[e.origin[h ^ 1]] - e.x[vertex], e.y[e.origin[h ^ 1]] - e.y[vertex]) for h in rim
        )
        bend = abs(ax * by - ay * bx)
        return bend <= STRAIGHT_RIM * math.hypot(ax, ay) * math.hypot(bx, by)

    def _n_nodes(self, face: int, chain: list[int]) -> int:
        start = next(h for h in (chain[0], chain[0] ^ 1) if self.editor.face[h] == face)
        return sum(self._is_node(self.editor.origin[h]) for h in self.editor.ring(start))

    def _follow(
        self,
        vertex: int,
        shift: tuple[float, float],
        own: set[int],
        moves: dict[int, tuple[float, float]],
    ) -> None:
        """Let the inner vertices of the other chains at a vertex follow its shift."""
        e = self.editor
        if shift == (0.0, 0.0):
            return
        for first in e.outgoing(vertex):
            if first >> 1 in own or OUTSIDE in (e.face[first], e.face[first ^ 1]):
                continue
            inner, lengths, h = [], [], first
            while True:
                end = e.origin[h ^ 1]
                step = math.hypot(e.x[end] - e.x[e.origin[h]], e.y[end] - e.y[e.origin[h]])
                lengths.append(step)
                if self._is_node(end):
                    break
                inner.append(end)
                h = e.next[h]
            total, run = sum(lengths), 0.0
            for v, step in zip(inner, lengths, strict=False):
                run += step
                share = 1.0 - run / total
                x, y = moves.get(v, (e.x[v], e.y[v]))
                moves[v] = x + share * shift[0], y + share * shift[1]

    def apply(self, batch: list[_Merge]) -> None:
        """Do the merges of a batch that leave legal parcels; they share no face."""
        if not batch:
            return
        before = self._evaluate([(f, {}) for m in batch for f in m.faces])
        after = self._evaluate([(f, m.moves) for m in batch for f in m.faces])
        start = 0
        for merge in batch:
            own = slice(start, start + len(merge.faces))
            start = own.stop
            area = after.area[own]
            enough = area >= np.minimum(self.min_area, before.area[own])
            rise = float((after.irregularity[own] - before.irregularity[own]).sum())
            if (
                after.simple[own].all()
                and enough.all()
                and rise <= IRREGULARITY_RISE * len(merge.faces)
            ):
                self._do(merge)

    def _start(self, face: int) -> int:
        """A living half-edge of a face."""
        h = self.starts[face]
        while not self.editor.is_edge(h):
            # a removed half-edge still points at what followed it in its loop
            h = self.editor.next[h]
        self.starts[face] = h
        return h

    def _do(self, merge: _Merge) -> None:
        for vertex, (x, y) in merge.moves.items():
            self.editor.move(vertex, x, y)
        for h in merge.chain:
            self.editor.collapse_edge(h)
        self.changed = True

    def _evaluate(self, jobs: list[tuple[int, dict[int, tuple[float, float]]]]) -> _Shapes:
        """Shapes of faces with some vertices moved; vertices that coincide count once."""
        e = self.editor
        rings = []
        for face, moves in jobs:
            ring: list[tuple[float, float]] = []
            for h in e.ring(self._start(face)):
                v = e.origin[h]
                p = moves.get(v) or (e.x[v], e.y[v])
                if not ring or p != ring[-1]:
                    ring.append(p)
            if ring[0] == ring[-1]:
                ring.pop()
            rings.append(ring)
        return _shapes(rings)


@dataclass(frozen=True, eq=False)
class _Shapes:
    simple: BoolArray
    area: FloatArray
    irregularity: FloatArray


def _shapes(rings: list[list[tuple[float, float]]]) -> _Shapes:
    """Whether rings are simple and counter-clockwise, their areas and irregularities."""
    n = len(rings)
    simple = np.zeros(n, dtype=bool)
    area, irregularity = np.zeros(n), np.full(n, np.inf)
    proper = np.array([i for i, ring in enumerate(rings) if len(ring) >= 3], dtype=np.int64)
    if len(proper) == 0:
        return _Shapes(simple, area, irregularity)
    count = np.array([len(rings[i]) for i in proper])
    offsets = np.append(0, np.cumsum(count))
    xy = np.array([p for i in proper for p in rings[i]])
    area[proper] = ring_areas(xy, offsets)
    polygons = shapely.polygons(linear_rings(xy, offsets))
    simple[proper] = shapely.is_valid(polygons) & (area[proper] > 0)
    corners, corner_offsets = reported_polygons(xy, offsets)
    irregularity[proper] = polygon_irregularity(xy[corners], corner_offsets)
    return _Shapes(simple, area, irregularity)
