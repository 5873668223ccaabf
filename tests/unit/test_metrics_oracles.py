"""Street metrics against osmnx, momepy and networkx, on layouts and on real networks."""

from __future__ import annotations

import math
from functools import lru_cache

import geopandas as gpd
import momepy
import networkx as nx
import numpy as np
import osmnx as ox
import pytest
import shapely
from network_fabrics import (
    SAMPLES,
    TOWNS,
    fabric_of_lines,
    line_graph,
    mesh_graph,
    osmnx_graph,
    town_lines,
)
from networks import CITIES, network

from urban_processing.fabric.model import Fabric
from urban_processing.io.boundaries import read_boundary
from urban_processing.mesh.straight import STRAIGHT_DEG
from urban_processing.metrics.measures import FabricMeasures, LayoutMeasures
from urban_processing.metrics.street_values import orientation_entropy
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.streets.classes import NodeKind

LAYOUTS = ("rect loop", "mauren tree", "schaan cul-de-sac", "ellipse loop")
Case = tuple[FabricMeasures, nx.MultiGraph]


@lru_cache
def case(name: str) -> Case:
    """What we measure, and the graph of its segments that somebody else measures."""
    if name in TOWNS:
        lines = town_lines(name)
        return FabricMeasures(fabric_of_lines(lines)), line_graph(lines)
    if name in CITIES:
        lines = shapely.get_parts(shapely.union_all(network(name).lines))
        return FabricMeasures(fabric_of_lines(lines)), line_graph(lines)
    land, pattern = name.split()
    params = CogenerateParams(parcels=150, pattern=pattern, optimize=False)
    layout = cogenerate(read_boundary(SAMPLES / f"{land}.gpkg"), params)
    return LayoutMeasures(layout).of_fabric, mesh_graph(layout)


def directed(graph: nx.MultiGraph) -> nx.MultiDiGraph:
    """The same, as osmnx has its graphs."""
    out = nx.MultiDiGraph()
    out.add_nodes_from(graph)
    out.add_edges_from(graph.edges(keys=True))
    nx.set_node_attributes(out, ox.stats.count_streets_per_node(out), "street_count")
    return out


def inside(graph: nx.MultiGraph) -> list[int]:
    """Number of streets at each node off the rim, as osmnx counts them."""
    counts = ox.stats.count_streets_per_node(directed(graph))
    return [counts[v] for v in graph if not graph.nodes[v]["on_rim"]]


every = pytest.mark.parametrize("name", [*LAYOUTS, *TOWNS, "slc", "liechtenstein"])


@every
def test_intersections_and_dead_ends_are_those_of_osmnx(name: str) -> None:
    known, graph = case(name)
    v, count = known.values, inside(graph)
    arms = np.array([c for c in count if c >= 3])
    assert v["intersections"] == len(arms)
    assert v["dead_ends"] == count.count(1)
    for n, share in ((3, arms == 3), (4, arms == 4), (5, arms >= 5)):
        expected = 100 * share.mean() if len(arms) else math.nan
        assert v[f"intersections_{n}_pct"] == pytest.approx(expected, nan_ok=True)
    if not any(on_rim for _, on_rim in graph.nodes(data="on_rim")):
        rings = sum(graph.degree(node) == 2 for node in graph)
        assert v["intersections"] == ox.stats.intersection_count(directed(graph), min_streets=3)
        assert len(count) - rings == v["intersections"] + v["dead_ends"]


@every
def test_segments_are_those_of_a_graph_without_nodes_of_two_edges(name: str) -> None:
    known, graph = case(name)
    length = sorted(length for *_, length in graph.edges(data="length"))
    assert sorted(known.segments.length) == pytest.approx(length)
    assert known.values["segment_length_mean_m"] == pytest.approx(np.mean(length))
    land = shapely.area(known.fabric.land).sum()
    assert known.values["street_km_per_km2"] == pytest.approx(1e3 * sum(length) / land)


@every
def test_circuity_is_that_of_osmnx(name: str) -> None:
    known, graph = case(name)
    theirs = osmnx_graph(graph, "EPSG:32632")
    # osmnx takes the length of rings, which lead nowhere, into account
    theirs.remove_edges_from(list(nx.selfloop_edges(theirs, keys=True)))
    assert known.values["circuity"] == pytest.approx(ox.stats.circuity_avg(theirs))


@every
def test_orientation_is_that_of_osmnx(name: str) -> None:
    known, graph = case(name)
    theirs = osmnx_graph(graph, "EPSG:4326")  # bearings, unlike ours, would be geographic
    entropy = ox.bearing.orientation_entropy(theirs, num_bins=36, weight="length")
    v = known.values
    assert v["orientation_entropy"] == pytest.approx(entropy, rel=1e-3)
    share = (v["orientation_entropy"] - math.log(4)) / (math.log(36) - math.log(4))
    assert v["orientation_order"] == pytest.approx(1 - share**2)


def test_orientation_is_that_of_osmnx_where_no_bearing_is_on_the_border_of_bins() -> None:
    rng = np.random.default_rng(0)
    bearing, length = rng.uniform(0, 180, 500), rng.uniform(1, 200, 500)
    theirs = nx.MultiGraph(crs="EPSG:4326")
    for i, (b, metres) in enumerate(zip(bearing, length, strict=True)):
        theirs.add_edge(i, -i - 1, bearing=b, length=metres)
    for weight, ours in (("length", length), (None, np.ones(500))):
        expected = ox.bearing.orientation_entropy(theirs, num_bins=36, weight=weight)
        assert orientation_entropy(bearing, ours) == pytest.approx(expected, rel=1e-12)


@every
def test_meshedness_is_that_of_momepy(name: str) -> None:
    known, graph = case(name)
    pieces = nx.number_connected_components(graph)
    # momepy takes it that there is one piece
    one = momepy.meshedness(graph, radius=None)
    expected = one + (pieces - 1) / (2 * len(graph) - 5)
    assert known.values["meshedness"] == pytest.approx(expected)
    # loops are counted, not worked out, where no two of them join the same ends
    simple = nx.Graph(graph)
    if simple.number_of_edges() == graph.number_of_edges():
        loops = len(nx.cycle_basis(simple))
        assert known.values["meshedness"] == pytest.approx(loops / (2 * len(graph) - 5))


@every
def test_pieces_of_the_network_are_those_of_networkx(name: str) -> None:
    known, _ = case(name)
    lines = known.fabric.lines
    used = known.fabric.network.half_edges
    graph = nx.Graph(np.column_stack([lines.origin[used], lines.target[used]]).tolist())
    assert known.values["network_pieces"] == nx.number_connected_components(graph)


@pytest.mark.parametrize("name", TOWNS)
def test_segments_are_those_of_shapely_and_as_straight_as_momepy_says(name: str) -> None:
    known, _ = case(name)
    merged = shapely.line_merge(shapely.multilinestrings(town_lines(name)))
    theirs = gpd.GeoSeries(shapely.get_parts(merged))
    assert sorted(known.segments.length) == pytest.approx(sorted(theirs.length))
    ours = known.segments.straight / known.segments.length
    assert sorted(ours) == pytest.approx(sorted(momepy.linearity(theirs)), abs=1e-9)


@pytest.mark.parametrize("name", [*TOWNS, "slc"])
def test_streets_are_those_of_coins_but_for_second_choices(name: str) -> None:
    """COINS joins two arms if each is the straightest way on for the other.

    So do we, and then we join the straightest of the arms that are left, as Chen's maximal
    chains ask for. Each such second choice makes one street less.
    """
    known, _ = case(name)
    fabric = known.fabric
    net = fabric.network
    pieces = [
        (k, h)
        for k in range(net.n_edges)
        for h in net.half_edges[net.offsets[k] : net.offsets[k + 1]]
    ]
    xy, lines = fabric.lines.xy, fabric.lines
    drawn = [shapely.LineString(xy[[lines.origin[h], lines.target[h]]]) for _, h in pieces]
    theirs = momepy.COINS(gpd.GeoDataFrame(geometry=drawn), angle_threshold=STRAIGHT_DEG)
    stroke = theirs.stroke_attribute().to_numpy()
    street = net.edge_street[[k for k, _ in pieces]]
    for s in np.unique(stroke):
        assert len(np.unique(street[stroke == s])) == 1
    more = len(np.unique(stroke)) - known.values["streets"]
    assert more == second_choices(fabric)
    assert 0 <= more <= 0.03 * known.values["streets"]


def second_choices(fabric: Fabric) -> int:
    """Pairs of arms that go on straight though one of them has a straighter way on."""
    net, lines = fabric.network, fabric.lines
    arms: dict[int, list[complex]] = {}
    for k in range(net.n_edges):
        first, last = net.half_edges[net.offsets[k]], net.half_edges[net.offsets[k + 1] - 1]
        for a, b in (
            (lines.origin[first], lines.target[first]),
            (lines.target[last], lines.origin[last]),
        ):
            arms.setdefault(int(a), []).append(complex(*(lines.xy[b] - lines.xy[a])))
    found = 0
    for z in arms.values():
        free, n = set(range(len(z))), len(z)
        angle = {
            (i, j): abs(math.degrees(np.angle(z[i] / z[j])))
            for i in range(n)
            for j in range(n)
            if i != j
        }
        for i, j in sorted(angle, key=lambda pair: -angle[pair]):
            if angle[i, j] > STRAIGHT_DEG and {i, j} <= free:
                free -= {i, j}
                best = [max((angle[a, b], b) for b in range(n) if b != a)[1] for a in (i, j)]
                found += best != [j, i]
    return found


@every
def test_junctions_meet_at_angles_of_which_none_is_above_a_right_one(name: str) -> None:
    known, graph = case(name)
    net = known.fabric.network
    assert ((net.pair_deviation >= -1e-9) & (net.pair_deviation <= 90 + 1e-9)).all()
    if name in TOWNS:  # Chen's ends and junctions are those of the graph, bends besides
        ends = (net.node_kind == NodeKind.END).sum()
        assert known.values["street_ends"] == ends == inside(graph).count(1)
        assert known.values["junctions"] >= known.values["intersections"]
