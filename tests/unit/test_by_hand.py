"""Layout files edited in a GIS: other CRSs, deleted streets, other land, uses typed in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pytest
import shapely

import urban_processing as up
from urban_processing.errors import BoundaryError
from urban_processing.layout import EdgeKind, Steering

LAND = shapely.box(0, 0, 400, 240)
Edit = Callable[[gpd.GeoDataFrame], gpd.GeoDataFrame]


@pytest.fixture
def stage(tmp_path: Path) -> Path:
    made = up.cogenerate(LAND, crs="EPSG:32630", min_area=900, stop_at_level=5)
    return made.save(tmp_path / "stage.gpkg")


def edited(file: Path, layer: str, edit: Edit) -> None:
    frame = edit(gpd.read_file(file, layer=layer))
    frame.to_file(file, layer=layer, driver="GPKG")


@pytest.mark.parametrize("layers", [["parcels"], ["streets"], ["parcels", "streets"]])
@pytest.mark.parametrize("crs", ["EPSG:32631", "EPSG:4326"])
def test_layers_in_another_crs_are_refused(stage: Path, layers: list[str], crs: str) -> None:
    for layer in layers:
        edited(stage, layer, lambda frame: frame.to_crs(crs))
    with pytest.raises(BoundaryError, match="and the layout in WGS 84 / UTM zone 30N") as error:
        up.resume(stage)
    assert len(error.value.problems) == len(layers)
    with pytest.raises(BoundaryError, match="write it in the CRS of the layout"):
        up.read_layout(stage)


def test_a_layer_written_in_the_same_crs_is_read(stage: Path) -> None:
    edited(stage, "parcels", lambda frame: frame)
    assert up.read_layout(stage).layout.mesh.n_faces == 32


def test_a_deleted_street_is_not_laid_again(stage: Path) -> None:
    streets = gpd.read_file(stage, layer="streets")
    inner = streets[streets["class"] != "rim"]
    # the first without which every parcel is still reached in the end
    for row in inner.index:
        gone = inner.geometry[row]
        streets.drop(index=row).to_file(stage, layer="streets", driver="GPKG")
        read = up.read_layout(stage, snap=0.05).layout
        barred = read.steered(Steering.NO_STREET)
        assert read.mesh.edge_length[barred].sum() == pytest.approx(gone.length, rel=1e-6)
        assert any("deleted by hand" in issue.message for issue in read.issues)
        done = up.resume(stage)
        if not done.issues.code.isin(["parcel_not_reached", "street_on_rim"]).any():
            ends = done.layout.mesh.xy[done.layout.mesh.origin.reshape(-1, 2)]
            kept = done.layout.steered(Steering.NO_STREET)
            assert kept.any()
            assert not done.layout.edge_street[kept].any()
            assert ends.shape[1:] == (2, 2)
            return
    pytest.fail("no street can be deleted")


def test_nothing_is_barred_in_a_file_that_nobody_edited(stage: Path) -> None:
    layout = up.read_layout(stage, snap=0.05).layout
    assert not layout.edge_steering.any()
    assert layout.edge_street[layout.edge_kind == EdgeKind.RIM].all()


def test_parcels_that_cover_other_land_are_told_of(stage: Path) -> None:
    edited(stage, "parcels", lambda frame: frame.drop(index=frame.index[0]))
    issues = up.read_layout(stage, snap=0.05).issues
    [message] = issues.message[issues.code == "land_changed"]
    assert "belong to no parcel now" in message


def test_a_use_typed_in_keeps_its_parcel(stage: Path) -> None:
    def school(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
        frame.loc[3, "land_use"] = "school"
        return frame

    before = gpd.read_file(stage, layer="parcels")
    edited(stage, "parcels", school)
    parcels = up.resume(stage).parcels
    [kept] = parcels[parcels.land_use == "school"].itertuples()
    assert kept.locked
    assert kept.geometry.area == pytest.approx(before.geometry[3].area, rel=1e-6)


def test_files_without_parcels_are_refused(stage: Path) -> None:
    edited(stage, "parcels", lambda frame: frame.iloc[:0])
    for read in (up.resume, up.optimize, lambda file: up.steer(layout=file)):
        with pytest.raises(BoundaryError, match="No parcel is left"):
            read(stage)


def test_uses_and_stages_survive_a_round_through_a_gis(stage: Path, tmp_path: Path) -> None:
    session = up.steer(layout=stage)
    session.lock(session.parcels[2], "park")
    session.choose(session.parcels[0], 1)
    file = session.view.save(tmp_path / "steered.gpkg")
    edited(file, "parcels", lambda frame: frame)
    edited(file, "streets", lambda frame: frame)
    again = up.read_layout(file, snap=0.05).layout
    for name in ("face_stage", "face_use", "face_locked", "face_lineage"):
        assert np.array_equal(getattr(again, name), getattr(session.layout, name)), name
