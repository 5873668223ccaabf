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
