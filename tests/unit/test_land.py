"""Simplification of the land, corners given by the user, and parts that must not meet."""

from __future__ import annotations

import dataclasses
import time

import numpy as np
import pytest
import shapely
from lands import ellipse, site_of

from urban_processing.errors import BoundaryError
from urban_processing.land import (
    _kept_apart,
    first_layout,
    land_corners,
    place_corners,
    simplify_site,
)
from urban_processing.layout import Layout
from urban_processing.mesh.planar import FloatArray
from urban_processing.site import Site, snap_to_grid


def rough(n: int, noise: float, *, size: float = 1000.0) -> shapely.Polygon:
    """A disc whose n vertices jitter in and out by up to `noise` metres."""
    rng = np.random.default_rng(0)
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    r = size + rng.uniform(-noise, noise, n)
    return shapely.Polygon(np.column_stack([r * np.cos(t), r * np.sin(t)]))


def with_corners(site: Site, corners: object) -> Site:
    return dataclasses.replace(site, corners=snap_to_grid(np.asarray(corners, dtype=float)))


def flagged(layout: Layout) -> list[tuple[float, float]]:
    return sorted(map(tuple, layout.mesh.xy[layout.vertex_corner].tolist()))


def as_pairs(xy: FloatArray) -> list[tuple[float, float]]:
    return sorted(map(tuple, xy.tolist()))


def codes(items: Site | Layout) -> list[str]:
    return [issue.code for issue in items.issues]


@pytest.mark.parametrize(("noise", "tolerance"), [(5, 5), (5, 60), (20, 20), (80, 60), (80, 200)])
def test_rough_rings_are_simplified_fast(noise: float, tolerance: float) -> None:
    site = site_of(rough(4000, noise))
    start = time.process_time()
    simple = simplify_site(site, tolerance)
    # some 0.4 s; ten times as much without the thinning before the buffers
    assert time.process_time() - start < 2.0
    (a,), (b,) = site.parts, simple.parts
    assert b.is_valid
    assert shapely.get_num_coordinates(b) < 0.5 * shapely.get_num_coordinates(a)
    assert a.symmetric_difference(b).area <= 0.05 * a.area


def test_narrow_inlets_and_spurs_go() -> None:
    inlet = shapely.box(97, 50, 103, 300)
    spur = shapely.box(300, 145, 500, 153)
    land = shapely.box(0, 0, 300, 300).difference(inlet).union(spur)
    (part,) = simplify_site(site_of(land), 30.0).parts
    assert part.symmetric_difference(shapely.box(0, 0, 300, 300)).area < 50


def test_given_corners_stay_through_the_simplification() -> None:
    ring = shapely.get_coordinates(ellipse(n=400))
    site = with_corners(site_of(ellipse(n=400)), ring[[3, 77, 140, 151, 290]])
    simple = simplify_site(site, 15.0)
    assert shapely.get_num_coordinates(simple.parts[0]) < 60
    assert as_pairs(simple.corners) == as_pairs(site.corners)
    layout = first_layout(simple, min_area=500)
    assert layout.corners_given
    assert flagged(layout) == as_pairs(site.corners)
    assert codes(layout) == ["boundary_simplified"]


@pytest.mark.parametrize("tolerance", [0.0, 10.0])
def test_given_corners_between_vertices_become_vertices(tolerance: float) -> None:
    site = with_corners(
        site_of(shapely.box(0, 0, 400, 400)), [(0, 0), (150.3, -1), (400, 200), (153.3, 401)]
    )
    layout = first_layout(simplify_site(site, tolerance), min_area=500)
    wanted = [(0, 0), (150.3, 0), (153.3, 400), (400, 200)]
    np.testing.assert_allclose(flagged(layout), wanted, atol=1e-5)
    assert layout.mesh.n_vertices == 4 + 3
    assert codes(layout) == []


def test_a_corner_takes_a_vertex_within_a_tenth_of_the_tolerance() -> None:
    site = with_corners(site_of(shapely.box(0, 0, 400, 400)), [(2, 0), (400, 0), (400, 400)])
    near = simplify_site(site, 30.0)
    assert near.corners[0].tolist() == [0, 0]
    far = simplify_site(site, 10.0)
    assert far.corners[0].tolist() == [2, 0]


def test_corners_keep_spurs_but_lie_on_outer_rings_alone() -> None:
    spur = shapely.box(300, 145, 500, 155)
    land = shapely.box(0, 0, 300, 300).union(spur).difference(shapely.box(3, 3, 100, 100))
    site = with_corners(site_of(land), [(500, 145), (500, 155), (0, 300), (4, 4)])
    simple = simplify_site(site, 30.0)
    layout = first_layout(simple, min_area=500)
    kept = flagged(layout)
    assert {(500.0, 145.0), (500.0, 155.0), (0.0, 300.0)} <= set(kept)
    assert len(kept) == 4
    outer = shapely.get_coordinates(simple.parts[0].exterior).tolist()
    assert all(list(corner) in outer for corner in kept)
    assert simple.parts[0].area == pytest.approx(land.area, rel=0.01)


def test_moved_corners_are_reported_once() -> None:
    corners = [(0, 0), (400, 0), (400, 400), (200, 410)]
    site = with_corners(site_of(shapely.box(0, 0, 400, 400)), corners)
    placed = place_corners(site)
    (issue,) = placed.issues
    assert issue.code == "corner_moved"
    assert issue.value == pytest.approx(10)
    assert issue.limit == pytest.approx(4)
    assert issue.geometry == shapely.Point(200, 400)
    assert codes(place_corners(placed)) == ["corner_moved"]
    assert codes(first_layout(simplify_site(site, 10.0), min_area=500)) == ["corner_moved"]


def test_too_few_corners_fall_back_to_angles() -> None:
    site = with_corners(site_of(shapely.box(0, 0, 400, 400)), [(100, 0), (100, 0), (0, 300)])
    layout = first_layout(site, min_area=500)
    (issue,) = layout.issues
    assert (issue.code, issue.part, issue.value) == ("too_few_corners", 0, 2)
    assert not layout.corners_given
    np.testing.assert_array_equal(layout.vertex_corner, land_corners(layout.mesh))


def test_parts_without_corners_are_told_apart_from_those_with_some() -> None:
    site = site_of(ellipse(n=40), shapely.box(1000, 0, 1100, 100))
    ring = shapely.get_coordinates(site.parts[0].exterior)
    layout = first_layout(with_corners(site, ring[[2, 15, 28]]), min_area=500)
    (issue,) = layout.issues
    assert (issue.code, issue.part, issue.value) == ("too_few_corners", 1, 0)
    assert layout.corners_given
    box = [(1000.0, 0.0), (1000.0, 100.0), (1100.0, 0.0), (1100.0, 100.0)]
    assert flagged(layout) == sorted([*map(tuple, ring[[2, 15, 28]].tolist()), *box])


def test_parts_taken_back_are_compared_again() -> None:
    box = shapely.box
    given = [box(0, 0, 10, 10), box(11, 0, 20, 10), box(21, 0, 30, 10), box(40, 0, 50, 10)]
    # the first two meet; the second as given then meets the third
    simple = [box(0, 0, 12, 10), box(11, 0, 18, 10), box(19, 0, 30, 10), box(39, 0, 50, 10)]
    assert _kept_apart(given, simple) == [*given[:3], simple[3]]
    # parts that met already do not keep it from ending
    assert _kept_apart([given[0], given[0]], [given[0], given[0]]) == [given[0], given[0]]


def test_a_changed_ring_with_as_many_vertices_is_kept() -> None:
    # an inlet that is narrow at its end alone: filled there, it has as many vertices as before
    land = shapely.Polygon(
        [(0, 0), (300, 0), (300, 300), (170, 300), (150, 20), (130, 300), (0, 300)]
    )
    site = site_of(land)
    simple = simplify_site(site, 20.0)
    moved = land.symmetric_difference(simple.parts[0]).area
    assert shapely.get_num_coordinates(simple.parts[0]) == shapely.get_num_coordinates(land)
    assert moved > 0
    assert codes(simple) == ["boundary_simplified"]


@pytest.mark.parametrize(
    "other",
    [
        shapely.box(100, 20, 150, 50),
        shapely.box(90, 20, 150, 50),
        shapely.box(40, 40, 60, 60),
    ],
    ids=["edge", "overlap", "filled hole"],
)
def test_parts_that_share_a_line_are_refused(other: shapely.Polygon) -> None:
    land = shapely.box(0, 0, 100, 100).difference(shapely.box(40, 40, 60, 60))
    for tolerance in (0.0, 5.0):
        site = simplify_site(site_of(land, other), tolerance)
        with pytest.raises(BoundaryError, match="Parts 1 and 2"):
            first_layout(site, min_area=100)


def test_parts_may_touch_at_points() -> None:
    site = site_of(shapely.box(0, 0, 100, 100), shapely.box(100, 100, 150, 150))
    assert first_layout(site, min_area=100).mesh.n_faces == 2


def test_simplification_makes_no_shared_lines() -> None:
    x = np.linspace(0, 100, 21)
    sag = 3 * np.sin(np.pi * x / 100)
    upper = shapely.Polygon([*np.column_stack([x, sag]), (100, 100), (0, 100)])
    lower = shapely.Polygon([*np.column_stack([x, -sag])[::-1], (0, -90), (100, -90)])
    site = simplify_site(site_of(upper, lower), 10.0)
    assert first_layout(site, min_area=100).mesh.n_faces == 2
