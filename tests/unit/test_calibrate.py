"""`calibrate`: hand-made blocks whose figures are known, and what people give that is wrong."""

from __future__ import annotations

import json
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pyogrio
import pytest
import shapely
from click.testing import CliRunner, Result

import urban_processing as up
from urban_processing.algorithms import get
from urban_processing.calibration.bounds import LEAST_SHARE, SLACK, bounds_of, statistics_of
from urban_processing.calibration.grouping import OUTSIDE, block_of_each, blocks_of
from urban_processing.calibration.layers import CALIBRATED_BLOCKS, OBSERVED_PARCELS
from urban_processing.cli.app import app
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.params.subdivide import per_block_parameters

CRS = "EPSG:32632"
X, Y = 500_000.0, 5_200_000.0
REAL = Path(__file__).resolve().parents[3] / "shared" / "data" / "test_only" / "parcels"


def box(*bounds: float) -> shapely.Polygon:
    return shapely.transform(shapely.box(*bounds), lambda xy: xy + np.array((X, Y)))


def row(widths: Sequence[float], depth: float, *, x: float = 0.0, y: float = 0.0) -> list[Any]:
    """Parcels side by side."""
    ends = np.append(0.0, np.cumsum(widths))
    return [box(x + a, y, x + b, y + depth) for a, b in pairwise(ends)]


WEST = [*row([20, 20, 20], 30), *row([12, 18, 30], 30, y=30)]
"""Areas 600, 600, 600, 360, 540, 900; widths 20, 20, 20, 12, 18, 30."""

FLAT = shapely.Polygon([(X, Y), (X + 9, Y), (X + 4, Y)])

EAST = row([25, 25], 40, x=80)


def frame(polygons: Sequence[Any], crs: Any = CRS, **columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=list(polygons), crs=crs)


def codes(found: up.GeoLayers) -> list[str]:
    return found.issues.code.tolist()


# ---- figures


def test_bounds_are_mean_and_standard_deviations() -> None:
    found = up.calibrate(frame([*WEST, *EAST]))
    west, east = found.blocks.to_dict("records")
    area = np.array([600, 600, 600, 360, 540, 900.0])
    width = np.array([20, 20, 20, 12, 18, 30.0])
    assert west["parcels"] == 6
    assert west["area_m2"] == pytest.approx(3600)
    assert west["area_mean_m2"] == pytest.approx(600)
    assert west["area_sd_m2"] == pytest.approx(area.std())
    assert west["width_mean_m"] == pytest.approx(20)
    assert west["width_sd_m"] == pytest.approx(width.std())
    assert west["min_area"] == pytest.approx(600 - 2 * area.std())
    assert west["max_area"] == pytest.approx(600 + 2 * area.std())
    assert west["min_width"] == pytest.approx(20 - 2 * width.std())
    assert west["max_width"] == pytest.approx(20 + 2 * width.std())
    # parcels that are all alike leave subdivision a tenth of the mean
    assert (east["area_sd_m2"], east["min_area"], east["max_area"]) == (
        pytest.approx(0, abs=1e-6),
        pytest.approx(900),
        pytest.approx(1100),
    )
    assert found.crs == CRS


def test_spread_is_the_number_of_standard_deviations() -> None:
    one, three = (up.calibrate(frame(WEST), spread=k).blocks.iloc[0] for k in (1.0, 3.0))
    sd = np.array([600, 600, 600, 360, 540, 900.0]).std()
    assert one.max_area - one.min_area == pytest.approx(2 * sd)
    assert three.max_area == pytest.approx(600 + 3 * sd)
    assert three.min_area == pytest.approx(LEAST_SHARE * 600)  # 600 - 3·sd would be 108


def test_parcels_have_their_block_and_width() -> None:
    own = frame([*WEST, *EAST], parcel_id=np.arange(8) + 40, owner=list("abcdefgh"))
    parcels = up.calibrate(own).parcels
    assert list(parcels.columns) == [*OBSERVED_PARCELS.column_names, "owner", "geometry"]
    by_id = parcels.set_index("parcel_id")
    assert by_id.block_id.to_dict() == {**dict.fromkeys(range(40, 46), 1), 46: 2, 47: 2}
    assert by_id.box_width_m[43] == pytest.approx(12)
    assert by_id.box_length_m[43] == pytest.approx(30)
    assert by_id.owner[45] == "f"
    without = up.calibrate(frame(WEST)).parcels  # counted as features, then
    assert sorted(without.parcel_id) == [1, 2, 3, 4, 5, 6]


def test_bounds_are_columns_that_subdivide_knows() -> None:
    names = {"min_area", "max_area", "min_width", "max_width"}
    assert names <= set(per_block_parameters())
    assert names <= set(CALIBRATED_BLOCKS.column_names)


def test_statistics_and_bounds_by_hand() -> None:
    made = statistics_of(np.array([1.0, 3.0, 10.0]), np.array([0, 0, 2]), 3)
    assert made.count.tolist() == [2, 0, 1]
    assert made.mean[[0, 2]].tolist() == [2.0, 10.0]
    assert made.deviation[[0, 2]].tolist() == [1.0, 0.0]
    assert np.isnan([made.mean[1], made.deviation[1]]).all()
    low, high = bounds_of(made, spread=2.0)
    assert low.tolist() == [0.5, 0.5, 9.0]  # 2 - 2·1 is no length: a quarter of the mean
    assert high.tolist() == [4.0, 4.0, 10.0 * (1 + SLACK)]


# ---- blocks


def test_blocks_are_the_union_of_parcels_that_share_sides() -> None:
    polygons = np.array([*WEST, *EAST], dtype=object)
    blocks, block = blocks_of(polygons, gap=0.0)
    assert block.tolist() == [0] * 6 + [1] * 2
    assert shapely.equals(blocks, [box(0, 0, 60, 60), box(80, 0, 130, 40)]).all()


def test_parcels_that_meet_at_a_corner_alone_are_of_two_blocks() -> None:
    polygons = np.array([box(0, 0, 20, 20), box(20, 20, 40, 40)], dtype=object)
    assert blocks_of(polygons, gap=0.1)[1].tolist() == [0, 1]


@pytest.mark.parametrize(("gap", "n"), [(0.1, 2), (0.5, 1)])
def test_gaps_up_to_the_widest_are_closed(gap: float, n: int) -> None:
    made = up.calibrate(frame([box(0, 0, 20, 30), box(20.3, 0, 40, 30)]), gap=gap)
    assert len(made.blocks) == n
    if n == 1:
        assert made.blocks.area_m2[0] == pytest.approx(40 * 30, rel=1e-6)


def test_sides_without_common_vertices_are_shared() -> None:
    parcels = [box(0, 0, 30, 20), box(0, 20, 17, 40), box(17, 20, 30, 40)]
    assert len(up.calibrate(frame(parcels)).blocks) == 1


def test_small_holes_are_filled_and_large_ones_stay() -> None:
    ring = row([20] * 5, 20) + row([20] * 5, 20, y=40)
    sides = [box(0, 20, 20, 40), box(80, 20, 100, 40)]
    inside = box(20, 20, 65, 40)  # leaves 15 x 20 m
    filled = up.calibrate(frame([*ring, *sides, inside])).blocks
    assert filled.area_m2.tolist() == [pytest.approx(6000)]
    left = up.calibrate(frame([*ring, *sides])).blocks  # leaves 60 x 20 m
    assert left.area_m2.tolist() == [pytest.approx(6000 - 1200)]
    assert len(left.geometry[0].interiors) == 1


def test_an_island_in_a_filled_hole_stays_a_block_of_its_own() -> None:
    ring = [*row([50, 50], 40), *row([50, 50], 40, y=60), *row([40], 20, y=40)]
    ring += row([45], 20, x=55, y=40)  # leaves 15 x 20 m
    found = up.calibrate(frame([*ring, box(43, 45, 52, 55)]))
    large, small = found.blocks.area_m2
    assert (large, small) == (pytest.approx(10_000 - 90), pytest.approx(90))
    assert len(up.subdivide(found).issues.query("code == 'overlaps_trimmed'")) == 0


def test_parcels_go_to_the_block_that_they_overlap_most() -> None:
    blocks = np.array([box(0, 0, 50, 50), box(60, 0, 110, 50)], dtype=object)
    parcels = np.array(
        [
            box(0, 0, 20, 20),
            box(30, 0, 70, 20),  # 20 m in the first, 10 in the second
            box(48, 0, 75, 20),  # 2 and 15 m
            box(49, 0, 70, 20),  # 1 and 10 of 21 m
            box(45, 0, 56, 20),  # 5 of 11 m
            box(200, 0, 220, 20),
        ],
        dtype=object,
    )
    assert block_of_each(parcels, blocks).tolist() == [0, 0, 1, 1, OUTSIDE, OUTSIDE]


def test_given_blocks_keep_numbers_and_columns() -> None:
    blocks = frame(
        [box(0, 0, 62, 61), box(78, 0, 132, 42)],
        block_id=[7, 3],
        strategy=["obb", None],
        min_area=[-5.0, None],  # worked out anew, whatever it was
        name=["west", "east"],
        parcels=[99, 99],
    )
    found = up.calibrate(frame([*WEST, *EAST]), blocks)
    assert found.blocks.block_id.tolist() == [3, 7]
    assert found.blocks.parcels.tolist() == [2, 6]
    assert found.blocks.name.tolist() == ["east", "west"]
    assert found.blocks.strategy[1] == "obb"
    assert found.blocks.min_area.min() > 100
    assert found.blocks.area_m2[1] == pytest.approx(62 * 61)
    made = up.subdivide(found)
    assert set(made.parcels.strategy[made.parcels.block_id == 7]) == {"obb"}
    assert set(made.parcels.strategy[made.parcels.block_id == 3]) == {"skeleton"}


def test_blocks_without_parcels_get_the_median_of_the_others() -> None:
    blocks = frame([box(0, 0, 60, 60), box(80, 0, 130, 40), box(200, 0, 260, 60)])
    found = up.calibrate(frame([*WEST, *EAST]), blocks)
    empty = found.blocks.iloc[2]
    assert empty.parcels == 0
    assert np.isnan([empty.area_mean_m2, empty.area_sd_m2, empty.width_mean_m]).all()
    for name in ("min_area", "max_area", "min_width", "max_width"):
        assert empty[name] == pytest.approx(found.blocks[name][:2].median())
    assert codes(found) == ["blocks_without_parcels"]
    assert len(up.subdivide(found).parcels.query("block_id == 3")) > 1


def test_what_does_not_count_is_listed_at_its_place() -> None:
    road, far, sliver = box(62, -100, 66, 200), box(300, 0, 320, 30), box(60, 0, 60.02, 30)
    blocks = frame([box(0, 0, 60, 60), box(80, 0, 130, 40)])
    found = up.calibrate(frame([*WEST, *EAST, road, far, sliver]), blocks)
    assert codes(found) == ["slivers", "parcel_thin", "parcel_outside"]
    thin, outside = (found.issues.iloc[k] for k in (1, 2))
    assert (thin.parcel_id, outside.parcel_id) == (9, 10)
    assert thin.geometry.within(road)
    assert thin.limit == pytest.approx(0.1)
    assert outside.geometry.within(far)
    assert found.blocks.parcels.tolist() == [6, 2]
    left_out = found.parcels[found.parcels.block_id.isna()]
    assert sorted(left_out.parcel_id) == [9, 10]
    kept = up.calibrate(frame([*WEST, road]), least_compactness=0)
    assert kept.blocks.parcels.tolist() == [6, 1]


def test_a_road_between_blocks_does_not_join_them() -> None:
    road = box(60, -100, 80, 500)
    found = up.calibrate(frame([*WEST, *EAST, road]), least_compactness=0.11)
    assert found.blocks.parcels.tolist() == [6, 2]


# ---- round trips


def test_equal_parcels_come_back_as_they_were() -> None:
    parcels = [*row([20] * 6, 30), *row([20] * 6, 30, y=30), *row([15] * 8, 40, x=200)]
    parcels += row([15] * 8, 40, x=200, y=40)
    found = up.calibrate(frame(parcels))
    made = up.subdivide(found, irregularity=0)
    assert len(made.parcels) == len(parcels)
    assert made.parcels.area_m2.tolist() == pytest.approx([600.0] * 28)
    assert len(made.issues) == 0
    again = up.calibrate(made)
    for name in ("parcels", "area_mean_m2", "width_mean_m", "min_area", "max_width"):
        assert again.blocks[name].tolist() == pytest.approx(found.blocks[name].tolist())


@pytest.mark.parametrize("strategy", ["skeleton", "obb", "hybrid", "streamline"])
def test_a_block_with_one_parcel_stays_whole(strategy: str) -> None:
    found = up.calibrate(frame([box(0, 0, 50, 70), shapely.buffer(box(100, 0, 101, 60), 30)]))
    made = up.subdivide(found, strategy=strategy)
    assert made.blocks.parcels.tolist() == [1, 1]
    assert len(made.issues) == 0


@pytest.mark.parametrize("strategy", ["skeleton", "obb"])
def test_statistics_come_back_nearly(strategy: str) -> None:
    rng = np.random.default_rng(5)
    parcels: list[Any] = []
    for k in range(12):
        for y in (0.0, 32.0):
            widths = rng.normal(18 + k, 0.2 * (18 + k), 8).clip(9)
            parcels += row(widths / widths.sum() * 8 * (18 + k), 32, x=400 * k, y=y)
    found = up.calibrate(frame(parcels))
    again = up.calibrate(up.subdivide(found, strategy=strategy))
    assert again.blocks.parcels.sum() == pytest.approx(found.blocks.parcels.sum(), rel=0.12)
    for name in ("area_mean_m2", "width_mean_m"):
        assert np.corrcoef(again.blocks[name], found.blocks[name])[0, 1] > 0.9
        assert again.blocks[name].mean() == pytest.approx(found.blocks[name].mean(), rel=0.12)


@pytest.mark.skipif(not REAL.is_dir(), reason="no real parcels here")
def test_a_real_town_comes_back_with_about_as_many_parcels() -> None:
    found = up.calibrate(REAL / "philadelphia_fishtown_us.gpkg")
    seen = found.parcels[found.parcels.block_id.notna()]
    assert len(seen) == 5729
    assert codes(found).count("parcel_thin") < 50
    assert (found.blocks.min_area < found.blocks.max_area).all()
    assert (found.blocks.min_width < found.blocks.max_width).all()
    made = up.subdivide(found, strategy="obb").parcels
    assert len(made) == pytest.approx(len(seen), rel=0.05)
    assert made.area_m2.median() == pytest.approx(seen.area_m2.median(), rel=0.1)


# ---- CRS and bad input


def test_blocks_are_brought_into_the_crs_of_the_parcels() -> None:
    blocks = frame([box(0, 0, 60, 60)]).to_crs(4326)
    found = up.calibrate(frame(WEST), blocks)
    assert found.crs == CRS
    assert found.blocks.parcels.tolist() == [6]
    assert found.blocks.area_m2[0] == pytest.approx(3600, rel=1e-5)
    said = found.issues.message[0]
    assert said.startswith("The blocks were reprojected from WGS 84 (EPSG:4326) to WGS 84 / UTM")


def test_parcels_in_degrees_are_measured_in_metres() -> None:
    found = up.calibrate(frame(WEST).to_crs(4326))
    assert found.crs == CRS
    assert found.blocks.area_mean_m2[0] == pytest.approx(600, rel=1e-3)
    assert codes(found) == ["crs_changed"]


def test_a_layer_without_crs_is_in_that_of_the_other() -> None:
    blocks = [box(0, 0, 60, 60)]
    for parcels, around in (
        (frame(WEST, crs=None), frame(blocks)),
        (frame(WEST), frame(blocks, crs=None)),
        (WEST, frame(blocks)),
        (frame(WEST), blocks),
    ):
        found = up.calibrate(parcels, around)
        assert (found.crs, found.blocks.parcels.tolist()) == (CRS, [6])
        assert set(codes(found)) <= {"crs_missing"}
    with pytest.raises(BoundaryError, match="has no CRS"):
        up.calibrate(frame(WEST, crs=None))


def test_layers_of_two_places_are_refused() -> None:
    with pytest.raises(BoundaryError, match=r"No parcel lies in a block.*Check the CRS of both"):
        up.calibrate(frame(WEST), frame([box(5000, 0, 5060, 60)]))


def test_what_is_no_parcel_is_refused() -> None:
    line = frame([WEST[0].exterior])
    with pytest.raises(BoundaryError, match=r"no polygon\. Observed parcels must be polygons"):
        up.calibrate(line)
    with pytest.raises(BoundaryError, match="no features"):
        up.calibrate(frame(WEST).iloc[:0])
    with pytest.raises(BoundaryError, match="have no area"):
        up.calibrate(frame([FLAT]))
    with pytest.raises(BoundaryError, match="have no area"):
        up.calibrate(frame(WEST), frame([FLAT]))
    with pytest.raises(BoundaryError, match="No parcel is as large as 1 m²"):
        up.calibrate(frame([box(0, 0, 0.5, 0.5)]))
    with pytest.raises(BoundaryError, match=r"as compact as least-compactness asks \(0.9\)"):
        up.calibrate(frame(WEST), least_compactness=0.9)


def test_all_mistakes_are_told_together() -> None:
    with pytest.raises(UrbanError) as error:
        up.calibrate("none.gpkg", "nothing.gpkg", spread=-1, gapp=2)
    said = str(error.value)
    for words in ("none.gpkg", "nothing.gpkg", "spread must be at least 0", "Did you mean gap?"):
        assert words in said
    with pytest.raises(ParameterError, match="gap must be at most 20"):
        up.calibrate(frame(WEST), gap=50)


def test_columns_of_blocks_that_are_wrong_name_their_rows() -> None:
    blocks = frame([box(0, 0, 60, 60)], strategy=["squares"])
    with pytest.raises(BoundaryError, match="Column strategy must be one of"):
        up.calibrate(frame(WEST), blocks)
    overlapping = frame([box(0, 0, 60, 60), box(30, 0, 90, 60)])
    with pytest.raises(BoundaryError, match="Blocks must not overlap"):
        up.calibrate(frame(WEST), overlapping)


def test_what_is_odd_is_repaired_and_said() -> None:
    corners = shapely.get_coordinates(box(0, 0, 20, 30)).tolist()
    spike = [(X + 20, Y), (X + 20.5, Y + 0.2), (X + 20, Y)]
    folded = shapely.Polygon([*corners, *spike])
    parts = shapely.MultiPolygon([WEST[2], EAST[0]])
    inner = box(2, 2, 10, 10)
    found = up.calibrate(frame([folded, WEST[1], parts, WEST[1], inner]))
    assert sorted(codes(found)) == [
        "parcels_of_parts",
        "parcels_overlap",
        "parcels_twice",
        "ring_repaired",
    ]
    assert found.parcels.parcel_id.value_counts()[3] == 2
    assert len(found.parcels) == 5


# ---- files


def run(*arguments: object) -> Result:
    return CliRunner().invoke(app, [*map(str, arguments)])


def test_from_file_to_file_to_parcels(tmp_path: Path) -> None:
    source, blocks, parcels = (tmp_path / f"{n}.gpkg" for n in ("plots", "blocks", "parcels"))
    frame([*WEST, *EAST], use=["lot"] * 7 + ["road"]).to_file(source)
    result = run("calibrate", source, "-o", blocks, "--plot", tmp_path / "map.png", "--export",
                 tmp_path / "plain", "--where", "use <> 'road'", "--spread", 1.5)  # fmt: skip
    assert result.exit_code == 0, result.output
    assert "2, 0 without parcels" in result.output
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    assert {p.name for p in (tmp_path / "plain").iterdir()} >= {"blocks.geojson", "parcels.geojson"}
    names = pyogrio.list_layers(blocks)[:, 0].tolist()
    assert {"blocks", "parcels", "issues", "provenance"} <= set(names)
    written = gpd.read_file(blocks, layer="provenance")
    assert json.loads(written.parameters[0])["spread"] == 1.5
    assert gpd.read_file(blocks, layer="blocks").parcels.tolist() == [6, 1]
    result = run("subdivide", blocks, "-o", parcels)
    assert result.exit_code == 0, result.output
    # of a file of both, the blocks are taken with the parcels
    again = up.calibrate(parcels)
    assert again.blocks.block_id.tolist() == [1, 2]
    assert again.blocks.area_m2.tolist() == pytest.approx([3600, 1000])


def test_calls_that_are_wrong(tmp_path: Path) -> None:
    source = tmp_path / "plots.gpkg"
    frame(WEST).to_file(source)
    result = run("calibrate", "-o", tmp_path / "a.gpkg", "--spread", "many")
    assert result.exit_code == 2
    assert "Give PARCELS, a file with polygons of parcels." in result.output
    assert "spread must be a number" in result.output
    result = run("calibrate", source, "-o", source, "--overwrite", "--blocks", tmp_path / "b.gpkg")
    assert result.exit_code == 2
    assert "would replace the input" in result.output
    assert "b.gpkg does not exist" in result.output


def test_it_is_declared_once() -> None:
    spec = get("calibrate")
    assert [item.name for item in spec.inputs] == ["parcels", "blocks"]
    assert [layer.name for layer in spec.outputs[0].layers] == [
        "blocks", "parcels", "issues", "provenance",
    ]  # fmt: skip
    page = Path(__file__).resolve().parents[2] / "docs" / "calibrate.md"
    assert "spread" in page.read_text(encoding="utf-8")
