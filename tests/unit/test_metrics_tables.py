"""Tables follow the schema, in map coordinates."""

from __future__ import annotations

import json

import numpy as np
import pytest
import shapely
from grid_layouts import SIDE, boxes, grid, layout_of

from urban_processing.metrics.tables import (
    boundary_table,
    junction_table,
    layout_tables,
    parcel_table,
    street_table,
)
from urban_processing.provenance import Step
from urban_processing.schema import LAID_OUT, LAYERS, OBSTACLES, ColumnType, GeometryType, layer
from urban_processing.site import Issue
from urban_processing.street_rules import StreetRules
from urban_processing.tables import Table, issue_table, provenance_table

ORIGIN = (500_000.0, 5_700_000.0)


def test_tables_follow_the_schema() -> None:
    layout = grid(3, 3, [(0, 1), (3, 1)], [(1, 1), (1, 2)], origin=ORIGIN).replace(
        street_rules=StreetRules(laid_out=True),
        input_parts=(shapely.box(0, 0, 60, 60),),
        history=(Step("cogenerate", {"min_area": 400.0}, 7, "1.0", "ab", 0.5),),
        issues=(Issue("small", "A small part.", part=0, geometry=shapely.Point(1, 1)),),
    )
    tables = layout_tables(layout)
    known = [each.name for each in LAYERS if each.name in tables]
    assert list(tables) == known
    assert list(tables) == [each.name for each in LAID_OUT if each is not OBSTACLES]
    for name, table in tables.items():
        declared = layer(name)
        assert tuple(table.columns) == declared.column_names
        assert len(table) > 0
        for column in declared.columns:
            dtype = table[column.name].dtype
            if column.dtype is ColumnType.TEXT:
                assert all(isinstance(v, str) for v in table[column.name])
            elif not column.nullable:
                assert dtype == np.dtype(column.dtype.value)
            else:
                assert dtype == np.float64
        if declared.geometry is GeometryType.NONE:
            assert table.geometry is None
        elif declared.geometry is not GeometryType.ANY:
            assert table.geometry is not None
            assert {g.geom_type for g in table.geometry} == {declared.geometry.value}


def test_a_layout_without_input_has_no_input_boundary() -> None:
    assert "input_boundary" not in layout_tables(grid(2, 2))


def test_parcels_are_numbered_from_one_and_lie_on_the_map() -> None:
    layout = grid(2, 2, origin=ORIGIN)
    layout = layout.replace(face_lineage=np.array([1, 2, 2**64 - 1, 0], dtype=np.uint64))
    table = parcel_table(layout)
    assert table["parcel_id"].tolist() == [1, 2, 3, 4]
    assert table["lineage"].tolist() == ["0" * 15 + "1", "0" * 15 + "2", "f" * 16, "0" * 16]
    assert np.isnan(table["net_area_m2"]).all()
    assert set(table["land_use"]) == {"parcel"}
    assert table.geometry is not None
    assert shapely.bounds(table.geometry[3]).tolist() == [
        ORIGIN[0] + SIDE,
        ORIGIN[1] + SIDE,
        ORIGIN[0] + 2 * SIDE,
        ORIGIN[1] + 2 * SIDE,
    ]


def test_locked_parcels_are_named() -> None:
    locked = np.array([False, True, False, False])
    assert (
        parcel_table(grid(2, 2).replace(face_locked=locked))["locked"].tolist() == locked.tolist()
    )


def test_shifting_to_the_map_and_back_loses_nothing() -> None:
    polygon = shapely.set_precision(shapely.Point(0, 0).buffer(30.123456), 2.0**-20)
    layout = layout_of([polygon], origin=ORIGIN)
    table = parcel_table(layout)
    assert table.geometry is not None
    back = shapely.get_coordinates(table.geometry) - np.asarray(ORIGIN)
    local = shapely.get_coordinates(layout.mesh.face_polygons())
    assert (back == local).all()


def test_streets_name_their_junctions() -> None:
    layout = grid(2, 2, [(0, 1), (1, 1)], origin=ORIGIN)
    streets, junctions = street_table(layout), junction_table(layout)
    assert junctions["kind"].tolist() == ["junction", "end"]
    assert junctions["degree"].tolist() == [3, 1]
    assert np.isnan(junctions["angle_dev_deg"]).tolist() == [False, True]
    assert streets.geometry is not None
    assert junctions.geometry is not None
    points = dict(zip(junctions["junction_id"].tolist(), junctions.geometry, strict=True))
    for line, a, b in zip(
        streets.geometry, streets["from_junction"], streets["to_junction"], strict=True
    ):
        assert shapely.Point(line.coords[0]) == points[int(a)]
        assert shapely.Point(line.coords[-1]) == points[int(b)]
    assert streets["length_m"] == pytest.approx(shapely.length(streets.geometry))


def test_a_ring_has_no_junction() -> None:
    table = street_table(grid(2, 2))
    assert np.isnan(table["from_junction"]).all()
    assert len(junction_table(grid(2, 2))) == 0


def test_boundary_has_a_polygon_for_each_part_with_its_holes() -> None:
    polygons = boxes(3, 3, without=[(1, 1)]) + boxes(2, 1, at=(3, 3))
    table = boundary_table(layout_of(polygons, part=[0] * 8 + [1] * 2, origin=ORIGIN))
    assert table["part"].tolist() == [0, 1]
    assert table["area_m2"].tolist() == [8 * 400.0, 2 * 400.0]
    assert table.geometry is not None
    assert shapely.get_num_interior_rings(table.geometry).tolist() == [1, 0]
    union = shapely.union_all(polygons[:8])
    assert shapely.transform(table.geometry[0], lambda xy: xy - ORIGIN).equals(union)


def test_boundary_with_a_hole_that_touches_the_rim_is_valid() -> None:
    hole = shapely.Polygon([(30, 0), (40, 20), (20, 20)])
    land = shapely.Polygon(shapely.box(0, 0, 60, 60).exterior, [hole.exterior])
    assert land.is_valid
    left = shapely.box(0, 0, 30, 60) & land
    right = shapely.box(30, 0, 60, 60) & land
    left = shapely.snap(left, right, 1e-9)
    table = boundary_table(layout_of([left, right]))
    assert table.geometry is not None
    assert table.geometry[0].is_valid
    assert table["area_m2"].tolist() == [pytest.approx(land.area)]


def test_issues_keep_their_gaps() -> None:
    issues = (
        Issue("a", "One.", part=1, parcel_id=4, value=2.0, limit=3.0, geometry=shapely.Point(1, 2)),
        Issue("b", "Two."),
    )
    table = issue_table(issues, grid(2, 2, origin=ORIGIN).frame)
    assert table["part"][0] == 1
    assert np.isnan(table["part"][1])
    assert np.isnan(table["parcel_id"][1])
    assert table["code"].tolist() == ["a", "b"]
    assert table.geometry is not None
    assert table.geometry[0] == shapely.Point(ORIGIN[0] + 1, ORIGIN[1] + 2)
    assert table.geometry[1] is None


def test_provenance_is_json() -> None:
    step = Step("cogenerate", {"min_area": 400.0, "orientation": None}, 7, "1.0", "ab", 0.5)
    table = provenance_table((step, step))
    assert table["step"].tolist() == [1, 2]
    assert json.loads(table["parameters"][0]) == {"min_area": 400.0, "orientation": None}


def test_columns_of_different_lengths_are_refused() -> None:
    with pytest.raises(ValueError, match="different lengths"):
        Table({"a": np.zeros(2), "b": np.zeros(3)})
