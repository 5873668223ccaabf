"""Streets and blocks out of files and frames, and all that may be wrong with them."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely
from networks import CITIES, network_file

import urban_processing as up
from urban_processing.blocks.model import UNKNOWN_STREET, Blocks
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.intake.projection import Projection
from urban_processing.io.blocks import read_blocks, read_streets
from urban_processing.io.crs import PYPROJ
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.street_rules import CLASS_WIDTHS, LANE_WIDTH, VERGES

UTM = "EPSG:32630"
X, Y = 500_000.0, 5_700_000.0


def box(west: float, south: float, east: float, north: float) -> shapely.Polygon:
    return shapely.box(X + west, Y + south, X + east, Y + north)


def line(*places: tuple[float, float]) -> shapely.LineString:
    return shapely.LineString([(X + x, Y + y) for x, y in places])


def frame(geometry: list[Any], crs: str | None = UTM, **columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=geometry, crs=crs)


TWO = [box(0, 0, 80, 50), box(80, 0, 160, 50)]


def problems_of(source: Any, **options: Any) -> str:
    with pytest.raises(BoundaryError) as error:
        read_blocks(source, **options)
    return str(error.value)


def told(blocks: Blocks) -> dict[str, float | None]:
    return {issue.code: issue.value for issue in blocks.issues}


# ---- streets


def widths(**columns: Any) -> tuple[list[float], list[float]]:
    n = max(len(values) for values in columns.values())
    lines = [line((0, 10 * k), (100, 10 * k)) for k in range(n)]
    streets = read_streets(frame(lines, **columns)).streets
    return streets.width.tolist(), streets.least_width.tolist()


def test_widths_of_a_plan_are_those_of_the_right_of_way() -> None:
    assert widths(width_m=[12.5, 8.0])[0] == [12.5, 8.0]
    assert widths(width=["12 m", "8,5"])[0] == [12, 8.5]


@pytest.mark.parametrize(
    ("value", "metres"),
    [
        ("7", 7), ("7.5 m", 7.5), ("['6', '8.5']", 8.5), (["6", "9"], 9), ("6;7", 7), (6, 6),
        ("20'", 20 * 0.3048), ("20 ft", 20 * 0.3048), (np.float64(5), 5),
    ],
)  # fmt: skip
def test_widths_of_openstreetmap_are_those_of_carriageways(value: Any, metres: float) -> None:
    given = widths(highway=["residential"], width=pd.Series([value], dtype=object))
    assert given[0] == [pytest.approx(metres + VERGES)]


@pytest.mark.parametrize("value", [None, "", math.nan, "narrow", "[]", True])
def test_widths_that_are_no_numbers_count_as_not_given(value: Any) -> None:
    lines = frame([line((0, 0), (9, 0))], width=pd.Series([value], dtype=object))
    streets = read_streets(lines).streets
    assert np.isnan(streets.width).all()
    assert [i.code for i in streets.issues] == ["width_ignored"] * (value in ("narrow", True))


def test_lanes_widen_a_class_but_do_not_narrow_it() -> None:
    found = up.find_blocks(
        frame([box(0, 0, 200, 200).exterior], highway=["residential"], lanes=["['2', '6']"])
    )
    assert set(found.block_edges.width_m) == {6 * LANE_WIDTH + VERGES}
    found = up.find_blocks(frame([box(0, 0, 200, 200).exterior], highway=["primary"], lanes=["1"]))
    assert set(found.block_edges.width_m) == {CLASS_WIDTHS["primary"]}


@pytest.mark.parametrize("value", [-3.0, 0.0, "-3 m", math.inf])
def test_widths_not_above_zero_name_their_rows(value: Any) -> None:
    lines = [line((0, 10 * k), (100, 10 * k)) for k in range(3)]
    values = pd.Series([8, value, value], dtype=object)
    with pytest.raises(BoundaryError, match=r"Column width_m .* above 0: row 2, 3"):
        read_streets(frame(lines, width_m=values))


def test_classes_names_and_bridges_are_read() -> None:
    lines = [line((0, 10 * k), (100, 10 * k)) for k in range(4)]
    streets = read_streets(
        frame(
            lines,
            highway=["residential", "['service', 'tertiary']", None, "steps"],
            name=["A", "['B', 'C']", None, math.nan],
            bridge=["yes", "no", None, None],
            tunnel=[None, None, math.nan, "building_passage"],
            access=["private", "yes", None, "no"],
        )
    ).streets
    assert streets.street_class.tolist() == ["residential", "tertiary", "", "steps"]
    assert streets.name.tolist() == ["A", "B", "", ""]
    assert streets.off_ground.tolist() == [True, False, False, True]


def test_streets_must_be_lines_with_a_crs() -> None:
    with pytest.raises(BoundaryError, match="Streets must be lines"):
        read_streets(frame(TWO))
    with pytest.raises(BoundaryError, match="has no CRS"):
        read_streets(frame([line((0, 0), (9, 0))], crs=None))
    with np.errstate(invalid="ignore"):
        lines = frame([shapely.LineString([(0, 0), (math.nan, 3)])])
    with pytest.raises(BoundaryError, match="not finite"):
        read_streets(lines)


OSM = {"railway": [None, None, "rail", None, None]}


def of_osm(**columns: Any) -> gpd.GeoDataFrame:
    """A square of streets, and a line across without a highway."""
    square = [line(a, b) for a, b in zip(CORNERS, [*CORNERS[1:], CORNERS[0]], strict=True)]
    across = line((0, 50), (100, 50))
    return frame([*square[:2], across, *square[2:]], **columns)


CORNERS = [(0, 0), (100, 0), (100, 100), (0, 100)]
HIGHWAYS = ["residential", "service", None, "primary", "residential"]


@pytest.mark.parametrize("empty", [None, math.nan, ""])
def test_lines_without_a_highway_among_all_of_openstreetmap_are_no_streets(empty: Any) -> None:
    values = [empty if value is None else value for value in HIGHWAYS]
    found = up.find_blocks(of_osm(highway=pd.Series(values, dtype=object), **OSM))
    assert len(found.blocks) == 1
    (issue,) = found.issues.itertuples()
    assert (issue.code, issue.value) == ("no_highway", 1)
    assert "1 line(s) of The frame have no highway" in issue.message


@pytest.mark.parametrize(
    "columns",
    [
        {"highway": HIGHWAYS},
        {"highway": [None] * 5, **OSM},
        {"highway": HIGHWAYS, "width_m": [None, None, 8.0, None, None], **OSM},
        {"highway": HIGHWAYS, "class": ["", "", "local", "", ""], **OSM},
        OSM,
    ],
    ids=["merged network", "no highway at all", "own width", "own class", "no column"],
)
def test_lines_without_a_highway_may_be_streets(columns: dict[str, Any]) -> None:
    found = up.find_blocks(of_osm(**columns))
    assert len(found.blocks) == 2
    assert "no_highway" not in found.issues.code.tolist()


def test_lines_that_are_no_streets_are_none_beside_blocks_either() -> None:
    lines = of_osm(highway=HIGHWAYS, **OSM)
    blocks = read_blocks(frame([box(5, 5, 95, 49), box(5, 51, 95, 95)]), streets=lines)
    assert told(blocks)["no_highway"] == 1
    rings = blocks.rings
    beside = np.abs((rings.xy + rings.xy[rings.following])[:, 1] / 2 + blocks.frame.origin[1] - Y)
    inner = (beside > 48) & (beside < 52)
    assert inner.sum() == 2
    assert np.isnan(blocks.edge_width[inner]).all()


def test_lines_without_length_in_degrees_are_dropped() -> None:
    ring = shapely.LineString([(7.0, 50.0), (7.002, 50.0), (7.002, 50.001), (7.0, 50.001), (7, 50)])
    point = shapely.LineString([(7.001, 50.0005)] * 2)
    for lines in ([ring, point], [shapely.MultiLineString([ring, point])]):
        found = up.find_blocks(frame(lines, "EPSG:4326"))
        assert len(found.blocks) == 1
        told = found.issues.set_index("code").value
        assert told["tiny_lines"] == 1


def test_wide_lines_in_degrees_may_have_members_without_length() -> None:
    long = shapely.LineString([(7.0, 50.0), (8.0, 50.0)])
    several = shapely.MultiLineString([long, [(7.5, 50.1)] * 2])
    projection = Projection(PYPROJ.from_text("EPSG:4326"), PYPROJ.from_text(UTM), PYPROJ)
    alone, among = projection.geometries(np.array([long, several], dtype=object))
    assert len(alone.coords) == 5
    assert among.equals(alone)


def test_streets_in_degrees_become_metric() -> None:
    lines = frame([box(0, 0, 200, 100).exterior]).to_crs("EPSG:4326")
    found = up.find_blocks(lines, default_width=10)
    assert found.crs == UTM
    assert found.blocks.area_m2.tolist() == [pytest.approx(190 * 90, abs=0.5)]
    assert "crs_changed" in found.issues.code.tolist()


def test_blocks_are_cut_at_land_in_another_crs() -> None:
    land = frame([box(0, 0, 200, 100)]).to_crs("EPSG:4326")
    streets = frame([line((100, -50), (100, 150)), line((-50, 0), (250, 0))], width_m=[10.0, 8.0])
    found = up.find_blocks(streets, land=land)
    assert found.blocks.area_m2.tolist() == [pytest.approx(95 * 96, abs=1)] * 2
    assert found.blocks.frontage_m.tolist() == [pytest.approx(95 + 96, abs=1)] * 2
    edges = found.block_edges
    assert sorted(edges.width_m[edges.access].tolist()) == [8, 8, 10, 10]
    assert edges.width_m[~edges.access].isna().all()
    assert edges.street_id[~edges.access].isna().all()


def test_mistakes_in_streets_and_parameters_come_together() -> None:
    with pytest.raises(UrbanError) as error:
        up.find_blocks(frame(TWO), min_width=-1, colour="red")
    assert len(error.value.problems) == 3
    with pytest.raises(ParameterError):
        up.find_blocks(frame([box(0, 0, 90, 90).exterior]), default_width=0)


def test_what_blocks_write_is_what_blocks_are_read_from(tmp_path: Path) -> None:
    lines = [box(0, 0, 300, 100).exterior, line((100, 0), (100, 100)), line((200, 0), (200, 100))]
    found = up.find_blocks(
        frame(lines, width_m=[16.0, 10.0, 8.0]), land=frame([box(-40, -30, 300, 90)])
    )
    path = found.save(tmp_path / "blocks.gpkg")
    again = read_blocks(path)
    made = found.blocks
    assert again.block_id.tolist() == made.block_id.tolist()
    length = np.hypot(*(again.rings.xy[again.rings.following] - again.rings.xy).T)
    for k, block in enumerate(again.block_id.tolist()):
        own = again.rings.edge_block == k
        edges = found.block_edges[found.block_edges.block_id == block]
        for width in {*edges.width_m.dropna(), 16.0}:
            at = own & (again.edge_width == width)
            assert length[at].sum() == pytest.approx(edges.length_m[edges.width_m == width].sum())
        assert length[own & again.edge_access].sum() == pytest.approx(
            edges.length_m[edges.access].sum()
        )
        assert set(again.edge_street[own & again.edge_access]) == set(edges.street_id.dropna())


# ---- blocks


def test_a_plain_layer_of_blocks() -> None:
    blocks = read_blocks(frame(TWO))
    assert blocks.block_id.tolist() == [1, 2]
    assert blocks.frame.crs == UTM
    assert blocks.frame.origin == (X, Y)
    assert blocks.edge_access.all()
    assert np.isnan(blocks.edge_width).all()
    assert blocks.columns == {}
    assert shapely.area(blocks.polygons).tolist() == [4000, 4000]


def test_neither_order_nor_start_of_blocks_matters() -> None:
    turned = shapely.Polygon(np.roll(np.array(TWO[0].exterior.coords)[:-1], 2, axis=0))
    a, b = read_blocks(frame(TWO)), read_blocks(frame([TWO[1], turned]))
    assert shapely.to_wkb(a.polygons).tolist() == shapely.to_wkb(b.polygons).tolist()
    assert a.input_sha256 != ""


def test_numbers_of_blocks_are_kept_and_sort_them() -> None:
    blocks = read_blocks(frame(TWO, block_id=[70, 3], min_area=[300.0, 500.0]))
    assert blocks.block_id.tolist() == [3, 70]
    assert blocks.columns["min_area"].tolist() == [500, 300]
    assert shapely.bounds(blocks.polygons)[:, 0].tolist() == [80, 0]


@pytest.mark.parametrize(
    ("ids", "said"),
    [([5, 5], "twice: block_id 5, in row 1, 2"), ([1.5, 2], "whole number: row 1"),
     ([1.0, None], "whole number: row 2"), (["a", "b"], "whole number: row 1, 2")],
)  # fmt: skip
def test_numbers_of_blocks_must_be_unique_numbers(ids: list[Any], said: str) -> None:
    assert said in problems_of(frame(TWO, block_id=pd.Series(ids, dtype=object)))


def test_blocks_that_are_no_polygons_are_refused() -> None:
    assert "no polygon" in problems_of(frame([line((0, 0), (9, 0))]))
    assert "has no CRS" in problems_of(frame(TWO, crs=None))
    assert "no features" in problems_of(frame([]))
    assert "not finite" in problems_of(frame([shapely.Polygon([(0, 0), (9, 0), (9, math.inf)])]))


def test_blocks_that_overlap_are_refused_by_name() -> None:
    three = [box(0, 0, 80, 50), box(70, 0, 160, 50), box(0, 100, 50, 150)]
    assert "row 1 and 2 (500 m²)" in problems_of(frame(three))
    assert "block 9 and 4 (500 m²)" in problems_of(frame(three, block_id=[9, 4, 1]))
    inside = [box(0, 0, 80, 50), box(20, 20, 40, 40)]
    assert "row 1 and 2 (400 m²)" in problems_of(frame(inside))
    assert "row 1 and 2 (4e+03 m²)" in problems_of(frame([TWO[0], TWO[0]]))
    many = [box(10 * k, 0, 10 * k + 15, 10) for k in range(9)]
    assert "and 3 more pairs" in problems_of(frame(many))


def test_overlaps_of_a_hair_go_to_the_larger_block() -> None:
    blocks = read_blocks(frame([box(0, 0, 80.005, 50), box(80, 0, 130, 50)]))
    assert told(blocks) == {"overlaps_trimmed": 1.0}
    assert shapely.coverage_is_valid(blocks.polygons)
    assert shapely.area(blocks.polygons).sum() == pytest.approx(130 * 50)
    assert blocks.edge_access.shape == blocks.edge_width.shape


@pytest.mark.parametrize(
    ("east", "north", "kept"),
    [(80.09, 50, True), (80.11, 50, False), (80.9, 3, True), (80.9, 9, False)],
    ids=["thin", "not thin", "small", "not small"],
)
def test_overlaps_are_trimmed_where_they_are_thin_or_small(
    east: float, north: float, kept: bool
) -> None:
    first = shapely.union(box(0, 0, 80, 50), box(80, 0, east, north))
    two = frame([first, box(80, 0, 160, 50)])
    if kept:
        blocks = read_blocks(two)
        assert told(blocks) == {"overlaps_trimmed": 1.0}
        assert shapely.coverage_is_valid(blocks.polygons)
        assert shapely.area(blocks.polygons).sum() == pytest.approx(160 * 50)
    else:
        assert "row 1 and 2" in problems_of(two)


def test_multipolygons_become_several_blocks() -> None:
    both = shapely.MultiPolygon([box(0, 0, 10, 10), box(100, 0, 140, 30)])
    blocks = read_blocks(
        frame(
            [both, box(0, 50, 20, 70)],
            block_id=[4, 7],
            min_area=pd.Series([50.0, None], dtype=object),
        )
    )
    assert blocks.block_id.tolist() == [4, 7, 8]
    assert shapely.area(blocks.polygons).tolist() == [1200, 400, 100]
    assert blocks.columns["min_area"].tolist()[::2] == [50, 50]
    assert told(blocks) == {"blocks_of_parts": 1.0}


def test_outlines_are_repaired_or_refused() -> None:
    spike = shapely.Polygon(
        [(X, Y), (X + 90, Y), (X + 90, Y + 60), (X + 40, Y + 60), (X + 40, Y + 90),
         (X + 40, Y + 60), (X, Y + 60)]
    )  # fmt: skip
    assert "ring_repaired" in told(read_blocks(frame([spike])))
    bow = shapely.Polygon([(X, Y), (X + 90, Y + 60), (X + 90, Y), (X, Y + 60)])
    assert "bow-tie" in problems_of(frame([bow]))


def test_columns_set_parameters_block_by_block() -> None:
    blocks = read_blocks(
        frame(
            TWO,
            min_area=pd.Series([250, None], dtype=object),
            strategy=["obb", None],
            patio=pd.Series([math.nan, "skeleton"], dtype=object),
            other=[1, 2],
        )
    )
    assert blocks.columns["min_area"].tolist() == [250.0, None]
    assert blocks.columns["strategy"].tolist() == [Strategy.OBB, None]
    assert blocks.columns["patio"].tolist() == [None, "skeleton"]
    assert set(blocks.columns) == {"min_area", "strategy", "patio"}


@pytest.mark.parametrize(
    ("column", "values", "said"),
    [
        ("min_area", [300, math.nan], "empty cell (None): nan in row 2"),
        ("min_area", [-5, 300], "above 0 m²: -5 in row 1"),
        ("min_area", ["many", 300], "a number: 'many' in row 1"),
        ("min_area", [True, 300], "a number: True in row 1"),
        ("max_area", [math.inf, 900], "finite number"),
        ("irregularity", [0.5, 1.5], "at most 1: 1.5 in row 2"),
        ("street_access", [-0.1, -0.1], "at least 0: -0.1 in rows 1, 2"),
        ("strategy", ["squares", None], "one of skeleton, obb, hybrid, streamline: 'squares'"),
        ("max_area", [300, 3000], "min_area must not be above max_area: 400 and 300 in row 1"),
        ("min_area", [1200, 300], "min_area must not be above max_area: 1200 and 1000 in row 1"),
    ],
)
def test_values_that_are_wrong_name_their_rows(column: str, values: list[Any], said: str) -> None:
    layer = frame(TWO, block_id=[11, 12], **{column: pd.Series(values, dtype=object)})
    message = problems_of(layer, params=SubdivideParams(max_area=1000))
    assert said in message
    assert "(block 1" in message


def test_all_that_is_wrong_with_columns_is_said_at_once() -> None:
    layer = frame(
        TWO, min_area=[math.nan, -3.0], max_width=[5.0, 4.0], min_width=[8.0, 3.0], block_id=[1, 1]
    )
    message = problems_of(layer)
    for said in ("finite number", "above 0 m²", "min_width must not be above max_width", "twice"):
        assert said in message


def test_nan_is_a_mistake_in_a_frame_and_an_empty_cell_in_a_file(tmp_path: Path) -> None:
    layer = frame(TWO, min_area=[math.nan, 300.0])
    assert "nan in row 1" in problems_of(layer)
    path = tmp_path / "blocks.gpkg"
    layer.to_file(path)
    assert read_blocks(path).columns["min_area"].tolist() == [None, 300.0]
    nullable = frame(TWO, min_area=pd.Series([None, 300.0], dtype="Float64"))
    assert read_blocks(nullable).columns["min_area"].tolist() == [None, 300.0]


def test_blocks_take_widths_from_centrelines() -> None:
    # a street of 12 m south of both, one of 20 m between them, 6 and 10 m off
    blocks = [box(0, 6, 80, 50), box(100, 6, 160, 50)]
    streets = frame(
        [line((-10, 0), (200, 0)), line((90, -10), (90, 100)), line((-30, 0), (-30, 90))],
        width_m=[12.0, 20.0, 8.0],
    )
    found = read_blocks(frame(blocks), streets=streets)
    rings = found.rings
    middle = (rings.xy + rings.xy[rings.following]) / 2 + np.array(found.frame.origin) - (X, Y)
    values = zip(found.edge_width.tolist(), found.edge_street.tolist(), strict=True)
    by_place = dict(zip(map(tuple, middle.tolist()), values, strict=True))
    assert by_place[(40.0, 6.0)][0] == by_place[(130.0, 6.0)][0] == 12
    assert by_place[(40.0, 6.0)][1] == by_place[(130.0, 6.0)][1] != UNKNOWN_STREET
    assert by_place[(80.0, 28.0)][0] == by_place[(100.0, 28.0)][0] == 20
    assert math.isnan(by_place[(0.0, 28.0)][0])
    assert found.edge_access.all()
    assert told(found)["edges_without_street"] == 4


def test_a_column_of_access_says_which_edges_are_streets() -> None:
    sides = [line((0, 0), (80, 0)), line((80, 0), (80, 50)), line((80, 50), (0, 50))]
    streets = frame(
        sides, width_m=[12.0, None, 8.0], access=[True, False, True], street_id=[7, 8, 9]
    )
    found = read_blocks(frame([TWO[0]]), streets=streets)
    assert sorted(found.edge_street.tolist()) == [UNKNOWN_STREET, UNKNOWN_STREET, 7, 9]
    assert found.edge_access.sum() == 2
    holed = TWO[0] - box(20, 20, 30, 30)
    ring = frame([*sides, box(20, 20, 30, 30).exterior], access=[True] * 4)
    assert read_blocks(frame([holed]), streets=ring).edge_access.sum() == 7


def test_widths_of_streets_along_blocks_are_checked() -> None:
    streets = frame([line((0, 0), (80, 0))], width_m=[-4.0])
    assert "above 0: row 1" in problems_of(frame(TWO), streets=streets)
    assert "Streets must be lines" in problems_of(frame(TWO), streets=frame(TWO))


@pytest.mark.parametrize("city", CITIES[-1:])
def test_streets_of_openstreetmap_with_lists_and_names(city: str) -> None:
    streets = read_streets(f"{network_file(city)}|layername=edges").streets
    assert {"residential", "unclassified"} <= set(streets.street_class.tolist())
    assert not any("[" in c for c in streets.street_class.tolist())
    assert "Landstrasse" in streets.name.tolist()
