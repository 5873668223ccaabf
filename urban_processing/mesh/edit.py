"""Edits of a mesh in one batch: open an editor, change, commit to a new mesh and a `Remap`."""

from __future__ import annotations

import copy
from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import OUTSIDE, IntArray, PlanarMesh
from urban_processing.site import GRID


@dataclass(frozen=True, eq=False)
class Remap:
    """Where the elements of an edited mesh come from: index in the mesh before, or -1.

    The pieces of a split edge have that edge as parent, the halves of a split face that face;
    vertices and edges of a new cut have none.
    """

    vertex: IntArray
    edge: IntArray
    face: IntArray


class MeshEditor:
    """Mutable half-edge lists of a mesh; positions are kept on the coordinate grid.

    The half-edges of an edge ``e`` are ``2 * e`` and ``2 * e + 1`` here too. `commit` drops
    what was removed and renumbers the rest in order.
    """

    def __init__(self, mesh: PlanarMesh) -> None:
        self.x: list[float] = mesh.xy[:, 0].tolist()
        self.y: list[float] = mesh.xy[:, 1].tolist()
        self.origin: list[int] = mesh.origin.tolist()
        self.next: list[int] = mesh.next.tolist()
        self.prev: list[int] = mesh.previous.tolist()
        self.face: list[int] = mesh.face.tolist()
        self.valence: list[int] = mesh.valence.tolist()
        self.half_edge_of: list[int] = mesh.vertex_half_edge.tolist()
        self.edge_parent: list[int] = list(range(mesh.n_edges))
        self.face_parent: list[int] = list(range(mesh.n_faces))
        self.dropped_faces: set[int] = set()
        self._n_old_vertices = mesh.n_vertices

    def copy(self) -> MeshEditor:
        """Return an editor in the same state that is edited by itself."""
        other = object.__new__(MeshEditor)
        for name, value in vars(self).items():
            setattr(other, name, copy.copy(value))
        return other

    def ring(self, half_edge: int) -> list[int]:
        """Half-edges of the loop that `half_edge` belongs to, beginning with it."""
        out = [half_edge]
        nxt = self.next
        h = nxt[half_edge]
        while h != half_edge:
            out.append(h)
            h = nxt[h]
        return out

    def outgoing(self, vertex: int) -> list[int]:
        """Half-edges that leave a vertex, clockwise."""
        start = h = self.half_edge_of[vertex]
        out = []
        while True:
            out.append(h)
            h = self.next[h ^ 1]
            if h == start:
                return out

    def split_edge(self, h: int, x: float, y: float) -> int:
        """Insert a vertex into an edge; `h` keeps its origin. Returns the half-edge after it."""
        t = h ^ 1
        vertex, a = len(self.x), len(self.origin)
        b = a + 1
        self.x.append(round(x / GRID) * GRID)
        self.y.append(round(y / GRID) * GRID)
        self.valence.append(2)
        self.half_edge_of.append(a)
        end = self.origin[t]
        after, before = self.next[h], self.prev[t]
        self.origin += (vertex, end)
        self.face += (self.face[h], self.face[t])
        self.edge_parent.append(self.edge_parent[h >> 1])
        self.origin[t] = vertex
        if after == t:  # a dangling end: the loop turns round at `end`
            self.next += (b, t)
            self.prev += (h, a)
        else:
            self.next += (after, t)
            self.prev += (h, before)
            self.prev[after] = a
            self.next[before] = b
        self.next[h] = a
        self.prev[t] = b
        if self.half_edge_of[end] == t:
            self.half_edge_of[end] = b
        return a

    def connect(self, ha: int, hb: int, points: list[tuple[float, float]]) -> int:
        """Draw a chain inside a face from the origin of `ha` to the origin of `hb`.

        `ha` and `hb` leave the two ends with the face on their left. If they lie on one loop
        the face is split: the half to the left of the chain keeps the face, the other one is
        returned as a new face. If they lie on two loops of the face these become one, and -1
        is returned.
        """
        face = self.face[ha]
        one_loop = self._on_loop(ha, hb)
        first = self._add_chain(ha, hb, points, face)
        if not one_loop:
            return -1
        new = len(self.face_parent)
        self.face_parent.append(self.face_parent[face])
        for h in self.ring(first ^ 1):
            self.face[h] = new
        return new

    def _on_loop(self, start: int, wanted: int) -> bool:
        h = start
        while True:
            if h == wanted:
                return True
            h = self.next[h]
            if h == start:
                return False

    def _add_chain(self, ha: int, hb: int, points: list[tuple[float, float]], face: int) -> int:
        """Append the half-edges of a chain and link them; returns its first half-edge."""
        base = len(self.origin)
        vertices = [self.origin[ha]]
        for i, (x, y) in enumerate(points):
            vertices.append(len(self.x))
            self.x.append(round(x / GRID) * GRID)
            self.y.append(round(y / GRID) * GRID)
            self.valence.append(2)
            self.half_edge_of.append(base + 2 * i + 2)
        vertices.append(self.origin[hb])
        before_a, before_b = self.prev[ha], self.prev[hb]
        n = len(vertices) - 1
        for i in range(n):
            self.origin += (vertices[i], vertices[i + 1])
            self.next += (base + 2 * i + 2, base + 2 * i - 1)
            self.prev += (base + 2 * i - 2, base + 2 * i + 3)
            self.face += (face, face)
            self.edge_parent.append(-1)
        self.valence[vertices[0]] += 1
        self.valence[vertices[-1]] += 1
        last = base + 2 * (n - 1)
        self._link(before_a, base)
        self._link(last, hb)
        self._link(before_b, last ^ 1)
        self._link(base ^ 1, ha)
        return base

    def _link(self, h: int, following: int) -> None:
        self.next[h] = following
        self.prev[following] = h

    def remove_chain(self, chain: list[int]) -> None:
        """Take away a chain between two faces; the face on its left takes over the other one.

        `chain` lists its half-edges in order; its inner vertices have valence 2 and go too.
        """
        first, last = chain[0], chain[-1]
        face, absorbed = self.face[first], self.face[first ^ 1]
        for h in self.ring(first ^ 1):
            self.face[h] = face
        start, stop = self.origin[first], self.origin[last ^ 1]
        self._link(self.prev[first], self.next[first ^ 1])
        self._link(self.prev[last ^ 1], self.next[last])
        for vertex, leaving in ((start, self.next[first ^ 1]), (stop, self.next[last])):
            self.valence[vertex] -= 1
            self.half_edge_of[vertex] = leaving
        for h in chain:
            if h != first:
                self._drop_vertex(self.origin[h])
            self._drop_edge(h)
        self.dropped_faces.add(absorbed)

    def dissolve_vertex(self, vertex: int) -> None:
        """Remove a vertex of valence 2; its two edges become one straight edge."""
        h = self.half_edge_of[vertex]
        t = h ^ 1
        before, after = self.prev[h], self.next[t]
        # `before` arrives at the vertex: stretch it to the end of `h`, and drop `h`
        end = self.origin[t]
        self._link(before, self.next[h])
        self._link(self.prev[t], after)
        self.origin[before ^ 1] = end
        if self.half_edge_of[end] == t:
            self.half_edge_of[end] = before ^ 1
        self._drop_edge(h)
        self._drop_vertex(vertex)

    def collapse_edge(self, h: int) -> None:
        """Merge the target of `h` into its origin.

        It is the caller's care that faces keep at least three edges.
        """
        t = h ^ 1
        kept, gone = self.origin[h], self.origin[t]
        for q in self.outgoing(gone):
            self.origin[q] = kept
        self.valence[kept] += self.valence[gone] - 2
        following = self.next[h]
        self._link(self.prev[h], self.next[h])
        self._link(self.prev[t], self.next[t])
        self.half_edge_of[kept] = following
        self._drop_edge(h)
        self._drop_vertex(gone)

    def _drop_edge(self, h: int) -> None:
        self.origin[h] = self.origin[h ^ 1] = -1

    def _drop_vertex(self, vertex: int) -> None:
        self.half_edge_of[vertex] = -1
        self.valence[vertex] = 0

    def is_edge(self, h: int) -> bool:
        """Whether a half-edge still exists."""
        return self.origin[h] >= 0

    def move(self, vertex: int, x: float, y: float) -> None:
        """Put a vertex elsewhere."""
        self.x[vertex] = round(x / GRID) * GRID
        self.y[vertex] = round(y / GRID) * GRID

    def commit(self) -> tuple[PlanarMesh, Remap]:
        """Return the edited mesh and where its elements come from."""
        origin = np.array(self.origin, dtype=np.int64)
        nxt = np.array(self.next, dtype=np.int64)
        face = np.array(self.face, dtype=np.int64)
        alive = np.flatnonzero(np.array(self.half_edge_of) >= 0)
        new_vertex = np.full(len(self.x), -1)
        new_vertex[alive] = np.arange(len(alive))
        edges = np.flatnonzero(origin[::2] >= 0)
        half = np.column_stack([2 * edges, 2 * edges + 1]).ravel()
        new_half = np.full(len(origin), -1)
        new_half[half] = np.arange(len(half))
        xy = np.column_stack([self.x, self.y])[alive]
        faces = np.setdiff1d(
            np.arange(len(self.face_parent)), np.array(sorted(self.dropped_faces), dtype=np.int64)
        )
        new_face = np.full(len(self.face_parent) + 1, OUTSIDE)  # the last stands for outside
        new_face[faces] = np.arange(len(faces))
        mesh = PlanarMesh(
            xy,
            new_vertex[origin[half]],
            new_half[nxt[half]],
            new_face[face[half]],
            len(faces),
        )
        remap = Remap(
            vertex=np.where(alive < self._n_old_vertices, alive, -1),
            edge=np.array(self.edge_parent, dtype=np.int64)[edges],
            face=np.array(self.face_parent, dtype=np.int64)[faces],
        )
        return mesh, remap
