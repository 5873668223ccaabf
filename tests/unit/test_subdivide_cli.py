"""`subdivide` on the command line: runs, files, processes, edits, and every kind of bad input."""

from __future__ import annotations

import json
import re
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from click.testing import CliRunner, Result

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.params.subdivide import Strategy

CRS = "EPSG:32632"
X, Y = 500_000.0, 5_200_000.0


def box(*bounds: float) -> shapely.Polygon:
    return shapely.transform(shapely.box(*bounds), lambda xy: xy + np.array((X, Y)))


TWO = [box(0, 0, 80, 50), box(90, 0, 170, 50)]


def write(
    path: Path, geometries: Sequence[Any] = TWO, crs: str | None = CRS, **columns: Any
) -> Path:
    frame = gpd.GeoDataFrame(columns, geometry=gpd.GeoSeries(list(geometries), crs=crs))
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        frame.to_file(path)
    return path


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("files")


@pytest.fixture(scope="module")
def found(folder: Path) -> Path:
    """Two blocks between streets, with the widths of these."""
    lines = [
        box(0, 0, 240, 100).exterior,
        shapely.LineString([(X + 120, Y), (X + 120, Y + 100)]),
    ]
    streets = gpd.GeoDataFrame({"width_m": [8.0, 20.0]}, geometry=lines, crs=CRS)
    return up.find_blocks(streets).save(folder / "blocks.gpkg")


@pytest.fixture(scope="module")
def plain(folder: Path) -> Path:
    return write(folder / "plain.gpkg", block_id=[1, 2])


@pytest.fixture(scope="module")
def made(folder: Path, found: Path) -> Path:
    """A subdivision of the two blocks."""
    out = folder / "parcels.gpkg"
    assert run(found, "-o", out, "--min-area", 300).exit_code == 0
    return out


def run(*arguments: object) -> Result:
    texts = ["subdivide", *map(str, arguments)]
    return CliRunner().invoke(app, texts, catch_exceptions=False)


def refused(*arguments: object) -> str:
    """The only sentence that a call fails with, which leaves no file."""
    problems = all_refused(*arguments)
    assert len(problems) == 1, problems
    return problems[0]


def all_refused(*arguments: object) -> list[str]:
    result = run(*arguments)
    assert result.exit_code == 2
    assert result.stdout == ""
    head, *lines = result.stderr.splitlines()
    assert head.startswith("Error: ")
    return [line.removeprefix("  - ") for line in lines] or [head.removeprefix("Error: ")]


def layer(path: Path, name: str) -> gpd.GeoDataFrame:
    frame: gpd.GeoDataFrame = pyogrio.read_dataframe(path, layer=name)
    return frame


def summary(result: Result) -> dict[str, str]:
    return dict(re.split(r"\s{2,}", line, maxsplit=1) for line in result.stdout.splitlines())


# ---- runs ------------------------------------------------------------------------------------


def test_a_run_writes_parcels_a_map_and_plain_files(found: Path, tmp_path: Path) -> None:
    out, picture, plain = tmp_path / "p.gpkg", tmp_path / "p.png", tmp_path / "plain"
    result = run(found, "-o", out, "--min-area", 300, "--plot", picture, "--export", plain)
    assert result.exit_code == 0, result.output
    rows = summary(result)
    parcels, blocks = layer(out, "parcels"), layer(out, "blocks")
    assert rows["parcels"].startswith(f"{len(parcels)}, ")
    assert rows["blocks"].startswith("2, ")
    assert (rows["layers"], rows["picture"], rows["export"]) == (str(out), str(picture), str(plain))
    assert parcels.groupby("block_id").size().tolist() == blocks.parcels.tolist()
    whole = parcels.dissolve("block_id").geometry.area
    assert whole.to_numpy() == pytest.approx(blocks.area_m2.to_numpy(), rel=1e-9)
    assert picture.read_bytes().startswith(b"\x89PNG")
    exported = json.loads((plain / "parcels.geojson").read_text())["features"]
    assert len(exported) == len(parcels)
    assert {p.stem for p in plain.iterdir()} >= {"parcels", "blocks", "provenance"}
    provenance = layer(out, "provenance")
    assert provenance.algorithm.tolist() == ["subdivide"]
    assert json.loads(provenance.parameters[0])["min_area"] == 300


def test_streets_of_a_file_of_blocks_say_whose_corners_are(
    found: Path, folder: Path, tmp_path: Path
) -> None:
    """Corner parcels face the wide street between the blocks, as the file's own edges say."""
    bare = write(folder / "bare.gpkg", layer(found, "blocks").geometry, block_id=[1, 2])
    fronts = []
    for source, more in (
        (found, ()),
        (bare, ()),
        (bare, ("--streets", f"{found}|layername=block_edges")),
    ):
        out = tmp_path / f"{len(fronts)}.gpkg"
        assert run(source, "-o", out, "--min-area", 300, "--irregularity", 0, *more).exit_code == 0
        parcels = layer(out, "parcels")
        fronts.append(shapely.to_wkb(shapely.normalize(parcels.geometry.to_numpy())).tolist())
    assert fronts[0] == fronts[2]
    assert fronts[0] != fronts[1]


def test_a_plain_shapefile(folder: Path, tmp_path: Path) -> None:
    shapefile = write(
        folder / "plain.shp",
        min_area=[300.0, 900.0],
        strategy=["obb", None],
        irregulari=[0.25, None],  # names in shapefiles have ten letters at most
        street_acc=[None, 0.5],
    )
    out = tmp_path / "p.gpkg"
    result = run(shapefile, "-o", out, "--irregularity", 0)
    assert result.exit_code == 0, result.output
    blocks = layer(out, "blocks")
    assert blocks.min_area.tolist() == [300, 900]
    assert blocks.strategy.tolist() == ["obb", "skeleton"]
    assert blocks.irregularity.tolist() == [0.25, 0]
    assert blocks.street_access.tolist() == [1, 0.5]
    assert layer(out, "parcels").groupby("block_id").area_m2.min().ge([300, 900]).all()


@pytest.mark.parametrize("strategy", Strategy)
def test_strategies_processes_and_runs_give_the_same_bytes(
    strategy: Strategy, plain: Path, tmp_path: Path
) -> None:
    again = ("--processes", 2) if strategy is Strategy.OBB else ()
    files = []
    for number, more in enumerate(((), again, ("--seed", 1))):
        out = tmp_path / f"{number}.gpkg"
        call = (plain, "-o", out, "-q", "--strategy", strategy.value, "--min-area", 300)
        result = run(*call, *more)
        assert (result.exit_code, result.output) == (0, "")
        files.append(out.read_bytes())
    assert files[0] == files[1]
    assert files[0] != files[2]
    assert set(layer(tmp_path / "0.gpkg", "parcels").strategy) == {strategy.value}


def test_parcels_keep_their_numbers_where_blocks_were_edited(
    found: Path, made: Path, tmp_path: Path
) -> None:
    edited = tmp_path / "edited.gpkg"
    blocks, edges = layer(found, "blocks"), layer(found, "block_edges")
    east, north = blocks.geometry[1].bounds[2:]
    cut = shapely.box(east - 12, north - 12, east, north)
    blocks.loc[1, "geometry"] = shapely.difference(blocks.geometry[1], cut)
    blocks.to_file(edited, layer="blocks")
    edges.to_file(edited, layer="block_edges")
    out = tmp_path / "after.gpkg"
    result = run(edited, "-o", out, "--min-area", 300, "--previous", made)
    assert result.exit_code == 0, result.output
    before, after = layer(made, "parcels"), layer(out, "parcels")

    def by_number(frame: gpd.GeoDataFrame, block: int) -> dict[int, bytes]:
        own = frame[frame.block_id == block]
        return dict(zip(own.parcel_id, shapely.to_wkb(own.geometry.normalize()), strict=True))

    assert by_number(after, 1) == by_number(before, 1)
    old, new = by_number(before, 2), by_number(after, 2)
    assert new != old
    assert len(set(new) & set(old)) > 0.6 * len(old)
    assert after.parcel_id.is_unique
    assert after[after.block_id == 2].area.sum() == pytest.approx(blocks.geometry[1].area)
    # without the file before, numbers are counted anew
    assert run(edited, "-o", tmp_path / "anew.gpkg", "--min-area", 300).exit_code == 0


def test_degrees_become_metres_and_it_is_said(folder: Path, tmp_path: Path) -> None:
    degrees = write(
        folder / "degrees.geojson", gpd.GeoSeries(TWO, crs=CRS).to_crs(4326), crs="EPSG:4326"
    )
    result = run(degrees, "-o", tmp_path / "p.gpkg")
    assert result.exit_code == 0
    assert "The blocks are in WGS 84 (EPSG:4326)" in result.stderr
    assert "the parcels are in WGS 84 / UTM zone 32N (EPSG:32632)" in result.stderr
    parcels = layer(tmp_path / "p.gpkg", "parcels")
    assert parcels.crs == CRS
    assert parcels.area_m2.sum() == pytest.approx(8000, rel=1e-4)
    assert "crs_changed" in layer(tmp_path / "p.gpkg", "issues").code.tolist()
    other = run(degrees, "-o", tmp_path / "other.gpkg", "--crs", "EPSG:25832", "-q")
    assert (other.exit_code, other.output) == (0, "")
    assert layer(tmp_path / "other.gpkg", "parcels").crs == "EPSG:25832"


def test_layer_and_where_choose_blocks(found: Path, tmp_path: Path) -> None:
    for number, more in enumerate((("--where", "block_id = 2"), ("--layer", "right_of_way"))):
        out = tmp_path / f"{number}.gpkg"
        assert run(found, "-o", out, *more).exit_code == 0
    assert set(layer(tmp_path / "0.gpkg", "parcels").block_id) == {2}
    streets = layer(found, "right_of_way").area.sum()
    assert layer(tmp_path / "1.gpkg", "blocks").area_m2.sum() == pytest.approx(streets)


# ---- what cannot be kept is said ---------------------------------------------------------------


def test_blocks_too_small_or_too_narrow_for_parcels_are_listed(
    folder: Path, tmp_path: Path
) -> None:
    small = write(
        folder / "small.gpkg",
        [box(0, 0, 15, 10), box(30, 0, 110, 50), box(130, 0, 330, 100)],
        min_width=[None, 90.0, None],
    )
    out = tmp_path / "p.gpkg"
    result = run(small, "-o", out)
    assert result.exit_code == 0
    assert "1 block_narrow" in summary(result)["issues"]
    assert "1 block_small" in summary(result)["issues"]
    assert layer(out, "blocks").parcels[0] == 1
    issues = layer(out, "issues").set_index("code")
    said = issues.loc["block_small"]
    assert said.message == (
        "A block of 150 m² is smaller than the smallest parcel, 400 m²: it stays whole."
    )
    assert (said.part, said.parcel_id, said.value, said.limit) == (0, 1, 150, 400)
    said = issues.loc["block_narrow"]
    assert said.message == (
        "A block is 80.0 m long, less than the smallest width of a parcel, 90.0 m: what it is "
        "divided into is narrower."
    )
    assert (said.part, said.value, said.limit) == (1, 80, 90)
    assert "parcel_narrow" not in issues.index
    assert box(30, 0, 110, 50).contains(said.geometry)


def test_parameters_that_columns_leave_nothing_of_are_told(made: Path, tmp_path: Path) -> None:
    result = run(made, "-o", tmp_path / "p.gpkg", "--min-area", 900, "--seed", 3)
    assert result.exit_code == 0
    assert result.stderr.splitlines() == [
        "min-area (900.0) has no effect: the column min_area sets it for every block."
    ]
    same = run(made, "-o", tmp_path / "same.gpkg", "--min-area", 300)
    assert same.stderr == ""


# ---- bad input ---------------------------------------------------------------------------------


def test_blocks_must_be_polygons(folder: Path, tmp_path: Path) -> None:
    lines = write(folder / "lines.gpkg", [shapely.LineString(TWO[0].exterior.coords)])
    said = refused(lines, "-o", tmp_path / "p.gpkg")
    assert said.startswith(f"{lines} holds 1 line, but no polygon. Blocks must be polygons: ")
    assert "the algorithm blocks finds those" in said
    assert not list(tmp_path.iterdir())


def test_blocks_that_overlap_are_named_in_pairs(folder: Path, tmp_path: Path) -> None:
    three = [box(0, 0, 80, 50), box(70, 0, 160, 50), box(150, 0, 240, 50)]
    overlapping = write(folder / "overlap.gpkg", three, block_id=[4, 9, 6])
    said = refused(overlapping, "-o", tmp_path / "p.gpkg")
    assert said.startswith("Blocks must not overlap: ")
    assert "block 4 and 9 (500 m²)" in said
    assert "block 9 and 6 (500 m²)" in said
    assert "Correct them" in said


def test_blocks_need_a_crs(folder: Path, tmp_path: Path) -> None:
    bare = write(folder / "nocrs.gpkg", crs=None)
    said = refused(bare, "-o", tmp_path / "p.gpkg")
    assert "has no CRS. Give it with crs (--crs EPSG:code)" in said
    result = run(bare, "-o", tmp_path / "p.gpkg", "--crs", CRS)
    assert result.exit_code == 0
    assert "was taken for it" in result.stderr


def test_empty_layers_and_missing_files(folder: Path, tmp_path: Path) -> None:
    out = tmp_path / "p.gpkg"
    empty = write(folder / "empty.gpkg", [])
    assert "has no features: check the layer" in refused(empty, "-o", out)
    assert "does not exist" in refused(folder / "none.gpkg", "-o", out)
    (folder / "text.gpkg").write_text("no file of polygons")
    assert "cannot be read" in refused(folder / "text.gpkg", "-o", out)
    assert "Give BLOCKS, a file with polygons of blocks." in refused("-o", out)


@pytest.mark.parametrize(
    ("column", "values", "said"),
    [
        ("min_width", [-5.0, 8.0], "Column min_width must be above 0 m: -5.0 in row 1 of"),
        ("max_area", [900.0, 300.0],
         "min_area must not be above max_area: 400 and 300 in row 2 of"),
        ("min_area", ["a lot", "300"], "Column min_area must be a number: 'a lot' in rows 1, 2 of"),
        ("strategy", ["obb", "squares"],
         "Column strategy must be one of skeleton, obb, hybrid, streamline: 'squares' in row 2 of"),
        ("irregularity", [0.1, 1.5], "Column irregularity must be at most 1: 1.5 in row 2 of"),
        ("block_id", [3, 3], "Numbers of blocks are there twice: block_id 3, in row 1, 2."),
        ("block_id", [1.5, 2.0], "Column block_id must be a whole number: row 1."),
        ("block_id", [1.0, None], "Column block_id must be a whole number: row 2."),
    ],
)  # fmt: skip
def test_columns_that_are_wrong_name_their_rows(
    column: str, values: list[Any], said: str, tmp_path: Path
) -> None:
    wrong = write(tmp_path / "wrong.gpkg", **{column: values})
    assert refused(wrong, "-o", tmp_path / "p.gpkg").startswith(said)


def test_a_smallest_area_above_the_largest_one_of_a_column(tmp_path: Path) -> None:
    columns = write(tmp_path / "both.gpkg", min_area=[500.0, None], max_area=[400.0, 900.0])
    said = refused(columns, "-o", tmp_path / "p.gpkg")
    assert said == f"min_area must not be above max_area: 500 and 400 in row 1 of {columns}."


@pytest.mark.parametrize(
    ("option", "value", "said"),
    [
        ("--min-width", "-4", "min-width must be above 0 m; got -4."),
        ("--max-area", "300", "min-area (400) must not be above max-area (300)."),
        ("--max-width", "3", None),
        ("--strategy", "squares",
         "strategy must be one of skeleton, obb, hybrid, streamline; got 'squares'."),
        ("--street-access", "2", "street-access must be at most 1; got 2."),
        ("--min-area", "nan", "min-area must be a finite number; got nan."),
    ],
)  # fmt: skip
def test_parameters_that_are_wrong(
    option: str, value: str, said: str | None, plain: Path, tmp_path: Path
) -> None:
    call = (plain, "-o", tmp_path / "p.gpkg", option, value)
    if said is None:
        assert "parcel_wide" in summary(run(*call))["issues"]
    else:
        assert refused(*call) == said


def test_everything_wrong_with_a_call_is_said_at_once(folder: Path) -> None:
    wrong = write(folder / "many.gpkg", min_area=["x", "y"], min_width=[-1.0, -2.0])
    said = "\n".join(
        all_refused(wrong, "--offset", -3, "--previous", folder / "no.gpkg", "--crs", "EPSG:4326")
    )
    for words in (
        "offset must be above 0 m",
        "-o FILE",
        "Column min_area",
        "Column min_width",
        "no.gpkg does not exist",
        "crs must be projected",
    ):
        assert words in said


def test_what_is_no_subdivision_before(
    plain: Path, found: Path, made: Path, folder: Path, tmp_path: Path
) -> None:
    out = tmp_path / "p.gpkg"

    def before(path: Path, *more: object) -> str:
        return refused(plain, "-o", out, "--previous", path, *more)

    layout = up.cogenerate(box(0, 0, 80, 50), crs=CRS, parcels=4).save(folder / "layout.gpkg")
    wrote = "give a GeoPackage that subdivide wrote."
    assert before(layout) == f"{layout} holds no subdivision but a layout: {wrote}"
    assert before(found) == f"{found} holds no subdivision but blocks: {wrote}"
    assert before(plain) == f"{plain} holds no subdivision: {wrote}"
    assert "does not exist" in before(folder / "none.gpkg")
    said = before(made, "--crs", "EPSG:25832")
    assert said.startswith(
        "The subdivision before is in EPSG:32632, but the blocks are worked on in EPSG:25832: "
    )
    assert "(--crs)" in said
    assert not out.exists()


def test_a_subdivision_is_no_layout(made: Path, tmp_path: Path) -> None:
    call = ["optimize", str(made), "-o", str(tmp_path / "o.gpkg")]
    result = CliRunner().invoke(app, call, catch_exceptions=False)
    assert result.exit_code == 2
    assert "is not a layout file but one of another kind (subdivision)" in result.stderr
    assert "cogenerate wrote" in result.stderr


# ---- files that exist --------------------------------------------------------------------------


def test_nothing_is_replaced_unless_asked_for(plain: Path, tmp_path: Path) -> None:
    out, picture = tmp_path / "p.gpkg", tmp_path / "p.svg"
    call = (plain, "-o", out, "--plot", picture)
    assert run(*call).exit_code == 0
    before = out.read_bytes(), picture.read_bytes()
    problems = all_refused(*call, "--seed", 1)
    assert len(problems) == 2
    assert all("--overwrite" in problem for problem in problems)
    assert (out.read_bytes(), picture.read_bytes()) == before
    assert run(*call, "--seed", 1, "--overwrite").exit_code == 0
    assert out.read_bytes() != before[0]


def test_no_output_replaces_an_input(found: Path, made: Path) -> None:
    before = found.read_bytes(), made.read_bytes()
    said = refused(found, "-o", found, "--overwrite")
    assert said == f"-o {found} would replace the input {found}: choose another."
    said = refused(found, "-o", made, "--previous", made, "--overwrite")
    assert said == f"-o {made} would replace the input {made}: choose another."
    assert (found.read_bytes(), made.read_bytes()) == before


def test_nan_of_a_file_is_an_empty_cell(tmp_path: Path) -> None:
    empty = write(tmp_path / "nan.gpkg", min_area=pd.Series([np.nan, 300.0]))
    assert run(empty, "-o", tmp_path / "p.gpkg").exit_code == 0
    assert layer(tmp_path / "p.gpkg", "blocks").min_area.tolist() == [400, 300]
