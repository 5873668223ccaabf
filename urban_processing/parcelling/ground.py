"""What a strategy takes and gives: ground to be divided, and the pieces made of it."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import BlockRings, ragged_rows
from urban_processing.mesh.corners import ring_neighbours
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

UintArray = npt.NDArray[np.uint64]


@dataclass(frozen=True, eq=False)
class Ground:
    """B polygons to be divided, and what their edges are; what runs over edges is N long.

    Parameters
    ----------
    rings
        Rings of the polygons: shells counter-clockwise, holes clockwise.
    access
        (N,) whether an edge is a street side.
    width
        (N,) width of the street along an edge in metres; NaN where none is known.
    street
        (N,) number of the street along an edge; -1 where none is known.
    lineage
        (B,) seed of each polygon's random numbers, to be used with `hashing.uniform`.
    """

    rings: BlockRings
    access: BoolArray
    width: FloatArray
    street: IntArray
    lineage: UintArray

    def __len__(self) -> int:
        """Return the number of polygons."""
        return len(self.lineage)

    def of(self, rows: IntArray) -> Ground:
        """Return some of the polygons."""
        if _are_all(rows, len(self)):
            return self
        rings, edges = self.rings.of(rows)
        return Ground(
            rings, self.access[edges], self.width[edges], self.street[edges], self.lineage[rows]
        )


@dataclass(frozen=True, eq=False)
class Rules:
    """What the parcels of B polygons are to be, one value for each; areas in m², lengths in m.

    Parameters
    ----------
    min_area, max_area, min_width, max_width
        Bounds (Vanegas 2012, section 4.1).
    irregularity
        ω, 0 to 1.
    street_access
        ξ, 0 to 1.
    offset
        Depth of rows along streets; infinite where they meet back to back.
    by_length
        Whether corner lots belong to the longer street, not to the wider one.
    snap
        Distance within which a cut goes through a vertex of the contour.
    corner
        Angle in degrees; a contour that bends by more is another street from there on.
    """

    min_area: FloatArray
    max_area: FloatArray
    min_width: FloatArray
    max_width: FloatArray
    irregularity: FloatArray
    street_access: FloatArray
    offset: FloatArray
    by_length: BoolArray
    snap: FloatArray
    corner: FloatArray

    def of(self, rows: IntArray) -> Rules:
        """Return the rules of some polygons."""
        return Rules(**{f.name: getattr(self, f.name)[rows] for f in dataclasses.fields(self)})


@dataclass(frozen=True, eq=False)
class Pieces:
    """Faces that tile the ground; V vertices, R rings, F faces. They share vertices by index.

    A vertex of one face that lies on the boundary of another is a vertex of that one too.

    Parameters
    ----------
    xy
        (V, 2) vertices: first those of the ground in their order, then those added, on
        `FINE_GRID`.
    vertex
        (N,) vertices of all rings, one after the other; shells counter-clockwise. Of vertices of
        the ground at one place, where its rings touch, it is the first (`BlockRings.place`).
    offsets
        (R + 1,) where rings begin in `vertex`.
    face
        (R,) face of each ring, not decreasing; its shell first.
    access
        (N,) whether the edge from a ring's vertex to the next is a street side.
    block
        (F,) polygon of the ground that a face is a piece of, not decreasing.
    lineage
        (F,) seed of each face, unique within the ground, that depends on its own path alone.
    level
        (F,) number of cuts that made a face.
    patio
        (F,) faces that are the inside of a perimeter block.
    """

    xy: FloatArray
    vertex: IntArray
    offsets: IntArray
    face: IntArray
    access: BoolArray
    block: IntArray
    lineage: UintArray
    level: IntArray
    patio: BoolArray

    @property
    def n_faces(self) -> int:
        """Number of faces."""
        return len(self.block)

    @property
    def following(self) -> IntArray:
        """(N,) place in `vertex` of the next vertex of the ring of each."""
        return ring_neighbours(self.offsets)[1]

    @property
    def edge_face(self) -> IntArray:
        """(N,) face of each edge."""
        return np.repeat(self.face, np.diff(self.offsets))

    def polygons(self) -> npt.NDArray[np.object_]:
        """(F,) the faces as shapely polygons."""
        size = np.diff(self.offsets)
        closed = np.append(0, np.cumsum(size + 1))
        at = np.arange(closed[-1]) - np.repeat(np.arange(len(size)), size + 1)
        at[closed[1:] - 1] = self.offsets[:-1]
        rings_of_face = np.searchsorted(self.face, np.arange(self.n_faces + 1))
        return np.asarray(
            shapely.from_ragged_array(
                shapely.GeometryType.POLYGON,
                self.xy[self.vertex[at]],
                (closed, rings_of_face),
            ),
            dtype=object,
        )


def _are_all(rows: IntArray, n: int) -> bool:
    """Whether rows are all of n rows in their order."""
    return len(rows) == n and bool((np.diff(rows) > 0).all())


def sort_faces(pieces: Pieces) -> Pieces:
    """Put faces into the order of their blocks; those of one block stay in theirs."""
    order = np.argsort(pieces.block, kind="stable")
    rings = ragged_rows(np.searchsorted(pieces.face, np.arange(pieces.n_faces + 1)), order)
    edges = ragged_rows(pieces.offsets, rings)
    size = np.diff(pieces.offsets)[rings]
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return Pieces(
        xy=pieces.xy,
        vertex=pieces.vertex[edges],
        offsets=np.append(0, np.cumsum(size)),
        face=rank[pieces.face[rings]],
        access=pieces.access[edges],
        block=pieces.block[order],
        lineage=pieces.lineage[order],
        level=pieces.level[order],
        patio=pieces.patio[order],
    )


def join_parts(parts: Sequence[tuple[IntArray, Pieces]], ground: Ground) -> Pieces:
    """Join pieces of some polygons of the ground each to pieces of all of it.

    Parameters
    ----------
    parts
        Polygons of the ground, each of them in one part, and the pieces of ``ground.of`` these.
    ground
        The whole.
    """
    if len(parts) == 1 and _are_all(parts[0][0], len(ground)):
        return parts[0][1]
    n = len(ground.rings.xy)
    added = [pieces.xy[len(ground.of(rows).rings.xy) :] for rows, pieces in parts]
    edge_of = [ground.rings.of(rows)[1] for rows, _ in parts]
    first_added = n + np.append(0, np.cumsum([len(xy) for xy in added]))
    vertex, face, n_faces, n_edges = [], [], 0, 0
    offsets = [np.zeros(1, dtype=np.int64)]
    for k, (_, pieces) in enumerate(parts):
        own = np.append(edge_of[k], np.arange(first_added[k], first_added[k + 1]))
        vertex.append(own[pieces.vertex])
        face.append(pieces.face + n_faces)
        offsets.append(pieces.offsets[1:] + n_edges)
        n_faces, n_edges = n_faces + pieces.n_faces, n_edges + len(pieces.vertex)
    return sort_faces(
        Pieces(
            xy=np.concatenate([ground.rings.xy, *added]),
            vertex=np.concatenate(vertex),
            offsets=np.concatenate(offsets),
            face=np.concatenate(face),
            access=np.concatenate([pieces.access for _, pieces in parts]),
            block=np.concatenate([rows[pieces.block] for rows, pieces in parts]),
            lineage=np.concatenate([pieces.lineage for _, pieces in parts]),
            level=np.concatenate([pieces.level for _, pieces in parts]),
            patio=np.concatenate([pieces.patio for _, pieces in parts]),
        )
    )
