"""Cuts of parcels: candidates, scores, insertion, short edges, holes."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from lands import LANDS, holed, site_of

from urban_processing.land import first_layout, simplify_site
from urban_processing.layout import Layout
from urban_processing.mesh.corners import side_irregularity
from urban_processing.params import CogenerateParams
from urban_processing.subdivision.holes import cut_through_holes
from urban_processing.subdivision.level import cut_level
from urban_processing.subdivision.parcels import parcel_rings
from urban_processing.subdivision.prospect import (
    prospect_of_area,
    prospect_of_quota,
)
from urban_processing.subdivision.short_edges import remove_short_edges
from urban_processing.subdivision.streamline import propose_cuts

PARAMS = CogenerateParams(min_area=500)
PRINTED = CogenerateParams(min_area=500, preset="chen2024")


def start(name: str, min_area: float = 500.0) -> Layout:
    return first_layout(site_of(LANDS[name]), min_area=min_area)


def exact_partition(layout: Layout, land: shapely.Polygon) -> None:
    layout.mesh.validate()
    polygons = layout.mesh.face_polygons()
    assert shapely.is_valid(polygons).all()
    assert shapely.coverage_is_valid(polygons)
    assert sum(p.area for p in polygons) == pytest.approx(land.area, rel=1e-8)


@pytest.mark.parametrize("name", ["square", "triangle", "ellipse", "ell", "star", "strip"])
@pytest.mark.parametrize("params", [PARAMS, PRINTED], ids=["recommended", "chen2024"])
def test_candidates_end_on_the_ring_and_are_ranked(name: str, params: CogenerateParams) -> None:
    layout = start(name)
    parcels = parcel_rings(layout, np.array([0]))
    (cuts,) = propose_cuts(parcels, min_area=500, params=params)
    assert cuts
    assert [c.quality for c in cuts] == sorted((c.quality for c in cuts), reverse=True)
    n = len(parcels.half_edge)
    for cut in cuts:
        assert 0 <= cut.edge_a < n
        assert 0 <= cut.edge_b < n
        for edge, along, end in ((cut.edge_a, cut.along_a, 0), (cut.edge_b, cut.along_b, -1)):
            a, b = parcels.xy[edge], parcels.xy[(edge + 1) % n]
            scale = np.sqrt(layout.mesh.face_area[0])
            assert np.hypot(*(a + along * (b - a) - cut.path[end])) < 0.1 * scale


@pytest.mark.parametrize("name", sorted(LANDS))
def test_levels_keep_an_exact_partition_above_the_smallest_area(name: str) -> None:
    layout, _ = cut_through_holes(start(name), min_area=500)
    for _ in range(5):
        todo = np.flatnonzero(layout.mesh.face_area >= 1000)
        before = layout.mesh.n_faces
        layout, cut, parent = cut_level(layout, todo, min_area=500, params=PARAMS)
        assert layout.mesh.n_faces == before + cut.sum()
        assert (np.bincount(parent, minlength=before)[todo] == 1 + cut).all()
        exact_partition(layout, LANDS[name])
        assert layout.mesh.face_area.min() >= 500


def test_square_is_halved() -> None:
    layout, cut, _ = cut_level(start("square"), np.array([0]), min_area=500, params=PARAMS)
    assert cut.all()
    assert layout.mesh.face_area == pytest.approx([80000, 80000], rel=1e-3)
    assert layout.mesh.n_edges <= 9  # a straight cut


@pytest.mark.parametrize("name", ["triangle", "ellipse", "ell", "star"])
def test_parcel_of_just_over_two_smallest_areas_is_still_cut(name: str) -> None:
    least = LANDS[name].area / 2.02
    layout, cut, _ = cut_level(start(name, least), np.array([0]), min_area=least, params=PARAMS)
    assert cut.all()
    assert layout.mesh.face_area.min() >= least


def test_no_cut_below_two_smallest_areas() -> None:
    least = LANDS["square"].area / 1.99
    _, cut, _ = cut_level(start("square"), np.array([0]), min_area=least, params=PARAMS)
    assert not cut.any()


def test_quota_of_three_leaves_a_third() -> None:
    site = site_of(shapely.box(0, 0, 300, 100))
    layout, _, _ = cut_level(
        first_layout(site, min_area=5000),
        np.array([0]),
        min_area=5000,
        params=PARAMS,
        quota=np.array([3]),
    )
    assert sorted(layout.mesh.face_area) == pytest.approx([10000, 20000], rel=0.01)


@pytest.mark.parametrize("preset", ["recommended", "chen2024"])
def test_cuts_follow_the_preferred_orientation(preset: str) -> None:
    def chord(orientation: float) -> np.ndarray:
        params = CogenerateParams(min_area=500, orientation=orientation, preset=preset)
        parcels = parcel_rings(start("square", 70000.0), np.array([0]))
        path = propose_cuts(parcels, min_area=70000, params=params)[0][0].path
        return np.abs(path[-1] - path[0])

    east, north = chord(0.0), chord(90.0)
    assert east[0] > 10 * east[1]
    assert north[1] > 10 * north[0]


def test_short_edge_is_merged_and_others_are_not() -> None:
    layout = start("square", 100.0)
    params = CogenerateParams(min_area=100)
    for _ in range(5):
        todo = np.flatnonzero(layout.mesh.face_area >= 200)
        layout, _, _ = cut_level(layout, todo, min_area=100, params=params)
    again = remove_short_edges(layout, min_area=100)
    exact_partition(again, LANDS["square"])
    assert again.mesh.n_faces == layout.mesh.n_faces


def brick() -> Layout:
    """Four parcels whose two vertical cuts miss each other by a little."""
    from urban_processing.layout import layout_from_mesh
    from urban_processing.mesh.build import mesh_from_polygons
    from urban_processing.site import Frame

    low = [
        shapely.Polygon([(0, 0), (20, 0), (20, 20), (0, 20)]),
        shapely.Polygon([(20, 0), (42, 0), (42, 20), (22, 20), (20, 20)]),
    ]
    high = [
        shapely.Polygon([(0, 20), (20, 20), (22, 20), (22, 40), (0, 40)]),
        shapely.Polygon([(22, 20), (42, 20), (42, 40), (22, 40)]),
    ]
    mesh = mesh_from_polygons(low + high)
    corner = np.isin(mesh.xy[:, 0], (0, 42)) & np.isin(mesh.xy[:, 1], (0, 40))
    return layout_from_mesh(
        mesh, frame=Frame(), face_part=np.zeros(4, dtype=int), min_area=350, vertex_corner=corner
    )


def test_brick_pattern_becomes_a_crossing() -> None:
    layout = brick()
    merged = remove_short_edges(layout, min_area=350)
    merged.mesh.validate()
    inner = ~merged.mesh.vertex_is_boundary
    assert merged.mesh.valence[inner].tolist() == [4]
    assert merged.mesh.xy[inner].tolist() == [[21, 20]]
    assert merged.mesh.face_area.sum() == layout.mesh.face_area.sum()


def test_merge_never_goes_below_the_smallest_area() -> None:
    assert remove_short_edges(brick(), min_area=435).mesh.n_vertices == brick().mesh.n_vertices


@pytest.mark.parametrize("holes", [1, 2, 3, 5])
def test_cuts_go_through_holes(holes: int) -> None:
    land = holed(seed=holes, holes=holes)
    layout = first_layout(site_of(land), min_area=100)
    cut, parent = cut_through_holes(layout, min_area=100)
    exact_partition(cut, land)
    assert (cut.mesh.face_n_loops == 1).all()
    assert cut.mesh.n_faces >= 2
    assert (parent == 0).all()
    assert not cut.issues


def test_holes_side_by_side_and_nested_cuts() -> None:
    land = shapely.box(0, 0, 100, 300)
    for y in (40, 110, 180, 250):
        land = land.difference(shapely.box(40, y - 20, 60, y + 20))
    layout, _ = cut_through_holes(first_layout(site_of(land), min_area=100), min_area=100)
    exact_partition(layout, land)
    sides = layout.mesh.face.reshape(-1, 2)
    assert (sides[:, 0] != sides[:, 1]).all()


def test_parcel_too_small_to_cut_keeps_its_hole() -> None:
    land = shapely.box(0, 0, 10, 10).difference(shapely.box(4, 4, 6, 6))
    layout, _ = cut_through_holes(first_layout(site_of(land), min_area=60), min_area=60)
    assert layout.mesh.face_n_loops.tolist() == [2]


def test_prospect_of_rectangles() -> None:
    two, square = np.array([2.0]), np.array([1.0])
    assert prospect_of_quota(two, np.array([2]))[0] == pytest.approx(0, abs=1e-4)
    assert prospect_of_quota(square, np.array([4]))[0] == pytest.approx(0, abs=1e-4)
    assert prospect_of_quota(square, np.array([1]))[0] == 0
    # 2:1 into four gives 2:1 whatever is done
    assert prospect_of_quota(two, np.array([4]))[0] == pytest.approx(
        side_irregularity(two)[0], abs=1e-3
    )
    assert prospect_of_area(two, np.array([1.5]))[0] == pytest.approx(
        side_irregularity(two)[0], abs=1e-3
    )
    assert prospect_of_area(two, np.array([3.0]))[0] < 0.002


def test_simplification_says_what_it_moved() -> None:
    site = site_of(LANDS["ellipse"])
    simple = simplify_site(site, 10.0)
    assert len(simple.parts[0].exterior.coords) < 40
    (issue,) = simple.issues
    moved = site.parts[0].symmetric_difference(simple.parts[0]).area
    assert issue.code == "boundary_simplified"
    assert issue.value == pytest.approx(moved)
    assert simplify_site(site, 0.0) is site


def test_simplification_keeps_parts_apart() -> None:
    t = np.linspace(0, np.pi, 60)
    bay = shapely.Polygon(
        [
            *np.column_stack([100 * np.cos(t), 100 * np.sin(t)]),
            (-200, 0),
            (-200, 300),
            (200, 300),
            (200, 0),
        ]
    )
    island = shapely.Point(0, 97).buffer(1.5)
    site = simplify_site(site_of(bay, island), 20.0)
    assert site.parts[0].intersection(site.parts[1]).area == 0
