"""`Rings`: the rings of many faces in flat arrays, and what is measured on all of them at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.touches import loops_of


@dataclass(frozen=True, eq=False)
class Rings:
    """Rings of F faces, R in all, with N vertices; each edge lies on a numbered segment.

    Parameters
    ----------
    vertex
        (N,) vertices of the rings, one ring after the other; shells counter-clockwise.
    segment
        (N,) segment that the edge from a vertex to the next one lies on.
    offsets
        (R + 1,) where rings begin in `vertex`.
    face
        (R,) face of each ring, not decreasing; its shell first. No face is without ring.
    """

    vertex: IntArray
    segment: IntArray
    offsets: IntArray
    face: IntArray

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return int(self.face[-1]) + 1 if len(self.face) else 0

    @cached_property
    def size(self) -> IntArray:
        """(R,) number of vertices of each ring."""
        return self.offsets[1:] - self.offsets[:-1]

    @cached_property
    def following(self) -> IntArray:
        """(N,) place of the next vertex in the ring."""
        after = np.arange(1, len(self.vertex) + 1)
        after[self.offsets[1:] - 1] = self.offsets[:-1]
        return after

    @cached_property
    def edge_face(self) -> IntArray:
        """(N,) face of each edge."""
        return self.face.repeat(self.size)

    @cached_property
    def is_shell(self) -> BoolArray:
        """(R,) rings that are shells."""
        return changes(self.face)

    @cached_property
    def n_rings(self) -> IntArray:
        """(F,) number of rings of each face."""
        return self.face_rings[1:] - self.face_rings[:-1]

    @cached_property
    def face_rings(self) -> IntArray:
        """(F + 1,) where the rings of each face begin."""
        first = np.empty(self.n_faces + 1, dtype=np.int64)
        first[:-1] = self.is_shell.nonzero()[0]
        first[-1] = len(self.face)
        return first

    @cached_property
    def face_nodes(self) -> IntArray:
        """(F + 1,) where the vertices of each face begin."""
        return self.offsets[self.face_rings]

    def take(self, faces: IntArray) -> Rings:
        """Return the rings of some faces in a new order; face k is ``faces[k]``."""
        number = np.arange(len(faces))
        if self.n_faces == len(self.face):
            rings, face = faces, number
        else:
            n_rings = self.n_rings[faces]
            rings, face = ranges(self.face_rings[faces], n_rings), number.repeat(n_rings)
        size = self.size[rings]
        nodes = ranges(self.offsets[rings], size)
        return Rings(self.vertex[nodes], self.segment[nodes], starts(size), face)

    def signed_areas(self, xy: FloatArray) -> FloatArray:
        """(R,) areas of the rings in m², those of holes below zero."""
        begin = self.offsets[:-1]
        x, y = xy[:, 0][self.vertex], xy[:, 1][self.vertex]
        x -= x[begin].repeat(self.size)
        y -= y[begin].repeat(self.size)
        double = x * y[self.following] - y * x[self.following]
        return np.asarray(0.5 * np.add.reduceat(double, begin))

    def areas(self, xy: FloatArray) -> FloatArray:
        """(F,) areas of the faces in m²."""
        area = self.signed_areas(xy)
        return area if len(area) == self.n_faces else np.add.reduceat(area, self.face_rings[:-1])

    def polygons(self, xy: FloatArray) -> npt.NDArray[np.object_]:
        """(F,) the faces as shapely polygons."""
        at = ranges(self.offsets[:-1], self.size + 1)
        closed = starts(self.size + 1)
        at[closed[1:] - 1] = self.offsets[:-1]
        return np.asarray(
            shapely.from_ragged_array(
                shapely.GeometryType.POLYGON, xy[self.vertex[at]], (closed, self.face_rings)
            ),
            dtype=object,
        )

    def are_valid(self, xy: FloatArray) -> BoolArray:
        """(F,) faces that are valid polygons; only those that are not convex are looked into."""
        x, y = xy[:, 0][self.vertex], xy[:, 1][self.vertex]
        x, y = x[self.following] - x, y[self.following] - y
        left = x * y[self.following] - y * x[self.following] > 0
        valid = np.logical_and.reduceat(left, self.face_nodes[:-1]) & (self.n_rings == 1)
        doubtful = np.flatnonzero(~valid)
        if len(doubtful):
            valid[doubtful] = shapely.is_valid(self.take(doubtful).polygons(xy))
            doubtful = doubtful[~valid[doubtful]]
        if len(doubtful):
            valid[doubtful] = shapely.is_valid(self.take(doubtful).parted(xy).polygons(xy))
        return np.asarray(valid)

    def parted(self, xy: FloatArray) -> Rings:
        """Return the rings taken apart where they come to a vertex again; shells first.

        Those of a face do so where holes of the ground touch another of its rings.
        """
        ring = np.arange(len(self.face)).repeat(self.size)
        if len(np.unique(ring * (self.vertex.max() + 1) + self.vertex)) == len(ring):
            return self
        vertex = self.vertex.tolist()
        loops = [
            (face, loop)
            for face, a, b in zip(self.face, self.offsets[:-1], self.offsets[1:], strict=True)
            for loop in loops_of(range(a, b), vertex)
        ]
        size = np.array([len(loop) for _, loop in loops])
        node = np.concatenate([loop for _, loop in loops])
        made = Rings(
            vertex=self.vertex[node],
            segment=self.segment[node],
            offsets=starts(size),
            face=np.array([face for face, _ in loops]),
        )
        order = np.lexsort((-made.signed_areas(xy), made.face))
        node = ranges(made.offsets[order], size[order])
        return Rings(made.vertex[node], made.segment[node], starts(size[order]), made.face[order])


def join_rings(parts: Sequence[Rings]) -> Rings:
    """Put the rings of one part after those of the other; faces are numbered on."""
    first = np.append(0, np.cumsum([part.n_faces for part in parts]))
    return Rings(
        vertex=np.concatenate([part.vertex for part in parts]),
        segment=np.concatenate([part.segment for part in parts]),
        offsets=starts(np.concatenate([part.size for part in parts])),
        face=np.concatenate([part.face + n for part, n in zip(parts, first, strict=False)]),
    )


def starts(counts: IntArray) -> IntArray:
    """(K + 1,) where runs of given lengths begin, and where the last one ends."""
    out = np.empty(len(counts) + 1, dtype=np.int64)
    out[0] = 0
    np.cumsum(counts, out=out[1:])
    return out


def changes(values: IntArray) -> BoolArray:
    """(K,) where a value is not the one before it; so is the first."""
    out = np.ones(len(values), dtype=bool)
    np.not_equal(values[1:], values[:-1], out=out[1:])
    return out


def ranges(first: IntArray, counts: IntArray) -> IntArray:
    """Return ``first[k], first[k] + 1, …``, ``counts[k]`` numbers for each k, in one array."""
    end = counts.cumsum()
    out: IntArray = (first - end + counts).repeat(counts)
    out += np.arange(len(out))
    return out
