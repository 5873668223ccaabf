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
