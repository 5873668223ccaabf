"""What a straight skeleton is as arrays."""

from __future__ import annotations

from dataclasses import dataclass

from urban_processing.mesh.planar import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class Skeleton:
    """Faces of the straight skeleton of one polygon with N vertices.

    Parameters
    ----------
    xy
        (V, 2) first the vertices of the polygon's rings in their order (vertex ``k`` begins
        edge ``k``), then the inner nodes, on `FINE_GRID`.
    height
        (V,) distance from the contour in metres; 0 on it.
    faces
        One for each merged edge, which is a run of collinear edges of one ring: a ring of
        vertices, counter-clockwise, that begins with those of the run in order, the `following`
        of the last one included; none twice.
    edge_face
        (N,) face of each edge.
    following
        (N,) next vertex of the contour after each. Where rings touch at a vertex, it is that of the
        edge which bounds the same corner of the land, which may be of another ring: faces on both
        sides of a touch have no vertex in common there.
    """

    xy: FloatArray
    height: FloatArray
    faces: tuple[IntArray, ...]
    edge_face: IntArray
    following: IntArray
