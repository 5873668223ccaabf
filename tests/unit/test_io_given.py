"""Layers besides the land: read from files and frames, in any CRS, with what is wrong said."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from click.testing import CliRunner

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.errors import BoundaryError, UrbanError
from urban_processing.io.boundaries import read_boundary
from urban_processing.layout import Layout

UTM = "EPSG:32632"
X, Y = 540_000.0, 5_220_000.0
LAND = shapely.box(X, Y, X + 400, Y + 300)


def line(*xy: tuple[float, float]) -> shapely.LineString:
    return shapely.LineString([(X + x, Y + y) for x, y in xy])


def frame(geometry: list[shapely.Geometry], crs: str = UTM, **columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=geometry, crs=crs)


MAIN = line((-20, 150), (420, 160))
ROADS = frame([MAIN, line((200, 100), (200, 250))], width=[22, None], **{"class": ["main", ""]})
LAKE = frame([shapely.Point(X + 300, Y + 60).buffer(30)])
ESTATE = frame([shapely.box(X + 40, Y + 200, X + 90, Y + 260)], land_use=["school"])
GATE = frame([shapely.Point(X, Y + 70)])
HALF = frame([line((0, 0), (400, 0), (400, 300))])
LAYERS = {
    "streets": ROADS,
    "obstacles": LAKE,
    "locked": ESTATE,
    "rim_lines": HALF,
    "entries": GATE,
}


def test_layers_in_another_crs_come_to_the_same_place() -> None:
    here = read_boundary(LAND, crs=UTM, **LAYERS)
    there = read_boundary(LAND, crs=UTM, **{k: f.to_crs("EPSG:4326") for k, f in LAYERS.items()})
    for a, b in zip(here.fixed_streets, there.fixed_streets, strict=True):
        assert shapely.hausdorff_distance(a.line, b.line) < 0.01
        assert a.street_class == b.street_class
    assert shapely.symmetric_difference(here.obstacles[0], there.obstacles[0]).area < 1
    assert np.abs(here.entries - there.entries).max() < 0.01
    assert here.input_sha256 != read_boundary(LAND, crs=UTM).input_sha256


def test_attributes_are_read_and_bad_ones_told_of() -> None:
    roads = frame([MAIN] * 4, width_m=["12", -3, "wide", None], street_class=["a", None, "", "b"])
    site = read_boundary(LAND, crs=UTM, streets=roads)
    assert [s.street_class for s in site.fixed_streets] == ["a", "", "", "b"]
    width = [s.width for s in site.fixed_streets]
    assert width[0] == 12.0
    assert np.isnan(width[1:]).all()
    (ignored,) = [i for i in site.issues if i.code == "width_ignored"]
    assert ignored.value == 2


def test_layers_without_crs_are_taken_to_be_in_that_of_the_land() -> None:
    site = read_boundary(gpd.GeoSeries([LAND], crs=UTM), streets=MAIN, entries=[(X, Y + 70)])
    assert (
        shapely.hausdorff_distance(
            site.fixed_streets[0].line, shapely.transform(MAIN, lambda xy: xy - [X, Y])
        )
        < 1e-6
    )
    assert site.entries.tolist() == [[0.0, 70.0]]


@pytest.mark.parametrize(
    ("layers", "words"),
    [
        ({"streets": LAKE}, "Fixed streets must be lines"),
        ({"obstacles": ROADS}, "Obstacles must be polygons"),
        ({"locked": GATE}, "Locked land must be polygons"),
        ({"rim_lines": GATE}, "Rim lines must be lines"),
        ({"entries": ROADS}, "Entries must be points"),
        ({"streets": frame([])}, "has no lines"),
        ({"entries": [(X + 200, Y + 150)]}, "Entry 1 lies 150 m from the rim"),
        ({"rim_lines": line((100, 100), (300, 200))}, "Rim line 1 lies 100 m from the rim"),
        ({"streets": shapely.from_wkt("LINESTRING (0 0, inf 1)")}, "not finite"),
        ({"entries": [(1, 2, 3)]}, "array"),
    ],
)
def test_what_is_wrong_is_said(layers: dict[str, Any], words: str) -> None:
    with pytest.raises(BoundaryError, match=words):
        read_boundary(LAND, crs=UTM, **layers)


def test_all_that_is_wrong_is_said_together() -> None:
    with pytest.raises(BoundaryError) as error:
        read_boundary(LAND, crs=UTM, streets=LAKE, obstacles=ROADS, entries="nowhere.gpkg")
    assert len(error.value.problems) == 3


def test_bow_ties_and_overlaps_of_given_polygons() -> None:
    bow = shapely.Polygon([(X, Y), (X + 50, Y + 50), (X + 50, Y), (X, Y + 50)])
    with pytest.raises(BoundaryError, match=r"Obstacles: .*bow-tie"):
        read_boundary(LAND, crs=UTM, obstacles=bow)
    twice = frame([shapely.box(X, Y, X + 50, Y + 50), shapely.box(X + 25, Y, X + 75, Y + 50)])
    site = read_boundary(LAND, crs=UTM, locked=twice, obstacles=twice)
    assert [p.area for p in site.obstacles] == [3750.0]
    assert sorted(each.polygon.area for each in site.locked) == [1250.0, 2500.0]


@pytest.fixture(scope="module")
def made() -> up.GeoLayout:
    return up.cogenerate(LAND, crs=UTM, parcels=25, **LAYERS)


def test_the_library_takes_all_layers(made: up.GeoLayout) -> None:
    assert made.certificate.holds
    assert {"main", "fixed"} <= set(made.streets["class"])
    assert made.streets.width_m[made.streets["class"] == "main"].eq(22).all()
    assert made.parcels.land_use.value_counts()["school"] == 1
    assert made.parcels.locked.sum() == 1
    assert (made.junctions.kind == "entry").sum() == 1
    assert made.frame("obstacles").area_m2.sum() == pytest.approx(LAKE.area.sum(), rel=1e-3)


def test_a_file_gives_all_of_it_again(made: up.GeoLayout, tmp_path: Path) -> None:
    made.save(tmp_path / "a.gpkg")
    again = up.read_layout(tmp_path / "a.gpkg")
    before, after = made.layout, again.layout
    for name in ("edge_fixed", "edge_kind", "edge_street", "face_locked", "face_use"):
        np.testing.assert_array_equal(getattr(before, name), getattr(after, name))
    np.testing.assert_array_equal(before.vertex_entry, after.vertex_entry)
    assert before.land_uses == after.land_uses
    assert str(before.fixed_streets) == str(after.fixed_streets)
    assert [p.area for p in before.obstacles] == pytest.approx([p.area for p in after.obstacles])
    again.save(tmp_path / "b.gpkg")
    assert (tmp_path / "a.gpkg").read_bytes() == (tmp_path / "b.gpkg").read_bytes()


def test_uses_that_were_edited_in_a_file_are_read(made: up.GeoLayout, tmp_path: Path) -> None:
    import sqlite3

    made.save(tmp_path / "a.gpkg")
    with sqlite3.connect(tmp_path / "a.gpkg") as connection:
        connection.execute("DROP TRIGGER IF EXISTS rtree_parcels_geom_update4")
        for (trigger,) in connection.execute(
            "SELECT name FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'parcels'"
        ).fetchall():
            connection.execute(f'DROP TRIGGER "{trigger}"')
        connection.execute("UPDATE parcels SET land_use = 'park' WHERE parcel_id = 1")
    layout: Layout = up.read_layout(tmp_path / "a.gpkg").layout
    assert layout.land_uses[layout.face_use[0]] == "park"


def test_on_the_command_line(tmp_path: Path) -> None:
    frame([LAND]).to_file(tmp_path / "land.gpkg")
    for name, layer in LAYERS.items():
        layer.to_crs("EPSG:4326").to_file(tmp_path / "given.gpkg", layer=name)
    file = tmp_path / "given.gpkg"
    flags = [
        part
        for name in LAYERS
        for part in (f"--{name.replace('_', '-')}", f"{file}|layername={name}")
    ]
    call = ["cogenerate", str(tmp_path / "land.gpkg"), "-o", str(tmp_path / "out.gpkg")]
    done = CliRunner().invoke(app, [*call, "--parcels", "25", *flags])
    assert done.exit_code == 0, done.output
    layout = up.read_layout(tmp_path / "out.gpkg")
    assert layout.parcels.locked.sum() == 1
    assert layout.streets.fixed_id.notna().any()


def test_contradictions_are_named_with_all_else_that_is_wrong(tmp_path: Path) -> None:
    HALF.to_file(tmp_path / "half.gpkg")
    frame([LAND]).to_file(tmp_path / "land.gpkg")
    call = ["cogenerate", str(tmp_path / "land.gpkg"), "-o", str(tmp_path / "out.gpkg")]
    options = ["--rim", "none", "--rim-lines", str(tmp_path / "half.gpkg")]
    more = ["--obstacle-rim", "street", "--streets", str(tmp_path / "none.gpkg")]
    done = CliRunner().invoke(app, [*call, *options, *more])
    assert done.exit_code == 2
    for words in ("rim none speaks", "obstacle-rim street needs", "does not exist", "min-area"):
        assert words in done.output


def test_parameters_and_layers_that_contradict_in_the_library() -> None:
    with pytest.raises(UrbanError, match="rim none speaks of the whole rim"):
        up.cogenerate(LAND, crs=UTM, parcels=5, rim="none", rim_lines=HALF)
