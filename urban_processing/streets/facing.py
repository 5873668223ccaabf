"""Which sides of parcels streets should lie on, where their dimensions are wanted so."""

from __future__ import annotations

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.corner_graph import CornerGraph
from urban_processing.mesh.corners import side_irregularity
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray, PlanarMesh
from urban_processing.params import CogenerateParams

FACING_COST = 40.0
"""Cost of each parcel side of street along a parcel, for each unit of irregularity that its
proportions have relative to the wanted ones if it fronts there."""

MEAN_OVER_MIN = 1.4
"""Mean area of finished parcels, in smallest areas."""


NARROW_COST = 3.0
"""Cost of each parcel side of street along a parcel that is too narrow there for the least
frontage, for a width of nothing; in proportion below."""


def facing_cost(layout: Layout, params: CogenerateParams, *, side: float) -> FloatArray | None:
    """Cost of a street along each chain for the parcel on its left.

    A parcel that is still to be cut can lose as many times too much width as the number of
    parcels that it will be cut into.

    Parameters
    ----------
    layout
        The layout.
    params
        Wanted ratio of the width along the street to the depth, and the least frontage.
    side
        Parcel side (m), the unit of length.

    Returns
    -------
    (M,) array or None
        Cost in parcel sides for each directed chain of the corner graph, 0 where the outside
        is on its left; None where no dimensions are wanted.
    """
    if params.width_depth is None and params.least_frontage is None:
        return None
    graph, mesh = layout.corner_graph, layout.mesh
    inside = np.flatnonzero(graph.face != OUTSIDE)
    width, depth = _extents(mesh, graph, inside)
    parcels = mesh.face_area[graph.face[inside]] / (MEAN_OVER_MIN * layout.min_area)
    cost = np.zeros(len(inside))
    if params.width_depth is not None:
        off = np.exp(np.abs(np.log(width / depth / params.width_depth)))
        cost += FACING_COST * side_irregularity(np.maximum(off / np.maximum(parcels, 1.0), 1.0))
    if params.least_frontage is not None:
        cost += NARROW_COST * np.maximum(1.0 - width / params.least_frontage, 0.0)
    out = np.zeros(graph.n_chains)
    out[inside] = cost * graph.length[inside] / side
    return out


def _extents(
    mesh: PlanarMesh, graph: CornerGraph, chains: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Extent along and across each chain (from end to end) of the parcel on its left."""
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    node = z[graph.node_vertex]
    chord = node[graph.end[chains]] - node[graph.start[chains]]
    chord = np.where(chord == 0, graph.leaving[chains], chord)
    ring, start = mesh.face_rings(graph.face[chains])
    count = np.diff(start)
    # relative to a vertex of the ring, so that far-off parcels lose no digits
    first = z[mesh.origin[ring[start[:-1]]]]
    local = z[mesh.origin[ring]] - np.repeat(first, count)
    local *= np.repeat(np.conj(chord) / np.abs(chord), count)
    return _extent(local.real, start), _extent(local.imag, start)


def _extent(values: FloatArray, start: IntArray) -> FloatArray:
    return np.maximum.reduceat(values, start[:-1]) - np.minimum.reduceat(values, start[:-1])
