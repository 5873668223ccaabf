"""Streets of OpenStreetMap within a land: files, cleaning, cutting, and what is said of it."""

from __future__ import annotations

import bz2
import gzip
import json
import os
import sys
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import requests
import shapely
import shapely.affinity
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from osm_towns import (
    CRS,
    EAST,
    NORTH,
    XY,
    Town,
    avenue_town,
    land,
    roundabout_town,
    slip_road_town,
)

from urban_processing.errors import BoundaryError, Cancelled, DependencyError
from urban_processing.io.blocks import read_streets
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.osm import ATTRIBUTION, ObservedStreets, read_osm_streets
from urban_processing.io.osm_faces import are_blocks
from urban_processing.io.osm_network import cut_at
from urban_processing.io.osm_ways import CLASSES, KEPT_TAGS, overpass_filter
from urban_processing.progress import CallbackProgress
from urban_processing.site import Site, snap_to_grid

ORIGIN = np.array([EAST, NORTH])

_BESIDE = Path(__file__).resolve().parents[3] / "shared/data"
DATA = Path(os.environ.get("URBAN_DATA", _BESIDE)) / "redistributable"


def real(name: str) -> Path:
    path = DATA / name
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return path


def local(observed: ObservedStreets) -> Any:
    """Lines in the town's metres."""
    return shapely.transform(
        np.asarray(observed.streets.geometry, dtype=object), lambda xy: xy - ORIGIN
    )


def degrees_of(lines: Any) -> dict[XY, int]:
    """How many edges end at each place, to the centimetre."""
    ends = shapely.get_coordinates([shapely.get_point(lines, i) for i in (0, -1)])
    places, count = np.unique(np.round(ends, 2), axis=0, return_counts=True)
    return {(float(x), float(y)): int(n) for (x, y), n in zip(places, count, strict=True)}


def crossings(lines: Any, at: shapely.Geometry) -> list[shapely.Point]:
    met = shapely.intersection(lines, at)
    return list(shapely.get_parts(met[~shapely.is_empty(met)]))


def codes(observed: ObservedStreets) -> dict[str, str]:
    return {issue.code: issue.message for issue in observed.issues}


def same(a: ObservedStreets, b: ObservedStreets) -> bool:
    equal = (
        shapely.to_wkb(a.streets.geometry).tolist() == shapely.to_wkb(b.streets.geometry).tolist()
    )
    tags = list(KEPT_TAGS)
    return bool(equal and a.streets[tags].equals(b.streets[tags]))


# Cleaning


def test_dual_carriageway_becomes_one_line(tmp_path: Path) -> None:
    path = avenue_town().write(tmp_path / "town.osm")
    site = land(-50, 50, 650, 550)
    across = shapely.LineString([(100, 250), (100, 350)])
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    assert len(crossings(local(mapped), across)) == 2
    cleaned = read_osm_streets(site, osm_file=path)
    (point,) = crossings(local(cleaned), across)
    assert point.y == pytest.approx(300.0, abs=1.0)
    row = cleaned.streets[shapely.dwithin(local(cleaned), point, 0.1)].iloc[0]
    assert (row.highway, row["name"]) == ("secondary", "Avenue")
    assert row.lanes == ""  # it was that of one carriageway
    for x in (0.0, 200.0, 400.0, 600.0):
        near = {p: n for p, n in degrees_of(local(cleaned)).items() if abs(p[0] - x) < 30}
        assert [n for (_, y), n in near.items() if 280 < y < 320] == [4]
    assert "simplified" in codes(cleaned)["osm_cleaned"]


def test_dual_carriageway_whose_closing_lies_beyond_the_land(tmp_path: Path) -> None:
    """Its carriageways meet 250 m outside."""
    path = avenue_town().write(tmp_path / "town.osm")
    cleaned = read_osm_streets(land(-50, 50, 650, 550), osm_file=path)
    for x in (-40.0, 640.0):
        across = shapely.LineString([(x, 250), (x, 350)])
        assert len(crossings(local(cleaned), across)) == 1


def test_roundabout_becomes_a_junction(tmp_path: Path) -> None:
    path = roundabout_town().write(tmp_path / "town.osm")
    site, middle = land(-20, -20, 420, 420), shapely.Point(200, 200)
    near = [
        {p: n for p, n in degrees_of(local(o)).items() if middle.distance(shapely.Point(p)) < 40}
        for o in (
            read_osm_streets(site, osm_file=path, clean=False),
            read_osm_streets(site, osm_file=path),
        )
    ]
    assert sorted(near[0].values()) == [3, 3, 3, 3]
    ((place, degree),) = near[1].items()
    assert degree == 4
    assert middle.distance(shapely.Point(place)) < 2


def test_slip_road_vanishes(tmp_path: Path) -> None:
    path = slip_road_town().write(tmp_path / "town.osm")
    site = land(-20, -20, 420, 420)
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    assert "primary_link" in set(mapped.streets.highway)
    cleaned = read_osm_streets(site, osm_file=path)
    assert "primary_link" not in set(cleaned.streets.highway)
    near = [
        n for (x, y), n in degrees_of(local(cleaned)).items() if abs(x - 200) + abs(y - 200) < 60
    ]
    assert near == [4]


@pytest.mark.parametrize("n", [4, 10])
def test_a_grid_of_small_blocks_stays_as_mapped(n: int, tmp_path: Path) -> None:
    """Blocks of 60 x 100 m, few and many of them."""
    town, xs, ys = Town(), [60.0 * i for i in range(n)], [100.0 * i for i in range(n)]
    for x in xs:
        town.way(*[(x, y) for y in ys])
    for y in ys:
        town.way(*[(x, y) for x in xs])
    path, site = town.write(tmp_path / "town.osm"), land(-20, -20, 60 * n, 100 * n)
    cleaned = read_osm_streets(site, osm_file=path)
    assert same(cleaned, read_osm_streets(site, osm_file=path, clean=False))
    assert "by 0.00 km" in codes(cleaned)["osm_smaller"]
    assert "osm_uncovered" not in codes(cleaned)


def test_small_blocks_stay_beside_what_is_cleaned(tmp_path: Path) -> None:
    """A roundabout, an avenue and a slip road, each with a grid of blocks of 60 x 100 m."""
    for i, town in enumerate((roundabout_town(), avenue_town(), slip_road_town())):
        far = 1000.0
        xs, ys = [far + 60.0 * i for i in range(8)], [100.0 * i for i in range(8)]
        for x in xs:
            town.way(*[(x, y) for y in ys])
        for y in ys:
            town.way(*[(x, y) for x in xs])
        town.way((400.0, 0.0), (far, 0.0))
        path, site = town.write(tmp_path / f"town{i}.osm"), land(-20, -20, 1500, 800)
        cleaned = read_osm_streets(site, osm_file=path)
        faces = shapely.get_parts(shapely.polygonize(local(cleaned)))
        blocks = faces[shapely.get_coordinates(shapely.centroid(faces))[:, 0] > far]
        assert shapely.area(blocks) == pytest.approx([6000.0] * 49, rel=1e-3)
        mapped = read_osm_streets(site, osm_file=path, clean=False)
        less = shapely.length(local(mapped)).sum() - shapely.length(local(cleaned)).sum()
        assert less > 10.0
        assert f"by {less / 1e3:.2f} km" in codes(cleaned)["osm_smaller"]


@pytest.mark.parametrize(
    ("face", "block"),
    [
        (shapely.box(0, 0, 60, 100), True),
        (shapely.box(0, 0, 30, 120), True),
        (shapely.box(0, 0, 55, 55), True),
        (shapely.box(0, 0, 20, 300), False),
        (shapely.box(0, 0, 27, 400), False),
        (shapely.Point(0, 0).buffer(38.0), False),
        (shapely.Point(0, 0).buffer(60.0), True),
        (shapely.Polygon([(0, 0), (52, 0), (0, 52)]), False),
        (shapely.Polygon([(0, 0), (120, 0), (0, 120)]), True),
    ],
)
def test_what_is_a_block(face: shapely.Polygon, block: bool) -> None:
    for angle in (0.0, 17.0):
        turned = shapely.affinity.rotate(face, angle)
        assert are_blocks(np.array([turned], dtype=object)).tolist() == [block]


def test_streets_that_would_be_lost_stay(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    import neatnet

    path, site = avenue_town().write(tmp_path / "town.osm"), land(-50, 50, 650, 550)
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    monkeypatch.setattr(neatnet, "neatify", lambda frame, **options: frame.iloc[::2])
    observed = read_osm_streets(site, osm_file=path)
    assert same(observed, mapped)
    assert "would be lost" in codes(observed)["osm_not_cleaned"]


def test_an_extract_of_a_part_of_the_land_is_told(tmp_path: Path) -> None:
    path = Town().grid().write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-20, -20, 2400, 620), osm_file=path)
    assert "a part of the land" in codes(observed)["osm_uncovered"]


def test_blocks_beside_an_artifact_stay(tmp_path: Path) -> None:
    """The only neighbour of the one block is a median: it is no roundabout for that."""
    town = Town()
    town.way((0.0, 0.0), (0.0, 180.0), (150.0, 180.0), (150.0, 110.0), (150.0, 70.0), (150.0, 0.0))
    town.way((150.0, 0.0), (0.0, 0.0)).way((150.0, 110.0), (156.0, 90.0), (150.0, 70.0))
    path = town.way((0.0, 0.0), (-90.0, 0.0)).write(tmp_path / "town.osm")
    cleaned = read_osm_streets(land(-20, -20, 420, 420), osm_file=path)
    (block,) = shapely.get_parts(shapely.polygonize(local(cleaned)))
    assert block.area == pytest.approx(150 * 180, rel=0.02)


def test_dead_ends_in_a_long_block_beside_an_artifact_stay(tmp_path: Path) -> None:
    """The block is 85 m by 1 km, as between the parallel streets of a village."""
    town = Town()
    rows = (0.0, 85.0, 300.0)
    for y in rows:
        town.way((0.0, y), (500.0, y), (985.0, y), (1000.0, y))
    for x in (0.0, 1000.0):
        town.way(*[(x, y) for y in sorted([*rows, 70.0])])
    town.way((985.0, 85.0), (1000.0, 70.0), highway="residential")
    town.way((500.0, 85.0), (500.0, 30.0))
    path = town.write(tmp_path / "town.osm")
    cleaned = read_osm_streets(land(-20, -20, 1020, 320), osm_file=path)
    (end,) = [place for place, degree in degrees_of(local(cleaned)).items() if degree == 1]
    assert end == pytest.approx((500.0, 30.0), abs=0.1)
    assert len(shapely.get_parts(shapely.polygonize(local(cleaned)))) == 2


def test_motorway_stays_apart_and_its_slip_roads_end_on_the_street(tmp_path: Path) -> None:
    town = avenue_town()
    for x in (290.0, 310.0):
        town.way((x, -400.0), (x, 100.0), (x, 1000.0), highway="motorway", bridge="yes", layer="1")
    # the slip road ends on the northern carriageway, which moves by 6 m
    town.way((310.0, 100.0), (330.0, 200.0), (350.0, 306.0), highway="motorway_link")
    lane = next(
        places for places, tags in town.ways if (400.0, 306.0) in places and "lanes" in tags
    )
    lane.insert(lane.index((400.0, 306.0)), (350.0, 306.0))
    path = town.write(tmp_path / "town.osm")
    cleaned = read_osm_streets(land(-50, 50, 650, 550), osm_file=path)
    lines, classes = local(cleaned), cleaned.streets.highway
    assert len(crossings(lines[classes == "motorway"], shapely.box(200, 400, 400, 401))) == 2
    assert set(cleaned.streets[classes == "motorway"].bridge) == {"yes"}
    (link,) = lines[classes == "motorway_link"]
    top = shapely.get_coordinates(link)[np.argmax(shapely.get_coordinates(link)[:, 1])]
    assert top[1] == pytest.approx(300.0, abs=1.0)
    assert degrees_of(lines)[tuple(np.round(top, 2).tolist())] == 3


@pytest.mark.parametrize(
    "town",
    [
        Town().way((0.0, 0.0), (100.0, 0.0)),
        Town().way((0.0, 0.0), (100.0, 0.0), (100.0, 0.0)).way((0.0, 0.0), (0.0, 0.0)),
        Town().way((0.0, 0.0), (100.0, 0.0)).way((50.0, 90.0), (50.0, 40.0)),
        Town().way((0.0, 0.0), (100.0, 0.0), (100.0, 100.0), (0.0, 0.0)),
        Town().way((0.0, 0.0), (9.0, 0.0), (9.0, 9.0), (0.0, 0.0)),
        Town().way((0.0, 0.0), (90.0, 0.0), (90.0, 90.0), (0.0, 0.0)).way((90.0, 0.0), (0.0, 90.0)),
        Town().way((0.0, 0.0), (50.0, 4.0), (90.0, 0.0)).way((0.0, 0.0), (50.0, -4.0), (90.0, 0.0)),
        Town().grid(2),
        Town().grid(2, step=9.0),
        Town().way((0.0, 0.0), (100.0, 0.0)).way((0.0, 0.0), (100.0, 0.0)),
    ],
    ids=["line", "no-length", "apart", "ring", "small-ring", "crossed", "lens", "block", "tiny",
         "twice"],
)  # fmt: skip
def test_networks_too_small_to_clean(town: Town, tmp_path: Path) -> None:
    site = land(-20, -20, 220, 220)
    observed = read_osm_streets(site, osm_file=town.write(tmp_path / "town.osm"))
    assert len(observed.streets) > 0
    assert observed.streets.is_valid.all()
    assert {"osm_cleaned", "osm_not_cleaned"} & set(codes(observed))


def test_a_failure_of_neatnet_leaves_the_streets_as_mapped(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import neatnet

    def neatify(*args: Any, **options: Any) -> None:
        raise IndexError("single positional indexer is out-of-bounds")

    path, site = avenue_town().write(tmp_path / "town.osm"), land(-50, 50, 650, 550)
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    monkeypatch.setattr(neatnet, "neatify", neatify)
    observed = read_osm_streets(site, osm_file=path)
    assert same(observed, mapped)
    assert "as mapped" in codes(observed)["osm_not_cleaned"]
    assert "osm_cleaned" not in codes(observed)


def test_what_neatnet_skips_or_severs_is_told(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import neatnet

    def neatify(frame: Any, **options: Any) -> Any:
        warnings.warn("The artifact has not been simplified.", UserWarning, stacklevel=1)
        return frame[~frame.intersects(shapely.Point(ORIGIN - origin + 125).buffer(9))]

    town = Town().grid(3, step=50.0).way((100.0, 100.0), (150.0, 150.0))
    town.way((190.0, 150.0), (150.0, 150.0), (150.0, 190.0))
    town.way((0.0, 0.0), (-9000.0, 0.0))  # next to which what is lost is little
    site = land(-50, -50, 220, 220)
    origin = np.array(site.frame.origin)
    monkeypatch.setattr(neatnet, "neatify", neatify)
    observed = read_osm_streets(site, osm_file=town.write(tmp_path / "town.osm"))
    assert codes(observed)["osm_places_not_cleaned"].startswith("1 place(s)")
    assert codes(observed)["osm_severed"].startswith("1 piece(s)")


def test_without_neatnet(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path, site = avenue_town().write(tmp_path / "town.osm"), land(-50, 50, 650, 550)
    monkeypatch.setitem(sys.modules, "neatnet", None)
    with pytest.raises(DependencyError, match=r"urban_processing\[osm\].*clean=False"):
        read_osm_streets(site, osm_file=path)
    assert len(read_osm_streets(site, osm_file=path, clean=False).streets) > 0


# What counts as a street


def test_only_streets_for_vehicles_count(tmp_path: Path) -> None:
    town = Town().grid(2, step=100.0)
    others = (
        {"highway": "footway"},
        {"highway": "pedestrian"},
        {"highway": "construction"},
        {"highway": "rim"},
        {"highway": "residential", "access": "private"},
        {"highway": "residential", "motor_vehicle": "no"},
        {"highway": "service"},
        {"highway": "track"},
    )
    for i, tags in enumerate(others):
        town.way((10.0 + i, 0.0), (10.0 + i, 100.0), **tags)
    square = ((60.0, 60.0), (80.0, 60.0), (80.0, 80.0), (60.0, 60.0))
    town.way(*square, highway="residential", area="yes")
    town.ways.append(([(0.0, 50.0), (100.0, 50.0)], {"railway": "rail"}))
    path, site = town.write(tmp_path / "town.osm"), land(-20, -20, 220, 220)
    observed = read_osm_streets(site, osm_file=path, clean=False)
    assert set(observed.streets.highway) == {"residential"}
    assert shapely.length(local(observed)).sum() == pytest.approx(400, abs=0.01)
    assert codes(observed)["osm_left_out"].startswith("9 way(s)")
    more = read_osm_streets(site, osm_file=path, clean=False, service=True)
    assert set(more.streets.highway) == {"residential", "service", "track"}


def test_classes_are_the_houses_own() -> None:
    assert {"motorway", "residential", "busway"} <= set(CLASSES)
    assert not {"rim", "fixed", "cul_de_sac", "footway", "pedestrian", "proposed"} & set(CLASSES)
    assert "|service|" not in overpass_filter(service=False)
    assert "|service|" in overpass_filter(service=True)


def test_ways_are_joined_from_junction_to_junction(tmp_path: Path) -> None:
    town = Town()
    town.way((0.0, 0.0), (40.0, 0.0), name="A", highway="tertiary")
    town.way((100.0, 0.0), (40.0, 0.0), name="B")
    town.way((100.0, 0.0), (200.0, 0.0), name="B").way((100.0, 0.0), (100.0, 50.0))
    path = town.write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-20, -20, 220, 220), osm_file=path, clean=False)
    found = sorted(zip(observed.streets["name"], observed.streets.highway, strict=True))
    assert found == [("", "residential"), ("B", "residential"), ("B", "residential")]


def test_of_equal_stretches_the_highest_class_counts(tmp_path: Path) -> None:
    town = Town().way((0.0, 0.0), (50.0, 0.0)).way((50.0, 0.0), (100.0, 0.0), highway="tertiary")
    path = town.write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-20, -20, 220, 220), osm_file=path, clean=False)
    assert list(observed.streets.highway) == ["tertiary"]


def test_a_bridge_does_not_meet_what_it_crosses(tmp_path: Path) -> None:
    town = Town().way((0.0, 50.0), (100.0, 50.0), lanes="2", width="7 m")
    town.way((50.0, 0.0), (50.0, 100.0), bridge="yes", layer="1")
    path = town.write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-20, -20, 220, 220), osm_file=path, clean=False)
    assert len(observed.streets) == 2
    assert sorted(observed.streets.bridge) == ["", "yes"]
    assert sorted(observed.streets.layer) == ["", "1"]
    assert sorted(observed.streets.width) == ["", "7 m"]


def test_ways_break_where_nodes_are_missing(tmp_path: Path) -> None:
    town = Town().grid(2, step=100.0)
    town.way((10.0, 0.0), (10.0, 20.0), (10.0, 500.0), (90.0, 500.0), (90.0, 20.0), (90.0, 0.0))
    town.missing = {(10.0, 500.0), (90.0, 500.0)}
    path = town.write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-20, -20, 220, 220), osm_file=path, clean=False)
    assert "1 way(s)" in codes(observed)["osm_missing_nodes"]
    assert not crossings(local(observed), shapely.LineString([(50, 10), (50, 90)]))
    assert {(10.0, 20.0), (90.0, 20.0)} <= set(degrees_of(local(observed)))


# Files


def test_compressed_files_and_any_order_give_the_same(tmp_path: Path) -> None:
    town, site = avenue_town(), land(-50, 50, 650, 550)
    path = town.write(tmp_path / "town.osm")
    expected = read_osm_streets(site, osm_file=path, clean=False)
    packed = tmp_path / "town.osm.bz2", tmp_path / "town.osm.gz"
    packed[0].write_bytes(bz2.compress(path.read_bytes()))
    packed[1].write_bytes(gzip.compress(path.read_bytes()))
    others = [
        *packed,
        town.write(tmp_path / "shuffled.osm", seed=1),
        town.write(tmp_path / "first.osm", seed=2, ways_first=True),
        town.write(tmp_path / "josm.osm", sign=-1),
    ]
    for other in others:
        assert same(read_osm_streets(site, osm_file=str(other), clean=False), expected), other.name
    expected = read_osm_streets(site, osm_file=path)
    assert same(read_osm_streets(site, osm_file=others[2]), expected)


def test_deleted_elements_do_not_count(tmp_path: Path) -> None:
    text = Town().grid(2, step=100.0).way((50.0, 0.0), (50.0, 100.0)).xml(sign=-1)
    last = '<way id="-5" '
    assert last in text
    path = tmp_path / "josm.osm"
    path.write_text(text.replace(last, f'{last}action="delete" '), encoding="utf-8")
    observed = read_osm_streets(land(-20, -20, 220, 220), osm_file=path, clean=False)
    assert shapely.length(local(observed)).sum() == pytest.approx(400, abs=0.01)


def test_pbf_gives_what_xml_gives() -> None:
    site = kotka()
    both = [
        read_osm_streets(site, osm_file=real(f"osm/kotka_suburb{end}"), clean=False)
        for end in (".osm.pbf", "_highways.osm.bz2")
    ]
    assert same(*both)
    assert len(both[0].streets) > 200


@pytest.mark.parametrize(
    ("name", "content", "said"),
    [
        ("a.osm", b"", "no XML, or damaged"),
        ("a.osm", b"name;x;y\n1;2;3\n", "no XML, or damaged"),
        ("a.osm", b"<osm version='0.6'><node id='1'", "no XML, or damaged"),
        ("a.osm", b"<gpx></gpx>", "begins with <gpx>"),
        ("a.osm", b"<osm><node id='1' lon='x' lat='2'/></osm>", "no usable lon and lat"),
        ("a.osm", b"<osm><node id='1' lon='nan' lat='2'/></osm>", "no usable lon and lat"),
        ("a.osm", b"<osm><node lon='1' lat='2'/></osm>", "a <node> has no id"),
        ("a.osm", b"<osm><way id='1'><nd/></way></osm>", "a <nd> has no ref"),
        ("a.osm", b"<osm><way id='1'><tag v='a'/></way></osm>", "a <tag> has no k"),
        ("a.osm", b"<osm><way id='1'><tag k='highway'/></way></osm>", "a <tag> has no v"),
        ("a.osm", b"<?xml version='1.0' encoding='klingon'?><osm/>", "unknown encoding"),
        ("a.osm", b"<?xml version='1.0' encoding='utf-7'?><osm/>", "encodings are not supported"),
        ("a.osm.gz", gzip.compress(b"<osm></osm>", mtime=0)[:-9], "end-of-stream"),
        ("a.osm.bz2", b"BZh91AY&SY" + bytes(40), "cannot be read as OpenStreetMap data"),
        ("a.osm.pbf", b"\x00\x00\x00\x0d\x0a\x09OSMHeader" + bytes(60), "it is damaged"),
    ],
)
def test_files_that_are_none_of_openstreetmap(
    name: str, content: bytes, said: str, tmp_path: Path
) -> None:
    path = tmp_path / name
    path.write_bytes(content)
    with pytest.raises(BoundaryError) as caught:
        read_osm_streets(land(0, 0, 100, 100), osm_file=path)
    (sentence,) = caught.value.problems
    assert said in sentence
    assert str(path) in sentence
    assert ".osm.pbf file" in sentence


def test_files_that_are_missing_or_folders(tmp_path: Path) -> None:
    with pytest.raises(BoundaryError, match="does not exist"):
        read_osm_streets(land(0, 0, 100, 100), osm_file=tmp_path / "none.osm")
    with pytest.raises(BoundaryError, match="is a folder"):
        read_osm_streets(land(0, 0, 100, 100), osm_file=tmp_path)


def test_a_file_without_streets(tmp_path: Path) -> None:
    site = land(0, 0, 100, 100)
    path = Town().way((0.0, 0.0), (50.0, 50.0), highway="footway").write(tmp_path / "town.osm")
    with pytest.raises(BoundaryError, match=r"no street for vehicles .*only 1 way\(s\)"):
        read_osm_streets(site, osm_file=path)
    with pytest.raises(BoundaryError, match="no way at all"):
        read_osm_streets(site, osm_file=Town().write(tmp_path / "empty.osm"))


@pytest.mark.parametrize("away", [150.0, 50_000.0])
@pytest.mark.parametrize("clean", [False, True])
def test_streets_that_do_not_enter_the_land(away: float, clean: bool, tmp_path: Path) -> None:
    path = Town().grid(3, step=100.0).write(tmp_path / "town.osm")
    with pytest.raises(BoundaryError, match="No street enters the boundary") as caught:
        read_osm_streets(land(200 + away, 0, 300 + away, 100), osm_file=path, clean=clean)
    (sentence,) = caught.value.problems
    assert sentence.count("longitude") == 2
    assert "15.0000 to 15.0027" in sentence


def test_land_without_crs(tmp_path: Path) -> None:
    path = Town().grid().write(tmp_path / "town.osm")
    with pytest.raises(BoundaryError, match="has no CRS"):
        read_osm_streets(read_boundary(shapely.box(0, 0, 100, 100)), osm_file=path)


# Cutting


def test_streets_are_cut_at_the_boundary_and_at_holes(tmp_path: Path) -> None:
    path = Town().grid(3, step=100.0).way((200.0, 150.4), (100.0, 150.4)).write(tmp_path / "t.osm")
    shell, hole = shapely.box(-10, -10, 199.6, 199.6), shapely.box(90, 40, 110, 60)
    polygon = shapely.transform(shell - hole, lambda xy: xy + ORIGIN)
    observed = read_osm_streets(read_boundary(polygon, crs=CRS), osm_file=path, clean=False)
    lines = local(observed)
    assert shapely.covers((shell - hole).buffer(1e-5), lines).all()
    expected = shapely.intersection(shapely.MultiLineString(list(streets_of(path))), shell - hole)
    assert shapely.length(lines).sum() == pytest.approx(expected.length, abs=0.01)
    assert shapely.length(lines).min() > 1.0


def streets_of(path: Path) -> Any:
    site = land(-500, -500, 700, 700)
    return local(read_osm_streets(site, osm_file=path, clean=False))


def test_short_ends_at_the_boundary_vanish(tmp_path: Path) -> None:
    town = Town().way((0.0, 50.0), (50.0, 50.0), (100.0, 50.0)).way((50.0, 50.0), (50.0, 120.0))
    path = town.write(tmp_path / "town.osm")
    observed = read_osm_streets(land(-10, -10, 110, 50.5), osm_file=path, clean=False)
    assert shapely.length(local(observed)).sum() == pytest.approx(100.0, abs=0.01)
    assert len(observed.streets) == 1


def test_a_touch_of_the_boundary_does_not_part_a_street() -> None:
    notch = [(0, 0), (9, 0), (9, 9), (6, 9), (5, 5), (4, 9), (0, 9)]
    edges = np.array([shapely.LineString([(-1, 5), (10, 5)])], dtype=object)
    (line,) = cut_at(edges, [shapely.Polygon(notch)], 1.0)
    assert line.equals(shapely.LineString([(0, 5), (9, 5)]))


# What is handed on


def test_the_readers_of_streets_take_it(tmp_path: Path) -> None:
    path, site = avenue_town().write(tmp_path / "town.osm"), land(-50, 50, 650, 550)
    observed = read_osm_streets(site, osm_file=path, clean=False)
    assert list(observed.streets.columns) == [*KEPT_TAGS, "geometry"]
    assert str(observed.streets.crs) == site.frame.crs
    boundary = shapely.transform(site.parts[0], lambda xy: xy + site.frame.origin)
    read = read_streets(observed.streets, land=boundary, crs=CRS)
    xy = shapely.get_coordinates(read.streets.lines)
    assert (xy == snap_to_grid(xy)).all()
    assert len(read.streets) == len(observed.streets)
    assert set(read.streets.street_class) == {"residential", "secondary"}
    assert codes(observed)["osm_source"].endswith(f"{ATTRIBUTION}.")


def test_progress_ends_at_one_and_can_be_stopped(tmp_path: Path) -> None:
    path, site = avenue_town().write(tmp_path / "town.osm"), land(-50, 50, 650, 550)
    told: list[float] = []
    note = CallbackProgress(lambda fraction, message: told.append(fraction))
    read_osm_streets(site, osm_file=path, progress=note)
    assert told == sorted(told)
    assert told[-1] == 1.0

    def stop(fraction: float, message: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        read_osm_streets(site, osm_file=path, progress=CallbackProgress(stop))


# Downloads, with the server's answers made up


def answer(monkeypatch: pytest.MonkeyPatch, content: dict[str, Any]) -> list[str]:
    """Make the server give an answer; returns the list of what was asked."""
    asked: list[str] = []

    def respond(url: str, text: bytes) -> requests.Response:
        response = requests.Response()
        response.status_code, response.url, response._content = 200, url, text
        return response

    def post(url: str, data: dict[str, str], **kwargs: Any) -> requests.Response:
        asked.append(data["data"])
        return respond(url, json.dumps(content).encode())

    monkeypatch.setattr(requests, "post", post)
    offline(monkeypatch)
    return asked


def offline(monkeypatch: pytest.MonkeyPatch) -> None:
    """No server tells of its load, and nothing is looked up."""
    monkeypatch.setattr("osmnx.settings.overpass_rate_limit", False)
    monkeypatch.setattr("osmnx._http._config_dns", lambda url: None)
    monkeypatch.setattr("time.sleep", lambda seconds: None)


def test_a_download_gives_what_a_file_gives(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    import osmnx

    town, site = avenue_town(), land(-50, 50, 650, 550)
    asked = answer(monkeypatch, town.overpass())
    before = dict(vars(osmnx.settings))
    first, second = (
        read_osm_streets(site, cache_folder=tmp_path / "cache", clean=False) for _ in range(2)
    )
    assert len(asked) == 1
    assert overpass_filter(service=False) in asked[0]
    assert dict(vars(osmnx.settings)) == before
    assert same(first, second)
    assert same(
        first, read_osm_streets(site, osm_file=town.write(tmp_path / "town.osm"), clean=False)
    )
    assert codes(first)["osm_source"] == f"Streets of OpenStreetMap: {ATTRIBUTION}."


def test_a_download_without_network(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    def post(url: str, **kwargs: Any) -> requests.Response:
        raise requests.exceptions.ConnectionError("no route")

    offline(monkeypatch)
    monkeypatch.setattr(requests, "post", post)
    with pytest.raises(DependencyError) as caught:
        read_osm_streets(land(0, 0, 100, 100), cache_folder=tmp_path)
    (sentence,) = caught.value.problems
    assert "cannot be reached" in sentence
    assert "--osm-file" in sentence


def test_a_download_of_nothing(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    answer(monkeypatch, {"version": 0.6, "elements": []})
    with pytest.raises(BoundaryError, match="OpenStreetMap has no street for vehicles"):
        read_osm_streets(land(0, 0, 100, 100), cache_folder=tmp_path)


# Any network, and real ones


places = st.tuples(st.integers(0, 12), st.integers(0, 12)).map(lambda p: (25.0 * p[0], 25.0 * p[1]))
towns = st.lists(st.lists(places, min_size=2, max_size=5, unique=True), min_size=1, max_size=8)


@settings(
    max_examples=15, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture]
)
@given(ways=towns, seed=st.integers(0, 9))
def test_any_network_is_cut_noded_and_in_one_order(
    ways: list[list[XY]], seed: int, tmp_path: Path
) -> None:
    town = Town([(way, {"highway": "residential"}) for way in ways])
    site = land(-10, -10, 310, 310)
    one = read_osm_streets(site, osm_file=town.write(tmp_path / "a.osm"))
    other = read_osm_streets(site, osm_file=town.write(tmp_path / "b.osm", seed=seed))
    assert same(one, other)
    assert_sound(one, site)


def assert_sound(observed: ObservedStreets, site: Site) -> None:
    """Lines lie in the land, have a class, and end where others do or nowhere."""
    streets = observed.streets
    lines = shapely.transform(
        np.asarray(streets.geometry, dtype=object), lambda xy: xy - site.frame.origin
    )
    assert shapely.covers(shapely.union_all(site.parts).buffer(1e-5), lines).all()
    assert set(streets.highway) <= set(CLASSES)
    xy, of = shapely.get_coordinates(lines, return_index=True)
    inner = np.ones(len(xy), dtype=bool)
    inner[np.flatnonzero(np.diff(of, prepend=-1, append=-1))[:-1]] = False
    inner[np.flatnonzero(np.diff(of, append=-1))] = False
    ends = {tuple(at) for at in xy[~inner].tolist()}
    assert not ends & {tuple(at) for at in xy[inner].tolist()}


def kotka() -> Site:
    frame = "EPSG:32635"
    return read_boundary(shapely.box(496_350, 6_709_550, 498_150, 6_711_300), crs=frame)


def test_real_streets_are_sound_and_fewer_when_cleaned() -> None:
    site, path = kotka(), real("osm/kotka_suburb_highways.osm.bz2")
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    cleaned = read_osm_streets(site, osm_file=path)
    for observed in (mapped, cleaned):
        assert_sound(observed, site)
    assert 0.8 * len(mapped.streets) < len(cleaned.streets) < len(mapped.streets)
    names = [set(o.streets["name"]) for o in (mapped, cleaned)]
    assert len(names[0] & names[1]) > 0.9 * len(names[0])


def test_a_network_that_would_grow_by_cleaning_stays_as_mapped(tmp_path: Path) -> None:
    """Two streets that part at a sharp angle: neatnet fills the wedge with hundreds of edges."""
    ways = [
        [(300.0, 300.0), (0.0, 0.0)],
        [(300.0, 0.0), (200.0, 225.0)],
        [(150.0, 0.0), (300.0, 0.0), (200.0, 175.0), (0.0, 0.0), (0.0, 25.0)],
        [(0.0, 0.0), (275.0, 0.0)],
        [(0.0, 75.0), (0.0, 0.0), (0.0, 150.0), (100.0, 50.0)],
        [(125.0, 125.0), (0.0, 225.0), (300.0, 275.0), (50.0, 25.0), (150.0, 175.0)],
    ]
    town = Town([(way, {"highway": "residential"}) for way in ways])
    site, path = land(-10, -10, 310, 310), town.write(tmp_path / "a.osm")
    cleaned = read_osm_streets(site, osm_file=path)
    mapped = read_osm_streets(site, osm_file=path, clean=False)
    assert cleaned.streets.length.sum() <= 1.01 * mapped.streets.length.sum()
    assert len(cleaned.streets) <= len(mapped.streets)
    assert set(cleaned.streets.highway) == {"residential"}
