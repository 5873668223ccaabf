"""Cuts through holes: every result is a valid partition without slits, whatever the holes."""

from __future__ import annotations

import time

import numpy as np
import pytest
import shapely
from lands import site_of

from urban_processing.land import first_layout
from urban_processing.layout import EdgeKind, Layout
from urban_processing.metrics import certificate
from urban_processing.params import CogenerateParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.subdivision.holes import cut_through_holes

LAND = shapely.box(0, 0, 600, 400)


def lakes(seed: int, *, grid: float = 0.0, diamonds: bool = False) -> shapely.Polygon:
    """A rectangle with random lakes; on a grid they often touch each other or the rim."""
    rng = np.random.default_rng(seed)
    land = LAND
    for _ in range(int(rng.integers(2, 9))):
        corner, size = rng.uniform([0, 0], [600, 400]), rng.uniform(10, 150, 2)
        if grid:
            corner = np.round(corner / grid) * grid
            size = np.maximum(grid, np.round(size / grid) * grid)
        w, h = size
        ring = [(0, 0), (w, 0), (w, h), (0, h)]
        if diamonds:
            ring = [(w / 2, 0), (w, h / 2), (w / 2, h), (0, h / 2)]
        rest = land.difference(shapely.Polygon(np.array(ring) + corner))
        land = max(shapely.get_parts(rest), key=lambda part: part.area)
    return land


def diamond(x: float, y: float, r: float) -> shapely.Polygon:
    return shapely.Polygon([(x - r, y), (x, y - r), (x + r, y), (x, y + r)])


def ponds(n: int, size: float) -> shapely.Polygon:
    """A square with n times n ponds of 4 m."""
    at = (np.arange(n) + 0.5) * size / n
    water = [shapely.box(x - 2, y - 2, x + 2, y + 2) for x in at for y in at]
    return shapely.box(0, 0, size, size).difference(shapely.union_all(water))


def three_boxes() -> shapely.Polygon:
    water = [shapely.box(x, 40, x + 20, 60) for x in (40, 140, 240)]
    return shapely.box(0, 0, 300, 100).difference(shapely.union_all(water))


TOUCHING = {
    "rim": LAND.difference(diamond(40, 200, 40)),
    "rim twice": LAND.difference(diamond(40, 200, 40)).difference(diamond(300, 50, 50)),
    "holes": LAND.difference(diamond(200, 200, 60)).difference(diamond(320, 200, 60)),
    "chain": LAND.difference(shapely.union_all([diamond(x, 200, 50) for x in (50, 150, 250)])),
    "corners": LAND.difference(shapely.box(100, 100, 200, 200)).difference(
        shapely.box(200, 200, 300, 300)
    ),
}

RANDOM = [
    *(pytest.param(lakes(s), id=f"lakes-{s}") for s in range(8)),
    *(pytest.param(lakes(s, grid=20), id=f"grid-{s}") for s in range(8)),
    *(pytest.param(lakes(s, grid=20, diamonds=True), id=f"diamonds-{s}") for s in range(8)),
]

FIXED = [
    *(pytest.param(land, id=name) for name, land in TOUCHING.items()),
    pytest.param(ponds(5, 500.0), id="ponds"),
    pytest.param(three_boxes(), id="boxes"),
]


def no_slits(layout: Layout) -> bool:
    sides = layout.mesh.face.reshape(-1, 2)
    return bool((sides[:, 0] != sides[:, 1]).all())


def assert_partition(layout: Layout, land: shapely.Polygon) -> None:
    layout.mesh.validate()
    polygons = layout.mesh.face_polygons()
    assert shapely.is_valid(polygons).all()
    assert shapely.coverage_is_valid(polygons)
    assert no_slits(layout)
    assert shapely.area(polygons).sum() == pytest.approx(land.area, rel=1e-9)


@pytest.mark.parametrize("share", [2.1, 6, 40])
@pytest.mark.parametrize("land", RANDOM + FIXED)
def test_cut_land_is_a_valid_partition(land: shapely.Polygon, share: float) -> None:
    least = land.area / share
    layout, parent = cut_through_holes(first_layout(site_of(land), min_area=least), min_area=least)
    assert_partition(layout, land)
    assert (parent == 0).all()
    assert len(parent) == layout.mesh.n_faces
    area, holed = layout.mesh.face_area, layout.mesh.face_n_loops > 1
    assert area.min() >= least
    # large parcels with holes are locked, and each is listed once
    kept = np.flatnonzero(holed & (area >= 2 * least))
    assert np.array_equal(np.flatnonzero(layout.face_locked), kept)
    assert sorted(i.parcel_id or 0 for i in layout.issues) == (kept + 1).tolist()
    assert {i.code for i in layout.issues} <= {"hole_not_cut"}


@pytest.mark.parametrize("parcels", [2, 12])
@pytest.mark.parametrize("land", RANDOM[::4] + FIXED)
def test_certificate_holds_for_land_with_holes(land: shapely.Polygon, parcels: int) -> None:
    params = CogenerateParams(parcels=parcels, simplify=0.0)
    layout = cogenerate(site_of(land), params)
    layout.mesh.validate()
    # where every cut ends at a pond, a parcel may be out of the streets' reach: then it is listed
    listed = {i.parcel_id for i in layout.issues if i.code == "parcel_not_reached"}
    broken = [c for c in certificate(layout).failures if c.name != "reached"]
    assert [c.message for c in broken] == []
    assert set(certificate(layout).check("reached").offenders) <= listed


@pytest.mark.parametrize("land", FIXED)
def test_small_parcels_leave_no_hole(land: shapely.Polygon) -> None:
    least = land.area / 200
    layout, _ = cut_through_holes(first_layout(site_of(land), min_area=least), min_area=least)
    assert (layout.mesh.face_n_loops == 1).all()
    assert not layout.issues


def test_one_hole_gets_one_straight_square_cut() -> None:
    land = LAND.difference(shapely.box(280, 180, 320, 220))
    layout, _ = cut_through_holes(first_layout(site_of(land), min_area=100), min_area=100)
    assert layout.mesh.n_faces == 2
    new = np.flatnonzero(layout.edge_kind == EdgeKind.INTERIOR)
    assert layout.mesh.edge_length[new] == pytest.approx([180, 180])
    assert (layout.edge_street == (layout.edge_kind == EdgeKind.RIM)).all()


def test_corners_and_streets_follow_the_cuts() -> None:
    start = first_layout(site_of(ponds(3, 300.0)), min_area=500)
    layout, _ = cut_through_holes(start, min_area=500)
    before, after = start.mesh, layout.mesh
    assert {*map(tuple, before.xy[start.vertex_corner])} == {
        *map(tuple, after.xy[layout.vertex_corner])
    }
    for kind in (EdgeKind.RIM, EdgeKind.HOLE):
        old = before.edge_length[start.edge_kind == kind].sum()
        assert after.edge_length[layout.edge_kind == kind].sum() == pytest.approx(old)


def test_land_that_no_straight_cut_halves_stays_whole() -> None:
    # a pond in a corner: what a cut through it takes off is too small or the rest is
    land = LAND.difference(shapely.box(10, 10, 14, 14))
    least = 0.4999 * land.area
    layout, parent = cut_through_holes(first_layout(site_of(land), min_area=least), min_area=least)
    assert_partition(layout, land)
    assert layout.mesh.face_n_loops.tolist() == [2]
    assert layout.face_locked.all()
    assert [i.code for i in layout.issues] == ["hole_not_cut"]
    assert (parent == 0).all()


def test_many_ponds_take_seconds() -> None:
    least = 1500.0
    land = ponds(10, 1000.0)
    started = time.perf_counter()
    layout, _ = cut_through_holes(first_layout(site_of(land), min_area=least), min_area=least)
    assert time.perf_counter() - started < 10
    assert_partition(layout, land)
    assert (layout.mesh.face_n_loops == 1).all()
