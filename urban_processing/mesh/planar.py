"""`PlanarMesh`: an immutable planar partition as half-edge arrays."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import TopologyError

IntArray = npt.NDArray[np.int64]
FloatArray = npt.NDArray[np.float64]
BoolArray = npt.NDArray[np.bool_]

OUTSIDE = -1
"""Face to the left of half-edges that bound the land from outside, holes included."""


@dataclass(frozen=True, eq=False)
class PlanarMesh:
    """A planar partition: V vertices, E edges of two half-edges each, F faces.

    Half-edges ``2 * e`` and ``2 * e + 1`` are the two directions of edge ``e``, so the twin
    of ``h`` is ``h ^ 1``. A face lies to the left of its half-edges; its outer loop runs
    counter-clockwise, the loops of holes clockwise. Dangling edges are legal: the same face
    then lies on both sides.

    Parameters
    ----------
    xy
        (V, 2) coordinates.
    origin
        (2E,) vertex that a half-edge leaves.
    next
        (2E,) following half-edge around the face on the left.
    face
        (2E,) face on the left, `OUTSIDE` where there is none.
    n_faces
        Number of faces; faces are ``0 … n_faces - 1``.
    """

    xy: FloatArray
    origin: IntArray
    next: IntArray
    face: IntArray
    n_faces: int

    def __post_init__(self) -> None:
        for array in (self.xy, self.origin, self.next, self.face):
            array.flags.writeable = False

    def __repr__(self) -> str:
        return f"PlanarMesh({len(self.xy)} vertices, {self.n_edges} edges, {self.n_faces} faces)"

    @property
    def n_edges(self) -> int:
        """Number of undirected edges."""
        return len(self.origin) // 2

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.xy)

    @cached_property
    def target(self) -> IntArray:
        """(2E,) vertex that a half-edge points to."""
        return np.asarray(self.origin.reshape(-1, 2)[:, ::-1].reshape(-1))

    @cached_property
    def previous(self) -> IntArray:
        """(2E,) preceding half-edge around the face on the left."""
        out = np.empty_like(self.next)
        out[self.next] = np.arange(len(self.next))
        return out

    @cached_property
    def valence(self) -> IntArray:
        """(V,) number of edges at a vertex."""
        return np.bincount(self.origin, minlength=self.n_vertices)

    @cached_property
    def vertex_half_edge(self) -> IntArray:
        """(V,) one half-edge that leaves a vertex, the one with the lowest index."""
        out = np.full(self.n_vertices, -1)
        out[self.origin[::-1]] = np.arange(len(self.origin))[::-1]
        return out

    @cached_property
    def edge_length(self) -> FloatArray:
        """(E,) length of an edge in metres."""
        d = self.xy[self.origin[1::2]] - self.xy[self.origin[0::2]]
        return np.hypot(d[:, 0], d[:, 1])

    @cached_property
    def edge_is_boundary(self) -> BoolArray:
        """(E,) whether an edge lies on the rim of the land or of a hole."""
        return np.asarray((self.face.reshape(-1, 2) == OUTSIDE).any(axis=1))

    @cached_property
    def vertex_is_boundary(self) -> BoolArray:
        """(V,) whether a vertex lies on the rim of the land or of a hole."""
        out = np.zeros(self.n_vertices, dtype=bool)
        out[self.origin[self.face == OUTSIDE]] = True
        return out

    @cached_property
    def loops(self) -> Loops:
        """All loops of half-edges, faces first in order, each from its lowest half-edge."""
        return _find_loops(self)

    @cached_property
    def face_loop(self) -> IntArray:
        """(F,) loop of a face; of several loops, the one around the largest area."""
        loops = self.loops
        area = self.loop_area
        order = np.lexsort((area, loops.face))
        order = order[loops.face[order] != OUTSIDE]
        out = np.full(self.n_faces, -1)
        out[loops.face[order]] = order
        return out

    @cached_property
    def face_n_loops(self) -> IntArray:
        """(F,) number of loops of a face: 1, or more while it still has holes."""
        inside = self.loops.face[self.loops.face != OUTSIDE]
        return np.bincount(inside, minlength=self.n_faces)

    @cached_property
    def loop_area(self) -> FloatArray:
        """Signed area of each loop in m², positive where it runs counter-clockwise."""
        loops = self.loops
        h = loops.half_edges
        # relative to a vertex of the loop, so that far-off loops lose no digits
        first = self.xy[self.origin[h[loops.offsets[:-1]]]]
        base = np.repeat(first, np.diff(loops.offsets), axis=0)
        a, b = self.xy[self.origin[h]] - base, self.xy[self.target[h]] - base
        cross = a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]
        return 0.5 * np.add.reduceat(cross, loops.offsets[:-1]) if len(h) else np.empty(0)

    @cached_property
    def face_area(self) -> FloatArray:
        """(F,) area of a face in m², its holes taken off."""
        inside = self.loops.face != OUTSIDE
        out = np.zeros(self.n_faces)
        np.add.at(out, self.loops.face[inside], self.loop_area[inside])
        return out

    def vertices_of(self, edges: BoolArray) -> BoolArray:
        """(V,) vertices of the chosen edges, (E,)."""
        out = np.zeros(self.n_vertices, dtype=bool)
        out[self.origin[np.repeat(edges, 2)]] = True
        return out

    def face_half_edges(self, face: int) -> IntArray:
        """Half-edges around the (outer) loop of a face."""
        return self.loops.ring(int(self.face_loop[face]))

    def face_rings(self, faces: IntArray | None = None) -> tuple[IntArray, IntArray]:
        """Half-edges of the (outer) loops of faces, all by default, as one ragged array.

        Returns
        -------
        half_edges, offsets
            The loop of the i-th face is ``half_edges[offsets[i]:offsets[i + 1]]``.
        """
        loops = self.loops
        loop = self.face_loop if faces is None else self.face_loop[faces]
        count = loops.offsets[loop + 1] - loops.offsets[loop]
        offsets = np.append(0, np.cumsum(count))
        step = np.arange(int(offsets[-1])) - np.repeat(offsets[:-1], count)
        return loops.half_edges[np.repeat(loops.offsets[loop], count) + step], offsets

    def face_polygons(self, offset: tuple[float, float] = (0.0, 0.0)) -> npt.NDArray[np.object_]:
        """(F,) shapely polygons of the faces, shifted by `offset`."""
        loops = self.loops
        xy = self.xy[self.origin[loops.half_edges]] + np.asarray(offset)
        rings = linear_rings(xy, loops.offsets)
        polygons = shapely.polygons(rings[self.face_loop])
        for face in np.flatnonzero(self.face_n_loops > 1):
            own = np.flatnonzero(loops.face == face)
            holes = [rings[i] for i in own if i != self.face_loop[face]]
            polygons[face] = shapely.Polygon(rings[self.face_loop[face]], holes)
        return np.asarray(polygons)

    def outgoing(self, vertex: int) -> list[int]:
        """Half-edges that leave a vertex, clockwise."""
        start = h = int(self.vertex_half_edge[vertex])
        out = []
        while True:
            out.append(h)
            h = int(self.next[h ^ 1])
            if h == start:
                return out

    def validate(self) -> None:
        """Raise `TopologyError` unless every invariant of the structure holds."""
        n_half = len(self.origin)
        problems = []
        if not np.isfinite(self.xy).all():
            problems.append("A vertex has a coordinate that is not finite.")
        if not np.array_equal(np.sort(self.next), np.arange(n_half)):
            problems.append("`next` is not a permutation of the half-edges.")
        elif not np.array_equal(self.origin[self.next], self.target):
            problems.append("A half-edge does not start where the one before it ends.")
        elif not np.array_equal(self.face[self.next], self.face):
            problems.append("The half-edges of one loop lie at different faces.")
        if (self.origin == self.target).any():
            problems.append("An edge starts and ends at the same vertex.")
        present = np.unique(self.face[self.face != OUTSIDE])
        if not np.array_equal(present, np.arange(self.n_faces)):
            problems.append("A face has no half-edges, or a half-edge has no face.")
        if (self.valence == 0).any():
            problems.append("A vertex has no edge.")
        if problems:
            raise TopologyError(problems)
        self._validate_geometry()

    def _validate_geometry(self) -> None:
        problems = []
        if (self.edge_length <= 0).any():
            problems.append("An edge has no length.")
        if self.n_faces and not (self.face_area > 0).all():
            problems.append("A face has no area or runs clockwise.")
        vertices_of_fans = sum(1 for _ in _fans(self))
        if vertices_of_fans != int((self.valence > 0).sum()):
            problems.append("The half-edges around a vertex form more than one fan.")
        if problems:
            raise TopologyError(problems)


def _fans(mesh: PlanarMesh) -> IntArray:
    """Lowest half-edge of each cycle of the rotation around vertices."""
    rotation = mesh.next[np.arange(len(mesh.next)) ^ 1]
    leader, _ = rank_cycles(rotation)
    return np.unique(leader)


@dataclass(frozen=True, eq=False)
class Loops:
    """Ragged list of loops: ``half_edges[offsets[i]:offsets[i + 1]]`` is loop ``i``."""

    half_edges: IntArray
    offsets: IntArray
    face: IntArray
    """(L,) face to the left of a loop, `OUTSIDE` for the rims of the land and its holes."""
    of_half_edge: IntArray
    """(2E,) loop of a half-edge."""
    position: IntArray
    """(2E,) place of a half-edge within its loop."""

    def ring(self, loop: int) -> IntArray:
        """Half-edges of one loop in order."""
        return self.half_edges[self.offsets[loop] : self.offsets[loop + 1]]


def linear_rings(xy: FloatArray, offsets: IntArray) -> npt.NDArray[np.object_]:
    """Shapely rings of ragged, unclosed rings: ring i is ``xy[offsets[i]:offsets[i + 1]]``."""
    closed = np.insert(xy, offsets[1:], xy[offsets[:-1]], axis=0)
    ring = np.repeat(np.arange(len(offsets) - 1), np.diff(offsets) + 1)
    return np.asarray(shapely.linearrings(closed, indices=ring), dtype=object)


def rank_cycles(successor: IntArray) -> tuple[IntArray, IntArray]:
    """Return for each element the lowest element of its cycle and its distance from there.

    Pointer doubling (Wyllie's list ranking): O(n log longest cycle), no Python loop.
    """
    n = len(successor)
    leader = np.arange(n)
    jump = successor.copy()
    while True:
        smaller = np.minimum(leader, leader[jump])
        if np.array_equal(smaller, leader):
            break
        leader = smaller
        jump = jump[jump]
    # cut each cycle before its leader, then count the steps to the end of the list
    is_last = successor == leader
    step = np.where(is_last, np.arange(n), successor)
    to_end = np.where(is_last, 0, 1)
    while True:
        further = to_end[step]
        if not further.any():
            break
        to_end = to_end + further
        step = step[step]
    return leader, to_end[leader] - to_end


def _find_loops(mesh: PlanarMesh) -> Loops:
    leader, position = rank_cycles(mesh.next)
    n_half = len(mesh.next)
    face = np.where(mesh.face == OUTSIDE, mesh.n_faces, mesh.face)
    order = np.lexsort((position, leader, face))
    first = np.flatnonzero(position[order] == 0)
    offsets = np.append(first, n_half)
    of_half_edge = np.empty(n_half, dtype=np.int64)
    of_half_edge[order] = np.repeat(np.arange(len(first)), np.diff(offsets))
    return Loops(order, offsets, mesh.face[order[first]], of_half_edge, position)
