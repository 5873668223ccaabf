"""`transfer` as people call it: files and frames of any origin."""

from __future__ import annotations

import json

import geopandas as gpd
import numpy as np
import pandas as pd
import pyogrio
import pytest
import shapely
from click.testing import CliRunner
from street_edits import town

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.errors import BoundaryError, ParameterError

ORIGIN = (600_000.0, 5_200_000.0)
CRS = "EPSG:32632"


def frame(polygons, **columns):
    moved = shapely.transform(np.asarray(polygons, dtype=object), lambda xy: xy + ORIGIN)
    return gpd.GeoDataFrame(columns, geometry=list(moved), crs=CRS)


@pytest.fixture(scope="module")
def before():
    parcels = town().parcels()
    n = len(parcels)
    return frame(
        parcels,
        parcel_id=np.arange(n) * 2 + 10,
        owner=[f"owner {i}" if i % 7 else None for i in range(n)],
        floors=np.arange(n) % 5,
        value=np.where(np.arange(n) % 3, np.arange(n) + 0.5, np.nan),
        listed=np.arange(n) % 2 == 0,
        irregularity=np.zeros(n),
        built=pd.to_datetime("1990-01-01") + pd.to_timedelta(np.arange(n), unit="D"),
    )


@pytest.fixture(scope="module")
def after():
    parcels = town().moved(6, 12, 3).parcels()
    return frame(parcels, area=np.full(len(parcels), 1.5))


def test_numbers_and_columns_are_carried_over(before, after):
    made = up.transfer(before, after)
    parcels = made.parcels
    assert parcels.parcel_id.is_unique
    assert len(parcels) == len(after)
    assert parcels.crs == CRS
    old = before.set_index("parcel_id")
    for row in parcels[parcels.change.isin(["kept", "moved", "split"])].itertuples():
        source = old.loc[row.old_id]
        assert row.owner == source.owner or pd.isna([row.owner, source.owner]).all()
        assert row.floors == source.floors
        assert row.listed == source.listed
        assert row.value == source.value or np.isnan([row.value, source.value]).all()
        assert row.built == source.built.isoformat()
    goes_on = parcels[parcels.change.isin(["kept", "moved"])]
    assert len(goes_on) > 100
    assert (goes_on.parcel_id == goes_on.old_id).all()
    assert "irregularity" not in parcels  # a measure of another shape
    assert (parcels["area"] == 1.5).all()  # own columns stay
    assert (parcels.parcel_id.diff().dropna() > 0).all()


def test_the_log_names_every_parcel(before, after):
    made = up.transfer(before, after)
    log = made.changes
    assert set(log.old_id.dropna()) == set(before.parcel_id)
    assert sorted(log.new_id.dropna().unique()) == sorted(made.parcels.parcel_id)
    assert log[log.change == "kept"]["distance"].max() == 0
    assert set(log.geometry.geom_type) == {"Polygon"}
    results = json.loads(made.provenance["results"].iloc[0])
    assert results == {k: int((log.change == k).sum()) for k in results}


def test_only_the_columns_asked_for(before, after):
    made = up.transfer(before, after, columns="owner, irregularity").parcels
    assert {"owner", "irregularity"} <= set(made.columns)
    assert "floors" not in made
    with pytest.raises(ParameterError, match=r"has no column ownr; its columns are parcel_id, own"):
        up.transfer(before, after, columns="ownr")
    with pytest.raises(ParameterError, match="separated by commas"):
        up.transfer(before, after, columns="owner,,floors")


def test_who_inherits():
    old = frame([shapely.box(0, 0, 40, 30)], parcel_id=[5], use=["shop"])
    halves = [shapely.box(0, 0, 25, 30), shapely.box(25, 0, 40, 30)]
    for inherit, want in (("none", {"shop", None}), ("part", {"shop"}), ("nearest", {"shop"})):
        made = up.transfer(old, frame(halves), inherit=inherit).parcels
        assert {v if isinstance(v, str) else None for v in made.use} == want
        assert made.parcel_id.tolist() == [5, 6]
        assert made.change.tolist() == ["moved", "split"]


def test_other_columns_of_numbers_and_of_blocks(before, after):
    renamed = before.rename(columns={"parcel_id": "number"})
    assert up.transfer(renamed, after, id_column="number").parcels.parcel_id.min() == 10
    counted = up.transfer(renamed, after)
    assert "counted from 1" in " ".join(counted.issues.message)
    assert counted.parcels["number"].notna().sum() > 100  # carried over as any other column
    block = [town().blocks(), town().moved(6, 12, 3).blocks()]
    layers = []
    for parcels, polygons in zip((before, after), block, strict=True):
        inside = gpd.sjoin(
            parcels.set_geometry(parcels.representative_point()), frame(polygons), how="left"
        )
        layers.append(parcels.assign(block_id=inside.index_right.to_numpy() + 1))
    by_column = up.transfer(*layers).parcels
    by_layer = up.transfer(
        before, after, blocks_before=frame(block[0]), blocks_after=frame(block[1])
    ).parcels
    assert by_column.parcel_id.tolist() == by_layer.parcel_id.tolist()
    assert by_column.geometry.geom_equals(by_layer.geometry).all()


def test_streets_may_stand_for_blocks():
    old = town().parcels()
    numbered = frame(old, parcel_id=np.arange(1, len(old) + 1))
    streets = [town().line(street) for street in town().streets]
    new = frame(town().with_width((5, 6), 20).parcels())
    plain = up.transfer(numbered, new).parcels
    made = up.transfer(
        numbered, new, blocks_before=frame(streets), blocks_after=frame(streets)
    ).parcels
    # between the same centrelines more of them lie where they lay
    assert (made.parcel_id == plain.parcel_id).mean() > 0.9


def test_layers_in_other_crs_are_reprojected_and_it_is_said(before, after):
    here = up.transfer(before, after)
    there = up.transfer(before.to_crs(4326), after)
    assert there.parcels.crs == CRS
    assert there.parcels.parcel_id.tolist() == here.parcels.parcel_id.tolist()
    assert (there.parcels.change == here.parcels.change).all()
    said = there.issues.message.tolist()
    assert said[0].startswith("Parcels before: reprojected from WGS 84 (EPSG:4326) to WGS 84 / UTM")


def test_a_layer_without_crs_is_taken_to_be_in_that_of_the_other(before, after):
    made = up.transfer(before.set_crs(None, allow_override=True), after)
    assert made.parcels.crs == CRS
    assert "crs_missing" in made.issues.code.tolist()
    bare = [f.set_crs(None, allow_override=True) for f in (before, after)]
    with pytest.raises(BoundaryError, match="have no CRS"):
        up.transfer(*bare)


def test_layers_that_do_not_overlap_have_nothing_in_common(before):
    elsewhere = frame([shapely.box(x, 90_000, x + 1, 90_900) for x in range(3)])
    made = up.transfer(before.iloc[:40], elsewhere, id_column="floors_unknown")
    codes = made.issues.code.tolist()
    assert ("nothing_in_common" in codes) == (made.parcels.change == "new").all()
    assert "numbers_missing" in codes


def test_numbers_may_be_text():
    old = frame(
        [shapely.box(20 * i, 0, 20 * i + 20, 30) for i in range(3)], number=["30", "7", "9"]
    )
    assert up.transfer(old, old, id_column="number").parcels.parcel_id.tolist() == [7, 9, 30]


@pytest.mark.parametrize(
    ("values", "message"),
    [
        ([1, 1, 2, 2, 3], "must be there once; in the column parcel_id of The frame 1, 2 are"),
        ([1, 2, 3, 4, None], "must be whole numbers; it has nan"),
        ([1.5, 2, 3, 4, 5], "must be whole numbers; it has 1.5"),
        (list("abcde"), "must be whole numbers; it has a, b, c, d, e"),
    ],
)
def test_numbers_that_are_none(values, message):
    old = frame([shapely.box(20 * i, 0, 20 * i + 20, 30) for i in range(5)], parcel_id=values)
    with pytest.raises(BoundaryError, match=message):
        up.transfer(old, old)


def test_empty_and_wrong_layers_are_told_together(tmp_path):
    empty = frame([])
    points = gpd.GeoDataFrame(geometry=[shapely.Point(0, 0)], crs=CRS)
    with pytest.raises(BoundaryError) as raised:
        up.transfer(empty, points)
    assert len(raised.value.problems) == 2
    assert raised.value.problems[0].startswith("Parcels before: ")
    with pytest.raises(BoundaryError, match="no polygon, and no lines that surround one"):
        up.transfer(
            frame([shapely.box(0, 0, 1, 1)]),
            frame([shapely.box(0, 0, 1, 1)]),
            blocks_before=frame([shapely.LineString([(0, 0), (1, 1)])]),
        )


def test_parcels_in_several_pieces_stay_one(tmp_path):
    pieces = shapely.MultiPolygon([shapely.box(0, 0, 20, 30), shapely.box(60, 0, 70, 30)])
    old = frame([pieces, shapely.box(20, 0, 40, 30)], parcel_id=[4, 9])
    made = up.transfer(old, old)
    assert made.parcels.parcel_id.tolist() == [4, 9]
    assert made.parcels.change.tolist() == ["kept", "kept"]
    path = made.save(tmp_path / "made.gpkg")
    assert gpd.read_file(path, layer="parcels").geometry.iloc[0].geom_type == "MultiPolygon"


def test_layout_files_bring_parcels_and_streets(tmp_path):
    land = shapely.transform(shapely.box(0, 0, 300, 200), lambda xy: xy + ORIGIN)
    layout = up.cogenerate(land, crs=CRS, parcels=40, seed=1)
    layout.save(tmp_path / "a.gpkg")
    up.cogenerate(land, crs=CRS, parcels=46, seed=1).save(tmp_path / "b.gpkg")
    same = up.transfer(tmp_path / "a.gpkg", tmp_path / "a.gpkg").parcels
    assert (same.change == "kept").all()
    assert same.parcel_id.tolist() == layout.parcels.index.tolist()
    assert {"land_use", "locked", "lineage"} <= set(same.columns)
    assert (same.lineage.to_numpy() == layout.parcels.lineage.to_numpy()).all()
    some = layout.parcels.iloc[::3]
    assert up.transfer(some, some).parcels.parcel_id.tolist() == some.index.tolist()
    again = up.read_layout(tmp_path / "b.gpkg")
    other = up.transfer(tmp_path / "a.gpkg", tmp_path / "b.gpkg")
    assert other.parcels.equals(up.transfer(layout, again).parcels)
    assert other.parcels.parcel_id.is_unique
    assert other.parcels.parcel_id.isin(layout.parcels.index).mean() > 0.5


def test_the_command_writes_a_file_a_picture_and_an_export(before, after, tmp_path):
    before.to_file(tmp_path / "before.gpkg", layer="plots")
    after.to_file(tmp_path / "after.gpkg")
    call = [
        "transfer",
        f"{tmp_path / 'before.gpkg'}|layername=plots",
        tmp_path / "after.gpkg",
        "-o",
        tmp_path / "made.gpkg",
        "--plot",
        tmp_path / "made.png",
        "--export",
        tmp_path / "made",
    ]
    result = CliRunner().invoke(app, [str(a) for a in call], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    assert "moved" in result.output
    first = (tmp_path / "made.gpkg").read_bytes()
    layers = dict(pyogrio.list_layers(tmp_path / "made.gpkg"))
    assert {"parcels", "changes", "provenance"} <= set(layers)
    made = gpd.read_file(tmp_path / "made.gpkg", layer="parcels")
    assert made.owner.notna().sum() > 80
    assert (tmp_path / "made" / "changes.geojson").is_file()
    again = CliRunner().invoke(app, [*map(str, call), "--overwrite"], catch_exceptions=False)
    assert again.exit_code == 0
    assert (tmp_path / "made.gpkg").read_bytes() == first


def test_mistakes_of_a_call_are_told_together(tmp_path):
    call = ["transfer", "--inherit", "all", "-o", str(tmp_path / "made.shp")]
    result = CliRunner().invoke(app, call)
    assert result.exit_code == 2
    for part in ("Give BEFORE", "Give AFTER", "inherit must be one of", ".gpkg"):
        assert part in result.output
    missing = CliRunner().invoke(app, ["transfer", "a.gpkg", "b.gpkg", "-o", "c.gpkg"])
    assert "a.gpkg does not exist" in missing.output
    assert "b.gpkg does not exist" in missing.output


def test_a_layout_moved_as_a_whole_is_said(before):
    turned = before.drop(columns="parcel_id").assign(
        geometry=before.rotate(40, origin=ORIGIN).scale(1.2, 1.2, origin=ORIGIN)
    )
    made = up.transfer(before, turned)
    assert (made.parcels.change == "moved").all()
    said = made.issues.set_index("code").message["layout_moved"]
    assert "turned by 40° and scaled by 1.2" in said


def test_yes_and_no_stay_so_where_some_are_missing(tmp_path):
    boxes = [shapely.box(x, 0, x + 20, 30) for x in (0, 20, 40)]
    before = frame(boxes[:2], parcel_id=[4, 5], listed=[True, False])
    after = frame([*boxes[:2], shapely.box(900, 0, 920, 30)])
    made = up.transfer(before, after)
    assert made.parcels.listed.dtype == "boolean"
    assert made.parcels.listed.tolist() == [True, False, pd.NA]
    made.save(tmp_path / "made.gpkg")
    info = pyogrio.read_info(tmp_path / "made.gpkg", layer="parcels")
    assert dict(zip(info["fields"], info["ogr_subtypes"], strict=True))["listed"] == "OFSTBoolean"
    read = gpd.read_file(tmp_path / "made.gpkg", layer="parcels")
    assert [None if pd.isna(v) else bool(v) for v in read.listed] == [True, False, None]
    whole = up.transfer(before, frame(boxes[:2])).parcels
    assert whole.listed.dtype == bool


def test_a_run_ends_by_saying_that_nothing_was_found_again(tmp_path):
    paths = [tmp_path / f"{name}.gpkg" for name in ("before", "after", "made")]
    town_of_two = [shapely.box(x, 0, x + 20, 30) for x in (0, 20)]
    frame(town_of_two, parcel_id=[1, 2]).to_file(paths[0])
    far = shapely.Polygon([(5000, 0), (5300, 10), (5200, 700), (5100, 300)])
    frame([far]).to_file(paths[1])
    ran = CliRunner().invoke(app, ["transfer", *map(str, paths[:2]), "-o", str(paths[2])])
    assert ran.exit_code == 0
    assert "Do the layers show the same place?" in " ".join(ran.output.split())
