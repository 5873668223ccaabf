"""`blocks` from end to end: layers, files, maps, and bad input on the command line."""

from __future__ import annotations

from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from click.testing import CliRunner, Result

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.schema import BLOCK_EDGES, BLOCKS

CRS = "EPSG:32632"
X, Y = 500_000.0, 5_200_000.0


def line(*places: tuple[float, float]) -> shapely.LineString:
    return shapely.LineString([(X + x, Y + y) for x, y in places])


@pytest.fixture
def streets() -> gpd.GeoDataFrame:
    """Two blocks side by side, with a dead end in one and a street that goes on outside."""
    lines = [
        line((0, 0), (200, 0), (300, 0)),
        line((200, 0), (200, 100)),
        line((200, 100), (0, 100)),
        line((0, 100), (0, 0)),
        line((100, 0), (100, 100)),
        line((150, 0), (150, 40)),
    ]
    classes = ["primary", "residential", "residential", "residential", "tertiary", "service"]
    return gpd.GeoDataFrame({"highway": classes}, geometry=lines, crs=CRS)


@pytest.fixture
def roads(streets: gpd.GeoDataFrame, tmp_path: Path) -> Path:
    path = tmp_path / "roads.gpkg"
    streets.to_file(path)
    return path


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, ["blocks", *map(str, arguments)])


def test_layers_say_what_blocks_are(streets: gpd.GeoDataFrame) -> None:
    found = up.find_blocks(streets)
    blocks, edges = found.blocks, found.block_edges
    assert list(blocks.columns) == [*BLOCKS.column_names, "geometry"]
    assert list(edges.columns) == [*BLOCK_EDGES.column_names, "geometry"]
    assert blocks.block_id.tolist() == [1, 2]
    assert blocks.area_m2.tolist()[0] == (100 - 6 - 8) * (100 - 12 - 6)
    assert blocks.perimeter_m.tolist() == pytest.approx(blocks.length.tolist())
    assert blocks.frontage_m.tolist() == pytest.approx(blocks.perimeter_m.tolist())
    assert blocks.streets.tolist() == [4, 5]
    assert edges.length_m.groupby(edges.block_id).sum().tolist() == pytest.approx(
        blocks.perimeter_m.tolist()
    )
    first = edges[edges.block_id == 1].set_index("class")
    assert first.loc["primary", "length_m"] == 86
    assert first.loc["tertiary", "width_m"] == 16
    assert len(edges[(edges.block_id == 2) & (edges["class"] == "service")]) == 1
    assert len(edges[(edges.block_id == 2) & (edges["class"] == "primary")]) == 2
    assert edges.access.all()
    assert set(found.right_of_way["class"]) == set(streets.highway)
    whole = shapely.union_all([*blocks.geometry, *found.right_of_way.geometry])
    assert whole.equals(shapely.box(X, Y, X + 200, Y + 100))


def test_edges_of_an_island_are_one_closed_line(streets: gpd.GeoDataFrame) -> None:
    roundabout = shapely.Point(X + 50, Y + 50).buffer(15).exterior
    streets.loc[len(streets)] = ["living_street", roundabout]
    found = up.find_blocks(streets)
    around = found.block_edges[found.block_edges["class"] == "living_street"]
    assert shapely.is_closed(around.geometry).all()
    assert len(around) == 2
    assert found.blocks.geometry.map(lambda g: len(g.interiors)).sum() == 1


def test_the_command_writes_a_file_a_map_and_plain_files(roads: Path, tmp_path: Path) -> None:
    out, picture, folder = tmp_path / "b.gpkg", tmp_path / "b.png", tmp_path / "plain"
    result = run(roads, "-o", out, "--plot", picture, "--export", folder, "--dead-ends")
    assert result.exit_code == 0, result.output
    assert "blocks        2" in result.stdout
    layers = set(pyogrio.list_layers(out)[:, 0])
    assert {"blocks", "block_edges", "right_of_way", "issues", "provenance"} <= layers
    assert picture.stat().st_size > 2000
    assert {p.name for p in folder.iterdir()} >= {"blocks.geojson", "block_edges.geojson"}
    provenance = pyogrio.read_dataframe(out, layer="provenance")
    assert provenance.algorithm.tolist() == ["blocks"]
    again = tmp_path / "again.gpkg"
    assert run(roads, "-o", again, "-q").exit_code == 0
    assert again.read_bytes() == out.read_bytes()


def test_blocks_are_cut_at_land_from_the_command_line(roads: Path, tmp_path: Path) -> None:
    land = tmp_path / "land.gpkg"
    box = shapely.box(X + 10, Y - 50, X + 120, Y + 80)
    gpd.GeoDataFrame(geometry=[box], crs=CRS).to_crs("EPSG:4326").to_file(land)
    out = tmp_path / "b.gpkg"
    result = run(roads, "-o", out, "--land", land)
    assert result.exit_code == 0, result.output
    edges = pyogrio.read_dataframe(out, layer="block_edges")
    assert set(edges.access) == {True, False}
    assert edges.width_m[~edges.access.astype(bool)].isna().all()


def test_everything_wrong_with_a_call_is_said_at_once(tmp_path: Path) -> None:
    result = run(tmp_path / "none.gpkg", "--default-width", "-3", "--class-widths", "a=b")
    assert result.exit_code == 2
    for said in ("does not exist", "default-width must be above 0", "class-widths", "-o FILE"):
        assert said in result.stderr
    assert run().exit_code == 2


def test_streets_that_enclose_nothing_are_a_mistake(tmp_path: Path) -> None:
    path = tmp_path / "one.gpkg"
    gpd.GeoDataFrame(geometry=[line((0, 0), (9, 0))], crs=CRS).to_file(path)
    result = run(path, "-o", tmp_path / "b.gpkg")
    assert result.exit_code == 2
    assert "enclose nothing" in result.stderr
    assert not (tmp_path / "b.gpkg").exists()


def test_what_reading_says_is_repeated(roads: Path, tmp_path: Path) -> None:
    degrees = tmp_path / "degrees.gpkg"
    gpd.read_file(roads).to_crs("EPSG:4326").to_file(degrees)
    result = run(degrees, "-o", tmp_path / "b.gpkg")
    assert "The streets are in WGS 84 (EPSG:4326)" in result.stderr
    frame = pyogrio.read_dataframe(tmp_path / "b.gpkg", layer="blocks")
    assert frame.crs == CRS
    assert np.allclose(frame.area_m2, frame.area)
