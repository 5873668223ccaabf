"""Ways along streets against networkx, and frontage where parcels meet the streets."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections import defaultdict

import networkx as nx
import numpy as np
import pytest
import shapely
from grid_layouts import boxes, cut_square, grid, layout_of
from hypothesis import given, settings
from hypothesis import strategies as st
from network_fabrics import SAMPLES, TOWNS, fabric_of_lines, town_lines

from urban_processing.fabric.model import Fabric, FabricParcels, Fronts, ParcelRings
from urban_processing.io.boundaries import read_boundary
from urban_processing.layout import Layout
from urban_processing.metrics import routes
from urban_processing.metrics.measures import FabricMeasures, LayoutMeasures
from urban_processing.metrics.routes import LEAST_SOURCES, NEAR, Routes
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.streets.classes import NodeKind

NAMES = ("rim_distance_m", "parcel_distance_m", "parcel_detour")


def fabric_of(layout: Layout) -> Fabric:
    return LayoutMeasures(layout).of_fabric.fabric


def sample_layout(name: str, parcels: int, pattern: str = "loop") -> Layout:
    params = CogenerateParams(parcels=parcels, pattern=pattern, optimize=False)
    return cogenerate(read_boundary(SAMPLES / f"{name}.gpkg"), params)


def with_parcels(fabric: Fabric, seed: int, n: int = 40) -> Fabric:
    """Parcels of one to three pieces of frontage anywhere on the streets of a fabric."""
    rng = np.random.default_rng(seed)
    length = fabric.network.edge_length
    parcel = np.sort(np.r_[np.arange(n), rng.integers(0, n, n)])
    edge = rng.integers(0, len(length), len(parcel))
    at = np.clip(rng.uniform(-0.2, 1.2, len(parcel)), 0, 1) * length[edge]  # some at nodes
    fronts = Fronts(parcel, edge, at, rng.uniform(5, 50, len(parcel)))
    corners = rng.uniform(0, 1000, (n, 2))
    polygons = shapely.box(*corners.T, *(corners + 20).T)
    some = np.zeros(n)
    rings = ParcelRings(
        xy=np.concatenate([shapely.get_coordinates(p)[:-1] for p in polygons]),
        offsets=np.arange(0, 4 * n + 1, 4),
        on_street=np.zeros(4 * n),
        frontage=np.bincount(parcel, weights=fronts.length),
        polygons=polygons,
        area=np.full(n, 400.0),
        rim=rng.random(n) < 0.3,
    )
    whole = some.astype(np.int64)
    uses = np.full(n, "parcel", dtype=object)
    parcels = FabricParcels(
        rings, np.arange(1, n + 1), whole, whole - 1, whole - 1, uses, some, whole, fronts
    )
    return dataclasses.replace(fabric, parcels=parcels)


class BruteForce:
    """The same figures from a graph with a node for every piece of frontage."""

    def __init__(self, fabric: Fabric) -> None:
        self.fabric, net = fabric, fabric.network
        assert fabric.parcels is not None
        self.fronts = fabric.parcels.fronts
        on: dict[int, list[tuple[float, object]]] = defaultdict(list)
        for i, (k, at) in enumerate(zip(self.fronts.edge, self.fronts.at, strict=True)):
            on[int(k)].append((float(at), ("front", i)))
        graph = nx.MultiGraph()
        for k in range(net.n_edges):
            ends = [(0.0, int(net.start[k])), (float(net.edge_length[k]), int(net.end[k]))]
            stops = [ends[0], *sorted(on[k], key=str), ends[1]]
            stops.sort(key=lambda stop: stop[0])
            for (a, v), (b, w) in itertools.pairwise(stops):
                graph.add_edge(v, w, weight=b - a)
        self.ways = dict(nx.all_pairs_dijkstra_path_length(graph))
        lines = net.lines(fabric.lines)
        self.places = [
            lines[k].interpolate(at) for k, at in zip(self.fronts.edge, self.fronts.at, strict=True)
        ]

    def values(self, chosen: np.ndarray) -> tuple[float, float, float]:
        fronts, net = self.fronts, self.fabric.network
        gates = set(np.flatnonzero(net.node_kind == NodeKind.ENTRY).tolist())
        gates |= set(net.start[net.edge_rim].tolist()) | set(net.end[net.edge_rim].tolist())
        total = np.bincount(fronts.parcel, weights=fronts.length)
        pieces = [i for i, p in enumerate(fronts.parcel) if chosen[p]]
        sums = np.zeros(6)
        for i in pieces:
            w = fronts.length[i] / total[fronts.parcel[i]]
            reached = self.ways[("front", i)]
            to_rim = min((reached[g] for g in gates if g in reached), default=math.inf)
            if net.edge_rim[fronts.edge[i]]:
                to_rim = 0.0
            if math.isfinite(to_rim):
                sums[:2] += w * to_rim, w
            for j in pieces:
                way = reached.get(("front", j))
                if fronts.parcel[i] == fronts.parcel[j] or way is None:
                    continue
                both = w * fronts.length[j] / total[fronts.parcel[j]]
                sums[2:4] += both * way, both
                straight = self.places[i].distance(self.places[j])
                if straight >= NEAR:
                    sums[4:] += both * way / straight, both
        a, b, c = (x / n if n else math.nan for x, n in sums.reshape(3, 2))
        return a, b, c


def assert_as_brute_force(fabric: Fabric) -> None:
    parcels = fabric.parcels
    assert parcels is not None
    oracle, ours = BruteForce(fabric), Routes(fabric)
    for part in (None, *np.unique(parcels.part).tolist()):
        for interior in (False, True):
            chosen = (parcels.part == part) | (part is None)
            chosen = np.asarray(chosen & ~(interior & parcels.rings.rim))
            found = ours.parcel_values(part, interior=interior)
            expected = pytest.approx(oracle.values(chosen), rel=1e-9, abs=1e-6, nan_ok=True)
            assert [found[name] for name in NAMES] == expected


LAYOUTS = {
    "crossing": lambda: grid(4, 4, [(0, 1), (4, 1)], [(2, 1), (2, 3)]),
    "rim alone": lambda: grid(3, 3),
    "no rim": lambda: grid(4, 4, [(0, 2), (4, 2)], [(2, 0), (2, 4)], rim=False),
    "ring": lambda: grid(5, 5, [(1, 1), (4, 1), (4, 4), (1, 4), (1, 1)]),
    "ring and spur": lambda: grid(5, 5, [(1, 1), (4, 1), (4, 4), (1, 4), (1, 1)], [(0, 1), (1, 1)]),
    "parallel edges": lambda: grid(
        5, 5, [(0, 2), (1, 2)], [(1, 1), (4, 1), (4, 4), (1, 4), (1, 1)], [(4, 2), (5, 2)]
    ),
    "dead end inside a parcel's reach": lambda: grid(4, 2, [(2, 0), (2, 1), (3, 1)]),
    "two pieces": lambda: grid(6, 3, [(1, 1), (2, 1)], [(4, 1), (5, 1), (5, 2)], rim=False),
    "two parts": lambda: layout_of(
        boxes(4, 4) + boxes(2, 2, at=(6, 0)),
        [(0, 2), (4, 2)],
        [(6, 1), (7, 1)],
        part=[0] * 16 + [1] * 4,
    ),
    "hole": lambda: layout_of(boxes(4, 4, without=[(1, 1)]), [(2, 0), (2, 4)]),
    "diagonals": lambda: cut_square(100, [(0, 0), (100, 100)], [(0, 100), (100, 0)]),
}


@pytest.mark.parametrize("name", LAYOUTS)
def test_ways_of_small_layouts(name: str) -> None:
    assert_as_brute_force(fabric_of(LAYOUTS[name]()))


@pytest.mark.parametrize("name", ["mauren tree", "schaan cul-de-sac", "rect loop"])
def test_ways_of_real_layouts(name: str) -> None:
    land, pattern = name.split()
    fabric = fabric_of(sample_layout(land, 60, pattern))
    assert (Routes(fabric)._sources == 1).all()
    assert_as_brute_force(fabric)


@pytest.mark.parametrize("town", TOWNS)
def test_ways_of_parcels_anywhere_on_real_streets(town: str) -> None:
    assert_as_brute_force(with_parcels(fabric_of_lines(town_lines(town)), seed=len(town)))


@settings(deadline=None, max_examples=15)
@given(seed=st.integers(0, 10_000))
def test_ways_on_random_lines(seed: int) -> None:
    rng = np.random.default_rng(seed)
    ends = rng.integers(0, 10, (8, 2, 2)) * 100.0
    drawn = [shapely.LineString(e) for e in ends if (e[0] != e[1]).any()]
    ring = shapely.Point(*rng.integers(0, 1000, 2)).buffer(60, quad_segs=3).exterior
    fabric = fabric_of_lines([*drawn, ring])
    assert_as_brute_force(with_parcels(fabric, seed, n=12))


@pytest.mark.parametrize("town", TOWNS)
def test_detour_between_nodes(town: str) -> None:
    fabric = fabric_of_lines(town_lines(town))
    net = fabric.network
    graph = nx.MultiGraph()
    edges = zip(net.start.tolist(), net.end.tolist(), net.edge_length.tolist(), strict=True)
    graph.add_weighted_edges_from(edges)
    ways = dict(nx.all_pairs_dijkstra_path_length(graph))
    xy = fabric.lines.xy[net.node_vertex]
    nodes = [v for v in graph if net.node_degree[v] != 2]
    detours = [
        ways[a][b] / math.dist(xy[a], xy[b])
        for a, b in itertools.combinations(nodes, 2)
        if b in ways[a] and math.dist(xy[a], xy[b]) >= NEAR
    ]
    found = FabricMeasures(fabric).values["network_detour"]
    assert found == pytest.approx(np.mean(detours))
    assert found > 1


def test_the_ways_of_few_parcels_are_no_sample(monkeypatch: pytest.MonkeyPatch) -> None:
    fabric = fabric_of(grid(8, 8, [(0, 4), (8, 4)]))
    monkeypatch.setattr(routes, "MOST_PAIRS", 1)
    reached = np.unique(fabric.parcels.fronts.parcel)  # type: ignore[union-attr]
    assert len(reached) <= LEAST_SOURCES
    assert (Routes(fabric)._sources[reached] == 1).all()


@pytest.mark.parametrize("name", ["irregular_64ha loop", "schaan tree"])
def test_a_sample_of_ways_is_near_all_of_them(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    land, pattern = name.split()
    fabric = fabric_of(sample_layout(land, 400, pattern))
    exact = {**Routes(fabric).parcel_values(None, interior=False)}
    exact |= Routes(fabric).network_values(None)
    monkeypatch.setattr(routes, "MOST_PAIRS", 100_000)
    monkeypatch.setattr(routes, "MOST_NODE_PAIRS", 1)
    sampled = Routes(fabric)
    found = {**sampled.parcel_values(None, interior=False), **sampled.network_values(None)}
    factor = sampled._sources
    assert 64 <= (factor > 0).sum() < 200
    # each one stands for others, of its own part, and all are stood for
    part = fabric.parcels.part  # type: ignore[union-attr]
    assert np.bincount(part, factor) == pytest.approx(np.bincount(part))
    for name_, value in found.items():
        assert value == pytest.approx(exact[name_], rel=0.03), name_
    assert found["rim_distance_m"] == exact["rim_distance_m"]


def test_blocks_of_pairs_do_not_matter(monkeypatch: pytest.MonkeyPatch) -> None:
    fabric = fabric_of(LAYOUTS["crossing"]())
    one = Routes(fabric).parcel_values(None, interior=False)
    monkeypatch.setattr(routes, "BLOCK", 7)
    other = Routes(fabric).parcel_values(None, interior=False)
    assert other == pytest.approx(one)


def test_what_has_no_ways_is_nan() -> None:
    nowhere = FabricMeasures(fabric_of(grid(3, 3, rim=False))).values
    for name in (*NAMES, "network_detour", "circuity", "orientation_entropy", "meshedness"):
        assert math.isnan(nowhere[name]), name
        assert math.isnan(nowhere.get(f"{name}_interior", math.nan)), name
    assert (nowhere["network_pieces"], nowhere["intersections"], nowhere["dead_ends"]) == (0, 0, 0)
    alone = FabricMeasures(fabric_of(grid(1, 1))).values
    assert alone["rim_distance_m"] == 0
    assert math.isnan(alone["parcel_distance_m"])
    assert math.isnan(alone["parcel_detour"])
    assert alone["network_pieces"] == 1
    # streets that nobody leaves the land by
    inner = FabricMeasures(fabric_of(LAYOUTS["two pieces"]())).values
    assert math.isnan(inner["rim_distance_m"])
    assert inner["parcel_distance_m"] > 0
    assert inner["network_pieces"] == 2


def test_streets_alone_have_no_parcel_metrics() -> None:
    fabric = fabric_of_lines(town_lines("aleppo"))
    v = FabricMeasures(fabric).values
    assert all(math.isnan(v[name]) for name in NAMES)
    assert v["network_detour"] > 1


def test_parcels_in_pieces_that_are_not_joined_have_no_way() -> None:
    layout = LAYOUTS["two parts"]()
    fabric = fabric_of(layout)
    both = Routes(fabric)
    apart = [both.parcel_values(p, interior=False)["parcel_distance_m"] for p in (0, 1)]
    whole = both.parcel_values(None, interior=False)["parcel_distance_m"]
    n = np.array([16, 4])  # all have frontage
    n[0] -= (layout.frontage[layout.face_part == 0] == 0).sum()
    pairs = n * (n - 1)
    assert whole == pytest.approx((pairs * apart).sum() / pairs.sum())


@pytest.mark.parametrize("name", LAYOUTS)
def test_pieces_of_frontage(name: str) -> None:
    assert_fronts(LAYOUTS[name]())


@pytest.mark.parametrize("name", ["schaan tree", "ellipse cul-de-sac"])
def test_pieces_of_frontage_of_real_layouts(name: str) -> None:
    land, pattern = name.split()
    assert_fronts(sample_layout(land, 150, pattern))


def assert_fronts(layout: Layout) -> None:
    """Pieces are the frontage, lie within their edge, on the street and on the parcel."""
    fabric = fabric_of(layout)
    net, lines = fabric.network, fabric.street_lines
    assert fabric.parcels is not None
    fronts, polygons = fabric.parcels.fronts, fabric.parcels.rings.polygons
    total = np.bincount(fronts.parcel, weights=fronts.length, minlength=len(fabric.parcels))
    np.testing.assert_allclose(total, fabric.parcels.rings.frontage, atol=1e-9)
    assert (fronts.length > 0).all()
    assert (fronts.at - fronts.length / 2 >= -1e-9).all()
    assert (fronts.at + fronts.length / 2 <= net.edge_length[fronts.edge] + 1e-9).all()
    if not len(fronts.parcel):
        return
    places = shapely.line_interpolate_point(lines[fronts.edge], fronts.at)
    assert shapely.distance(places, shapely.boundary(polygons[fronts.parcel])).max() < 1e-6
    for shift in (-0.49, 0.49):  # so does all of a piece
        near = shapely.line_interpolate_point(lines[fronts.edge], fronts.at + shift * fronts.length)
        assert shapely.distance(near, shapely.boundary(polygons[fronts.parcel])).max() < 1e-6
    # along an edge the pieces on both sides cover it, less the rim's outer side
    covered = np.bincount(fronts.edge, weights=fronts.length, minlength=net.n_edges)
    sides = np.where(net.edge_rim, 1, 2)
    holes = shapely.length(shapely.intersection(lines, _holes(fabric)))
    np.testing.assert_allclose(covered, sides * net.edge_length - holes, atol=1e-6)


def _holes(fabric: Fabric) -> shapely.Geometry:
    rings = [r for land in fabric.land for r in land.interiors]
    return shapely.multilinestrings(rings) if rings else shapely.LineString()


@settings(deadline=None, max_examples=10)
@given(data=st.data())
def test_ways_do_not_depend_on_the_order_of_rows(data: st.DataObject) -> None:
    town = data.draw(st.sampled_from(TOWNS))
    fabric = with_parcels(fabric_of_lines(town_lines(town)), data.draw(st.integers(0, 99)))
    parcels = fabric.parcels
    assert parcels is not None
    new = np.array(data.draw(st.permutations(range(len(parcels)))))
    old = np.argsort(new)
    fronts = parcels.fronts
    order = np.array(data.draw(st.permutations(range(len(fronts.parcel)))))
    turned = dataclasses.replace(
        parcels,
        rings=dataclasses.replace(
            parcels.rings, rim=parcels.rings.rim[old], polygons=parcels.rings.polygons[old]
        ),
        fronts=Fronts(
            new[fronts.parcel][order], fronts.edge[order], fronts.at[order], fronts.length[order]
        ),
    )
    with pytest.MonkeyPatch.context() as patch:  # a sample of them, so that it is told as well
        patch.setattr(routes, "LEAST_SOURCES", 20)
        patch.setattr(routes, "MOST_PAIRS", 1)
        for interior in (False, True):
            one = Routes(fabric).parcel_values(None, interior=interior)
            other = Routes(dataclasses.replace(fabric, parcels=turned)).parcel_values(
                None, interior=interior
            )
            assert other == pytest.approx(one, rel=1e-9, nan_ok=True)


@settings(deadline=None, max_examples=10)
@given(order=st.permutations(range(20)))
def test_no_metric_depends_on_the_order_of_parcels(order: list[int]) -> None:
    streets = [(0, 2), (5, 2)], [(3, 2), (3, 3), (4, 3)], [(1, 0), (1, 2)]
    cells = boxes(5, 4)
    one = LayoutMeasures(layout_of(cells, *streets)).of_fabric.values
    other = LayoutMeasures(layout_of([cells[i] for i in order], *streets)).of_fabric.values
    assert dict(other) == pytest.approx(dict(one), rel=1e-9, abs=1e-9, nan_ok=True)
