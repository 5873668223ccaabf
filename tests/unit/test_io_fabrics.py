"""Fabrics out of files and frames: what is taken for what, and what is said of bad input."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pytest
import shapely
from shapely import LineString, Point, Polygon, box

import urban_processing as up
from tests.unit.real_parcels import bubenec
from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import Fabric
from urban_processing.io.fabrics import read_fabric
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.params.measure import MeasureParams

UTM = "EPSG:32633"
ORIGIN = (450_000.0, 5_500_000.0)


def at(geometries: list[Any], crs: str | None = UTM, **columns: Any) -> gpd.GeoDataFrame:
    moved = [shapely.transform(g, lambda xy: xy + ORIGIN) for g in geometries]
    return gpd.GeoDataFrame(columns, geometry=moved, crs=crs)


LOTS = [box(x, y, x + 20, y + 30) for x in range(0, 100, 20) for y in (-36, 6)]
STREET = [LineString([(-30, 0), (130, 0)])]
LAND = [box(-10, -60, 110, 60)]


def codes(fabric: Fabric) -> set[str]:
    return {issue.code for issue in fabric.issues}


def values(fabric: Fabric) -> Any:
    return FabricMeasures(fabric).values


@cache
def made() -> Any:
    return up.cogenerate(
        shapely.transform(box(0, 0, 300, 200), lambda xy: xy + ORIGIN), crs=UTM, min_area=1200
    )


def file_of(path: Path, **layers: gpd.GeoDataFrame) -> Path:
    for name, frame in layers.items():
        frame.to_file(path, layer=name)
    return path


# what is taken for what


def test_a_layout_its_file_and_its_object_are_one_fabric(tmp_path: Path) -> None:
    layout = made()
    file = layout.save(tmp_path / "town.gpkg")
    given = [read_fabric(layout), read_fabric(layout.layout), read_fabric(file)]
    assert len({values(each)["junction_deviation_deg"] for each in given}) == 1
    assert given[-1].name == "town"
    assert read_fabric(given[0]) is given[0] or read_fabric(given[0]).land is given[0].land


def test_layers_of_a_layout_file_may_be_named(tmp_path: Path) -> None:
    file = made().save(tmp_path / "town.gpkg")
    fabric = read_fabric(
        parcels=f"{file}|layername=parcels",
        streets=f"{file}|layername=streets",
        land=f"{file}|layername=boundary",
    )
    known = values(read_fabric(file))
    for name in ("parcels", "blocks", "frontage_mean_m", "streets", "area_m2"):
        assert values(fabric)[name] == pytest.approx(known[name], rel=1e-4), name


def test_a_file_of_two_layers_needs_no_names(tmp_path: Path) -> None:
    path = file_of(tmp_path / "plan.gpkg", plots=at(LOTS), axes=at(STREET))
    fabric = read_fabric(path)
    assert values(fabric)["frontage_mean_m"] == pytest.approx(20)
    assert fabric.name == "plan"
    assert fabric.frame.crs == UTM


def test_layers_named_parcels_and_streets_are_taken_among_others(tmp_path: Path) -> None:
    path = file_of(
        tmp_path / "plan.gpkg",
        buildings=at([box(3, 10, 9, 20)]),
        parcels=at(LOTS),
        pipes=at([LineString([(0, 9), (50, 9)])]),
        streets=at(STREET),
    )
    assert values(read_fabric(path))["parcels"] == 10


def test_a_file_of_several_layers_asks_for_their_names(tmp_path: Path) -> None:
    path = file_of(
        tmp_path / "plan.gpkg",
        plots=at(LOTS),
        buildings=at([box(3, 10, 9, 20)]),
        axes=at(STREET),
        pipes=at(STREET),
    )
    with pytest.raises(BoundaryError) as caught:
        read_fabric(path)
    told = "\n".join(caught.value.problems)
    assert "several layers of polygons: plots, buildings" in told
    assert "several layers of lines: axes, pipes" in told
    assert f"parcels (--parcel-layer) as {path}|layername=NAME" in told
    fabric = read_fabric(path, parcels=f"{path}|layername=plots", streets=f"{path}|layername=axes")
    assert values(fabric)["parcels"] == 10


def test_a_single_layer_by_its_name_is_to_be_called_what_it_is(tmp_path: Path) -> None:
    path = file_of(tmp_path / "plan.gpkg", plots=at(LOTS))
    with pytest.raises(
        BoundaryError, match=r"is one layer: give it as parcels \(--parcel-layer\) or as streets"
    ):
        read_fabric(f"{path}|layername=plots")


def test_a_file_without_polygons_and_lines_says_what_it_has(tmp_path: Path) -> None:
    path = file_of(tmp_path / "trees.gpkg", trees=at([Point(0, 0)]))
    with pytest.raises(BoundaryError, match="neither polygons nor lines; its layers are trees"):
        read_fabric(path)


def test_frames_are_parcels_or_streets_by_their_geometry() -> None:
    assert values(read_fabric(at(LOTS)))["parcels"] == 10
    crossing = [*STREET, LineString([(20, -80), (20, 80)])]
    assert values(read_fabric(at(crossing)))["streets"] == 2
    assert values(read_fabric(at(LOTS), streets=at(STREET)))["unreached"] == 0


def test_a_subdivision_has_parcels_and_streets_are_given_besides(tmp_path: Path) -> None:
    ring = at([LineString([(0, 0), (120, 0), (120, 80), (0, 80), (0, 0)])])
    blocks = up.find_blocks(ring, default_width=10)
    parcels = up.subdivide(blocks, min_area=400)
    file = parcels.save(tmp_path / "parcels.gpkg")
    for source in (parcels, file):
        alone = read_fabric(source)
        assert "no_streets_given" in codes(alone)
        assert values(alone)["parcels"] == len(parcels.parcels)
        around = read_fabric(source, streets=ring)
        assert values(around)["unreached"] == 0
        assert values(around)["area_m2"] == pytest.approx(120 * 80, rel=1e-4)
    with pytest.raises(BoundaryError, match="neither parcels nor streets in"):
        read_fabric(blocks.save(tmp_path / "blocks.gpkg"))


def test_what_was_measured_is_measured_again(tmp_path: Path) -> None:
    measured = up.measure(parcels=at(LOTS), streets=at(STREET))
    again = up.measure(measured.save(tmp_path / "measured.gpkg"))
    for name in ("parcels", "unreached", "area_m2", "frontage_mean_m", "blocks"):
        assert again.metric(name) == pytest.approx(measured.metric(name), rel=1e-6), name
    assert up.measure(measured).metric("parcels") == 10


def test_columns_number_parcels_and_say_their_use() -> None:
    uses = ["park" if i == 3 else None if i == 4 else "housing" for i in range(10)]
    parcels = at(LOTS, parcel_id=np.arange(90, 100), landuse=uses)
    fabric = read_fabric(parcels, streets=at(STREET))
    assert fabric.parcels is not None
    assert fabric.parcels.parcel_id.tolist() == list(range(90, 100))
    assert fabric.parcels.land_use.tolist()[3:6] == ["park", "parcel", "housing"]
    assert values(fabric)["land_use_parks_pct"] == pytest.approx(100 / 12)


def test_parcels_there_twice_count_once_and_those_of_pieces_piece_by_piece() -> None:
    apart = shapely.MultiPolygon([box(0, 6, 20, 36), box(40, 6, 60, 36), box(70, 6, 70.5, 7)])
    fabric = read_fabric(at([apart, LOTS[2], LOTS[2]]), streets=at(STREET))
    assert {"parcels_twice", "parcels_of_parts", "tiny_parcels"} <= codes(fabric)
    assert values(fabric)["parcels"] == 3


def test_numbers_that_are_not_unique_are_told_of() -> None:
    fabric = read_fabric(at(LOTS, parcel_id=[7] * 10), streets=at(STREET))
    assert fabric.parcels is not None
    assert "parcel_id_ignored" in codes(fabric)
    assert fabric.parcels.parcel_id.tolist() == list(range(1, 11))


# CRS


def test_streets_in_another_crs_are_reprojected_and_that_is_said() -> None:
    same = read_fabric(at(LOTS), streets=at(STREET))
    other = read_fabric(at(LOTS), streets=at(STREET).to_crs("EPSG:4326"))
    told = [issue.message for issue in other.issues if issue.code == "layer_reprojected"]
    assert len(told) == 1
    assert told[0].startswith("The streets are in WGS 84 (EPSG:4326), not in the CRS of the parc")
    assert values(other)["frontage_mean_m"] == pytest.approx(values(same)["frontage_mean_m"])
    assert "layer_reprojected" not in codes(same)


def test_degrees_are_measured_in_metres() -> None:
    fabric = read_fabric(
        at(LOTS).to_crs("EPSG:4326"), streets=at(STREET).to_crs("EPSG:4326"),
        land=at(LAND).to_crs("EPSG:3857"),
    )  # fmt: skip
    assert values(fabric)["area_mean_m2"] == pytest.approx(600, rel=2e-3)
    assert fabric.frame.crs == UTM


@pytest.mark.parametrize("what", ["parcels", "streets"])
def test_a_layer_without_crs_has_that_of_the_land_and_that_is_said(what: str) -> None:
    layers = {"parcels": at(LOTS), "streets": at(STREET), "land": at(LAND)}
    layers[what] = layers[what].set_crs(None, allow_override=True)
    fabric = read_fabric(**layers)
    told = [issue.message for issue in fabric.issues if issue.code == "crs_assumed"]
    assert told == [f"The {what} have no CRS: that of the land, WGS 84 / UTM zone 33N ({UTM}), was "
                    "taken for it."]  # fmt: skip
    assert values(fabric)["unreached"] == 0


def test_a_crs_that_only_the_streets_have_is_asked_for() -> None:
    with pytest.raises(BoundaryError, match="has no CRS"):
        read_fabric(at(LOTS, crs=None), streets=at(STREET))
    given = read_fabric(at(LOTS, crs=None), streets=at(STREET), crs=UTM)
    assert values(given)["unreached"] == 0
    bare = [shapely.transform(g, lambda xy: xy + ORIGIN) for g in LOTS]
    with pytest.raises(BoundaryError, match="but the parcels have none"):
        read_fabric(parcels=bare, streets=at(STREET))


def test_layers_of_different_places_say_where_each_is() -> None:
    away = at(STREET).translate(5_000, 0)
    with pytest.raises(BoundaryError) as caught:
        read_fabric(at(LOTS), streets=away)
    told = str(caught.value)
    assert "The parcels and the streets do not overlap" in told
    assert "x 450000 to 450100" in told
    assert "x 454970 to 455130" in told
    assert UTM in told


# bad input, each with its sentence


@pytest.mark.parametrize(
    ("layers", "sentence"),
    [
        ({}, "Give parcels, streets, or both."),
        ({"parcels": STREET}, "Parcels: The geometry holds 1 line, but no polygon"),
        ({"parcels": LOTS, "streets": LOTS}, "Streets must be lines; The geometry has Polygon"),
        ({"parcels": [], "streets": STREET}, "Parcels: The geometry has no features"),
        ({"parcels": LOTS, "streets": []}, "Streets: The geometry has no lines"),
        ({"parcels": LOTS, "streets": STREET, "land": STREET}, "holds 1 line, but no polygon"),
        ({"parcels": LOTS, "streets": STREET, "land": [box(0, 0, 40, 1)]}, "No parcel lies in"),
        ({"streets": STREET, "land": [box(0, 20, 40, 60)]}, "No street enters the land"),
        ({"streets": STREET}, "The streets have no extent"),
        ({"parcels": [Polygon([(0, 0), (9, 9), (9, 0), (0, 9)])]}, "bow-tie"),
        ({"parcels": [box(0, 0, 0.1, 0.1)]}, "its polygons have no area"),
        ({"parcels": "no/such/file.gpkg"}, "Parcels: The file no/such/file.gpkg does not exist."),
        ({"source": "no/such/file.gpkg"}, "The file no/such/file.gpkg does not exist."),
        ({"source": object()}, "object is nothing that can be read"),
        ({"parcels": LOTS, "crs": "EPSG:99999999"}, "CRS 'EPSG:99999999' is not known"),
    ],
)
def test_bad_input_is_told_in_a_sentence(layers: dict[str, Any], sentence: str) -> None:
    with pytest.raises(BoundaryError) as caught:
        read_fabric(**layers)
    assert sentence in "\n".join(caught.value.problems)


def test_all_that_is_wrong_is_told_together(tmp_path: Path) -> None:
    with pytest.raises(BoundaryError) as caught:
        read_fabric(parcels=tmp_path / "a.gpkg", streets=tmp_path / "b.gpkg", crs="nonsense")
    assert len(caught.value.problems) == 3


def test_a_layout_takes_no_other_layers() -> None:
    with pytest.raises(BoundaryError, match="A layout is ready as it is: leave out streets, crs"):
        read_fabric(made(), streets=STREET, crs=UTM)


def test_a_land_that_no_street_enters_is_an_issue_of_parcels() -> None:
    fabric = read_fabric(at([LOTS[1]]), streets=at(STREET), land=at([box(-5, 20, 25, 40)]))
    assert "no_street_enters" in codes(fabric)


def test_reach_and_widths_are_parameters() -> None:
    far = at([box(x, 106, x + 20, 136) for x in range(0, 100, 20)])
    street = at([LineString([(-30, 88), (130, 88)])])
    land = at([box(-10, 50, 110, 150)])
    for reach, width, unreached in ((10, 12, 5), (20, 12, 0), (10, 30, 0)):
        params = MeasureParams(street_reach=reach, default_width=width)
        fabric = read_fabric(far, streets=street, land=land, params=params)
        assert values(fabric)["unreached"] == unreached


def test_bubenec_has_the_figures_that_its_map_shows() -> None:
    path = bubenec()
    fabric = read_fabric(path, parcels=f"{path}|layername=plots")
    assert {"crs_changed", "land_assumed", "width_assumed"} <= codes(fabric)
    found = values(fabric)
    # half of the plots are courtyards and the buildings in them
    assert (found["parcels"], found["blocks"]) == (406, 13)
    assert 180 < found["unreached"] < 230
    assert found["intersections"] == 14
    total = sum(found[f"land_use_{use}_pct"] for use in ("streets", "parcels", "parks", "other"))
    assert total == pytest.approx(100, abs=0.1)
    turned = read_fabric(path, parcels=f"{path}|layername=plots", crs="EPSG:5514")
    assert values(turned)["unreached"] == pytest.approx(found["unreached"], abs=2)
    assert values(turned)["frontage_mean_m"] == pytest.approx(found["frontage_mean_m"], rel=0.01)
