"""Going on with a layout that stopped at a level, as it is or edited by hand."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from click.testing import CliRunner

import urban_processing as up
from urban_processing.cli.app import app
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.io.frames import GeoLayout
from urban_processing.layout_file.reading import STAGES_SINCE

RUNS = {
    "area": ["--min-area", "30000"],
    "number": ["--parcels", "40"],
    "skeleton": ["--min-area", "20000", "--strategy", "skeleton"],
}


def run(*args: object, code: int = 0) -> str:
    made = CliRunner().invoke(app, [str(arg) for arg in args])
    assert made.exit_code == code, made.output
    return made.output


def same(a: GeoLayout, b: GeoLayout) -> None:
    """All layers are the same but the steps that made them."""
    assert list(a.tables) == list(b.tables)
    for name in a.tables:
        if name == "provenance":
            continue
        for column, values in a.tables[name].columns.items():
            np.testing.assert_array_equal(values, b.tables[name][column], err_msg=name)
        for one, other in zip(a.tables[name].shapes, b.tables[name].shapes, strict=True):
            assert one is other is None or shapely.to_wkb(one) == shapely.to_wkb(other)


@pytest.mark.parametrize("name", RUNS)
def test_stopping_and_going_on_gives_the_layout_of_one_run(
    name: str, tmp_path: Path, sample: Callable[[str], Path]
) -> None:
    land, options = sample("ellipse"), RUNS[name]
    whole, stage, next_, final = (tmp_path / f"{n}.gpkg" for n in ("whole", "a", "b", "c"))
    run("cogenerate", land, "-o", whole, *options)
    assert "stopped" in run("cogenerate", land, "-o", stage, *options, "--stop-at-level", 3)
    run("resume", stage, "-o", next_, "--stop-at-level", 4)
    run("resume", next_, "-o", final)
    counts = [len(up.read_layout(path).parcels) for path in (stage, next_, final)]
    assert counts[0] == 8
    assert counts[0] < counts[1] < counts[2]
    same(up.read_layout(whole), up.read_layout(final))
    steps = up.read_layout(final).provenance
    assert steps.algorithm.tolist() == ["cogenerate", "resume", "resume"]


@pytest.fixture(scope="module")
def stage(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A layout of 16 parcels that stopped, four of them inside."""
    path = tmp_path_factory.mktemp("stage") / "stage.gpkg"
    land = shapely.box(0, 0, 400, 400)
    up.cogenerate(land, crs="EPSG:32630", min_area=1000, stop_at_level=4).save(path)
    return path


@pytest.fixture
def copy(stage: Path, tmp_path: Path) -> Path:
    path = tmp_path / "edited.gpkg"
    path.write_bytes(stage.read_bytes())
    return path


def parcels_of(path: Path) -> gpd.GeoDataFrame:
    return gpd.read_file(path, layer="parcels")


def rewritten(path: Path, parcels: gpd.GeoDataFrame) -> Path:
    parcels.to_file(path, layer="parcels")
    return path


def halves(polygon: shapely.Polygon) -> list[shapely.Polygon]:
    x0, y0, x1, y1 = polygon.bounds
    line = shapely.LineString([((x0 + x1) / 2, y0 - 1), ((x0 + x1) / 2, y1 + 1)])
    return list(shapely.ops.split(polygon, line).geoms)


def split_by_hand(parcels: gpd.GeoDataFrame, row: int) -> gpd.GeoDataFrame:
    """As the tool of QGIS does it: a second row with the same values."""
    low, high = halves(parcels.geometry[row])
    other = parcels.iloc[[row]].set_geometry([high], crs=parcels.crs)
    out = gpd.GeoDataFrame(pd.concat([parcels, other], ignore_index=True), crs=parcels.crs)
    out.loc[row, "geometry"] = low
    return out


def test_values_typed_in_by_hand_count(copy: Path) -> None:
    before = up.read_layout(copy)
    parcels = parcels_of(copy)
    parcels.loc[3, ["land_use", "locked"]] = ["market", True]
    parcels.loc[5, "stage"] = "done"
    rewritten(copy, parcels)
    made = up.resume(copy)
    assert made.certificate.holds
    market = made.parcels[made.parcels.land_use == "market"]
    assert len(market) == 1
    assert market.locked.all()
    for row in (3, 5):
        old = before.parcels.iloc[row]
        (now,) = np.flatnonzero(made.parcels.lineage == old.lineage)
        assert made.parcels.geometry.iloc[now].intersection(old.geometry).area > 0.9 * old.area_m2
    assert len(made.parcels) > 60


def test_a_parcel_split_by_hand_and_a_moved_vertex(copy: Path) -> None:
    before = up.read_layout(copy)
    parcels = split_by_hand(parcels_of(copy), 6)
    parcels.loc[6, "land_use"] = "park"
    rewritten(copy, parcels)
    read = up.resume(copy, stop_at_level=4)
    assert len(read.parcels) == 17
    assert read.parcels.lineage.is_unique
    kept = read.parcels.lineage.isin(before.parcels.lineage)
    assert kept.sum() == 15
    assert (read.parcels.level[kept] == 4).all()
    assert (read.parcels.level[~kept] == 5).all()
    assert sorted(read.parcels.land_use[~kept]) == ["parcel", "park"]
    assert (read.parcels.stage == "open").all()
    assert {"layers_edited", "stopped"} <= set(read.issues.code)
    final = up.resume(read)
    assert final.certificate.holds
    assert "stopped" not in set(final.issues.code)


def test_quotas_are_shared_by_what_was_split(tmp_path: Path) -> None:
    path = tmp_path / "n.gpkg"
    up.cogenerate(shapely.box(0, 0, 600, 400), crs="EPSG:32630", parcels=100, stop_at_level=3).save(
        path
    )
    parcels = split_by_hand(parcels_of(path), 2)
    whole = parcels.quota[2]
    read = up.resume(rewritten(path, parcels), stop_at_level=3)
    assert read.parcels.quota.sum() == 100
    assert read.parcels.quota.loc[[3, 9]].sum() == whole
    assert len(up.resume(read).parcels) == pytest.approx(100, abs=3)


def test_edited_with_what_fits_exactly_is_read_without_snapping(copy: Path) -> None:
    parcels = parcels_of(copy)
    square = parcels.geometry[0]
    xy = shapely.get_coordinates(square)[:-1]
    corner = [xy[i] for i in range(len(xy))]
    cut = shapely.LineString([corner[0], corner[len(xy) // 2]])
    pieces = list(shapely.ops.split(square, cut).geoms)
    if len(pieces) != 2:
        pytest.skip("the parcel has no diagonal")
    other = parcels.iloc[[0]].set_geometry([pieces[1]], crs=parcels.crs)
    both = gpd.GeoDataFrame(pd.concat([parcels, other], ignore_index=True), crs=parcels.crs)
    both.loc[0, "geometry"] = pieces[0]
    read = up.read_layout(rewritten(copy, both))
    assert len(read.parcels) == 17
    assert read.parcels.lineage.is_unique
    assert read.issues.code.tolist()[0] == "layers_edited"


def test_a_value_without_meaning_is_refused_or_told(copy: Path) -> None:
    parcels = parcels_of(copy)
    parcels.loc[0, "stage"] = "opne"
    parcels["stage"] = parcels["stage"].astype(object)
    parcels.loc[1, "lineage"] = None
    rewritten(copy, parcels)
    with pytest.raises(BoundaryError, match="not all parcels have all of the values"):
        up.read_layout(copy)
    read = up.resume(copy, stop_at_level=4)
    (told,) = read.issues.message[read.issues.code == "values_ignored"]
    assert told == "Column stage of the parcels: 'opne' means nothing; 1 row took the default."
    assert read.parcels.stage.tolist() == ["open"] * 16
    assert read.parcels.lineage.is_unique


def test_streets_keep_their_levels_and_decisions_their_edges(copy: Path) -> None:
    before = up.read_layout(copy)
    parcels = split_by_hand(parcels_of(copy), 6)
    read = up.resume(rewritten(copy, parcels), stop_at_level=4)
    levels = before.streets.groupby("level").length_m.sum()
    assert read.streets.groupby("level").length_m.sum().to_dict() == pytest.approx(levels.to_dict())
    assert len(levels) > 1


def test_layers_need_a_size_and_their_columns_count(stage: Path) -> None:
    layout = up.read_layout(stage)
    parcels, streets = layout.parcels, layout.streets
    with pytest.raises(ParameterError, match="Give min-area"):
        up.resume(parcels=parcels, streets=streets)
    locked = parcels.assign(locked=parcels.index == 2, land_use="field")
    made = up.resume(parcels=locked, streets=streets, min_area=1000)
    assert made.certificate.holds
    assert set(made.parcels.land_use) == {"field"}
    assert made.parcels.lineage.isin([parcels.lineage[2]]).sum() == 1
    assert len(made.parcels) > 60
    bare = up.resume(parcels=parcels[["geometry"]], streets=streets, min_area=4000)
    assert bare.certificate.holds
    assert len(bare.parcels) > 16
    assert bare.metric("min_area_m2") == 4000
    again = up.resume(bare, stop_at_level=1)  # it says itself what it was gone on with
    assert again.provenance.algorithm.tolist() == ["resume", "resume"]


def test_another_size_takes_the_place_of_the_first(stage: Path, tmp_path: Path) -> None:
    coarse = up.resume(stage, min_area=4000, stop_at_level=5)
    coarse.save(tmp_path / "coarse.gpkg")
    made = up.resume(tmp_path / "coarse.gpkg")
    assert made.metric("min_area_m2") == 4000
    assert made.parcels.area_m2.min() >= 4000
    assert len(made.parcels) < len(up.resume(stage).parcels)


def test_what_is_no_layout_in_the_making_says_what_to_give(tmp_path: Path, stage: Path) -> None:
    parts = up.read_layout(stage)
    path = tmp_path / "smooth.gpkg"
    up.optimize(parcels=parts.parcels, streets=parts.streets).save(path)
    with pytest.raises(BoundaryError, match="Give min_area"):
        up.resume(path)
    out = tmp_path / "o.gpkg"
    assert "Give min_area (--min-area)" in run("resume", path, "-o", out, code=2)
    layers = ("--parcel-layer", path, "--street-layer", path)
    assert "Give min-area (m²)" in run("resume", *layers, "-o", out, code=2)
    assert "layout file, or" in run("resume", "-o", out, code=2)
    assert not out.exists()
    run("resume", *layers, "-o", out, "--min-area", 1000)
    assert len(up.read_layout(out).parcels) > 60


def test_all_that_is_wrong_is_told_together() -> None:
    with pytest.raises(UrbanError) as told:
        up.resume("missing.gpkg", min_area=-1)
    assert len(told.value.problems) == 2


def old_format(path: Path) -> None:
    """Make a file of one as it was written before there were stages."""
    with closing(sqlite3.connect(path)) as db, db:
        for column in ("stage", "quota"):
            db.execute(f'ALTER TABLE "parcels" DROP COLUMN "{column}"')
            db.execute("DELETE FROM gpkg_data_columns WHERE column_name = ?", (column,))
        ((text,),) = db.execute("SELECT metadata FROM gpkg_metadata").fetchall()
        state = {**json.loads(text), "format": STAGES_SINCE - 1}
        del state["steered_edges"]
        db.execute("UPDATE gpkg_metadata SET metadata = ?", (json.dumps(state),))


def test_files_of_the_first_format_are_read_as_before(
    tmp_path: Path, sample: Callable[[str], Path]
) -> None:
    path = tmp_path / "old.gpkg"
    up.cogenerate(sample("ellipse"), parcels=40).save(path)
    now = up.read_layout(path)
    old_format(path)
    assert {"stage", "quota"}.isdisjoint(parcels_of(path).columns)
    same(up.read_layout(path), now)
    # an edited one, too: all its parcels were finished
    parcels = parcels_of(path)
    edited = up.optimize(rewritten(path, split_by_hand(parcels, 5)))
    assert len(edited.parcels) == 41
    assert (edited.parcels.stage == "done").all()


def test_an_edited_layout_and_its_changes(stage: Path, copy: Path) -> None:
    parcels = split_by_hand(parcels_of(copy), 6)
    layout, changes = up.read_edited(stage, rewritten(copy, parcels))
    assert layout.issues.message.tolist()[-1] == (
        "Parcels since stage.gpkg: 15 kept as they were, 1 moved or changed shape, "
        "1 new by a split."
    )
    assert changes.crs == layout.crs
    assert sorted(changes.new_id) == list(range(1, 18))
    assert set(changes.old_id[changes.change != "new"]) == set(range(1, 17))
    by_layers, same_changes = up.read_edited(
        stage, parcels=parcels, streets=up.read_layout(copy, snap=0.05).streets
    )
    assert same_changes.change.tolist() == changes.change.tolist()
    assert by_layers.parcels.lineage.tolist() == layout.parcels.lineage.tolist()
    assert by_layers.metric("min_area_m2") == 1000
    # all that layers do not say is as it was before, so that one can go on
    assert len(up.resume(by_layers).parcels) > 60
    degrees, moved = up.read_edited(
        stage,
        parcels=parcels.to_crs("EPSG:4326"),
        streets=up.read_layout(stage).streets.to_crs("EPSG:4326"),
    )
    assert degrees.crs == layout.crs
    assert moved.change.tolist() == changes.change.tolist()
    with pytest.raises(BoundaryError, match="Give the layout after the edit, or"):
        up.read_edited(stage)
