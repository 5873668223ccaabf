"""Boundaries in: what is read, repaired, refused, and said."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.io.boundaries import read_boundary
from urban_processing.site import Site, snap_to_grid

UTM = "EPSG:32630"
Sample = Callable[[str], Path]


def box(x: float, y: float, width: float = 100.0, height: float = 80.0) -> shapely.Polygon:
    return shapely.box(x, y, x + width, y + height)


def series(*geometries: shapely.Geometry | None, crs: object = UTM) -> gpd.GeoSeries:
    return gpd.GeoSeries(list(geometries), crs=crs)


def codes(site: Site) -> list[str]:
    return [issue.code for issue in site.issues]


def problems(*args: object, **kwargs: object) -> tuple[str, ...]:
    with pytest.raises(BoundaryError) as caught:
        read_boundary(*args, **kwargs)  # type: ignore[arg-type]
    return caught.value.problems


def assert_ready(site: Site) -> None:
    """The promises of `Site`."""
    areas = [part.area for part in site.parts]
    assert areas == sorted(areas, reverse=True)
    for part in site.parts:
        assert part.is_valid
        assert part.exterior.is_ccw
        assert not any(hole.is_ccw for hole in part.interiors)
        xy = shapely.get_coordinates(part)
        np.testing.assert_array_equal(xy, snap_to_grid(xy))
        np.testing.assert_array_equal((xy + site.frame.origin) - site.frame.origin, xy)
    assert site.frame.origin == (math.floor(site.frame.origin[0]), math.floor(site.frame.origin[1]))


@pytest.mark.parametrize(
    ("name", "parts", "holes", "km2"),
    [
        ("wandsworth", 1, 0, 34.281),
        ("islington", 1, 0, 14.864),
        ("sant_adria", 1, 0, 3.203),
        ("schaan", 5, 2, 26.952),
        ("planken", 5, 2, 5.355),
        ("wyoming", 1, 0, 253_366.0),
        ("rect", 1, 0, 1.5),
    ],
)
def test_samples(sample: Sample, name: str, parts: int, holes: int, km2: float) -> None:
    site = read_boundary(sample(name))
    assert_ready(site)
    assert len(site.parts) == parts
    assert sum(len(p.interiors) for p in site.parts) == holes
    assert site.area / 1e6 == pytest.approx(km2, rel=1e-3)
    assert len(site.input_sha256) == 64


def test_crs_change_is_said(sample: Sample) -> None:
    site = read_boundary(sample("wandsworth"))
    assert site.frame.crs == UTM
    assert codes(site) == ["crs_changed"]
    assert "EPSG:4326" in site.issues[0].message
    assert "EPSG:32630" in site.issues[0].message


def test_crs_can_be_chosen(sample: Sample) -> None:
    site = read_boundary(sample("wandsworth"), crs="EPSG:27700")
    assert site.frame.crs == "EPSG:27700"
    assert codes(site) == []


def test_feet_become_metres() -> None:
    land = series(shapely.box(1_170_000, 1_900_000, 1_171_000, 1_901_000), crs="EPSG:3435")
    site = read_boundary(land)
    assert site.frame.crs == "EPSG:32616"
    assert site.area == pytest.approx((1000 * 1200 / 3937) ** 2, rel=2e-3)


def test_kinds_of_files_agree(tmp_path: Path, sample: Sample) -> None:
    frame = gpd.read_file(sample("planken"))
    frame.to_file(tmp_path / "a.shp")
    frame.to_file(tmp_path / "a.geojson", driver="GeoJSON", COORDINATE_PRECISION=15)
    frame.to_parquet(tmp_path / "a.parquet")
    zipped = tmp_path / "a.zip"
    pyogrio.write_dataframe(frame, f"/vsizip/{zipped}/a.fgb", driver="FlatGeobuf")
    expected = read_boundary(sample("planken"))
    for name in ("a.shp", "a.geojson", "a.parquet", "a.zip"):
        site = read_boundary(tmp_path / name)
        assert len(site.parts) == 5
        assert site.area == pytest.approx(expected.area, rel=1e-9)
    np.testing.assert_array_equal(
        shapely.equals(read_boundary(frame).parts, expected.parts), [True] * 5
    )
    assert read_boundary(frame).input_sha256 == expected.input_sha256


def test_layers_and_filter(tmp_path: Path) -> None:
    path = tmp_path / "two.gpkg"
    frame = gpd.GeoDataFrame(
        {"name": ["a", "b"]}, geometry=[box(500_000, 0), box(600_000, 0, 50)], crs=UTM
    )
    frame.to_file(path, layer="first")
    frame.to_file(path, layer="second")
    frame.set_geometry(frame.centroid).to_file(path, layer="points")
    (several,) = problems(path)
    assert "first, second" in several
    assert "--layer" in several
    assert "points" not in several
    site = read_boundary(path, layer="second", where="name = 'b'")
    assert [p.area for p in site.parts] == [4000]
    (missing,) = problems(path, layer="third")
    assert "'third'" in missing
    assert "first, second, points" in missing
    (no_column,) = problems(path, layer="first", where="nam = 'b'")
    assert "nam = 'b'" in no_column
    assert "name" in no_column.split("columns are")[1]
    (nothing,) = problems(path, layer="first", where="name = 'c'")
    assert "no features" in nothing
    (points,) = problems(path, layer="points")
    assert "2 points" in points
    assert "no polygon" in points


def test_layout_files_offer_their_boundary(tmp_path: Path) -> None:
    path = tmp_path / "layout.gpkg"
    series(box(500_000, 0)).to_file(path, layer="parcels")
    series(box(500_000, 0), crs=UTM).to_file(path, layer="boundary")
    assert len(read_boundary(path).parts) == 1


def test_touching_districts_become_one_land() -> None:
    site = read_boundary(series(box(500_000, 0), box(500_100, 0), box(500_500, 0, 10, 10)))
    assert [p.area for p in site.parts] == [16_000, 100]


def test_duplicates_count_once() -> None:
    assert read_boundary(series(box(500_000, 0), box(500_000, 0))).area == 8000


def test_holes_stay_and_slivers_are_filled() -> None:
    land = box(500_000, 0, 1000, 1000)
    lake, sliver = box(500_200, 200), box(500_600, 100, 0.01, 800)
    site = read_boundary(series(land.difference(shapely.union(lake, sliver))))
    assert [len(p.interiors) for p in site.parts] == [1]
    assert codes(site) == ["gaps_filled"]
    assert site.issues[0].value == pytest.approx(8.0, rel=1e-3)
    assert site.issues[0].geometry is not None


def test_heights_are_dropped() -> None:
    site = read_boundary(series(shapely.force_3d(box(500_000, 0), 7.0)))
    assert not site.parts[0].has_z


def test_180th_meridian() -> None:
    halves = series(
        shapely.box(179.99, -17, 180, -16.99), shapely.box(-180, -17, -179.99, -16.99), crs=4326
    )
    site = read_boundary(halves)
    assert len(site.parts) == 1
    assert_ready(site)


def test_small_self_crossing_is_repaired_and_said() -> None:
    ring = [(0, 0), (100, 0), (100, 100), (50, 50), (50.1, 50), (50, 100), (0, 100)]
    site = read_boundary(shapely.Polygon(ring), crs=UTM)
    assert_ready(site)
    assert codes(site) == ["ring_repaired"]
    assert "Self-intersection" in site.issues[0].message
    assert site.issues[0].value == pytest.approx(-0.005, rel=0.01)


def test_hole_outside_the_shell_does_not_become_land() -> None:
    shell = [(0, 0), (100, 0), (100, 100), (0, 100)]
    site = read_boundary(
        shapely.Polygon(shell, [[(120, 10), (130, 10), (130, 20), (120, 20)]]), crs=UTM
    )
    assert site.area == 10_000
    assert codes(site) == ["ring_repaired"]


def test_bow_tie_is_refused() -> None:
    (problem,) = problems(shapely.Polygon([(0, 0), (100, 100), (100, 0), (0, 100)]), crs=UTM)
    assert "bow-tie" in problem
    assert "50 50" in problem


def test_empty_and_other_geometries_are_left_out_and_said() -> None:
    site = read_boundary(series(box(500_000, 0), None, shapely.Point(0, 0), shapely.Polygon()))
    assert site.area == 8000
    assert codes(site) == ["empty_geometry", "not_polygons"]


def test_collections_give_their_polygons() -> None:
    mixed = shapely.GeometryCollection(
        [shapely.MultiPolygon([box(500_000, 0)]), shapely.LineString([(0, 0), (1, 1)])]
    )
    assert read_boundary(series(mixed)).area == 8000


@pytest.mark.parametrize(
    ("geometries", "words"),
    [
        ([None, None], "without geometry"),
        ([shapely.Polygon()], "without geometry"),
        ([], "no features"),
        ([shapely.LineString([(0, 0), (1, 1)]), shapely.Point(1, 1)], "1 line and 1 point"),
        ([shapely.Polygon([(0, 0), (1, 0), (2, 0)])], "no area"),
    ],
)
def test_useless_geometry_is_refused(geometries: list[shapely.Geometry], words: str) -> None:
    (problem,) = problems(series(*geometries))
    assert words in problem


def test_coordinates_must_be_finite(tmp_path: Path) -> None:
    with np.errstate(invalid="ignore"):
        bad = shapely.from_wkt("POLYGON ((0 0, 10 0, 10 nan, 0 0))")
        land = series(box(500_000, 0), bad)
        land.to_file(tmp_path / "a.gpkg", SPATIAL_INDEX="NO")
    for source in (land, tmp_path / "a.gpkg"):
        (problem,) = problems(source)
        assert "feature 2" in problem
        assert "not finite" in problem


def test_missing_crs_says_how_to_give_it(tmp_path: Path) -> None:
    (problem,) = problems(series(box(500_000, 0), crs=None))
    assert "--crs" in problem
    assert "set_crs" in problem


def test_given_crs_is_taken_for_a_missing_one() -> None:
    land = series(box(500_000, 0), crs=None)
    site = read_boundary(land, crs=UTM)
    assert site.frame.crs == UTM
    assert site.area == 8000
    assert codes(site) == ["crs_assumed"]
    degrees = read_boundary(series(shapely.box(9.5, 47.2, 9.51, 47.21), crs=None), crs=4326)
    assert degrees.frame.crs == "EPSG:32632"


def test_bare_polygons_may_lie_on_a_plane_without_crs() -> None:
    site = read_boundary(shapely.box(0, 0, 100, 80))
    assert site.frame.crs == ""
    assert site.area == 8000
    assert codes(site) == []


def test_degrees_taken_for_metres_are_refused() -> None:
    (problem,) = problems(shapely.box(9.5, 47.2, 9.51, 47.21), crs=UTM)
    assert "EPSG:4326" in problem


def test_chosen_crs_must_be_metric() -> None:
    (problem,) = problems(series(box(500_000, 0)), crs="EPSG:4326")
    assert "projected" in problem


def test_all_mistakes_are_reported_together() -> None:
    found = problems("/no/such/file.gpkg", crs="EPSG:0", corners=[[1.0]])
    assert len(found) == 3
    assert "EPSG:0" in found[0]
    assert "/no/such/file.gpkg does not exist" in found[1]
    assert "Corners" in found[2]
    assert len(problems(series(None, crs=None))) == 2


def test_what_is_no_vector_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "notes.txt"
    path.write_text("not a map")
    assert "vector file" in problems(path)[0]
    broken = tmp_path / "broken.parquet"
    broken.write_text("PAR1")
    assert "GeoParquet" in problems(broken)[0]
    assert "int" in problems(5)[0]


def test_corners_in_another_crs() -> None:
    land = series(box(500_000, 0))
    points = gpd.GeoSeries(shapely.points([(500_000, 0), (500_100, 80)]), crs=UTM)
    for corners in (points, points.to_crs(4326), [[500_000, 0], [500_100, 80]]):
        site = read_boundary(land, corners=corners)
        np.testing.assert_allclose(site.corners, [[0, 0], [100, 80]], atol=1e-5)
    (far,) = problems(land, corners=[[500_000, 0], [500_050, 40]])
    assert "Corner 2" in far


def test_hash_depends_on_the_land_alone() -> None:
    one = read_boundary(series(box(500_000, 0), box(500_500, 0)))
    other = read_boundary(
        gpd.GeoDataFrame(
            {"name": ["b", "a"]}, geometry=[box(500_500, 0).reverse(), box(500_000, 0)], crs=UTM
        )
    )
    assert one.input_sha256 == other.input_sha256
    assert one.input_sha256 != read_boundary(series(box(500_000, 0))).input_sha256
    assert all(a.equals_exact(b) for a, b in zip(one.parts, other.parts, strict=True))
