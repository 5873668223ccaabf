"""`Rings`: the rings of many faces in flat arrays, and what is measured on all of them at once."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray


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
        return np.diff(self.offsets)

    @cached_property
    def following(self) -> IntArray:
        """(N,) place of the next vertex in the ring."""
        after = np.arange(1, len(self.vertex) + 1)
        after[self.offsets[1:] - 1] = self.offsets[:-1]
        return after

    @cached_property
    def edge_face(self) -> IntArray:
        """(N,) face of each edge."""
        return np.repeat(self.face, self.size)

    @cached_property
    def is_shell(self) -> BoolArray:
        """(R,) rings that are shells."""
        return np.asarray(np.diff(self.face, prepend=-1) != 0)

    @cached_property
    def n_rings(self) -> IntArray:
        """(F,) number of rings of each face."""
        return np.diff(self.face_rings)

    @cached_property
    def face_rings(self) -> IntArray:
        """(F + 1,) where the rings of each face begin."""
        return np.append(np.flatnonzero(self.is_shell), len(self.face))

    @cached_property
    def face_nodes(self) -> IntArray:
        """(F + 1,) where the vertices of each face begin."""
        return self.offsets[self.face_rings]

    def take(self, faces: IntArray) -> Rings:
        """Return the rings of some faces in a new order; face k is ``faces[k]``."""
        n_rings = self.n_rings[faces]
        rings = ranges(self.face_rings[faces], n_rings)
        size = self.size[rings]
        nodes = ranges(self.offsets[rings], size)
        return Rings(
            vertex=self.vertex[nodes],
            segment=self.segment[nodes],
            offsets=starts(size),
            face=np.repeat(np.arange(len(faces)), n_rings),
        )

    def signed_areas(self, xy: FloatArray) -> FloatArray:
        """(R,) areas of the rings in m², those of holes below zero."""
        at = xy[self.vertex]
        at -= np.repeat(at[self.offsets[:-1]], self.size, axis=0)
        after = at[self.following]
        double = at[:, 0] * after[:, 1] - at[:, 1] * after[:, 0]
        return np.asarray(0.5 * np.add.reduceat(double, self.offsets[:-1]))

    def areas(self, xy: FloatArray) -> FloatArray:
        """(F,) areas of the faces in m²."""
        return np.asarray(np.add.reduceat(self.signed_areas(xy), self.face_rings[:-1]))

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
        edge = xy[self.vertex[self.following]] - xy[self.vertex]
        after = edge[self.following]
        left = edge[:, 0] * after[:, 1] - edge[:, 1] * after[:, 0] > 0
        valid = np.logical_and.reduceat(left, self.face_nodes[:-1]) & (self.n_rings == 1)
        doubtful = np.flatnonzero(~valid)
        if len(doubtful):
            valid[doubtful] = shapely.is_valid(self.take(doubtful).polygons(xy))
        return np.asarray(valid)


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
    return np.append(0, np.cumsum(counts))


def ranges(first: IntArray, counts: IntArray) -> IntArray:
    """Return ``first[k], first[k] + 1, …``, ``counts[k]`` numbers for each k, in one array."""
    end = np.cumsum(counts)
    total = int(end[-1]) if len(end) else 0
    return np.arange(total) + np.repeat(first - (end - counts), counts)
