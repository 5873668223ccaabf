"""Meshes from polygons whose shared boundaries have the same vertices."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import TopologyError
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray, PlanarMesh, rank_cycles
from urban_processing.site import snap_to_grid


def mesh_from_polygons(polygons: Sequence[shapely.Polygon]) -> PlanarMesh:
    """Build the mesh whose face ``i`` is ``polygons[i]``.

    Where rims touch at a single point, each gets a vertex of its own there. Neighbours must
    share vertices exactly (a valid coverage): a vertex of one that lies on
    another's boundary is a vertex of the other too. Coordinates are rounded to the grid.

    Raises
    ------
    TopologyError
        If two polygons claim the same side of an edge, that is, overlap.
    """
    oriented = shapely.orient_polygons(np.asarray(polygons, dtype=object))
    rings, ring_face = shapely.get_rings(oriented, return_index=True)
    if len(rings) == 0:
        raise TopologyError("There is no polygon to build a mesh from.")
    xy, origin, ring_of = _ring_vertices(rings)
    vertices, origin = _unique_vertices(xy, origin)
    first = np.flatnonzero(np.diff(ring_of, prepend=-1))
    following = np.arange(1, len(origin) + 1)
    following[np.append(first[1:], len(origin)) - 1] = first
    return _pair_half_edges(
        vertices, origin, origin[following], following, ring_face[ring_of], len(oriented)
    )


def canonical_rings(polygons: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Start every ring at its lowest vertex; shells counter-clockwise."""
    return np.asarray(shapely.orient_polygons(shapely.normalize(polygons)), dtype=object)


def _ring_vertices(rings: object) -> tuple[FloatArray, IntArray, IntArray]:
    """Coordinates without the closing point, their running number and their ring."""
    xy, ring_of = shapely.get_coordinates(rings, return_index=True)
    last = np.append(np.diff(ring_of) > 0, True)
    xy, ring_of = snap_to_grid(xy[~last]), ring_of[~last]
    repeats = np.append(False, (xy[1:] == xy[:-1]).all(axis=1) & (ring_of[1:] == ring_of[:-1]))
    xy, ring_of = xy[~repeats], ring_of[~repeats]
    return xy, np.arange(len(xy)), ring_of


def _unique_vertices(xy: FloatArray, order: IntArray) -> tuple[FloatArray, IntArray]:
    """Merge equal coordinates, in order of their first appearance."""
    xy = xy + 0.0  # no negative zeros
    unique, first, inverse = np.unique(xy, axis=0, return_index=True, return_inverse=True)
    rank = np.empty(len(unique), dtype=np.int64)
    by_appearance = np.argsort(first, kind="stable")
    rank[by_appearance] = np.arange(len(unique))
    return unique[by_appearance], rank[inverse.ravel()][order]


def _pair_half_edges(
    xy: FloatArray,
    tail: IntArray,
    head: IntArray,
    following: IntArray,
    face: IntArray,
    n_faces: int,
) -> PlanarMesh:
    """Give every half-edge its twin; half-edges without one get an outside twin."""
    n = len(tail)
    low, high = np.minimum(tail, head), np.maximum(tail, head)
    _, edge_first, edge = np.unique(
        low * (len(xy) + 1) + high, return_index=True, return_inverse=True
    )
    rank = np.empty(len(edge_first), dtype=np.int64)
    rank[np.argsort(edge_first, kind="stable")] = np.arange(len(edge_first))
    edge = rank[edge.ravel()]
    side = np.where(np.arange(n) == np.sort(edge_first)[edge], 0, 1)
    index = 2 * edge + side
    if len(np.unique(index)) != n:
        raise TopologyError("Polygons overlap: two of them lie on the same side of an edge.")
    n_half = 2 * len(edge_first)
    origin, nxt = np.full(n_half, -1), np.full(n_half, -1)
    faces = np.full(n_half, OUTSIDE)
    origin[index], nxt[index], faces[index] = tail, index[following], face
    missing = np.flatnonzero(origin < 0)
    twin_tail = np.full(n_half, -1)
    twin_tail[index] = head
    origin[missing] = twin_tail[missing ^ 1]
    mesh_next = _close_outside(nxt, missing)
    if len(set(zip(origin.tolist(), _targets(origin).tolist(), strict=True))) != n_half:
        raise TopologyError("Polygons overlap: they run along an edge in the same direction.")
    return _split_pinches(PlanarMesh(xy, origin, mesh_next, faces, n_faces))


def _split_pinches(mesh: PlanarMesh) -> PlanarMesh:
    """Give each fan of half-edges a vertex of its own where rims touch at a point."""
    rotation = mesh.next[np.arange(len(mesh.next)) ^ 1]
    leader, _ = rank_cycles(rotation)
    fans = np.unique(leader)
    if len(fans) == mesh.n_vertices:
        return mesh
    order = np.lexsort((fans, mesh.origin[fans]))
    rank = np.empty(len(fans), dtype=np.int64)
    rank[order] = np.arange(len(fans))
    origin = rank[np.searchsorted(fans, leader)]
    xy = mesh.xy[mesh.origin[fans[order]]]
    return PlanarMesh(xy, origin, mesh.next, mesh.face, mesh.n_faces)


def _targets(origin: IntArray) -> IntArray:
    return np.asarray(origin.reshape(-1, 2)[:, ::-1].reshape(-1))


def _close_outside(nxt: IntArray, outside: IntArray) -> IntArray:
    """Link the outside half-edges: turn around the head through the faces that meet there."""
    nxt = nxt.copy()
    previous = np.full(len(nxt), -1)
    known = np.flatnonzero(nxt >= 0)
    previous[nxt[known]] = known
    is_outside = np.zeros(len(nxt), dtype=bool)
    is_outside[outside] = True
    # the next outside half-edge leaves the head of `o`: it is the twin of the first
    # half-edge into that head that we meet turning clockwise and that lies outside
    probe = outside ^ 1
    found = np.full(len(outside), -1)
    open_ = np.arange(len(outside))
    while len(open_):
        turned = previous[probe[open_]] ^ 1
        done = is_outside[turned]
        found[open_[done]] = turned[done]
        probe[open_] = turned
        open_ = open_[~done]
    nxt[outside] = found
    return nxt
