"""Obstacles, locked land, given streets, the rim and its entries: what a planner may give."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity
import shapely.ops
from lands import LANDS, ell, ellipse, site_of, star

from urban_processing.constraints.ground import divide_land
from urban_processing.errors import BoundaryError, InfeasibleError, ParameterError
from urban_processing.layout import NOT_FIXED, EdgeKind, Layout
from urban_processing.metrics import certificate
from urban_processing.metrics.tables import junction_table, obstacle_table, street_table
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.site import FixedStreet, LockedLand, Site

SQUARE = shapely.box(0, 0, 400, 400)
STAR = shapely.affinity.translate(star(3), 200, 200)
LAKE = shapely.Point(210, 190).buffer(60, quad_segs=6)
BAY = shapely.Point(210, 400).buffer(70, quad_segs=6)
RIVER = shapely.LineString([(150, -20), (200, 200), (260, 420)]).buffer(12)
BESIDE = 1.0 + 1e-6
"""Given streets may be moved by the default tolerance."""


def given(land: shapely.Polygon = SQUARE, **layers: Any) -> Site:
    return dataclasses.replace(site_of(land), **layers)


def street(*xy: tuple[float, float], name: str = "", width: float = np.nan) -> FixedStreet:
    return FixedStreet(shapely.LineString(xy), name, width)


def laid_out(site: Site, **values: Any) -> Layout:
    layout = cogenerate(site, CogenerateParams(**{"parcels": 14, **values}))
    layout.mesh.validate()
    proof = certificate(layout)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]
    return layout


def codes(layout: Layout) -> list[str]:
    return [issue.code for issue in layout.issues]


def given_lines(layout: Layout) -> shapely.Geometry:
    """The streets of a layout that lie on given ones."""
    table = street_table(layout)
    return shapely.union_all(table.geometry[~np.isnan(table["fixed_id"])])


def ends_of(layout: Layout) -> np.ndarray:
    """(V,) which vertices are street ends."""
    mesh = layout.mesh
    at = mesh.origin[np.repeat(layout.edge_street, 2)]
    return np.bincount(at, minlength=mesh.n_vertices) == 1


# --- obstacles


@pytest.mark.parametrize("pattern", ["loop", "tree"])
@pytest.mark.parametrize("obstacle", [LAKE, BAY, RIVER], ids=["lake", "bay", "river"])
@pytest.mark.parametrize("land", [SQUARE, STAR], ids=["square", "star"])
def test_no_parcel_and_no_street_meets_an_obstacle(
    land: shapely.Polygon, obstacle: shapely.Polygon, pattern: str
) -> None:
    layout = laid_out(given(land, obstacles=(obstacle,)), pattern=pattern)
    parcels = layout.mesh.face_polygons()
    inner = obstacle.buffer(-1e-5)
    assert not shapely.intersects(parcels, inner).any()
    assert not shapely.intersects(street_table(layout).geometry, inner).any()
    shore = layout.edge_kind == EdgeKind.OBSTACLE
    assert shore.any()
    assert not layout.edge_street[shore].any() or "street_on_rim" in codes(layout)


def test_obstacles_and_land_tile_what_was_given() -> None:
    layout = laid_out(given(obstacles=(LAKE, BAY)), simplify=0)
    land = shapely.union_all(layout.mesh.face_polygons())
    gone = shapely.union_all(list(layout.obstacles))
    assert shapely.intersection(land, gone).area < 1e-4
    assert shapely.symmetric_difference(shapely.union(land, gone), SQUARE).area < 1e-4
    wanted = shapely.intersection(shapely.union(LAKE, BAY), SQUARE)
    assert shapely.difference(wanted, gone).area < 1e-4
    table = obstacle_table(layout)
    assert table["area_m2"].sum() == pytest.approx(gone.area)
    assert set(table["part"]) == {0}


def test_a_river_parts_the_land_and_each_part_has_a_network() -> None:
    layout = laid_out(given(obstacles=(RIVER,)))
    assert set(layout.face_part) == {0, 1}
    for part in (0, 1):
        west = shapely.union_all(layout.mesh.face_polygons()[layout.face_part == part])
        assert west.geom_type == "Polygon"


def test_edges_on_an_obstacle_that_touches_the_rim_are_no_rim() -> None:
    layout = laid_out(given(obstacles=(BAY,)))
    mesh = layout.mesh
    middle = mesh.xy[mesh.origin.reshape(-1, 2)].mean(axis=1)
    outer = np.flatnonzero(mesh.edge_is_boundary)
    on_square = shapely.distance(shapely.points(middle[outer]), SQUARE.exterior) < 1e-4
    assert (layout.edge_kind[outer[on_square]] == EdgeKind.RIM).all()
    assert (layout.edge_kind[outer[~on_square]] == EdgeKind.OBSTACLE).all()


@pytest.mark.parametrize("obstacle", [LAKE, BAY, RIVER], ids=["lake", "bay", "river"])
def test_a_lakeside_road_is_part_of_the_network(obstacle: shapely.Polygon) -> None:
    layout = laid_out(given(obstacles=(obstacle,)), obstacle_rim="street")
    shore = layout.edge_kind == EdgeKind.OBSTACLE
    assert shore.any()
    assert layout.edge_street[shore].all()


def test_no_road_around_a_lake_that_no_street_can_lead_to() -> None:
    pond = shapely.Point(200, 200).buffer(20)
    layout = laid_out(given(obstacles=(pond,)), parcels=1, obstacle_rim="street")
    assert not layout.edge_street[layout.edge_kind == EdgeKind.OBSTACLE].any()
    (told,) = [i for i in layout.issues if i.code == "shore_without_street"]
    assert told.value == pytest.approx(pond.length, rel=1e-3)


def test_locked_land_that_no_street_can_lead_to_is_refused() -> None:
    estate = LockedLand(shapely.box(150, 150, 250, 250))
    with pytest.raises(InfeasibleError, match="no street can lead there"):
        laid_out(given(locked=(estate,)), parcels=None, min_area=100_000)


def test_overlapping_obstacles_count_once_and_those_outside_are_told_of() -> None:
    obstacles = (LAKE, shapely.box(200, 180, 300, 220), shapely.box(500, 0, 600, 100))
    layout = laid_out(given(obstacles=obstacles))
    (outside,) = [i for i in layout.issues if i.code == "obstacles_outside"]
    assert outside.value == pytest.approx(10_000, rel=1e-6)
    assert "1 obstacle(s) as a whole" in outside.message


def test_obstacles_that_cover_the_land_are_refused() -> None:
    with pytest.raises(BoundaryError, match="cover the whole land"):
        laid_out(given(obstacles=(SQUARE.buffer(1),)))


def test_land_too_narrow_at_an_obstacle_goes_with_it() -> None:
    # a strip of 2 m between the lake and the rim
    layout = laid_out(given(obstacles=(shapely.box(100, 2, 300, 60),)))
    (grown,) = [i for i in layout.issues if i.code == "obstacles_grown"]
    assert grown.value == pytest.approx(400, rel=0.05)
    assert layout.mesh.face_area.sum() == pytest.approx(SQUARE.area - 200 * 60, rel=1e-3)


# --- locked land


@pytest.mark.parametrize("place", [(150, 150), (0, 0), (390, 200)])
def test_locked_land_stays_one_parcel_and_is_reached(place: tuple[float, float]) -> None:
    x, y = place
    estate = shapely.box(x, y, x + 90, y + 70)
    layout = laid_out(given(locked=(LockedLand(estate, "school"),)))
    (face,) = np.flatnonzero(layout.face_locked)
    wanted = shapely.intersection(estate, SQUARE)
    polygon = layout.mesh.face_polygons()[face]
    assert shapely.symmetric_difference(polygon, wanted).area < 1e-4
    assert layout.land_uses[layout.face_use[face]] == "school"
    assert layout.frontage[face] > 3
    assert ("locked_outside" in codes(layout)) == (wanted.area < estate.area)


def test_locked_land_may_be_smaller_than_a_parcel_but_no_block_may_without_a_word() -> None:
    kiosk = LockedLand(shapely.box(200, 200, 206, 205))
    layout = laid_out(given(locked=(kiosk,)))
    assert layout.mesh.face_area[layout.face_locked] == pytest.approx([30])
    triangle = (street((0, 30), (30, 0)),)
    cut = laid_out(given(fixed_streets=triangle), simplify=0)
    (small,) = [i for i in cut.issues if i.code == "block_below_min_area"]
    assert small.value == pytest.approx(450)
    unlisted = cut.replace(issues=())
    assert [c.name for c in certificate(unlisted).failures] == ["min_area"]


# --- given streets

LINES: dict[str, Sequence[FixedStreet]] = {
    "through": [street((-20, 150), (180, 200), (420, 230))],
    "crossing": [street((-20, 150), (420, 230)), street((150, -20), (230, 420))],
    "dangling": [street((-20, 150), (220, 200))],
    "island": [street((120, 150), (200, 250), (290, 260))],
    "ring": [street((150, 120), (260, 110), (280, 250), (140, 240), (150, 120))],
    "to the corner": [street((400, 400), (200, 150), (0, 0))],
    "itself": [street((50, 50), (350, 350), (350, 60), (60, 340))],
    "tree": [
        street((0, 200), (300, 200)),
        street((100, 200), (100, 320)),
        street((200, 200), (210, 90), (290, 60)),
    ],
    "along the rim": [street((50, 0.6), (350, 0.4), (399.5, 200))],
}


@pytest.mark.parametrize("pattern", ["loop", "tree"])
@pytest.mark.parametrize("name", sorted(LINES))
def test_given_streets_lie_in_the_network(name: str, pattern: str) -> None:
    lines = LINES[name]
    layout = laid_out(given(fixed_streets=tuple(lines)), pattern=pattern)
    found = given_lines(layout)
    wanted = shapely.intersection(shapely.union_all([s.line for s in lines]), SQUARE)
    missing = shapely.difference(wanted, shapely.buffer(found, BESIDE))
    assert missing.length < 1e-3, codes(layout)
    beyond = shapely.difference(found, shapely.buffer(wanted, BESIDE))
    assert beyond.length < 1e-3
    assert not any(code == "fixed_street_dropped" for code in codes(layout))
    assert layout.edge_street[layout.edge_fixed != NOT_FIXED].all()
    assert (layout.edge_level[layout.edge_fixed != NOT_FIXED] == 0).all()


@pytest.mark.parametrize("land", ["ellipse", "ell", "star", "lakes", "triangle"])
@pytest.mark.parametrize("rim", ["street", "none"])
def test_given_streets_on_many_lands(land: str, rim: str) -> None:
    x0, y0, x1, y1 = LANDS[land].bounds
    lines = (
        street((x0 - 9, 0.4 * y0 + 0.6 * y1), (x1 + 9, 0.5 * (y0 + y1))),
        street((0.7 * x0 + 0.3 * x1, y0 - 9), (0.6 * x0 + 0.4 * x1, 0.4 * y0 + 0.6 * y1)),
    )
    layout = laid_out(given(LANDS[land], fixed_streets=lines), simplify=0, rim=rim)
    ground = shapely.union_all(layout.mesh.face_polygons())
    wanted = shapely.intersection(shapely.union_all([s.line for s in lines]), ground)
    dropped = sum(i.value for i in layout.issues if i.code == "fixed_street_dropped")
    missing = shapely.difference(wanted, shapely.buffer(given_lines(layout), BESIDE))
    assert missing.length <= dropped + 1e-3


def test_class_and_width_are_kept() -> None:
    lines = (
        street((-20, 150), (420, 230), name="main road", width=22.5),
        street((150, -20), (230, 420)),
    )
    table = street_table(laid_out(given(fixed_streets=lines)))
    first, second = table["fixed_id"] == 1, table["fixed_id"] == 2
    assert set(table["class"][first]) == {"main road"}
    assert set(table["width_m"][first]) == {22.5}
    assert set(table["class"][second]) == {"fixed"}
    assert not np.isin("fixed", table["class"][np.isnan(table["fixed_id"])])


def test_streets_outside_are_cut_off_and_counted() -> None:
    lines = (street((-100, 200), (500, 200)), street((500, 0), (600, 100)))
    layout = laid_out(given(fixed_streets=lines))
    (outside,) = [i for i in layout.issues if i.code == "fixed_street_outside"]
    assert outside.value == pytest.approx(200 + 100 * 2**0.5, abs=3)
    assert "1 of 2 streets have nothing left" in outside.message


def test_streets_given_twice_count_once() -> None:
    one = street((-20, 150), (420, 230), name="first")
    beside = street((-20, 150.4), (420, 230.4), name="second")
    layout = laid_out(given(fixed_streets=(one, one, beside)))
    table = street_table(layout)
    assert set(table["fixed_id"][~np.isnan(table["fixed_id"])]) == {1.0}
    (doubled,) = [i for i in layout.issues if i.code == "fixed_street_doubled"]
    assert doubled.value == pytest.approx(
        2 * shapely.intersection(one.line, SQUARE).length, rel=0.01
    )


@pytest.mark.parametrize("gap", [-0.7, 0.7])
def test_ends_join_within_the_tolerance(gap: float) -> None:
    lines = (street((0.6, 200), (399.5, 200)), street((200, 200 + gap), (200, 399.4)))
    layout = laid_out(given(fixed_streets=lines))
    assert not (ends_of(layout)).any()
    apart = laid_out(given(fixed_streets=lines), snap_tolerance=0.1, pattern="tree")
    assert any("fixed" in code for code in codes(apart)) or ends_of(apart).any() or gap < 0


def near_corner(*places: tuple[float, float]) -> Site:
    """A pointed land, and a street by way of places that are given from its point."""
    land = shapely.Polygon([(0, 0), (400, 0), (430, 200), (400, 400), (0, 400)])
    line = street((100, 210), *((430 + x, 200 + y) for x, y in places))
    return given(land, fixed_streets=(line, street((100, 210), (0, 180))))


@pytest.mark.parametrize(
    "site",
    [
        near_corner((-2e-6, -1e-6), (0, 0)),
        near_corner((-2e-6, -1e-6), (3e-6, 0)),
        near_corner((-3e-5, 2e-5), (-1e-6, 1e-6), (50, 3)),
        near_corner((-4e-4, 3e-4), (-1e-6, 2e-6)),
        near_corner((-4e-4, 3e-4), (-1e-6, 2e-6), (-1e-6, 3e-5)),
    ],
)
def test_no_edge_is_as_short_as_a_rounding_error(site: Site) -> None:
    ground = divide_land(site, min_area=900, snap=1.0)
    assert len(ground.polygons) == 2
    assert shapely.coverage_is_valid(ground.polygons)
    assert sum(p.area for p in ground.polygons) == pytest.approx(site.area, abs=1e-3)
    for polygon in ground.polygons:
        xy = shapely.get_coordinates(polygon)
        assert np.hypot(*np.diff(xy, axis=0).T).min() > 1
    length = np.hypot(*(ground.segments[:, 1] - ground.segments[:, 0]).T)
    assert length.sum() == pytest.approx(
        shapely.length([s.line for s in site.fixed_streets]).sum(), abs=60
    )
    layout = laid_out(site, parcels=None, min_area=900)
    assert "parcel_not_cut" not in codes(layout)


def test_a_given_dead_end_stays_and_is_told_of_where_nothing_joins_it() -> None:
    # its face is large, but cut so that the tip need not be met
    layout = laid_out(given(fixed_streets=(street((-20, 200), (200, 200)),)), parcels=12)
    tips = ends_of(layout)
    listed = [i.geometry for i in layout.issues if i.code == "fixed_dead_end"]
    assert len(listed) == int(tips.sum())


def test_a_street_is_cut_at_an_obstacle_and_at_locked_land() -> None:
    line = street((-20, 190), (420, 190))
    estate = shapely.box(300, 150, 360, 230)
    layout = laid_out(given(obstacles=(LAKE,), locked=(LockedLand(estate),), fixed_streets=(line,)))
    found = given_lines(layout)
    assert not shapely.intersects(found, LAKE.buffer(-1e-3))
    assert not shapely.intersects(found, estate.buffer(-1e-3))
    assert found.length == pytest.approx(400 - 120 - 60, abs=2)


def test_a_stub_in_a_block_too_small_to_be_cut_is_left_out_and_told_of() -> None:
    frame = [street((100, 0), (100, 60)), street((160, 0), (160, 60)), street((100, 60), (160, 60))]
    stub = street((130, 60), (130, 30))
    layout = laid_out(given(fixed_streets=(*frame, stub)), parcels=None, min_area=2000)
    (dropped,) = [i for i in layout.issues if i.code == "fixed_street_dropped"]
    assert dropped.value == pytest.approx(30, abs=1)


@pytest.mark.parametrize("name", ["crossing", "tree", "itself"])
def test_given_streets_stay_where_net_areas_are_promised(name: str) -> None:
    site = given(fixed_streets=tuple(LINES[name]), entries=np.array([[0.0, 60.0]]))
    values = {"min_area": 2500, "min_area_basis": "net", "rim": "none"}
    layout = cogenerate(site, CogenerateParams(**values))
    wanted = shapely.intersection(shapely.union_all([s.line for s in LINES[name]]), SQUARE)
    missing = shapely.difference(wanted, shapely.buffer(given_lines(layout), BESIDE))
    assert missing.length < 1e-3
    at = layout.mesh.origin[np.repeat(layout.edge_street, 2)]
    assert np.isin(np.flatnonzero(layout.vertex_entry), at).all()


# --- the rim


@pytest.mark.parametrize("pattern", ["loop", "tree"])
@pytest.mark.parametrize("name", sorted(LANDS))
def test_without_street_on_the_rim_all_parcels_are_reached(name: str, pattern: str) -> None:
    layout = laid_out(given(LANDS[name]), rim="none", pattern=pattern)
    rim = layout.edge_kind != EdgeKind.INTERIOR
    assert not layout.edge_street[rim].any()
    (chosen,) = [i for i in layout.issues if i.code == "entry_chosen"]
    kinds = junction_table(layout)
    (at,) = np.flatnonzero(kinds["kind"] == "entry")
    assert shapely.distance(kinds.geometry[at], chosen.geometry) < 1e-6
    assert (
        shapely.distance(
            kinds.geometry[at], shapely.union_all([p.exterior for p in site_of(LANDS[name]).parts])
        )
        < 30
    )


@pytest.mark.parametrize("rim", ["street", "none"])
@pytest.mark.parametrize("land", [SQUARE, ell(), ellipse(), star(5)])
def test_the_network_meets_the_outside_at_the_entries(land: shapely.Polygon, rim: str) -> None:
    ring = land.exterior
    places = np.array(
        [ring.interpolate(share, normalized=True).coords[0] for share in (0.11, 0.37, 0.8)]
    )
    layout = laid_out(given(land, entries=places), rim=rim, pattern="tree")
    table = junction_table(layout)
    found = table.geometry[table["kind"] == "entry"]
    assert len(found) == 3
    assert shapely.distance(shapely.points(places), shapely.union_all(found)).max() < 1e-5
    at = layout.mesh.origin[np.repeat(layout.edge_street, 2)]
    assert np.isin(np.flatnonzero(layout.vertex_entry), at).all()
    assert "entry_chosen" not in codes(layout)


@pytest.mark.parametrize("except_lines", [False, True])
@pytest.mark.parametrize("land", [SQUARE, star(3), ellipse()])
def test_lines_say_which_part_of_the_rim_is_street(
    land: shapely.Polygon, except_lines: bool
) -> None:
    ring = land.exterior
    line = shapely.ops.substring(ring, 0.2, 0.55, normalized=True)
    beside = shapely.transform(line, lambda xy: xy + 0.5)
    values = {"rim": "except-lines"} if except_lines else {}
    layout = laid_out(given(land, rim_lines=(beside,)), **values, simplify=0)
    mesh = layout.mesh
    middle = shapely.points(mesh.xy[mesh.origin.reshape(-1, 2)].mean(axis=1))
    rim = layout.edge_kind == EdgeKind.RIM
    along = shapely.distance(middle, shapely.buffer(line, 1.0)) == 0
    assert (layout.edge_street[rim] == (along[rim] != except_lines)).all()


def test_entries_in_an_obstacle_are_refused_by_number() -> None:
    site = given(obstacles=(BAY,), entries=np.array([[0.0, 100.0], [210.0, 400.0]]))
    with pytest.raises(BoundaryError, match="Entry 2 lies in an obstacle"):
        laid_out(site)


def test_contradictions_are_named_together() -> None:
    site = given(rim_lines=(shapely.LineString([(0, 0), (100, 0)]),))
    with pytest.raises(ParameterError) as error:
        laid_out(site, rim="none", obstacle_rim="street")
    assert len(error.value.problems) == 2
    with pytest.raises(ParameterError, match="needs rim-lines"):
        laid_out(given(), rim="along-lines")


# --- all of it


def everything() -> Site:
    return given(
        obstacles=(BAY, shapely.Point(300, 120).buffer(35)),
        locked=(LockedLand(shapely.box(40, 40, 100, 90), "estate"),),
        fixed_streets=(
            street((-20, 220), (420, 240), name="main", width=20.0),
            street((150, 225), (160, 120)),
        ),
        rim_lines=(shapely.LineString([(0, 300), (0, 0), (400, 0)]),),
        entries=np.array([[400.0, 300.0]]),
    )


def test_the_same_input_gives_the_same_layout() -> None:
    first, second = laid_out(everything()), laid_out(everything())
    for field in dataclasses.fields(Layout):
        a, b = getattr(first, field.name), getattr(second, field.name)
        if isinstance(a, np.ndarray):
            np.testing.assert_array_equal(a, b)
    assert first.mesh.xy.tobytes() == second.mesh.xy.tobytes()
