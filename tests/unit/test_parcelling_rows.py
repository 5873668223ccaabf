"""Parts of the subdivision into rows: streets, strips, spacing, sheets and plots."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely

from urban_processing.blocks.model import plain_blocks
from urban_processing.hashing import child, mix, splitmix64
from urban_processing.parcelling.rows.divided import Polygon
from urban_processing.parcelling.rows.plots import Place, Plots
from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.sight import sees
from urban_processing.parcelling.rows.spacing import Bounds, Profile, shares_of
from urban_processing.parcelling.rows.streets import Street, logical_streets, sides_of_rings
from urban_processing.parcelling.rows.strips import alpha_strips
from urban_processing.parcelling.rows.tidy import divide_large, tidy
from urban_processing.skeleton.straight import Skeleton, straight_skeleton

BOUNDS = Bounds(
    min_area=400.0, max_area=1000.0, min_width=12.0, max_width=24.0, irregularity=0.0, snap=2.0
)


def polygon_of(shape: shapely.Polygon, **known: list[float]) -> Polygon:
    rings = plain_blocks(np.array([shapely.orient_polygons(shape)])).rings
    n = len(rings.xy)
    return Polygon(
        first=0,
        shift=np.zeros(2),
        xy=rings.xy,
        offsets=rings.offsets,
        place=rings.place.tolist(),
        access=known.get("access", [True] * n),
        width=known.get("width", [math.nan] * n),
        street=known.get("street", [-1] * n),
        lineage=1,
    )


def sheet_of(polygon: Polygon) -> tuple[Sheet, Skeleton]:
    skeleton = straight_skeleton(polygon.xy, polygon.offsets)
    return Sheet(skeleton.xy, skeleton.height, polygon.following), skeleton


def streets_of(shape: shapely.Polygon, depth: float = 0.0, **known: list[float]) -> list[Street]:
    polygon = polygon_of(shape, **known)
    sheet, skeleton = sheet_of(polygon)
    return [
        street
        for ring in sides_of_rings(sheet, polygon, skeleton.edge_face.tolist())
        for street in logical_streets(ring, (0.0, 0.0), corner=40.0, reach=12.0, depth=depth)
    ]


def test_a_rectangle_has_four_streets() -> None:
    streets = streets_of(shapely.box(0, 0, 100, 40))
    assert sorted(street.length for street in streets) == [40.0, 40.0, 100.0, 100.0]
    assert not any(street.closed or street.rim for street in streets)


def test_a_rounded_corner_is_one_corner_in_the_middle() -> None:
    streets = streets_of(shapely.box(8, 8, 92, 52).buffer(8, quad_segs=4))
    assert len(streets) == 4
    middles = {(100 - 8 + 8 * math.sqrt(0.5), 60 - 8 + 8 * math.sqrt(0.5))}
    spots = {(s.sides[0].x, s.sides[0].y) for s in streets}
    for x, y in middles:
        assert min(math.hypot(x - a, y - b) for a, b in spots) < 1e-6


def test_a_jag_of_the_contour_is_no_corner() -> None:
    jag = [(0, 0), (50, 0), (50, 1), (52, 1), (52, 0), (100, 0), (100, 40), (0, 40)]
    assert len(streets_of(shapely.Polygon(jag))) == 4


def test_a_round_block_is_one_closed_street() -> None:
    (street,) = streets_of(shapely.Point(0, 0).buffer(60, quad_segs=12), depth=48.0)
    assert street.closed
    assert street.front[0] == street.front[-1]


def test_a_tight_turn_is_a_corner_where_rows_are_deep() -> None:
    turn = [(60 + 40 * math.cos(t), 60 + 40 * math.sin(t)) for t in np.linspace(0, math.pi / 2, 9)]
    shape = shapely.Polygon([(0, 0), (100, 0), *turn, (0, 100)])
    assert len(streets_of(shape)) == 3
    assert len(streets_of(shape, depth=32.0)) == 4


def test_another_street_begins_where_its_number_changes_at_a_bend() -> None:
    shape = shapely.Polygon([(0, 0), (60, 0), (118, 21), (100, 70), (0, 50)])
    names = [1 if k == 0 else 2 for k in range(5)]
    polygon = polygon_of(shape)
    first = int(np.flatnonzero((polygon.xy == (0, 0)).all(axis=1))[0])
    names = np.roll(names, first).tolist()
    assert len(streets_of(shape)) == 4
    assert len(streets_of(shape, street=names)) == 5


def test_a_strip_ends_on_what_lies_behind_its_street() -> None:
    polygon = polygon_of(shapely.box(0, 0, 100, 40))
    sheet, skeleton = sheet_of(polygon)
    ring = sides_of_rings(sheet, polygon, skeleton.edge_face.tolist())[0]
    streets = logical_streets(ring, (50, 20), corner=40.0, reach=12.0, depth=0.0)
    strips = alpha_strips(sheet, [f.tolist() for f in skeleton.faces], streets)
    assert sorted(round(sheet.area(s.ring)) for s in strips) == [400, 400, 1600, 1600]


def test_a_closed_street_is_cut_open() -> None:
    polygon = polygon_of(shapely.LineString([(0, 0), (90, 0)]).buffer(30, quad_segs=8))
    sheet, skeleton = sheet_of(polygon)
    ring = sides_of_rings(sheet, polygon, skeleton.edge_face.tolist())[0]
    streets = logical_streets(ring, (45, 0), corner=40.0, reach=12.0, depth=0.0)
    (strip,) = alpha_strips(sheet, [f.tolist() for f in skeleton.faces], streets)
    assert strip.front[0] == strip.front[-1] == strip.back[0] == strip.back[-1]
    assert sheet.area(strip.ring) == pytest.approx(shapely.Polygon(polygon.xy).area)
    # the middle line is walked on both sides
    assert len(strip.back) > len(set(strip.back)) + 1


def test_seeds_are_those_of_the_vectorised_hash() -> None:
    values = [0, 1, 2**63, 2**64 - 1]
    assert [mix(v) for v in values] == splitmix64(np.array(values, dtype=np.uint64)).tolist()
    assert child(5, 0) != child(5, 1)


def test_points_of_an_edge_keep_their_order_and_are_added_once() -> None:
    sheet = Sheet(np.array([[0.0, 0.0], [10.0, 0.0], [0.0, 10.0]]), np.zeros(3), [1, 2, 0])
    late, early = sheet.insert(0, 1, 0.7), sheet.insert(1, 0, 0.8)
    assert sheet.insert(1, 0, 0.3) == late
    assert sheet.insert(0, 1, 1e-9) == 0
    assert [v for _, v in sheet.between(0, 1)] == [early, late]
    assert [v for _, v in sheet.between(1, 0)] == [late, early]
    between = sheet.insert(early, late, 0.5)
    assert sheet.within(0, 1) == [early, between, late]
    assert sheet.contour_side(early, between) == 0


def test_a_line_that_touches_a_vertex_is_not_seen() -> None:
    xy = np.array([[0, 0], [20, 0], [20, 20], [12, 20], [10, 10], [8, 20], [0, 20]], dtype=float)
    sheet = Sheet(xy, np.zeros(7), [1, 2, 3, 4, 5, 6, 0])
    ring = list(range(7))
    assert sees(sheet, ring, p=(5, 0), q=(5, 20))
    assert sees(sheet, ring, p=(0, 9), q=(20, 9))
    assert not sees(sheet, ring, p=(0, 10), q=(20, 10))
    assert not sees(sheet, ring, p=(0, 15), q=(20, 15))
    assert not sees(sheet, ring, p=(8, 20), q=(12, 20))


def _unmoved(s: float) -> float:
    return s


def test_parcels_end_where_area_and_width_allow() -> None:
    spots = np.linspace(0.0, 100.0, 51)
    depth = np.where(spots < 50.0, 20.0, 60.0)
    areas = np.append(0.0, np.cumsum(np.diff(spots) * depth[1:]))
    profile = Profile(spots, areas, BOUNDS)
    count = profile.number()
    ends = profile.ends(shares_of([0.5] * count, 0.0, BOUNDS), _unmoved, margin=1.01)
    assert ends is not None
    bounds = np.array([0.0, *ends, 100.0])
    assert (np.diff(bounds) >= 12.0).all()
    assert (np.diff(np.interp(bounds, spots, areas)) >= 400.0).all()
    assert (np.diff(np.interp(bounds, spots, areas)) <= 1000.0).all()
    assert profile.ends([k / 9 for k in range(1, 10)], _unmoved, margin=1.0) is None


def test_a_whole_front_is_shared_out_evenly() -> None:
    assert np.allclose(shares_of([0.5] * 4, 1.0, BOUNDS), [0.25, 0.5, 0.75, 1.0])
    shares = shares_of(np.random.default_rng(0).random(2000).tolist(), 0.5, BOUNDS)
    widths = np.diff([0.0, *shares]) * 2000
    assert widths.std() == pytest.approx(0.5 / 3.0, rel=0.05)
    assert shares[-1] == pytest.approx(1.0)


def strips_of_boxes(*cuts: float) -> Plots:
    """A rectangle 20 m deep on a street at its foot, cut at some places."""
    ends = [0.0, *cuts, cuts[-1] + 30.0]
    far = ends[-1]
    xy = np.array([[0, 0], [far, 0], [far, 20], [0, 20]], dtype=float)
    sheet = Sheet(xy, np.zeros(4), [1, 2, 3, 0])
    foot = [0, *(sheet.insert(0, 1, x / far) for x in cuts), 1]
    head = [3, *(sheet.insert(3, 2, x / far) for x in cuts), 2]
    rings = [[a, b, d, c] for a, b, c, d in zip(foot, foot[1:], head, head[1:], strict=False)]
    access = [True, False, False, False]
    return Plots(sheet, [[ring] for ring in rings], range(len(rings)), access=access)


def test_small_parcels_are_united_until_none_is_left() -> None:
    plots = strips_of_boxes(8.0, 30.0, 36.0)
    tidy(plots, BOUNDS)
    assert sorted(round(plots.area[n]) for n in plots.rings) == [600, 720]
    assert all(len(plots.borders(n)) == 1 for n in plots.rings)


def test_large_parcels_are_divided_by_a_line_from_the_street() -> None:
    plots = strips_of_boxes(70.0)
    divide_large(plots, BOUNDS)
    assert sorted(round(plots.area[n]) for n in plots.rings) == [600, 700, 700]
    assert all(plots.front(n) >= 12.0 for n in plots.rings)


def test_a_line_that_divides_a_parcel_is_noded_on_both_sides() -> None:
    plots = strips_of_boxes(40.0)
    plots.divide(0, Place(1, 0.5), Place(3, 0.25))
    first = [ring for ring in plots.rings.values() if plots.sheet.x[ring[0]] >= 40.0]
    assert max(len(ring) for ring in plots.rings.values()) == 5
    assert first
    for (u, v), number in plots.left_of.items():
        if plots.sheet.contour_side(u, v) < 0:
            assert plots.left_of[v, u] != number


def test_parcels_with_two_borders_are_not_united() -> None:
    xy = np.array([[0, 0], [30, 0], [30, 30], [0, 30]], dtype=float)
    sheet = Sheet(xy, np.zeros(4), [1, 2, 3, 0])
    a, b = sheet.add(10, 10), sheet.add(20, 20)
    plots = Plots(
        sheet,
        [
            [[0, 1, 2, b, a]],
            [[0, a, b, 2, 3]],
        ],
        [1, 2],
        access=[True] * 4,
    )
    assert plots.united(0, 1) is not None
    c, d = sheet.add(14, 16), sheet.add(16, 14)
    rings = [[0, 1, 2, b, d, a], [0, a, c, b, 2, 3], [a, d, b, c]]
    plots = Plots(sheet, [[ring] for ring in rings], [1, 2, 3], access=[True] * 4)
    assert plots.united(0, 1) is None
    assert plots.united(0, 2) is not None
