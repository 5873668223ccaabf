"""What lies at given places: edges and vertices of a mesh, and segments of lines."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import snap_to_grid

Geometries = npt.NDArray[np.object_]


def edges_at(mesh: PlanarMesh, segments: FloatArray) -> IntArray:
    """(S,) edge that each of (S, 2, 2) segments is, in either direction; -1 for none."""
    edges = mesh.xy[mesh.origin.reshape(-1, 2)]
    both = np.concatenate([edges, snap_to_grid(segments).reshape(-1, 2, 2)])
    keys = lower_end_first(both).reshape(-1, 4)
    unique, index = np.unique(keys, axis=0, return_inverse=True)
    edge_of = np.full(len(unique), -1)
    index = index.ravel()
    edge_of[index[: mesh.n_edges]] = np.arange(mesh.n_edges)
    return np.asarray(edge_of[index[mesh.n_edges :]])


def lower_end_first(segments: FloatArray) -> FloatArray:
    """(n, 2, 2) the segments, each from its lower end, without negative zeros."""
    a, b = segments[:, 0], segments[:, 1]
    swap = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    return np.where(swap[:, None, None], segments[:, ::-1], segments) + 0.0


def vertices_at(xy: FloatArray, places: FloatArray) -> BoolArray:
    """(V,) which vertices lie exactly at one of some places."""
    keys = np.concatenate([xy, snap_to_grid(places).reshape(-1, 2)]) + 0.0
    _, index = np.unique(keys, axis=0, return_inverse=True)
    index = index.ravel()
    return np.isin(index[: len(xy)], index[len(xy) :])


def line_segments(lines: Geometries) -> tuple[FloatArray, IntArray]:
    """Split lines at their vertices: (S, 2, 2) ends, and (S,) the line of each."""
    xy, line = shapely.get_coordinates(lines, return_index=True)
    same = line[1:] == line[:-1]
    return np.stack([xy[:-1], xy[1:]], axis=1)[same], line[1:][same]


def segments_on(
    segments: FloatArray, lines: Sequence[shapely.Geometry], distance: float
) -> tuple[IntArray, IntArray]:
    """Pairs of a line and a segment that lies on it, sorted.

    Both ends and the middle of (S, 2, 2) segments are within `distance` metres of that line.
    """
    if not len(lines) or not len(segments):
        return np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    tree = shapely.STRtree(lines)
    found = []
    for places in (segments[:, 0], segments.mean(axis=1), segments[:, 1]):
        segment, line = tree.query(shapely.points(places), predicate="dwithin", distance=distance)
        found.append(set(zip(line.tolist(), segment.tolist(), strict=True)))
    pairs = np.array(sorted(set.intersection(*found)), dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def edges_on(
    mesh: PlanarMesh, other: PlanarMesh, chosen: BoolArray, distance: float
) -> tuple[IntArray, IntArray]:
    """Edges of a mesh that lie on chosen edges of another one, and on which of them."""
    some = np.flatnonzero(chosen)
    lines = shapely.linestrings(other.xy[other.origin.reshape(-1, 2)[some]])
    on, edge = segments_on(mesh.xy[mesh.origin.reshape(-1, 2)], lines, distance)
    return edge, some[on]


def are_near(xy: FloatArray, geometries: Sequence[shapely.Geometry], distance: float) -> BoolArray:
    """(n,) which places lie within some metres of one of the geometries."""
    at, _ = shapely.STRtree(geometries).query(
        shapely.points(xy), predicate="dwithin", distance=distance
    )
    out = np.zeros(len(xy), dtype=bool)
    out[at] = True
    return out


def nearest_on_ring(ring: FloatArray, place: FloatArray) -> tuple[int, FloatArray, float]:
    """Where a closed ring (n, 2) is nearest to a place: its edge, the point, and how far it is."""
    a, edge = ring[:-1], np.diff(ring, axis=0)
    along = np.clip(((place - a) * edge).sum(axis=1) / (edge**2).sum(axis=1), 0.0, 1.0)
    foot = a + along[:, None] * edge
    off = np.hypot(*(foot - place).T)
    k = int(np.argmin(off))
    return k, foot[k], float(off[k])
