"""Rights-of-way whose areas can be worked out by hand, and what becomes of them."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
import shapely
import shapely.affinity
from grid_layouts import cut_square, grid, layout_of
from lands import LANDS, site_of

from urban_processing.errors import ParameterError
from urban_processing.io.files import read_layout, write_layout
from urban_processing.io.frames import GeoLayout
from urban_processing.layout import NOT_FIXED, EdgeKind, GivenStreet, Layout
from urban_processing.metrics import LayoutMeasures, certificate, layout_tables, measure
from urban_processing.metrics.certificate import certify
from urban_processing.metrics.tables import (
    boundary_table,
    net_parcel_table,
    parcel_table,
    right_of_way_table,
    street_table,
)
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.pipelines.findings import findings
from urban_processing.rights_of_way import (
    RightsOfWay,
    lay_out_rights_of_way,
    rights_of_way_of_lines,
)
from urban_processing.rights_of_way.lay_out import CLASSES
from urban_processing.street_rules import StreetClass, StreetRules
from urban_processing.tables import Table, issue_table

ARC = 0.03
"""Share of a fillet that its straight segments may differ from a true arc."""

SQUARE = [shapely.box(0, 0, 200, 200)]


def ruled(layout: Layout, **rules: float) -> Layout:
    plain = {"corner_radius": 0.0, "turning_radius": 0.0, "laid_out": True}
    return layout.replace(street_rules=StreetRules(**(plain | rules)))


def line(*points: tuple[float, float]) -> shapely.LineString:
    return shapely.LineString(points)


def class_areas(streets: RightsOfWay) -> dict[str, float]:
    area = np.bincount(streets.rank, shapely.area(streets.polygons), len(CLASSES))
    return {c.value: a for c, a in zip(CLASSES, area.tolist(), strict=True) if a}


def assert_partition(streets: RightsOfWay, land: shapely.Geometry) -> None:
    net = streets.net[~shapely.is_missing(streets.net)]
    all_of_it = np.concatenate([streets.polygons, net])
    assert shapely.is_valid(all_of_it).all()
    assert (shapely.get_type_id(all_of_it) == shapely.GeometryType.POLYGON).all()
    assert shapely.coverage_is_valid(all_of_it)
    assert shapely.area(all_of_it).sum() == pytest.approx(land.area, rel=1e-8)
    assert shapely.coverage_union_all(all_of_it).symmetric_difference(land).area <= 1e-7 * land.area


def test_one_straight_street_between_two_parcels() -> None:
    layout = ruled(cut_square(100, [(50, 0), (50, 100)]), rim=20.0, collector=10.0)
    streets = lay_out_rights_of_way(layout)
    np.testing.assert_allclose(streets.net_area, [35 * 80] * 2)
    assert class_areas(streets) == pytest.approx({"rim": 100**2 - 80**2, "collector": 800})
    assert_partition(streets, shapely.box(0, 0, 100, 100))


def test_a_rim_street_outside_takes_nothing() -> None:
    layout = ruled(cut_square(100, [(50, 0), (50, 100)]), rim=0.0, collector=10.0)
    streets = lay_out_rights_of_way(layout)
    np.testing.assert_allclose(streets.net_area, [45 * 100] * 2)
    assert class_areas(streets) == pytest.approx({"collector": 1000})


@pytest.mark.parametrize("radius", [0.0, 3.0, 6.0])
def test_corners_of_a_crossing_are_rounded(radius: float) -> None:
    crossing = [line((100, -5), (100, 210)), line((0, 100), (200, 100))]
    blocks, streets = rights_of_way_of_lines(
        SQUARE, crossing, width=[10, 16], rank=[1, 0], corner_radius=radius
    )
    assert len(blocks) == 4
    fillet = (1 - math.pi / 4) * radius**2
    np.testing.assert_allclose(92 * 95 - streets.net_area, fillet, rtol=ARC, atol=1e-6)
    # the higher class takes the junction and its corners
    np.testing.assert_allclose(
        shapely.area(streets.polygons), [200 * 16 + 4 * fillet, 920, 920], rtol=1e-3
    )


@pytest.mark.parametrize("degrees", [30.0, 45.0, 70.0, 120.0])
def test_corners_of_any_angle_are_rounded(degrees: float) -> None:
    angle, radius = math.radians(degrees), 4.0
    end = (100 + 300 * math.cos(angle), 300 * math.sin(angle))
    streets = [line((-10, 0), (210, 0)), line((100, 0), end)]
    land = [shapely.box(0, -100, 200, 100)]
    net = [
        rights_of_way_of_lines(land, streets, width=10, corner_radius=r)[1].net_area.sum()
        for r in (0.0, radius)
    ]
    fillets = [
        radius**2 * (1 / math.tan(a / 2) - (math.pi - a) / 2) for a in (angle, math.pi - angle)
    ]
    assert net[0] - net[1] == pytest.approx(sum(fillets), rel=ARC)


def test_a_dead_end_has_a_turning_head() -> None:
    street, half, radius = [line((100, 0), (100, 120))], 5.0, 9.0
    block, streets = rights_of_way_of_lines(SQUARE, street, width=10, turning_radius=radius)
    # the street up to where it meets the circle, and the circle beyond its chord
    angle = math.asin(half / radius)
    taken = 2 * half * (120 - radius * math.cos(angle)) + (math.pi - angle) * radius**2
    taken += half * radius * math.cos(angle)
    assert len(block) == 1
    assert 200**2 - streets.net_area[0] == pytest.approx(taken, rel=2e-3)
    _, plain = rights_of_way_of_lines(SQUARE, street, width=10)
    round_end = math.pi * half**2 / 2
    assert 200**2 - plain.net_area[0] == pytest.approx(1200 + round_end, rel=1e-3)


def test_a_wide_street_leaves_no_dent_beyond_a_narrow_one() -> None:
    streets = [line((0, 100), (200, 100)), line((100, 0), (100, 100))]
    blocks, laid = rights_of_way_of_lines(SQUARE, streets, width=[6, 30], corner_radius=0)
    far = np.flatnonzero(shapely.contains_xy(blocks, 100, 150))
    assert laid.net_area[far].tolist() == [pytest.approx(97 * 200, abs=1e-9)]


def test_a_dead_end_in_the_same_block_makes_no_difference_to_that() -> None:
    streets = [line((50, 100), (200, 100)), line((100, 0), (100, 100))]
    _, laid = rights_of_way_of_lines(SQUARE, streets, width=[6, 30], corner_radius=0)
    above = shapely.box(49, 103, 199, 104)  # the far kerb is straight
    assert shapely.covers(shapely.union_all(laid.net), above)


def test_streets_of_two_widths_in_a_row_meet_without_spike() -> None:
    streets = [line((0, 100), (100, 100)), line((100, 100), (200, 100))]
    blocks, laid = rights_of_way_of_lines(SQUARE, streets, width=[20, 12], corner_radius=6)
    wide, narrow = 200 * 90, 200 * 94
    assert all(wide < area < narrow for area in laid.net_area)
    # the kerb comes no nearer to the rim, nor to the centreline, than on either side
    kerb = shapely.get_coordinates(laid.net)
    off = np.abs(kerb[:, 1] - 100)
    assert off.min() == pytest.approx(6)
    assert set(np.round(np.unique(off[off > 10 + 1e-6]), 6)) == {100.0}
    assert_partition(laid, SQUARE[0])
    assert len(blocks) == 2


def test_classes_do_not_overlap_and_take_their_width() -> None:
    layout = grid(6, 4, [(0, 2), (6, 2)])
    inner = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)].mean(axis=1)
    side = (np.abs(inner[:, 0] - 60) < 1e-6) & (inner[:, 1] < 40)
    layout = layout.replace(
        edge_street=layout.edge_street | side,
        edge_level=np.where(side, 2, layout.edge_level).astype(np.int16),
    )
    streets = lay_out_rights_of_way(ruled(layout, rim=8.0, collector=10.0, local=6.0))
    assert class_areas(streets) == pytest.approx(
        {"rim": 120 * 80 - 112 * 72, "collector": 112 * 10, "local": (40 - 4 - 5) * 6}
    )


def test_parcels_that_streets_swallow_are_listed() -> None:
    layout = ruled(grid(4, 3), rim=40.0)
    streets = lay_out_rights_of_way(layout)
    assert shapely.is_missing(streets.net).sum() == 10
    assert_partition(streets, shapely.box(0, 0, 80, 60))
    listed = [i for i in findings(layout, CogenerateParams(min_area=400)) if "swallowed" in i.code]
    assert [i.parcel_id for i in listed] == (np.flatnonzero(streets.net_area == 0) + 1).tolist()
    assert all(i.value == 0 and i.limit == pytest.approx(20) for i in listed)
    assert len(layout_tables(layout)["net_parcels"]) == 2
    assert certificate(layout).check("right_of_way").holds


def test_pieces_that_a_turning_head_cuts_off_become_street() -> None:
    parcels = [
        shapely.box(0, 0, 50, 40),
        shapely.box(50, 0, 100, 40),
        shapely.Polygon([(0, 40), (50, 40), (100, 40), (100, 46), (0, 46)]),
        shapely.box(0, 46, 100, 80),
    ]
    layout = ruled(
        layout_of(parcels, [(50, 0), (50, 40)], unit=1.0),
        rim=0.0,
        cul_de_sac=8.0,
        turning_radius=9.0,
    )
    streets = lay_out_rights_of_way(layout)
    strip = int(np.argmin(layout.mesh.face_area))
    assert streets.cut_off[strip] == pytest.approx(streets.net_area[strip], rel=0.01)
    assert_partition(streets, shapely.box(0, 0, 100, 80))
    (issue,) = (
        i for i in findings(layout, CogenerateParams(min_area=400)) if i.code == "parcel_cut_off"
    )
    assert issue.parcel_id == strip + 1
    assert issue.value == pytest.approx(streets.cut_off[strip])


def test_no_street_no_right_of_way() -> None:
    streets = lay_out_rights_of_way(ruled(grid(2, 2, rim=False)))
    np.testing.assert_allclose(streets.net_area, 400)
    assert len(streets.polygons) == 0


def test_a_street_that_leaves_the_land_has_no_turning_head() -> None:
    layout = ruled(cut_square(100, [(50, 0), (50, 100)], rim=False), turning_radius=9.0)
    streets = lay_out_rights_of_way(layout)
    np.testing.assert_allclose(streets.net_area, (50 - layout.street_rules.cul_de_sac / 2) * 100)


def test_turning_the_land_changes_little() -> None:
    streets = [line((0, 80), (120, 90)), line((120, 90), (200, 60)), line((120, 90), (130, 200))]
    found = []
    for turn in (0.0, 33.0, 90.0):
        turned = [shapely.affinity.rotate(g, turn, origin=(100, 100)) for g in SQUARE + streets]
        blocks, laid = rights_of_way_of_lines(
            turned[:1], turned[1:], width=[14, 10, 12], corner_radius=6, turning_radius=9
        )
        found.append(sorted(laid.net_area.tolist()))
        assert len(blocks) == 3
    np.testing.assert_allclose(found[1:], found[:1] * 2, rtol=1e-4)


def test_tables_and_metrics_agree() -> None:
    layout = ruled(cut_square(100, [(50, 0), (50, 100)]), rim=20.0, collector=10.0)
    tables = layout_tables(layout)
    np.testing.assert_allclose(tables["parcels"]["net_area_m2"], 2800)
    assert tables["right_of_way"]["class"].tolist() == ["rim", "collector"]
    assert tables["net_parcels"]["parcel_id"].tolist() == [1, 2]
    values = {m.metric: m.value for m in measure(layout)}
    assert values["right_of_way_m2"] == pytest.approx(4400)
    assert values["right_of_way_pct"] == pytest.approx(44)
    assert values["net_area_mean_m2"] == values["net_area_min_m2"] == pytest.approx(2800)
    assert set(tables["streets"]["width_m"]) == {20.0, 10.0}


def test_without_rights_of_way_there_are_no_layers_and_no_net_areas() -> None:
    layout = grid(3, 3)
    tables = layout_tables(layout)
    assert not {"right_of_way", "net_parcels"} & set(tables)
    assert np.isnan(tables["parcels"]["net_area_m2"]).all()
    assert "right_of_way" not in [c.name for c in certificate(layout).checks]
    assert len(GeoLayout(layout).net_parcels) == len(GeoLayout(layout).right_of_way) == 0


def test_the_same_streets_are_laid_out_once() -> None:
    layout = ruled(grid(3, 3))
    known = lay_out_rights_of_way(layout)
    assert lay_out_rights_of_way(layout.replace(history=())) is known
    assert lay_out_rights_of_way(ruled(layout, rim=4.0)) is not known
    interior = layout.replace(edge_street=np.ones_like(layout.edge_street))
    assert LayoutMeasures(interior).net_area.sum() < known.net_area.sum()


@pytest.mark.parametrize("basis", ["gross", "net"])
def test_a_file_gives_the_same_layout_again(tmp_path: Path, basis: str) -> None:
    values = {"min_area": 900, "pattern": "tree", "rim_width": 8, "min_area_basis": basis}
    layout = cogenerate(site_of(LANDS["star"]), CogenerateParams(**values))
    read = read_layout(write_layout(layout, tmp_path / "a.gpkg")).layout
    assert read.street_rules == layout.street_rules
    assert read.street_rules.rim == 8.0
    written, again = layout_tables(layout), layout_tables(read)
    for name in ("parcels", "right_of_way", "net_parcels", "streets"):
        for column, values_ in written[name].columns.items():
            np.testing.assert_array_equal(values_, again[name][column])
        assert shapely.equals_exact(written[name].geometry, again[name].geometry).all()
    assert GeoLayout(read).net_parcels.area_m2.sum() + GeoLayout(
        read
    ).right_of_way.area_m2.sum() == pytest.approx(read.mesh.face_area.sum())


def certified(layout: Layout, right_of_way: Table, net_parcels: Table) -> set[str]:
    proof = certify(
        parcel_table(layout),
        street_table(layout),
        boundary_table(layout),
        min_area=layout.min_area,
        issues=issue_table(layout.issues, layout.frame),
        right_of_way=right_of_way,
        net_parcels=net_parcels,
        net_min_area=layout.street_rules.net_min_area,
    )
    return {check.name for check in proof.failures}


def test_the_certificate_sees_what_is_wrong_with_net_parcels() -> None:
    layout = ruled(grid(4, 4, [(0, 2), (4, 2)], min_area=100.0), rim=8.0)
    streets = lay_out_rights_of_way(layout)
    right, net = right_of_way_table(layout, streets), net_parcel_table(layout, streets)
    assert net.geometry is not None
    assert right.geometry is not None
    assert certified(layout, right, net) == set()
    moved = net.geometry.copy()
    moved[0] = shapely.affinity.translate(moved[0], 0.01, 0)
    cut = net.geometry.copy()
    west, south, east, north = cut[5].bounds
    cut[5] = cut[5].intersection(shapely.box(west, south, east - 0.1, north))
    double = right.geometry.copy()
    double[0] = shapely.box(*shapely.total_bounds(double))
    lost = dataclasses.replace(
        net, columns={k: v[1:] for k, v in net.columns.items()}, geometry=net.geometry[1:]
    )
    for geometry in (moved, cut):
        flawed = dataclasses.replace(net, geometry=geometry)
        assert certified(layout, right, flawed) == {"right_of_way"}
    assert certified(layout, dataclasses.replace(right, geometry=double), net) == {"right_of_way"}
    assert certified(layout, right, lost) == {"right_of_way"}


def test_a_net_floor_is_held_against_net_parcels() -> None:
    layout = ruled(grid(4, 4, [(0, 2), (4, 2)], min_area=390.0), rim=8.0)
    assert certificate(layout).holds
    net = layout.replace(street_rules=dataclasses.replace(layout.street_rules, net_min_area=True))
    (failure,) = certificate(net).failures
    assert failure.name == "min_area"
    assert failure.value == pytest.approx(lay_out_rights_of_way(net).net_area.min())


@pytest.mark.parametrize("name", ["rim", "local", "collector", "cul_de_sac"])
def test_widths_that_are_none_are_refused(name: str) -> None:
    with pytest.raises(ParameterError, match=f"{name.replace('_', '-')}-width must be at least"):
        CogenerateParams(min_area=400, **{f"{name}_width": -1.0})


@pytest.mark.parametrize("width", [0.0, -3.0, math.nan])
def test_lines_without_width_are_refused(width: float) -> None:
    with pytest.raises(ParameterError, match="above 0"):
        rights_of_way_of_lines(SQUARE, [line((0, 9), (9, 9))], width=width)


def test_land_without_lines_stays_whole() -> None:
    blocks, streets = rights_of_way_of_lines(SQUARE, [], width=10)
    assert len(blocks) == 1
    assert streets.net_area.tolist() == [200.0**2]


def test_radii_below_zero_are_refused_together() -> None:
    with pytest.raises(ParameterError) as error:
        CogenerateParams(min_area=400, corner_radius=-1, turning_radius=-2)
    assert len(error.value.problems) == 2


def test_a_net_floor_needs_rights_of_way() -> None:
    with pytest.raises(ParameterError, match="min-area-basis net needs right-of-way"):
        CogenerateParams(min_area=400, min_area_basis="net", right_of_way=False)


def test_rules_survive_a_file_and_its_age() -> None:
    rules = StreetRules(rim=3.0, laid_out=True)
    assert StreetRules.from_dict(rules.as_dict()) == rules
    assert StreetRules.from_dict({"rim": 3.0, "of_later_versions": 1}).rim == 3.0
    assert set(rules.width_m) == {c.value for c in StreetClass}


def test_widths_of_given_streets_are_heeded_on_one_mesh() -> None:
    layout = grid(4, 2, [(2, 0), (2, 2)])
    fixed = np.where(layout.edge_street & (layout.edge_kind == EdgeKind.INTERIOR), 0, NOT_FIXED)
    rules = dataclasses.replace(layout.street_rules, laid_out=True)
    taken = [
        shapely.area(
            lay_out_rights_of_way(
                layout.replace(
                    edge_fixed=fixed,
                    fixed_streets=(GivenStreet("lane", width),),
                    street_rules=rules,
                )
            ).polygons
        ).sum()
        for width in (4.0, 8.0)
    ]
    assert taken[1] > taken[0] + 1.0
