"""Layouts as files of OpenStreetMap and SUMO: what other programs read is what was laid out."""

from __future__ import annotations

import math
import shutil
import subprocess
import xml.etree.ElementTree as ET
from collections import Counter
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path
from typing import Any

import geopandas as gpd
import networkx as nx
import numpy as np
import osmnx as ox
import pyproj
import pytest
import shapely
from grid_layouts import boxes, grid, layout_of
from odd_layouts import ODD_CLASS, odd_layout, rotated

import urban_processing as up
from urban_processing.errors import OutputError
from urban_processing.io.exports import check_export, export_layers, export_layout
from urban_processing.io.frames import GeoLayout
from urban_processing.layout import GivenStreet, Layout
from urban_processing.network_files.streets import Street
from urban_processing.network_files.tags import DEAD_END_TAGS, LONGEST, PARCEL_TAGS, STREET_TAGS
from urban_processing.schema import BLOCKS
from urban_processing.site import Frame
from urban_processing.street_rules import (
    CLASS_WIDTHS,
    FOOTPATHS,
    HIGHWAYS,
    TRAFFIC,
    VERGES,
    StreetRules,
)

GEOD = pyproj.Geod(ellps="WGS84")

SWISS: dict[str, Any] = {"crs": "EPSG:2056", "origin": (2_600_000.0, 1_200_000.0)}


@pytest.fixture(params=["utm", "swiss", "turned"])
def layout(request: pytest.FixtureRequest) -> Layout:
    if request.param == "swiss":
        return odd_layout(**SWISS)
    return rotated(odd_layout(), 31.0) if request.param == "turned" else odd_layout()


@pytest.fixture
def odd(tmp_path: Path) -> tuple[GeoLayout, Path]:
    """The layout and a folder with its files for OpenStreetMap."""
    geo = GeoLayout(odd_layout())
    return geo, geo.export(tmp_path / "osm", kind="osm")


def elements(path: Path, name: str) -> list[ET.Element]:
    return list(ET.parse(path).getroot().iter(name))


def tags(element: ET.Element) -> dict[str, str]:
    return {tag.attrib["k"]: tag.attrib["v"] for tag in element.iter("tag")}


# ---- streets -----------------------------------------------------------------------------------


def test_every_class_with_a_width_has_its_traffic() -> None:
    assert set(HIGHWAYS) == set(CLASS_WIDTHS)
    assert set(HIGHWAYS.values()) <= set(TRAFFIC)
    assert set(TRAFFIC) >= FOOTPATHS
    assert all(TRAFFIC[name].users for name in FOOTPATHS)


@pytest.mark.parametrize(
    ("street_class", "width", "highway", "carriageway", "lanes"),
    [
        ("collector", 16, "tertiary", 10, 2),
        ("local", 12, "residential", 6, 2),
        ("cul_de_sac", 10, "residential", 4, 1),
        ("rim", 16, "unclassified", 10, 2),
        ("fixed", 16, "unclassified", 10, 2),
        ("motorway", 40, "motorway", 34, 4),
        ("primary", 22, "primary", 16, 4),
        ("primary", 21, "primary", 15, 4),
        ("primary", 15, "primary", 9, 2),
        ("service", 8, "service", 2, 1),
        ("service", 7.9, "service", None, None),
        ("local", 0, "residential", None, None),
        ("footway", 12, "footway", 6, None),
        ("Main Street", 12, "unclassified", 6, 2),
        ("proposed", 12, "unclassified", 6, 2),
        ("", 12, "unclassified", 6, 2),
    ],
)
def test_streets_as_others_see_them(
    street_class: str, width: float, highway: str, carriageway: float | None, lanes: int | None
) -> None:
    street = Street(1, 1, street_class, width)
    assert street.highway == highway
    assert (street.carriageway, street.lanes) == (carriageway, lanes)


# ---- OpenStreetMap -----------------------------------------------------------------------------


def test_osmnx_finds_the_streets_with_their_lengths(layout: Layout, tmp_path: Path) -> None:
    geo = GeoLayout(layout)
    path = geo.export(tmp_path / "out", kind="osm") / "streets.osm"
    graph = ox.graph_from_xml(path, simplify=False, retain_all=True)
    lines = geo.streets.to_crs(4326)
    vertices = np.unique(np.round(shapely.get_coordinates(lines.geometry), 7), axis=0)
    segments = int((shapely.get_num_points(lines.geometry) - 1).sum())
    assert (len(graph), len(graph.edges)) == (len(vertices), 2 * segments)
    assert nx.number_strongly_connected_components(graph) == 3  # one for each part
    assert nx.number_weakly_connected_components(graph) == 3
    streets = lines.assign(
        highway=[HIGHWAYS.get(c, "unclassified") for c in lines["class"]],
        geodesic=[GEOD.geometry_length(line) for line in lines.geometry],
    )
    edges = ox.graph_to_gdfs(graph, nodes=False)
    found = edges.groupby("highway").length.sum() / 2
    for column, near in (("geodesic", 0.004), ("length_m", 0.006)):  # OSMnx measures on a sphere
        expected = streets.groupby("highway")[column].sum()
        assert found.to_dict() == pytest.approx(expected.to_dict(), rel=near)
    limits = edges.dropna(subset="maxspeed").groupby("highway").maxspeed.unique()
    for highway, speeds in limits.items():
        assert [float(speed) for speed in speeds] == [TRAFFIC[str(highway)].speed]
    assert set(edges.highway) - set(limits.index) == {"footway"}
    assert not edges.oneway.any()


def test_vertices_lie_where_they_were(layout: Layout, tmp_path: Path) -> None:
    geo = GeoLayout(layout)
    path = geo.export(tmp_path / "out", kind="osm") / "layout.osm"
    parcels = gpd.read_file(path, layer="multipolygons").to_crs(geo.crs)
    number = parcels.other_tags.str.extract(r'"ref"=>"(\d+)"')[0].astype(int)
    parcels = parcels.set_index(number).sort_index()
    assert parcels.index.tolist() == geo.parcels.index.tolist()
    own = shapely.normalize(geo.parcels.geometry.values)
    read = shapely.normalize(shapely.get_geometry(parcels.geometry.values, 0))
    # GDAL keeps seven digits of degrees
    assert shapely.hausdorff_distance(own, read).max() < 0.02
    assert parcels.area.to_numpy() == pytest.approx(geo.parcels.area.to_numpy(), rel=2e-3)
    assert (shapely.get_num_interior_rings(read) == [*[0] * 31, 2, 0]).all()
    assert (parcels["boundary"] == "lot").all()


def test_streets_and_parcels_share_nodes(odd: tuple[GeoLayout, Path]) -> None:
    geo, folder = odd
    ways = {way.attrib["id"]: way for way in elements(folder / "layout.osm", "way")}
    places = {n.attrib["id"]: n for n in elements(folder / "layout.osm", "node")}
    assert len(places) == geo.layout.mesh.n_vertices
    assert len({(n.attrib["lat"], n.attrib["lon"]) for n in places.values()}) == len(places)
    refs = {k: [nd.attrib["ref"] for nd in way.iter("nd")] for k, way in ways.items()}
    streets = [k for k, way in ways.items() if "highway" in tags(way)]
    assert [int(k) for k in streets] == geo.streets.index.tolist()
    rings = [r for k, r in refs.items() if k not in streets]
    assert all(ring[0] == ring[-1] for ring in rings)
    sides = {frozenset(pair) for ring in rings for pair in pairwise(ring)}
    for k in streets:
        assert {frozenset(p) for p in pairwise(refs[k])} <= sides
    alone = {way.attrib["id"]: way for way in elements(folder / "streets.osm", "way")}
    assert list(alone) == streets
    for k in streets:
        assert [nd.attrib["ref"] for nd in alone[k].iter("nd")] == refs[k]
        assert tags(alone[k]) == tags(ways[k])
    used = {n.attrib["id"] for n in elements(folder / "streets.osm", "node")}
    assert used == {ref for k in streets for ref in refs[k]}


def test_tags_are_those_declared_and_hold_any_text(odd: tuple[GeoLayout, Path]) -> None:
    geo, folder = odd
    found = [tags(e) for e in elements(folder / "layout.osm", "way")]
    streets = [t for t in found if "highway" in t]
    assert [t["urban_processing:class"] for t in streets] == [
        c.replace("\x07", "\ufffd") for c in geo.streets["class"]
    ]
    assert "\x07" in ODD_CLASS
    declared = [tag.key for tag in STREET_TAGS]
    assert {key for t in streets for key in t} == set(declared)
    relations = [tags(e) for e in elements(folder / "layout.osm", "relation")]
    parcels = [t for t in (*found, *relations) if "boundary" in t]
    assert len(parcels) == len(geo.parcels)
    assert {key for t in parcels for key in t} - {"type"} == {tag.key for tag in PARCEL_TAGS}
    uses = Counter((t.get("landuse"), t.get("urban_processing:land_use")) for t in parcels)
    assert uses == {
        (None, None): len(parcels) - 3,
        ("retail", "retail"): 2,
        (None, "a <park> & more"): 1,
    }
    assert [t["type"] for t in relations] == ["multipolygon"]
    roles = [m.attrib["role"] for m in elements(folder / "layout.osm", "member")]
    assert roles == ["outer", "inner", "inner"]


def test_a_text_is_no_longer_than_openstreetmap_allows(tmp_path: Path) -> None:
    layout = odd_layout()
    given = tuple(GivenStreet("x" * 999, math.nan) for _ in layout.fixed_streets)
    folder = export_layout(layout.replace(fixed_streets=given), tmp_path / "out", kind="osm")
    classes = [
        tags(w).get("urban_processing:class", "") for w in elements(folder / "streets.osm", "way")
    ]
    assert max(map(len, classes)) == LONGEST


@pytest.mark.parametrize("laid_out", [True, False])
def test_streets_end_where_they_do_not_leave_the_land(laid_out: bool, tmp_path: Path) -> None:
    """One end lies on the rim, where a street goes on; the other one inside the land."""
    layout = grid(4, 2, [(0, 1), (3, 1)], rim=False)
    layout = layout.replace(street_rules=StreetRules(laid_out=laid_out, turning_radius=9.5))
    folder = export_layout(layout, tmp_path / "out", kind="osm")
    (end,) = [n for n in elements(folder / "streets.osm", "node") if tags(n)]
    head = {"highway": "turning_circle", "diameter": "19"} if laid_out else {}
    assert tags(end) == {"noexit": "yes", **head}
    assert [*tags(end)] == [tag.key for tag in DEAD_END_TAGS][: 3 if laid_out else 1]
    to_map = pyproj.Transformer.from_crs("EPSG:32630", 4326)
    assert (float(end.attrib["lat"]), float(end.attrib["lon"])) == pytest.approx(
        to_map.transform(60, 20), abs=1e-9
    )


def test_blocks_read_the_widths_of_rights_of_way_again(
    odd: tuple[GeoLayout, Path],
) -> None:
    geo, folder = odd
    own = geo.streets[geo.streets.part == 0]
    wanted = {
        (str(c).replace("\x07", "\ufffd"), w)
        for c, w in zip(own["class"], own.width_m, strict=True)
    }
    # by GDAL: all tags, so that class and width are those of the layer of streets
    made = up.find_blocks(folder / "layout.osm", layer="lines", crs="EPSG:32630", footpaths=True)
    edges = made.block_edges.dropna(subset="width_m")
    assert {(c, round(w, 9)) for c, w in zip(edges["class"], edges.width_m, strict=True)} >= {
        pair for pair in wanted if pair[0] != "cul_de_sac"
    }
    assert "width_assumed" not in set(made.issues.code)
    # by OSMnx: the width of the carriageway, and what the verges take
    graph = ox.graph_from_xml(folder / "streets.osm", simplify=False, retain_all=True)
    lines = ox.graph_to_gdfs(graph, nodes=False)
    assert {
        (h, float(w) + VERGES)
        for h, w in zip(lines.highway, lines.width, strict=True)
        if h != "footway"
    } == {(HIGHWAYS.get(c, "unclassified"), w) for c, w in wanted if c != "footway"}
    again = up.find_blocks(lines, crs="EPSG:32630").block_edges
    assert set(again.width_m) <= {w for _, w in wanted}


def test_tags_in_one_column_do_not_replace_what_a_column_says() -> None:
    square = [(0, 0), (100, 0), (100, 100), (0, 100), (0, 0)]
    lines = [shapely.LineString(square[i : i + 2]) for i in range(4)]
    frame = gpd.GeoDataFrame(
        {
            "highway": "residential",
            "width": ["4", None, None, None],
            "other_tags": [
                '"width"=>"99","access"=>"no"',
                '"surface"=>"a \\"b\\", c","width"=>"9"',
                '"urban_processing:width_m"=>"30","width"=>"9"',
                None,
            ],
        },
        geometry=lines,
        crs="EPSG:32630",
    )
    edges = up.find_blocks(frame).block_edges
    assert sorted(edges.width_m) == [10, 12, 15, 30]


# ---- SUMO --------------------------------------------------------------------------------------


def netconvert(folder: Path, *arguments: str) -> str:
    """Run netconvert in a folder and return what it says."""
    sumo = pytest.importorskip("sumo", reason="the package eclipse-sumo is not here")
    program = shutil.which("netconvert", path=str(Path(sumo.SUMO_HOME) / "bin"))
    assert program is not None
    done = subprocess.run(
        [program, *arguments], cwd=folder, capture_output=True, text=True, timeout=60, check=False
    )
    assert done.returncode == 0, done.stderr
    return done.stdout + done.stderr


def build_net(folder: Path) -> tuple[ET.Element, str]:
    """Let netconvert build a network; it and what it said."""
    files = "--node-files", "layout.nod.xml", "--edge-files", "layout.edg.xml"
    said = netconvert(folder, *files, "--output-file", "layout.net.xml")
    return ET.parse(folder / "layout.net.xml").getroot(), said


def full_length(edge: ET.Element, places: dict[str, tuple[float, float]]) -> float:
    """Length of an edge from the middle of one junction to that of the other."""
    ends = [places[edge.attrib["from"]], places[edge.attrib["to"]]]
    if "shape" in edge.attrib:
        inner = [tuple(map(float, p.split(","))) for p in edge.attrib["shape"].split()]
        ends = [ends[0], *inner, ends[1]]
    return float(shapely.LineString(ends).length)


def test_netconvert_builds_the_network(layout: Layout, tmp_path: Path) -> None:
    geo = GeoLayout(layout)
    net, said = build_net(geo.export(tmp_path / "out", kind="sumo"))
    assert "Error" not in said
    assert said.count("Warning") <= 2
    edges = [e for e in net.iter("edge") if e.get("function") != "internal"]
    nodes = [n for n in net.iter("junction") if n.attrib["type"] != "internal"]
    rings = int((geo.streets.from_junction.isna()).sum())
    assert rings == 2
    assert len(edges) == 2 * (len(geo.streets) + 2 * rings)
    assert len(nodes) == len(geo.junctions) + 3 * rings
    graph = nx.DiGraph((e.attrib["from"], e.attrib["to"]) for e in edges)
    assert nx.number_strongly_connected_components(graph) == 3
    places = {n.attrib["id"]: (float(n.attrib["x"]), float(n.attrib["y"])) for n in nodes}
    own = geo.streets
    length: Counter[int] = Counter()
    for edge in edges:
        number = int(edge.attrib["id"].lstrip("-").partition("#")[0])
        length[number] += full_length(edge, places) / 2
        lanes = list(edge.iter("lane"))
        street = Street(number, 0, own["class"][number], own.width_m[number])
        assert len(lanes) == max(1, (street.lanes or 1) // 2)
        for lane in lanes:
            speed = float(lane.attrib["speed"]) * 3.6
            assert speed == pytest.approx(street.traffic.speed, abs=0.04)
        assert edge.attrib["priority"] == str(street.traffic.priority)
        walk = lanes[0].get("allow")
        assert (walk is not None and "pedestrian" in walk) is (street.highway == "footway")
    # netconvert moves the ends of shapes a little
    assert dict(length) == pytest.approx(own.length_m.to_dict(), rel=0.01, abs=0.1)


@pytest.mark.parametrize("where", [{}, SWISS], ids=["utm", "swiss"])
def test_sumo_knows_where_on_earth_the_network_is(where: dict[str, Any], tmp_path: Path) -> None:
    geo = GeoLayout(odd_layout(**where))
    folder = geo.export(tmp_path / "out", kind="sumo")
    build_net(folder)
    netconvert(folder, "-s", "layout.net.xml", "--plain-output-prefix", "geo", "--proj.plain-geo")
    read = {n.attrib["id"]: n.attrib for n in elements(folder / "geo.nod.xml", "node")}
    for number, place in geo.junctions.to_crs(4326).geometry.items():
        x, y = (float(read[str(number)][axis]) for axis in "xy")
        assert GEOD.inv(x, y, place.x, place.y)[2] < 0.2


def test_entries_are_at_the_outer_fringe(tmp_path: Path) -> None:
    layout = grid(4, 2, [(0, 1), (4, 1)], rim=False)
    entry = np.all(layout.mesh.xy == [0, 20], axis=1)
    folder = export_layout(layout.replace(vertex_entry=entry), tmp_path / "out", kind="sumo")
    nodes = elements(folder / "layout.nod.xml", "node")
    assert [(n.attrib["x"], n.get("fringe")) for n in nodes] == [
        ("0.000", "outer"),
        ("80.000", None),
    ]
    build_net(folder)


@pytest.mark.parametrize("sides", [3, 4, 50])
def test_a_ring_becomes_three_edges(sides: int, tmp_path: Path) -> None:
    turn = np.linspace(0, 2 * np.pi, sides, endpoint=False)
    land = shapely.Polygon(np.column_stack([np.cos(turn), np.sin(turn)]) * 90)
    folder = export_layout(layout_of([land]), tmp_path / "out", kind="sumo")
    edges = elements(folder / "layout.edg.xml", "edge")
    assert [e.attrib["id"] for e in edges] == ["1#0", "-1#0", "1#1", "-1#1", "1#2", "-1#2"]
    longest = max(1 + len(e.get("shape", "a b").split()) for e in edges)
    assert longest <= sides / 3 + 4
    build_net(folder)


def test_without_a_crs_sumo_has_a_plane_and_osm_is_refused(tmp_path: Path) -> None:
    layout = odd_layout().replace(frame=Frame("", (0.0, 0.0)))
    folder = export_layout(layout, tmp_path / "out", kind="sumo")
    (location,) = elements(folder / "layout.nod.xml", "location")
    assert location.attrib["projParameter"] == "!"
    assert location.attrib["netOffset"] == "0.000,0.000"
    build_net(folder)
    with pytest.raises(OutputError, match="OpenStreetMap is in WGS 84, but the layout has no CRS"):
        export_layout(layout, tmp_path / "osm", kind="osm")
    assert not (tmp_path / "osm").exists()


# ---- both --------------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", ["osm", "sumo"])
def test_the_same_layout_gives_the_same_bytes(kind: str, tmp_path: Path) -> None:
    layout = odd_layout()
    file = GeoLayout(layout).save(tmp_path / "layout.gpkg")
    one = export_layout(layout, tmp_path / "one", kind=kind)
    two = up.read_layout(file).export(tmp_path / "two", kind=kind)
    names = sorted(path.name for path in one.iterdir())
    assert names == sorted(path.name for path in two.iterdir())
    assert len(names) == 2
    assert all((one / name).read_bytes() == (two / name).read_bytes() for name in names)


@pytest.mark.parametrize(
    ("kind", "names"),
    [("osm", ("layout.osm", "streets.osm")), ("sumo", ("layout.nod.xml", "layout.edg.xml"))],
)
def test_files_that_are_there_are_kept(
    kind: str, names: tuple[str, str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    layout = odd_layout()
    (tmp_path / names[1]).write_text("precious")
    assert check_export(tmp_path) == []
    with pytest.raises(OutputError, match=f"already holds {names[1]}"):
        export_layout(layout, tmp_path, kind=kind)
    # a write that fails half-way leaves all as it was
    write = Path.write_bytes

    def broken(path: Path, content: bytes) -> int:
        if path.name == names[1]:
            raise OSError("no space")
        return write(path, content)

    monkeypatch.setattr(Path, "write_bytes", broken)
    with pytest.raises(OutputError, match="no space"):
        export_layout(layout, tmp_path, kind=kind, overwrite=True)
    assert [path.name for path in tmp_path.iterdir()] == [names[1]]
    assert (tmp_path / names[1]).read_text() == "precious"
    monkeypatch.undo()
    export_layout(layout, tmp_path, kind=kind, overwrite=True)
    assert sorted(path.name for path in tmp_path.iterdir()) == sorted(names)


def test_layers_without_a_network_are_refused(tmp_path: Path) -> None:
    sentence = "osm is a format of layouts, which have a network of streets: choose geojson or "
    assert check_export(tmp_path, kind="osm", layers=[BLOCKS]) == [f"{sentence}parquet."]
    with pytest.raises(OutputError, match=sentence):
        export_layers({}, tmp_path, crs="EPSG:32630", kind="osm")
    lines = [shapely.LineString(line) for line in ([(0, 0), (99, 0), (99, 99)], [(99, 99), (0, 0)])]
    blocks = up.find_blocks(lines)
    with pytest.raises(OutputError, match="sumo is a format of layouts"):
        blocks.export(tmp_path, kind="sumo")
    assert (blocks.export(tmp_path / "plain", kind="parquet") / "blocks.parquet").exists()


def test_a_layout_without_streets(tmp_path: Path) -> None:
    layout = layout_of(boxes(2, 1), rim=False)
    folder = export_layout(layout, tmp_path / "osm", kind="osm")
    assert elements(folder / "streets.osm", "node") == []
    assert len(elements(folder / "layout.osm", "way")) == 2
    with pytest.raises(OutputError, match="no streets"):
        export_layout(layout, tmp_path / "sumo", kind="sumo")


def test_a_real_place(sample: Callable[[str], Path], tmp_path: Path) -> None:
    geo = up.cogenerate(sample("schaan"), parcels=120)
    folder = geo.export(tmp_path, kind="osm")
    graph = ox.graph_from_xml(folder / "streets.osm", simplify=False, retain_all=True)
    parts = geo.streets.part.nunique()
    assert parts > 1
    assert nx.number_strongly_connected_components(graph) == parts
    geo.export(tmp_path, kind="sumo")
    net, said = build_net(tmp_path)
    assert "Error" not in said
    edges = [e for e in net.iter("edge") if e.get("function") != "internal"]
    rings = int(geo.streets.from_junction.isna().sum())
    assert len(edges) == 2 * (len(geo.streets) + 2 * rings)
