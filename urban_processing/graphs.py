"""The four graphs of a layout (Chen 2024, section 3) as networkx graphs."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.planar import OUTSIDE, IntArray
from urban_processing.metrics.parcels import measure_parcels
from urban_processing.streets import network as net
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network_model import StreetNetwork

if TYPE_CHECKING:
    import networkx as nx


def corner_graph(layout: Layout) -> nx.MultiGraph[int]:
    """Return the parcel corner graph: the parcel mesh without its parcel vertices.

    Nodes are numbered as in ``layout.corner_graph``; two corners may be joined twice.

    Returns
    -------
    networkx.MultiGraph
        Nodes with `x`, `y` (map coordinates, m), `vertex` (mesh vertex) and `rim` (on the
        boundary of the land or of a hole). Edges, keyed by the number of their chain, with
        `length_m`, `street`, `rim` and `parcels` (the one or two parcels beside it).
    """
    import networkx as nx

    graph: nx.MultiGraph[int] = nx.MultiGraph()
    mesh, corners = layout.mesh, layout.corner_graph
    xy = _map_xy(layout, corners.node_vertex)
    rim = mesh.vertex_is_boundary[corners.node_vertex].tolist()
    for node, vertex in enumerate(corners.node_vertex.tolist()):
        graph.add_node(node, x=xy[node][0], y=xy[node][1], vertex=vertex, rim=rim[node])
    for chain in range(0, corners.n_chains, 2):
        faces = corners.face[[chain, chain + 1]]
        graph.add_edge(
            int(corners.start[chain]),
            int(corners.end[chain]),
            key=chain,
            length_m=float(corners.length[chain]),
            street=bool(layout.chain_street[chain]),
            rim=bool((faces == OUTSIDE).any()),
            parcels=tuple(np.unique(faces[faces != OUTSIDE] + 1).tolist()),
        )
    return graph


def parcel_graph(layout: Layout) -> nx.Graph[int]:
    """Return the parcel graph: parcels, and an edge where two share a boundary.

    Returns
    -------
    networkx.Graph
        Nodes are parcel numbers, with `area_m2`, `part`, `level`, `rim`, `corners` (nodes of
        the corner graph around the parcel, counter-clockwise) and `approximate` (map
        coordinates of the corners of the reported approximate polygon). Edges have
        `length_m`, `street_length_m` (the share of it that is street) and `chains` (keys of
        the shared edges in the corner graph).
    """
    import networkx as nx

    graph: nx.Graph[int] = nx.Graph()
    measures = measure_parcels(layout)
    node_of = np.full(layout.mesh.n_vertices, -1)
    node_of[layout.corner_graph.node_vertex] = np.arange(layout.corner_graph.n_nodes)
    xy = measures.corner_xy + np.asarray(layout.frame.origin)
    for face in range(layout.mesh.n_faces):
        ring = node_of[layout.mesh.origin[layout.mesh.face_half_edges(face)]]
        low, high = measures.corner_offsets[face], measures.corner_offsets[face + 1]
        graph.add_node(
            face + 1,
            area_m2=float(measures.area[face]),
            part=int(layout.face_part[face]),
            level=int(layout.face_level[face]),
            rim=bool(measures.rim[face]),
            corners=tuple(ring[ring >= 0].tolist()),
            approximate=tuple(map(tuple, xy[low:high].tolist())),
        )
    _add_neighbours(graph, layout)
    return graph


def _add_neighbours(graph: nx.Graph[int], layout: Layout) -> None:
    corners = layout.corner_graph
    for chain in range(0, corners.n_chains, 2):
        a, b = int(corners.face[chain]), int(corners.face[chain + 1])
        if OUTSIDE in (a, b) or a == b:
            continue
        length = float(corners.length[chain])
        street = length if layout.chain_street[chain] else 0.0
        if not graph.has_edge(a + 1, b + 1):
            graph.add_edge(a + 1, b + 1, length_m=0.0, street_length_m=0.0, chains=())
        edge = graph.edges[a + 1, b + 1]
        edge["length_m"] += length
        edge["street_length_m"] += street
        edge["chains"] += (chain,)


def street_network(layout: Layout) -> nx.MultiGraph[int]:
    """Return the street network graph: the part of the corner graph that is street.

    Its nodes are the parcel corners on streets, and bends.

    Returns
    -------
    networkx.MultiGraph
        Nodes are mesh vertices, with `x`, `y` (map coordinates, m), `kind` ("junction" of
        streets, "end" of a street, or "point" along one) and `junction_id` (None for a
        point). Edges have `edge_id`, `street_id` (as in the `streets` layer), `class`,
        `level`, `part` and `length_m`.
    """
    import networkx as nx

    graph: nx.MultiGraph[int] = nx.MultiGraph()
    network, mesh = net.street_network(layout), layout.mesh
    kinds = np.full(mesh.n_vertices, NodeKind.POINT)
    kinds[network.node_vertex] = network.node_kind
    number = np.zeros(mesh.n_vertices, dtype=np.int64)
    number[network.node_vertex] = network.node_number
    is_node = np.zeros(mesh.n_vertices, dtype=bool)
    is_node[layout.corner_graph.node_vertex] = True
    is_node[network.node_vertex] = True
    first, last, length = _pieces(layout, network, is_node)
    edge = np.searchsorted(network.offsets, first, side="right") - 1
    tails = mesh.origin[network.half_edges[first]]
    heads = mesh.target[network.half_edges[last]]
    vertices = np.unique(np.concatenate([tails, heads]))
    xy = _map_xy(layout, vertices)
    for i, v in enumerate(vertices.tolist()):
        kind = NodeKind(int(kinds[v])).name.lower()
        junction = int(number[v]) or None
        graph.add_node(v, x=xy[i][0], y=xy[i][1], kind=kind, junction_id=junction)
    for i, k in enumerate(edge.tolist()):
        graph.add_edge(
            int(tails[i]),
            int(heads[i]),
            edge_id=k + 1,
            street_id=int(network.edge_street[k]) + 1,
            level=int(network.edge_level[k]),
            part=int(network.edge_part[k]),
            length_m=float(length[i]),
            **{"class": str(network.edge_class[k])},
        )
    return graph


def _pieces(
    layout: Layout, network: StreetNetwork, is_node: np.ndarray[tuple[int], np.dtype[np.bool_]]
) -> tuple[IntArray, IntArray, np.ndarray[tuple[int], np.dtype[np.float64]]]:
    """First and last place in `network.half_edges` of each piece between nodes; its length."""
    starts = is_node[layout.mesh.origin[network.half_edges]]
    starts[network.offsets[:-1]] = True
    first = np.flatnonzero(starts)
    last = np.append(first, len(starts))[1:] - 1
    step = layout.mesh.edge_length[network.half_edges >> 1]
    return first, last, np.add.reduceat(step, first) if len(first) else step


def street_graph(layout: Layout) -> nx.MultiGraph[int]:
    """Return the street graph: streets, and an edge for each junction of two of them.

    Returns
    -------
    networkx.MultiGraph
        Nodes are street numbers (as in the `streets` layer), with `rim`, `part`,
        `length_m` and `edges` (their network edges). Edges, keyed by the number of the
        junction, have `deviation_deg` (mean over the pairs of network edges).
    """
    import networkx as nx

    graph: nx.MultiGraph[int] = nx.MultiGraph()
    network = net.street_network(layout)
    for street in range(len(network.street_length)):
        graph.add_node(
            street + 1,
            rim=bool(network.street_rim[street]),
            part=int(network.street_part[street]),
            length_m=float(network.street_length[street]),
            edges=tuple((np.flatnonzero(network.edge_street == street) + 1).tolist()),
        )
    found: dict[tuple[int, int, int], list[float]] = {}
    streets = np.sort(network.edge_street[network.pair_edges], axis=1) + 1
    for node, (a, b), deviation in zip(
        network.pair_node, streets.tolist(), network.pair_deviation.tolist(), strict=True
    ):
        if a != b:
            found.setdefault((a, b, int(network.node_number[node])), []).append(deviation)
    for (a, b, junction), deviations in found.items():
        graph.add_edge(a, b, key=junction, deviation_deg=sum(deviations) / len(deviations))
    return graph


def _map_xy(layout: Layout, vertices: IntArray) -> list[list[float]]:
    xy: list[list[float]] = (layout.mesh.xy[vertices] + np.asarray(layout.frame.origin)).tolist()
    return xy
