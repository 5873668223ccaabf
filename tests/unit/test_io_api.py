"""The library in one call."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import pytest
import shapely

import urban_processing as up
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.io.boundaries import read_boundary

Sample = Callable[[str], Path]


def test_boundary_in_layout_out(sample: Sample, tmp_path: Path) -> None:
    land = gpd.read_file(sample("irregular_64ha"))
    layout = up.cogenerate(land, parcels=60)
    assert isinstance(layout, up.GeoLayout)
    assert layout.certificate.holds, layout.certificate.failures
    assert len(layout.parcels) == pytest.approx(60, abs=2)
    assert layout.parcels.crs == "EPSG:32633"
    path = layout.save(tmp_path / "a.gpkg")
    again = up.read_layout(path)
    assert again.parcels.geometry.geom_equals_exact(layout.parcels.geometry, 0).all()
    assert again.streets.drop(columns="geometry").equals(layout.streets.drop(columns="geometry"))


def test_same_call_gives_same_bytes(sample: Sample, tmp_path: Path) -> None:
    one, two = (
        up.cogenerate(sample("rect"), parcels=40, seed=3).save(tmp_path / f"{name}.gpkg")
        for name in "ab"
    )
    assert one.read_bytes() == two.read_bytes()


def test_a_site_is_taken_as_it_is() -> None:
    site = read_boundary(shapely.box(0, 0, 300, 200), crs="EPSG:32630")
    assert len(up.cogenerate(site, min_area=3000).parcels) > 5
    with pytest.raises(BoundaryError, match="leave out crs"):
        up.cogenerate(site, crs="EPSG:32631", min_area=3000)


@pytest.fixture(scope="module")
def layers() -> tuple[up.GeoLayers, up.GeoLayers]:
    """A block between streets, and its parcels."""
    ring = shapely.box(500_000, 5_700_000, 500_090, 5_700_060).exterior
    found = up.find_blocks(gpd.GeoDataFrame(geometry=[ring], crs="EPSG:32630"))
    return found, up.subdivide(found, min_area=300)


def test_transfer_takes_what_subdivide_made(layers: tuple[up.GeoLayers, up.GeoLayers]) -> None:
    found, made = layers
    again = up.subdivide(found, min_area=200, seed=4)
    carried = up.transfer(made, again)
    assert len(carried.parcels) == len(again.parcels)
    plain = up.transfer(
        made.parcels, again.parcels, blocks_before=made.blocks, blocks_after=again.blocks
    )
    assert carried.parcels.equals(plain.parcels)
    assert up.transfer(made, again, blocks_after=found).parcels.equals(plain.parcels)
    assert set(up.transfer(made, made).parcels.change) == {"kept"}
    with pytest.raises(BoundaryError, match=r"There is no layer parcels .* there are blocks, "):
        up.transfer(found, made)


def test_optimize_says_what_it_takes_of_layers(
    layers: tuple[up.GeoLayers, up.GeoLayers], tmp_path: Path
) -> None:
    found, made = layers
    with pytest.raises(BoundaryError, match=r"give parcels=made.parcels .*=found.block_edges"):
        up.optimize(made)  # type: ignore[arg-type]
    direct = up.optimize(parcels=made.parcels, streets=found.block_edges)
    assert len(direct.parcels) == len(made.parcels)
    parcels, blocks = made.save(tmp_path / "p.gpkg"), found.save(tmp_path / "b.gpkg")
    named = up.optimize(parcels=parcels, streets=f"{blocks}|layername=block_edges")
    assert named.parcels.equals(direct.parcels)
    as_blocks = up.optimize(
        parcels=f"{parcels}|layername=blocks", streets=f"{blocks}|layername=block_edges"
    )
    assert len(as_blocks.parcels) == 1
    with pytest.raises(BoundaryError, match=r"Streets: .* has no layer 'roads'"):
        up.optimize(parcels=parcels, streets=f"{blocks}|layername=roads")


def test_all_mistakes_are_reported_together() -> None:
    with pytest.raises(UrbanError) as caught:
        up.cogenerate("/no/such.gpkg", min_area=-1, pattern="star", colour="red")
    text = str(caught.value)
    for word in ("/no/such.gpkg", "min-area", "pattern", "colour"):
        assert word in text
    with pytest.raises(ParameterError):
        up.cogenerate(shapely.box(0, 0, 300, 200))
    with pytest.raises(BoundaryError):
        up.cogenerate("/no/such.gpkg", min_area=400)


# ---- geometries on a plane without CRS go from one function to the next

STREETS = [
    shapely.box(0, 0, 200, 150).exterior,
    shapely.LineString([(0, 70), (200, 80)]),
    shapely.LineString([(90, 0), (80, 150)]),
]


@pytest.fixture(scope="module")
def plane() -> tuple[up.GeoLayers, up.GeoLayers]:
    """Blocks of bare lines, and their subdivision."""
    found = up.find_blocks(STREETS, default_width=8)
    return found, up.subdivide(found, min_area=600)


@pytest.fixture(scope="module")
def bare_layout() -> up.GeoLayout:
    return up.cogenerate(shapely.box(0, 0, 200, 150), min_area=2000)


def test_blocks_of_bare_lines_are_subdivided(plane: tuple[up.GeoLayers, up.GeoLayers]) -> None:
    found, made = plane
    assert made.parcels.crs is None
    assert made.parcels.area_m2.sum() == pytest.approx(found.blocks.area_m2.sum())
    for blocks in (found.blocks, found.blocks[found.blocks.area_m2 > 0], found.blocks.copy()):
        again = up.subdivide(blocks, streets=found.block_edges, min_area=600)
        assert again.parcels.geometry.geom_equals_exact(made.parcels.geometry, 0).all()
    one = up.subdivide(found.blocks.geometry.iloc[:1], min_area=600)
    assert one.blocks.area_m2.tolist() == found.blocks.area_m2.tolist()[:1]
    kept = up.subdivide(found, previous=made, min_area=600)
    assert (kept.changes.change == "kept").all()


def test_bare_parcels_are_calibrated_and_their_blocks_subdivided(
    plane: tuple[up.GeoLayers, up.GeoLayers],
) -> None:
    found, made = plane
    bare = list(made.parcels.geometry)
    for measured in (
        up.calibrate(bare),
        up.calibrate(made),
        up.calibrate(made.parcels, found.blocks),
        up.calibrate(bare, found),
    ):
        assert measured.crs is None
        again = up.subdivide(measured)
        assert len(again.blocks) == len(found.blocks)
        assert len(again.parcels) == pytest.approx(len(made.parcels), rel=0.3)


def test_a_bare_layout_is_optimized_from_its_frames(bare_layout: up.GeoLayout) -> None:
    layout = bare_layout
    again = up.optimize(parcels=layout.parcels, streets=layout.streets)
    assert again.crs is None
    assert len(again.parcels) == len(layout.parcels)
    assert again.certificate.holds, again.certificate.failures
    assert not [i for i in again.issues.message if "CRS" in i]
    land = up.cogenerate(layout.boundary, streets=layout.streets, min_area=2500)
    assert land.crs is None
    assert land.metric("area_m2") == pytest.approx(layout.metric("area_m2"))


def test_bare_parcels_are_transferred(
    plane: tuple[up.GeoLayers, up.GeoLayers], bare_layout: up.GeoLayout
) -> None:
    _, made = plane
    assert len(up.transfer(made, made).parcels) == len(made.parcels)
    assert len(up.transfer(made.parcels, bare_layout.parcels).parcels) == len(bare_layout.parcels)


def test_frames_of_the_user_need_a_crs(
    plane: tuple[up.GeoLayers, up.GeoLayers], bare_layout: up.GeoLayout
) -> None:
    own = gpd.GeoDataFrame(geometry=list(plane[0].blocks.geometry))
    lines = gpd.GeoDataFrame(geometry=list(bare_layout.streets.geometry))
    for call in (
        lambda: up.subdivide(own, min_area=600),
        lambda: up.subdivide(own.geometry, min_area=600),
        lambda: up.calibrate(own),
        lambda: up.cogenerate(own, min_area=2000),
        lambda: up.find_blocks(lines),
        lambda: up.optimize(parcels=own, streets=lines),
        lambda: up.transfer(own, own),
    ):
        with pytest.raises(BoundaryError, match="CRS"):
            call()


def test_only_frames_without_crs_are_marked(sample: Sample) -> None:
    layout = up.cogenerate(sample("rect"), parcels=12)
    stripped = layout.parcels.set_crs(None, allow_override=True)
    with pytest.raises(BoundaryError, match="no CRS"):
        up.optimize(parcels=stripped, streets=layout.streets)
