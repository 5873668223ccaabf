"""What must hold of every layout, on many lands."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest
import shapely
import shapely.affinity
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lands import LANDS, holed, site_of, star

from urban_processing.errors import InfeasibleError
from urban_processing.layout import EdgeKind, Layout
from urban_processing.metrics import certificate, measure
from urban_processing.metrics.tables import parcel_table
from urban_processing.params import CogenerateParams, StreetPattern
from urban_processing.pipelines.cogenerate import begin, cogenerate, estimate, step
from urban_processing.progress import CallbackProgress

FEW = settings(
    max_examples=25, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def run(*polygons: shapely.Polygon, **values: object) -> Layout:
    return cogenerate(site_of(*polygons), CogenerateParams(**values))


def street_ends(layout: Layout) -> int:
    at = layout.mesh.origin[np.repeat(layout.edge_street, 2)]
    return int((np.bincount(at) == 1).sum())


def must_hold(layout: Layout) -> None:
    layout.mesh.validate()
    proof = certificate(layout)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]


@pytest.mark.parametrize("name", sorted(LANDS))
@pytest.mark.parametrize("pattern", list(StreetPattern))
@pytest.mark.parametrize("parcels", [2, 9, 60])
def test_certificate_holds(name: str, pattern: StreetPattern, parcels: int) -> None:
    layout = run(LANDS[name], parcels=parcels, pattern=pattern)
    must_hold(layout)
    if pattern is StreetPattern.LOOP:
        assert street_ends(layout) == 0
    assert abs(layout.mesh.n_faces - parcels) <= max(0.03 * parcels, 0)


@pytest.mark.parametrize("preset", ["recommended", "chen2024"])
@pytest.mark.parametrize("name", ["triangle", "ell", "star"])
def test_smallest_area_is_kept_and_cutting_goes_on(name: str, preset: str) -> None:
    layout = run(LANDS[name], min_area=900, preset=preset)
    must_hold(layout)
    area = layout.mesh.face_area
    assert area.min() >= 900
    assert (area > 1800).mean() <= 0.05
    listed = {i.parcel_id for i in layout.issues if i.code == "parcel_not_cut"}
    assert {f + 1 for f in np.flatnonzero(area > 2700)} <= listed


@FEW
@given(
    seed=st.integers(0, 10_000),
    corners=st.integers(5, 24),
    low=st.floats(0.25, 0.95),
    parcels=st.integers(1, 80),
    pattern=st.sampled_from(list(StreetPattern)),
    turn=st.floats(0, 360),
)
def test_random_lands(
    seed: int, corners: int, low: float, parcels: int, pattern: StreetPattern, turn: float
) -> None:
    land = shapely.affinity.rotate(star(seed, corners, low=low), turn)
    if not land.is_valid:
        return
    layout = run(land, parcels=parcels, pattern=pattern, seed=seed)
    must_hold(layout)
    if pattern is StreetPattern.LOOP:
        assert street_ends(layout) == 0


@FEW
@given(seed=st.integers(0, 1000), holes=st.integers(1, 6), parcels=st.integers(8, 80))
def test_random_lakes(seed: int, holes: int, parcels: int) -> None:
    land = holed(seed, holes)
    if not isinstance(land, shapely.Polygon):
        return
    layout = run(land, parcels=parcels, seed=seed)
    must_hold(layout)
    assert street_ends(layout) == 0


@pytest.mark.parametrize("scale", [0.04, 1.0, 3000.0])
def test_nothing_assumes_a_scale(scale: float) -> None:
    land = shapely.affinity.scale(star(5), scale, scale, origin=(0, 0))
    layout = run(land, parcels=40)
    must_hold(layout)
    assert layout.mesh.n_faces == 40


def test_same_seed_same_layout_other_seed_another() -> None:
    first, again = (run(LANDS["star"], parcels=60, seed=4) for _ in range(2))
    assert np.array_equal(first.mesh.xy, again.mesh.xy)
    assert np.array_equal(first.edge_street, again.edge_street)
    assert np.array_equal(first.face_lineage, again.face_lineage)
    other = run(LANDS["star"], parcels=60, seed=5)
    assert not np.array_equal(first.mesh.xy, other.mesh.xy)


def test_place_and_rotation_do_not_matter() -> None:
    base = LANDS["star"]
    quality = []
    for turn, shift in ((0, 0), (33, 0), (90, 5000), (200, -3e5)):
        land = shapely.affinity.translate(
            shapely.affinity.rotate(base, turn, origin=(0, 0)), shift, 2 * shift
        )
        layout = run(land, parcels=100, simplify=0)
        must_hold(layout)
        area = np.sort(layout.mesh.face_area)
        quality.append((layout.mesh.n_faces, area[0], area[50], area[-1]))
    # the grid of coordinates and ties aside, the layouts are the same
    for other in quality[1:]:
        assert other == pytest.approx(quality[0], rel=0.2)


def test_lineages_are_unique_and_levels_count_cuts() -> None:
    layout = run(LANDS["ell"], parcels=60)
    assert len(np.unique(layout.face_lineage)) == layout.mesh.n_faces
    assert 2.0 ** -layout.face_level.astype(float) @ np.ones(60) == pytest.approx(1.0)


def test_parts_are_laid_out_apart_and_small_ones_stay_whole() -> None:
    parts = (
        shapely.box(0, 0, 300, 200),
        shapely.box(400, 0, 500, 100),
        shapely.box(600, 0, 610, 9),
    )
    layout = run(*parts, min_area=400)
    must_hold(layout)
    assert (np.bincount(layout.face_part) > [50, 8, 0]).all()
    (small,) = [i for i in layout.issues if i.code == "part_below_min_area"]
    assert layout.face_part[small.parcel_id - 1] == 2


def test_lineages_differ_between_parts() -> None:
    layout = run(*(shapely.box(x, 0, x + 100, 80) for x in range(0, 2000, 150)), parcels=120)
    assert len(np.unique(layout.face_lineage)) == layout.mesh.n_faces


def test_exact_multiple_of_the_smallest_area_is_cut() -> None:
    layout = run(shapely.box(0, 0, 100, 100), min_area=2500, simplify=0)
    assert layout.mesh.face_area.tolist() == [2500] * 4


@pytest.mark.parametrize("width", [4.0, 8.0])
def test_winding_strips_are_cut(width: float) -> None:
    t = np.linspace(0, 6 * np.pi, 300)
    r = 20 + 6 * t
    spiral = shapely.LineString(np.column_stack([r * np.cos(t), r * np.sin(t)])).buffer(width / 2)
    layout = run(spiral, parcels=40)
    must_hold(layout)
    assert layout.mesh.n_faces == 40


def test_missed_number_of_parcels_is_said() -> None:
    parts = [shapely.box(x, 0, x + 10, 10) for x in range(0, 300, 30)]
    layout = run(*parts, parcels=4)
    (issue,) = [i for i in layout.issues if i.code == "count_missed"]
    assert (issue.value, issue.limit) == (10, 4)


def test_unreached_parcels_are_listed() -> None:
    # without a street on the rim, a strip cut across leaves parcels that no street can reach
    site = site_of(shapely.box(0, 0, 600, 20), rim_is_street=False)
    layout = cogenerate(site, CogenerateParams(parcels=12))
    listed = {i.parcel_id for i in layout.issues if i.code == "parcel_not_reached"}
    needed = np.minimum(3.0, 0.25 * np.sqrt(layout.mesh.face_area))
    assert listed == {f + 1 for f in np.flatnonzero(layout.frontage < needed).tolist()}


def test_too_many_parcels_are_refused() -> None:
    with pytest.raises(InfeasibleError, match="parcels"):
        run(shapely.box(0, 0, 1000, 1000), min_area=1e-6)


def test_land_smaller_than_one_parcel_is_one_parcel() -> None:
    layout = run(shapely.box(0, 0, 10, 10), min_area=400)
    assert layout.mesh.n_faces == 1
    # nor do the streets around it leave anything of it
    assert [i.code for i in layout.issues] == ["part_below_min_area", "parcel_swallowed"]


@pytest.mark.parametrize("pattern", list(StreetPattern))
def test_without_rim_street_the_first_access_becomes_the_network(pattern: StreetPattern) -> None:
    site = site_of(LANDS["ellipse"], rim_is_street=False)
    layout = cogenerate(site, CogenerateParams(parcels=60, pattern=pattern))
    must_hold(layout)
    assert not (layout.edge_street & (layout.edge_kind != EdgeKind.INTERIOR)).any()


def test_given_corners_shape_the_first_cut() -> None:
    site = site_of(LANDS["ellipse"])
    corners = np.array([[300.0, 0], [0, 200], [-300, 0], [0, -200]])
    layout = cogenerate(
        dataclasses.replace(site, corners=corners), CogenerateParams(parcels=30, simplify=0)
    )
    must_hold(layout)
    flagged = layout.mesh.xy[layout.vertex_corner]
    assert len(flagged) == 4
    assert np.abs(flagged).max(axis=0) == pytest.approx([300, 200])


def figures(name: str, **values: object) -> dict[str, float]:
    """Figures of a layout of a few hundred parcels, and the mean aspect ratio of parcels."""
    layout = run(LANDS[name], parcels=200, **values)
    found = {m.metric: m.value for m in measure(layout) if m.part is None}
    columns = parcel_table(layout).columns
    aspect = columns["depth_m"] / columns["width_m"]
    found["aspect"] = float(np.nanmean(np.maximum(aspect, 1 / aspect)))
    return found


@pytest.mark.parametrize("name", ["star", "triangle", "square"])
def test_weight_of_regularity_lowers_irregularity(name: str) -> None:
    low = figures(name, weight_regularity=0.05, weight_size=0.3, weight_access=0.2)
    high = figures(name, weight_regularity=2.0, weight_size=0.3, weight_access=0.2)
    assert high["irregularity_mean"] < 0.85 * low["irregularity_mean"]


ACCESS_LANDS = ("star", "triangle", "ellipse", "ell")


def test_weight_of_access_lengthens_parcels_along_fewer_streets() -> None:
    low = [figures(name, weight_access=0.0) for name in ACCESS_LANDS]
    high = [figures(name, weight_access=0.6) for name in ACCESS_LANDS]

    def mean(found: list[dict[str, float]], metric: str) -> float:
        return float(np.mean([f[metric] for f in found]))

    assert mean(high, "aspect") > 1.03 * mean(low, "aspect")
    assert mean(high, "street_length_relative") < mean(low, "street_length_relative")


def test_orientation_turns_the_long_sides_of_parcels() -> None:
    def share_along(orientation: float) -> float:
        """Share of elongated parcels whose long side runs east-west."""
        layout = run(LANDS["star"], parcels=200, orientation=orientation, weight_orientation=1.0)
        boxes = shapely.minimum_rotated_rectangle(layout.mesh.face_polygons())
        corners = np.array([shapely.get_coordinates(b)[:3] for b in boxes])
        sides = np.diff(corners, axis=1)
        length = np.hypot(sides[..., 0], sides[..., 1])
        longest = sides[np.arange(len(sides)), length.argmax(axis=1)]
        elongated = length.max(axis=1) > 1.3 * length.min(axis=1)
        east_west = np.abs(longest[:, 0]) > np.abs(longest[:, 1])
        return float(east_west[elongated].mean())

    assert share_along(0.0) > 0.65
    assert share_along(90.0) < 0.35


def test_cancel_stops_between_levels() -> None:
    from urban_processing.errors import Cancelled

    seen = []

    def cancel(fraction: float, message: str) -> None:
        seen.append((fraction, message))
        if len(seen) == 3:
            raise Cancelled

    with pytest.raises(Cancelled):
        cogenerate(site_of(LANDS["square"]), CogenerateParams(parcels=50), CallbackProgress(cancel))
    assert len(seen) == 3
    fractions = [f for f, _ in seen]
    assert fractions == sorted(fractions)
    assert "parcels" in seen[-1][1]


def test_step_is_pure() -> None:
    state = begin(site_of(LANDS["ell"]), CogenerateParams(min_area=400))
    once, again = step(state), step(state)
    assert np.array_equal(once.layout.mesh.xy, again.layout.mesh.xy)
    assert state.level == 0
    assert state.layout.mesh.n_faces == 1


def test_estimate_is_near() -> None:
    site = site_of(LANDS["star"])
    params = CogenerateParams(min_area=300)
    found = cogenerate(site, params).mesh.n_faces
    assert estimate(site, params).parcels == pytest.approx(found, rel=0.1)
