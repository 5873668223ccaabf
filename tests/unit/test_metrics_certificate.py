"""The certificate holds for sound layouts and fails for each kind of flaw."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import shapely
from grid_layouts import boxes, cut_square, grid, layout_of, with_streets

from urban_processing.layout import Layout
from urban_processing.metrics.certificate import Certificate, certificate, certify
from urban_processing.metrics.tables import boundary_table, parcel_table, street_table
from urban_processing.site import Issue
from urban_processing.tables import Table, issue_table

ORIGIN = (500_000.0, 5_700_000.0)


def sound() -> Layout:
    return grid(4, 4, [(0, 2), (4, 2)], origin=ORIGIN)


def certify_edited(
    layout: Layout,
    *,
    parcels: dict[int, shapely.Geometry] | None = None,
    streets: list[shapely.LineString] | None = None,
    min_area: float = 400.0,
) -> Certificate:
    """Certify the tables of a layout after geometries, in local metres, were replaced."""
    table, lines = parcel_table(layout), street_table(layout)
    assert table.geometry is not None
    geometry = table.geometry.copy()
    for i, polygon in (parcels or {}).items():
        geometry[i] = shapely.transform(polygon, lambda xy: xy + ORIGIN)
    if streets is not None:
        moved = shapely.transform(np.array(streets, dtype=object), lambda xy: xy + ORIGIN)
        lines = Table({"part": np.zeros(len(streets), dtype=np.int64)}, moved)
    return certify(
        replace(table, geometry=geometry), lines, boundary_table(layout), min_area=min_area
    )


def failed(result: Certificate) -> set[str]:
    assert result.holds == (not result.failures)
    return {check.name for check in result.failures}


def test_a_sound_layout_holds() -> None:
    result = certificate(sound())
    assert failed(result) == set()
    assert [c.name for c in result.checks] == [
        "valid_polygons",
        "coverage",
        "land_covered",
        "reached",
        "streets_on_boundaries",
        "streets_connected",
        "min_area",
    ]
    assert result.check("min_area").value == pytest.approx(400.0)
    with pytest.raises(KeyError, match="no check nothing"):
        result.check("nothing")


def test_slanting_and_holed_and_several_parts_hold() -> None:
    assert certificate(cut_square(100, [(13, 0), (57, 100)], [(0, 33), (100, 61)])).holds
    polygons = boxes(3, 3, without=[(1, 1)]) + boxes(2, 2, at=(3, 3))
    assert certificate(layout_of(polygons, part=[0] * 8 + [1] * 4)).holds


def test_overlapping_parcels_fail() -> None:
    result = certify_edited(sound(), parcels={5: shapely.box(15, 20, 40, 40)})
    assert {"coverage", "land_covered"} <= failed(result)
    assert 6 in result.check("coverage").offenders
    assert result.check("land_covered").value == pytest.approx(100 / 6400)


def test_two_parcels_on_one_place_fail() -> None:
    result = certify_edited(sound(), parcels={5: shapely.box(0, 0, 20, 20)})
    assert {"coverage", "land_covered"} <= failed(result)


def test_a_gap_fails() -> None:
    result = certify_edited(sound(), parcels={5: shapely.box(21, 20, 40, 40)}, min_area=300.0)
    assert "land_covered" in failed(result)
    assert result.check("land_covered").value == pytest.approx(20 / 6400)


def test_a_gap_of_a_millimetre_fails() -> None:
    corner = shapely.Polygon([(0.001, 0.001), (20, 0), (20, 20), (0, 20)])
    assert "land_covered" in failed(certify_edited(sound(), parcels={0: corner}, min_area=399.0))


def test_a_vertex_that_the_neighbour_lacks_fails() -> None:
    bent = shapely.Polygon([(20, 20), (40, 20), (40, 40), (20, 40), (19.9, 30)])
    assert "coverage" in failed(certify_edited(sound(), parcels={5: bent}))


def test_an_invalid_or_missing_polygon_fails() -> None:
    bow_tie = shapely.Polygon([(20, 20), (40, 40), (40, 20), (20, 40)])
    for wrong in (bow_tie, shapely.Point(1, 1), shapely.Polygon()):
        result = certify_edited(sound(), parcels={5: wrong})
        assert {"valid_polygons", "land_covered", "reached"} <= failed(result)
        assert result.check("valid_polygons").offenders == (6,)


def test_land_that_is_not_laid_out_fails() -> None:
    layout = sound()
    assert certificate(layout, land=[shapely.box(0, 0, 80, 80)]).holds
    result = certificate(layout, land=[shapely.box(0, 0, 80, 81)])
    assert failed(result) == {"land_covered"}
    assert result.check("land_covered").value == pytest.approx(1 / 81)


def test_an_unreached_parcel_fails_and_is_named() -> None:
    result = certificate(grid(3, 3, origin=ORIGIN))
    assert failed(result) == {"reached"}
    assert result.check("reached").offenders == (5,)


@pytest.mark.parametrize(("length", "holds"), [(2.9, False), (3.0, True)])
def test_frontage_is_measured_on_the_lines(length: float, holds: bool) -> None:
    layout = grid(1, 1, origin=ORIGIN)
    result = certify_edited(layout, streets=[shapely.LineString([(4, 0), (4 + length, 0)])])
    assert result.check("reached").holds == holds
    assert result.check("streets_on_boundaries").holds


def test_a_street_through_a_parcel_fails() -> None:
    rim = shapely.box(0, 0, 80, 80).exterior
    across = shapely.LineString([(0, 40), (30, 40), (30, 20)])
    result = certify_edited(
        sound(), streets=[shapely.LineString(rim.coords), shapely.LineString(across)]
    )
    assert "streets_on_boundaries" in failed(result)
    assert result.check("streets_on_boundaries").value == pytest.approx(20.0)


def test_a_second_component_fails() -> None:
    layout = grid(4, 4, [(1, 2), (3, 2)], origin=ORIGIN)
    result = certificate(layout)
    assert failed(result) == {"streets_connected"}
    assert result.check("streets_connected").value == 2
    assert len(result.check("streets_connected").offenders) == 16


def test_components_are_counted_for_each_part() -> None:
    polygons = boxes(2, 2) + boxes(2, 2, at=(2, 2))
    layout = layout_of(polygons, part=[0] * 4 + [1] * 4)
    assert certificate(layout).holds
    rim_of_second = with_streets(
        layout_of(polygons, part=[0] * 4 + [1] * 4, rim=False),
        [(2, 2), (4, 2), (4, 4), (2, 4), (2, 2)],
    )
    result = certificate(rim_of_second)
    assert failed(result) == {"reached", "streets_connected"}
    assert result.check("streets_connected").offenders == (1, 2, 3, 4)


def test_too_small_a_parcel_fails() -> None:
    result = certificate(sound().replace(min_area=400.001))
    assert failed(result) == {"min_area"}
    assert len(result.check("min_area").offenders) == 16
    assert result.check("min_area").value == pytest.approx(400.0)


def test_a_part_smaller_than_a_parcel_must_be_flagged() -> None:
    polygons = [*boxes(2, 1), shapely.box(100, 0, 110, 10)]
    layout = layout_of(polygons, part=[0, 0, 1])
    assert certificate(layout).check("min_area").offenders == (3,)
    issue = Issue("part_too_small", "Too small to divide.", part=1, parcel_id=3)
    assert certificate(layout.replace(issues=(issue,))).holds
    # a small parcel among others is not excused by an issue
    other = layout_of(polygons, part=[0, 0, 0]).replace(issues=(issue,))
    assert not certificate(other).check("min_area").holds


def test_tables_are_certified_without_the_layout() -> None:
    layout = sound()
    parcels, streets, boundary = parcel_table(layout), street_table(layout), boundary_table(layout)
    lies = {**parcels.columns, "area_m2": np.full(16, 1.0), "frontage_m": np.zeros(16)}
    result = certify(
        Table(lies, parcels.geometry),
        streets,
        boundary,
        min_area=400.0,
        issues=issue_table(layout.issues, layout.frame),
    )
    assert result.holds
    with pytest.raises(ValueError, match="without geometry"):
        certify(Table(parcels.columns), streets, boundary, min_area=400.0)


def test_a_layout_without_streets_fails() -> None:
    result = certificate(grid(2, 2, rim=False, origin=ORIGIN))
    assert failed(result) == {"reached", "streets_connected"}


def test_a_parcel_around_a_lake_that_touches_its_side_holds() -> None:
    lake = [(20, 20), (14, 32), (26, 32)]
    upper = shapely.Polygon([(0, 20), (20, 20), (40, 20), (40, 60), (0, 60)], [lake])
    lower = shapely.Polygon([(0, 0), (20, 0), (20, 20), (0, 20)])
    # GEOS itself calls the lower one invalid where the lake touches
    assert not shapely.coverage_is_valid([upper, lower])
    layout = layout_of([upper, lower], origin=ORIGIN)
    assert certificate(layout).check("coverage").holds
    over = shapely.Polygon([(0, 0), (20, 0), (20, 20), (19, 23), (0, 20)])
    edited = certify_edited(layout, parcels={1: over})
    assert edited.check("coverage").offenders == (1, 2)
