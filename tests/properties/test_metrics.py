"""Properties of measures on squares that are cut at random."""

from __future__ import annotations

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from urban_processing.layout import Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.overlap import covered_share, find_overlaps, segments_of
from urban_processing.metrics.certificate import certificate
from urban_processing.metrics.measures import LayoutMeasures, measure
from urban_processing.site import Frame
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network import street_network

SIZE = 200.0
SEEDS = st.integers(min_value=0, max_value=10_000)


def random_cells(seed: int, cuts: int = 5) -> list[shapely.Polygon]:
    """A square cut by random lines, with coordinates on a coarse grid so that nothing is thin."""
    rng = np.random.default_rng(seed)
    frame = shapely.box(0, 0, SIZE, SIZE)
    lines = []
    for _ in range(cuts):
        centre = rng.uniform(0.2 * SIZE, 0.8 * SIZE, 2)
        angle = rng.uniform(0, np.pi)
        d = 2 * SIZE * np.array([np.cos(angle), np.sin(angle)])
        lines.append(shapely.LineString([centre - d, centre + d]) & frame)
    noded = shapely.node(shapely.geometrycollections([frame.exterior, *lines]))
    return [p for p in shapely.polygonize(list(noded.geoms)).geoms if p.area > 1e-3]


def layout_with_random_streets(seed: int, polygons: list[shapely.Polygon]) -> Layout:
    """Streets on the rim and on about half of the inner edges, whatever their order."""
    mesh = mesh_from_polygons(polygons)
    layout = layout_from_mesh(
        mesh,
        frame=Frame("EPSG:32630", (1000.0, 2000.0)),
        face_part=np.zeros(mesh.n_faces, dtype=np.int64),
        min_area=1.0,
    )
    rng = np.random.default_rng(seed)
    chosen = np.repeat(rng.random(len(mesh.origin) // 2) < 0.5, 1)
    street = layout.edge_street | chosen
    level = np.where(layout.edge_street, 0, np.where(chosen, rng.integers(1, 6, len(chosen)), -1))
    return layout.replace(edge_street=street, edge_level=level.astype(np.int16))


def rotated(layout: Layout, degrees: float) -> Layout:
    """The same mesh, turned about the origin and moved."""
    t = np.radians(degrees)
    turn = np.array([[np.cos(t), np.sin(t)], [-np.sin(t), np.cos(t)]])
    mesh = layout.mesh
    new = type(mesh)(mesh.xy @ turn + 37.0, mesh.origin, mesh.next, mesh.face, mesh.n_faces)
    return layout.replace(mesh=new)


@settings(deadline=None, max_examples=25)
@given(seed=SEEDS, degrees=st.floats(min_value=1.0, max_value=359.0))
def test_metrics_do_not_change_when_the_land_is_turned(seed: int, degrees: float) -> None:
    layout = layout_with_random_streets(seed, random_cells(seed))
    before, after = measure(layout), measure(rotated(layout, degrees))
    for a, b in zip(before, after, strict=True):
        if a.metric.startswith("orientation"):  # by the points of the compass
            continue
        tolerance = 0.02 if a.metric.startswith("thinness") else 1e-6
        assert b.value == pytest.approx(a.value, rel=tolerance, abs=1e-4, nan_ok=True), a.metric


@settings(deadline=None, max_examples=25)
@given(seed=SEEDS)
def test_frontage_on_the_lines_is_that_of_the_mesh(seed: int) -> None:
    layout = layout_with_random_streets(seed, random_cells(seed))
    net = street_network(layout)
    street = segments_of(net.lines(layout.mesh))
    outline = segments_of(layout.mesh.face_polygons())
    found = find_overlaps(street, outline, 1e-6)
    length = (found.high - found.low) * street.length[found.first]
    owner = outline.line[found.second]
    frontage = np.bincount(owner, weights=length, minlength=layout.mesh.n_faces)
    assert frontage == pytest.approx(layout.frontage, abs=1e-4)
    assert covered_share(found, len(street.line)) == pytest.approx(np.ones(len(street.line)))


@settings(deadline=None, max_examples=25)
@given(seed=SEEDS)
def test_network_agrees_with_the_mesh(seed: int) -> None:
    layout = layout_with_random_streets(seed, random_cells(seed))
    net, mesh = street_network(layout), layout.mesh
    plain = nx.Graph(mesh.origin.reshape(-1, 2)[layout.edge_street].tolist())
    graph = nx.MultiGraph()
    graph.add_nodes_from(range(net.n_nodes))
    graph.add_edges_from(zip(net.start.tolist(), net.end.tolist(), strict=True))
    assert nx.number_connected_components(graph) == nx.number_connected_components(plain)
    assert net.edge_length.sum() == pytest.approx(mesh.edge_length[layout.edge_street].sum())
    degree = dict(plain.degree)
    at = net.node_vertex.tolist()
    assert [degree[v] for v in at] == net.node_degree.tolist()
    assert {v for v, d in degree.items() if d != 2} <= set(at)
    ends = {v for v, d in degree.items() if d == 1}
    assert ends == {v for v, k in zip(at, net.node_kind, strict=True) if k == NodeKind.END}
    connected = nx.number_connected_components(plain) == 1
    assert certificate(layout).check("streets_connected").holds == connected


@settings(deadline=None, max_examples=25)
@given(seed=SEEDS)
def test_streets_pair_the_straightest_first(seed: int) -> None:
    layout = layout_with_random_streets(seed, random_cells(seed))
    net, mesh = street_network(layout), layout.mesh
    arms: dict[int, list[tuple[int, complex]]] = {}
    for k in range(net.n_edges):
        h = net.half_edges[net.offsets[k] : net.offsets[k + 1]]
        for v, w in (
            (mesh.origin[h[0]], mesh.target[h[0]]),
            (mesh.target[h[-1]], mesh.origin[h[-1]]),
        ):
            d = mesh.xy[w] - mesh.xy[v]
            arms.setdefault(int(v), []).append((k, complex(*d)))
    graph = nx.Graph()
    graph.add_nodes_from(range(net.n_edges))
    for at in arms.values():
        free = set(range(len(at)))
        pairs = sorted(
            (180 - np.degrees(abs(np.angle(at[i][1] / at[j][1]))), i, j)
            for i in free
            for j in free
            if i < j
        )
        for turn, i, j in pairs:
            if turn < 45 and {i, j} <= free:
                free -= {i, j}
                if net.edge_rim[at[i][0]] == net.edge_rim[at[j][0]]:
                    graph.add_edge(at[i][0], at[j][0])
    found = {frozenset(np.flatnonzero(net.edge_street == s)) for s in np.unique(net.edge_street)}
    assert found == {frozenset(c) for c in nx.connected_components(graph)}


@settings(deadline=None, max_examples=15)
@given(seed=SEEDS)
def test_thinness_is_within_one_percent(seed: int) -> None:
    layout = layout_with_random_streets(seed, random_cells(seed))
    polygons, area = layout.mesh.face_polygons(), layout.mesh.face_area
    exact = 2 * shapely.length(shapely.maximum_inscribed_circle(polygons, 1e-5 * np.sqrt(area)))
    found = LayoutMeasures(layout).parcels.thinness * np.sqrt(area)
    assert (np.abs(found - exact) <= 0.012 * np.sqrt(area)).all()


@settings(deadline=None, max_examples=25)
@given(seed=SEEDS, shift=st.floats(min_value=1e-3, max_value=5.0))
def test_the_certificate_sees_a_parcel_that_moved(seed: int, shift: float) -> None:
    polygons = random_cells(seed)
    layout = layout_with_random_streets(seed, polygons)
    before = certificate(layout)
    assert before.check("coverage").holds
    assert before.check("land_covered").holds
    assert before.check("streets_on_boundaries").holds
    mesh = layout.mesh
    xy = mesh.xy.copy()
    xy[np.flatnonzero(mesh.vertex_is_boundary)[0]] -= shift
    moved = type(mesh)(xy, mesh.origin, mesh.next, mesh.face, mesh.n_faces)
    land = [shapely.union_all(mesh.face_polygons())]
    assert certificate(layout, land=land).check("land_covered").holds
    assert not certificate(layout.replace(mesh=moved), land=land).check("land_covered").holds
