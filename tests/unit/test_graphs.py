"""The networkx graphs of a layout."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
from grid_layouts import SIDE, boxes, grid, layout_of

from urban_processing import graphs
from urban_processing.streets.network import street_network

CROSS = ([(0, 1), (2, 1)], [(1, 0), (1, 2)])


def test_corner_graph_of_a_grid() -> None:
    layout = grid(2, 2, *CROSS, origin=(500_000.0, 4_000_000.0))
    graph = graphs.corner_graph(layout)
    # corners of the land have valence 2 and are left out unless they are marked
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (5, 8)
    inner = [d for _, _, d in graph.edges(data=True) if not d["rim"]]
    assert [d["length_m"] for d in inner] == [SIDE] * 4
    assert all(d["street"] and len(d["parcels"]) == 2 for d in inner)
    assert min(d["x"] for _, d in graph.nodes(data=True)) == 500_000.0


def test_corner_graph_keeps_the_lands_corners() -> None:
    layout = grid(2, 2)
    corner = (layout.mesh.valence == 2).copy()
    graph = graphs.corner_graph(layout.replace(vertex_corner=corner))
    assert (graph.number_of_nodes(), graph.number_of_edges()) == (9, 12)


def test_parcel_graph_of_a_grid() -> None:
    layout = grid(3, 2, [(0, 1), (3, 1)])
    graph = graphs.parcel_graph(layout)
    expected = nx.grid_2d_graph(3, 2)
    assert nx.is_isomorphic(graph, expected)
    street = {frozenset(e) for *e, d in graph.edges(data=True) if d["street_length_m"]}
    assert street == {frozenset({1, 2}), frozenset({3, 4}), frozenset({5, 6})}
    assert graph.nodes[1]["approximate"][0] in {(0.0, 0.0), (20.0, 0.0), (20.0, 20.0), (0.0, 20.0)}
    assert len(graph.nodes[1]["approximate"]) == 4
    assert graph.nodes[3]["area_m2"] == 400.0
    assert graph.edges[1, 3]["length_m"] == SIDE


def test_parcel_graph_adds_up_boundaries_in_two_pieces() -> None:
    # two parcels around a hole share a boundary on both sides of it
    left = boxes(1, 3)
    polygons = boxes(2, 3, without=[(1, 1)])
    assert len(polygons) == len(left) + 2
    layout = layout_of(polygons)
    graph = graphs.parcel_graph(layout)
    assert graph.edges[1, 4]["chains"]
    assert sum(d["length_m"] for *_, d in graph.edges(data=True)) == 4 * SIDE


def test_street_network_is_part_of_the_corner_graph() -> None:
    layout = grid(3, 3, [(0, 1), (3, 1)], [(1, 1), (1, 2)])
    streets, corners = graphs.street_network(layout), graphs.corner_graph(layout)
    vertices = {d["vertex"] for _, d in corners.nodes(data=True)}
    assert set(streets.nodes) <= vertices
    total = sum(d["length_m"] for *_, d in streets.edges(data=True))
    assert total == sum(d["length_m"] for *_, d in corners.edges(data=True) if d["street"])
    assert nx.is_connected(streets)
    kinds = [d["kind"] for _, d in streets.nodes(data=True)]
    assert kinds.count("junction") == 3
    assert kinds.count("end") == 1
    assert all(
        (d["junction_id"] is None) == (d["kind"] == "point") for _, d in streets.nodes(data=True)
    )


def test_street_network_has_the_components_of_the_mesh() -> None:
    layout = layout_of(
        boxes(3, 3) + boxes(2, 2, at=(5, 0)),
        [(1, 1), (2, 1)],
        [(5, 1), (7, 1)],
        part=[0] * 9 + [1] * 4,
    )
    mesh = nx.Graph(layout.mesh.origin.reshape(-1, 2)[layout.edge_street].tolist())
    graph = graphs.street_network(layout)
    assert nx.number_connected_components(graph) == nx.number_connected_components(mesh) == 3


def test_street_graph_of_a_crossing() -> None:
    graph = graphs.street_graph(grid(2, 2, *CROSS))
    rim = [s for s, d in graph.nodes(data=True) if d["rim"]]
    inner = [s for s, d in graph.nodes(data=True) if not d["rim"]]
    assert len(rim) == 1
    assert len(inner) == 2
    assert graph.number_of_edges(*inner) == 1
    assert [graph.number_of_edges(rim[0], s) for s in inner] == [2, 2]
    assert all(d["deviation_deg"] == pytest.approx(0.0) for *_, d in graph.edges(data=True))
    assert all(d["length_m"] == 2 * SIDE for _, d in graph.nodes(data=True) if not d["rim"])


def test_street_graph_names_every_network_edge_once() -> None:
    layout = grid(4, 4, [(0, 1), (4, 1)], [(2, 1), (2, 3), (4, 3)])
    graph = graphs.street_graph(layout)
    edges = np.concatenate([d["edges"] for _, d in graph.nodes(data=True)])
    assert sorted(edges.tolist()) == list(range(1, street_network(layout).n_edges + 1))


def test_graphs_of_a_layout_without_streets() -> None:
    layout = grid(2, 2, rim=False)
    assert len(graphs.street_network(layout)) == len(graphs.street_graph(layout)) == 0
    assert len(graphs.parcel_graph(layout)) == 4
