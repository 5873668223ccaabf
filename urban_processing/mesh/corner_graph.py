"""The parcel corner graph (Chen 2024, section 3): the mesh without its parcel vertices."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import (
    OUTSIDE,
    BoolArray,
    FloatArray,
    IntArray,
    PlanarMesh,
    rank_cycles,
)

DIRECTION_SPAN = 0.3
"""Share of a chain's length over which its direction at an end is taken."""


@dataclass(frozen=True, eq=False)
class CornerGraph:
    """Nodes are parcel corners; a chain is a run of half-edges between two nodes.

    Chains come in pairs: the reverse of chain ``i`` is ``i ^ 1``. N nodes, M directed chains.

    Parameters
    ----------
    node_vertex
        (N,) mesh vertex of a node.
    half_edges, offsets
        Half-edges of chain ``i`` are ``half_edges[offsets[i]:offsets[i + 1]]``.
    start, end
        (M,) nodes that a chain leaves and reaches.
    face
        (M,) face to the left, `OUTSIDE` where there is none.
    length
        (M,) length in metres.
    leaving, arriving
        (M,) unit complex numbers: direction of travel at the start and at the end, taken over
        `DIRECTION_SPAN` of the length.
    out, out_offsets
        Chains that leave node ``n``, clockwise: ``out[out_offsets[n]:out_offsets[n + 1]]``.
    around, around_offsets
        Chains around face ``f``, in no particular order.
    """

    node_vertex: IntArray
    half_edges: IntArray
    offsets: IntArray
    start: IntArray
    end: IntArray
    face: IntArray
    length: FloatArray
    leaving: npt.NDArray[np.complex128]
    arriving: npt.NDArray[np.complex128]
    out: IntArray
    out_offsets: IntArray
    around: IntArray
    around_offsets: IntArray

    @property
    def n_nodes(self) -> int:
        """Number of parcel corners."""
        return len(self.node_vertex)

    @property
    def n_chains(self) -> int:
        """Number of directed chains, twice the number of edges of the graph."""
        return len(self.start)

    def first_edge(self) -> IntArray:
        """(M,) first mesh edge of each chain."""
        return self.half_edges[self.offsets[:-1]] >> 1

    def edges_of(self, chains: npt.ArrayLike) -> IntArray:
        """Mesh edges of the given chains, one after the other."""
        picked = np.asarray(chains, dtype=np.int64)
        spans = [self.half_edges[self.offsets[i] : self.offsets[i + 1]] for i in picked]
        return np.concatenate(spans) >> 1 if spans else np.empty(0, dtype=np.int64)


def build_corner_graph(mesh: PlanarMesh, is_node: BoolArray) -> CornerGraph:
    """Contract the mesh to the chains between nodes.

    Parameters
    ----------
    mesh
        The parcel mesh.
    is_node
        (V,) vertices to keep; every vertex of a valence other than 2 is kept anyway. Loops
        without any such vertex keep their lowest one.
    """
    is_node = is_node | (mesh.valence != 2)
    is_node = _with_node_on_every_loop(mesh, is_node)
    half_edges, offsets = _chains(mesh, is_node)
    first, last = half_edges[offsets[:-1]], half_edges[offsets[1:] - 1]
    node_vertex = np.flatnonzero(is_node)
    node_of = np.full(mesh.n_vertices, -1)
    node_of[node_vertex] = np.arange(len(node_vertex))
    length, leaving, arriving = _measure(mesh, half_edges, offsets)
    out, out_offsets = _fan_out(mesh, node_vertex, first)
    face = mesh.face[first]
    inside = np.flatnonzero(face != OUTSIDE)
    around = inside[np.argsort(face[inside], kind="stable")]
    return CornerGraph(
        node_vertex=node_vertex,
        half_edges=half_edges,
        offsets=offsets,
        start=node_of[mesh.origin[first]],
        end=node_of[mesh.target[last]],
        face=face,
        length=length,
        leaving=leaving,
        arriving=arriving,
        out=out,
        out_offsets=out_offsets,
        around=around,
        around_offsets=np.searchsorted(face[around], np.arange(mesh.n_faces + 1)),
    )


def _with_node_on_every_loop(mesh: PlanarMesh, is_node: BoolArray) -> BoolArray:
    loops = mesh.loops
    has = np.zeros(len(loops.face), dtype=bool)
    has[loops.of_half_edge[is_node[mesh.origin]]] = True
    if has.all():
        return is_node
    is_node = is_node.copy()
    is_node[mesh.origin[loops.half_edges[loops.offsets[:-1][~has]]]] = True
    # the other side of the same edges must see the same vertex, which it does by index
    return is_node


def _chains(mesh: PlanarMesh, is_node: BoolArray) -> tuple[IntArray, IntArray]:
    """Half-edges chain by chain, each chain followed by its reverse."""
    order = mesh.loops.half_edges
    starts = is_node[mesh.origin[order]]
    # rotate every loop so that it begins at a node: half-edges before the first node of a
    # loop belong to the chain that the loop's last node begins
    loop = mesh.loops.of_half_edge[order]
    chain = np.cumsum(starts) - 1
    before = _before_first_node(starts, loop)
    last_of_loop = np.maximum.reduceat(chain, mesh.loops.offsets[:-1])
    chain = np.where(before, last_of_loop[loop], chain)
    position = np.arange(len(order)) + np.where(before, len(order), 0)
    by_chain = np.lexsort((position, chain))
    half_edges = order[by_chain]
    offsets = np.append(np.flatnonzero(np.diff(chain[by_chain], prepend=-1)), len(order))
    # pair each chain with its reverse
    n = len(offsets) - 1
    of_half_edge = np.empty(len(order), dtype=np.int64)
    of_half_edge[half_edges] = np.repeat(np.arange(n), np.diff(offsets))
    reverse = of_half_edge[half_edges[offsets[1:] - 1] ^ 1]
    low = np.flatnonzero(np.arange(n) < reverse)
    paired = np.column_stack([low, reverse[low]]).ravel()
    counts = np.diff(offsets)[paired]
    new_offsets = np.append(0, np.cumsum(counts))
    source = np.arange(len(order)) - np.repeat(new_offsets[:-1], counts)
    return half_edges[np.repeat(offsets[:-1][paired], counts) + source], new_offsets


def _before_first_node(starts: BoolArray, loop: IntArray) -> BoolArray:
    """Which half-edges of the loop order come before the first node of their loop."""
    total = np.cumsum(starts)
    at_loop_start = np.append(0, total[:-1])[np.searchsorted(loop, np.arange(loop[-1] + 1))]
    return np.asarray(total - at_loop_start[loop] == 0)


def _measure(
    mesh: PlanarMesh, half_edges: IntArray, offsets: IntArray
) -> tuple[FloatArray, npt.NDArray[np.complex128], npt.NDArray[np.complex128]]:
    """Length of each chain and its directions at both ends."""
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    step = mesh.edge_length[half_edges >> 1]
    total = np.append(0.0, np.cumsum(step))
    length = total[offsets[1:]] - total[offsets[:-1]]

    def point_at(distance: FloatArray) -> npt.NDArray[np.complex128]:
        where = total[offsets[:-1]] + distance
        i = np.searchsorted(total, where, side="right") - 1
        i = np.clip(i, offsets[:-1], offsets[1:] - 1)
        t = np.clip((where - total[i]) / step[i], 0.0, 1.0)
        a, b = z[mesh.origin[half_edges[i]]], z[mesh.target[half_edges[i]]]
        return np.asarray(a + t * (b - a))

    z_start = z[mesh.origin[half_edges[offsets[:-1]]]]
    z_end = z[mesh.target[half_edges[offsets[1:] - 1]]]
    leaving = point_at(DIRECTION_SPAN * length) - z_start
    arriving = z_end - point_at((1.0 - DIRECTION_SPAN) * length)
    return length, leaving / np.abs(leaving), arriving / np.abs(arriving)


def _fan_out(mesh: PlanarMesh, node_vertex: IntArray, first: IntArray) -> tuple[IntArray, IntArray]:
    """Chains that leave each node, clockwise from the one with the lowest half-edge."""
    rotation = mesh.next[np.arange(len(mesh.next)) ^ 1]
    leader, position = rank_cycles(rotation)
    vertex = mesh.origin[first]
    out = np.lexsort((position[first], leader[first], vertex))
    return out, np.append(np.searchsorted(vertex[out], node_vertex), len(out))
