"""Which edges and vertices of a mesh lie at given places."""

from __future__ import annotations

import numpy as np

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import snap_to_grid


def edges_at(mesh: PlanarMesh, segments: FloatArray) -> IntArray:
    """(S,) edge that each of (S, 2, 2) segments is, in either direction; -1 for none."""
    edges = mesh.xy[mesh.origin.reshape(-1, 2)]
    keys = _sorted_ends(np.concatenate([edges, snap_to_grid(segments).reshape(-1, 2, 2)]))
    unique, index = np.unique(keys, axis=0, return_inverse=True)
    edge_of = np.full(len(unique), -1)
    index = index.ravel()
    edge_of[index[: mesh.n_edges]] = np.arange(mesh.n_edges)
    return np.asarray(edge_of[index[mesh.n_edges :]])


def _sorted_ends(segments: FloatArray) -> FloatArray:
    """(n, 4) ends of segments, the lower one first."""
    a, b = segments[:, 0] + 0.0, segments[:, 1] + 0.0  # no negative zeros
    swap = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    return np.hstack([np.where(swap[:, None], b, a), np.where(swap[:, None], a, b)])


def vertices_at(xy: FloatArray, places: FloatArray) -> BoolArray:
    """(V,) which vertices lie exactly at one of some places."""
    keys = np.concatenate([xy, snap_to_grid(places).reshape(-1, 2)]) + 0.0
    _, index = np.unique(keys, axis=0, return_inverse=True)
    index = index.ravel()
    return np.isin(index[: len(xy)], index[len(xy) :])
