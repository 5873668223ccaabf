"""Blocks from streets: what is mended, what is left, and the street along each edge."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
import shapely
import shapely.affinity
from networks import CITIES, network

from urban_processing.blocks.find import FoundBlocks, find_blocks
from urban_processing.blocks.model import UNKNOWN_STREET, rings_of
from urban_processing.blocks.streets import StreetLines, street_lines
from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.mesh.build import canonical_rings
from urban_processing.params.blocks import BlocksParams
from urban_processing.site import snap_to_grid

Place = tuple[float, float]


def line(*places: Place) -> shapely.LineString:
    return shapely.LineString(places)


def rectangle(width: float, height: float) -> list[shapely.LineString]:
    """Its sides: south, east, north, west."""
    a, b, c, d = (0.0, 0.0), (width, 0.0), (width, height), (0.0, height)
    return [line(a, b), line(b, c), line(c, d), line(d, a)]


def grid(n: int, step: float = 100.0) -> list[shapely.LineString]:
    """n + 1 streets each way, without nodes where they cross."""
    far = n * step
    across = [line((0, k * step), (far, k * step)) for k in range(n + 1)]
    return across + [line((k * step, 0), (k * step, far)) for k in range(n + 1)]


def found(
    lines: list[shapely.LineString] | StreetLines,
    *,
    land: list[shapely.Polygon] | None = None,
    width: Any = 10.0,
    known: dict[str, Any] | None = None,
    **params: Any,
) -> FoundBlocks:
    streets = lines
    if not isinstance(streets, StreetLines):
        streets = street_lines(streets, width=width, **(known or {}))
    out = find_blocks(streets, BlocksParams(**params), land=land)
    must_be_consistent(out, land)
    return out


def must_be_consistent(out: FoundBlocks, land: list[shapely.Polygon] | None) -> None:
    """Blocks and right-of-way tile the land; arrays fit the rings, which are canonical."""
    blocks = out.blocks
    pieces = np.append(blocks.polygons, out.right_of_way)
    assert shapely.is_valid(pieces).all()
    assert (shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON).all()
    assert shapely.coverage_is_valid(pieces)
    area = shapely.area(pieces).sum()
    if land is not None:
        assert area == pytest.approx(sum(p.area for p in land), rel=1e-8)
    assert shapely.union_all(pieces).area == pytest.approx(area, rel=1e-9)
    assert shapely.equals_exact(canonical_rings(blocks.polygons), blocks.polygons).all()
    assert len(np.unique(blocks.block_id)) == len(blocks) == len(out.part)
    n = len(blocks.rings.xy)
    for values in (blocks.edge_access, blocks.edge_width, blocks.edge_street, out.edge_class):
        assert len(values) == n
    np.testing.assert_array_equal(np.isnan(blocks.edge_width), ~blocks.edge_access)
    np.testing.assert_array_equal(blocks.edge_street == UNKNOWN_STREET, ~blocks.edge_access)
    assert (out.edge_class[~blocks.edge_access] == "").all()


def areas(out: FoundBlocks) -> list[float]:
    return np.round(shapely.area(out.blocks.polygons), 6).tolist()


def told(out: FoundBlocks) -> dict[str, float | None]:
    return {issue.code: issue.value for issue in out.blocks.issues}


def by_direction(out: FoundBlocks, block: int = 0) -> dict[str, tuple[float, int, bool]]:
    """Width, street and access of the edges of a rectangular block, by their side."""
    rings = out.blocks.rings
    way = rings.xy[rings.following] - rings.xy
    sides = {(1, 0): "south", (0, 1): "east", (-1, 0): "north", (0, -1): "west"}
    result: dict[str, tuple[float, int, bool]] = {}
    for k in np.flatnonzero(rings.edge_block == block).tolist():
        side = sides[tuple(np.sign(np.round(way[k], 6)).astype(int).tolist())]
        value = (
            float(out.blocks.edge_width[k]),
            int(out.blocks.edge_street[k]),
            bool(out.blocks.edge_access[k]),
        )
        assert result.setdefault(side, value) == value or np.isnan(value[0])
    return result


def test_a_grid_without_nodes_becomes_blocks() -> None:
    out = found(grid(2))
    assert areas(out) == [8100.0] * 4
    assert out.blocks.block_id.tolist() == [1, 2, 3, 4]
    lower_left = shapely.bounds(out.blocks.polygons)[:, :2].tolist()
    assert lower_left == [[5, 5], [5, 105], [105, 5], [105, 105]]
    assert told(out) == {"crossings_noded": 1.0}
    assert set(out.blocks.edge_street.tolist()) == {1, 2, 3, 4, 5, 6}
    assert out.blocks.edge_access.all()
    assert (out.blocks.edge_width == 10).all()
    assert out.part.tolist() == [0] * 4


def test_each_edge_has_the_width_and_number_of_its_street() -> None:
    out = found(rectangle(100, 60), width=[8.0, 12.0, 16.0, 20.0])
    assert areas(out) == [(100 - 6 - 10) * (60 - 4 - 8)]
    sides = by_direction(out)
    assert [sides[s][0] for s in ("south", "east", "north", "west")] == [8, 12, 16, 20]
    assert len({sides[s][1] for s in sides}) == 4
    assert all(access for _, _, access in sides.values())


def test_widths_follow_from_classes() -> None:
    classes = ["primary", "residential", "alley", ""]
    out = found(
        rectangle(200, 200),
        width=np.nan,
        known={"street_class": classes},
        class_widths="alley=5; residential=14",
        default_width=9,
    )
    sides = by_direction(out)
    assert [sides[s][0] for s in ("south", "east", "north", "west")] == [24, 14, 5, 9]
    assert told(out)["width_assumed"] == 1
    assert set(out.edge_class.tolist()) == set(classes)
    assert set(out.right_of_way_class.tolist()) == set(classes)


def test_classes_of_unknown_width_are_named() -> None:
    classes = ["lane", "alley", "lane", ""]
    out = found(rectangle(200, 200), width=np.nan, known={"street_class": classes})
    (issue,) = out.blocks.issues
    assert (issue.code, issue.value) == ("width_assumed", 4)
    assert "no class of known width" not in issue.message
    assert "(lane, alley): 12 m" in issue.message
    many = found(
        [*rectangle(200, 200), *rectangle(100, 100)],
        width=np.nan,
        known={"street_class": list("abcdefgh")},
    )
    assert any("(a, b, c, d, e and 3 more)" in issue.message for issue in many.blocks.issues)


def test_widths_of_classes_that_no_street_has_are_told() -> None:
    out = found(
        rectangle(200, 200),
        width=np.nan,
        known={"street_class": ["residential", "residential", "service", "primary"]},
        class_widths="residental=14; service=6; zzz=3",
    )
    (issue,) = out.blocks.issues
    assert (issue.code, issue.value) == ("class_widths_unused", 2)
    assert issue.message.endswith("residental (is residential meant?), zzz.")


@pytest.mark.parametrize("text", ["residential", "residential=wide", "=12", "a=-3", "a=nan"])
def test_widths_by_class_that_are_none_are_refused(text: str) -> None:
    with pytest.raises(ParameterError, match="class-widths"):
        BlocksParams(class_widths=f"primary=20, {text}")


def test_footpaths_are_streets_only_if_wanted() -> None:
    lines = [*rectangle(200, 100), line((100, 0), (100, 100))]
    known = {"street_class": [*["residential"] * 4, "footway"]}
    out = found(lines, width=np.nan, known=known)
    assert len(out.blocks) == 1
    assert told(out) == {"no_streets": 1.0}
    assert len(found(lines, width=np.nan, known=known, footpaths=True).blocks) == 2
    known["street_class"][-1] = "proposed"
    assert len(found(lines, width=np.nan, known=known, footpaths=True).blocks) == 1


def test_lines_that_lie_on_others_count_once_and_the_widest_counts() -> None:
    double = line((100, 100), (100, 0))
    lines = [*rectangle(200, 100), double, double.reverse(), line((100, 20), (100, 50))]
    out = found(lines, width=[10, 10, 10, 10, 10, 30, 4])
    assert told(out) == {"streets_doubled": 130.0}
    assert areas(out) == [80 * 90.0] * 2
    assert by_direction(out)["east"][0] == 30
    (issue,) = out.blocks.issues
    assert "1 line(s) are there twice" in issue.message


def test_lines_that_lie_on_parts_of_others_change_the_width_of_that_part() -> None:
    out = found([*rectangle(200, 100), line((50, 0), (150, 0))], width=[10, 10, 10, 10, 20])
    widths = out.blocks.edge_width
    assert set(widths.tolist()) == {10.0, 20.0}
    rings = out.blocks.rings
    length = np.hypot(*(rings.xy[rings.following] - rings.xy).T)
    low = rings.xy[:, 1] < 20
    assert length[(widths == 20) & low].max() == pytest.approx(100, abs=1)


def test_lines_without_length_and_tiny_loops_are_dropped() -> None:
    loop = line((50, 50), (50.4, 50), (50.2, 50.3), (50, 50))
    out = found([*rectangle(100, 100), line((20, 20), (20, 20)), loop])
    assert told(out) == {"tiny_lines": 2.0}
    assert areas(out) == [8100.0]


def test_a_dead_end_makes_a_notch_or_is_left_out() -> None:
    lines = [*rectangle(200, 100), line((100, 0), (100, 50))]
    out = found(lines)
    half_disc = 0.5 * np.pi * 25
    assert areas(out)[0] == pytest.approx(190 * 90 - 45 * 10 - half_disc, abs=0.6)
    assert told(out) == {"dead_ends": 1.0}
    turning = found(lines, turning_radius=9)
    assert areas(turning)[0] < areas(out)[0] - 100
    assert turning.blocks.edge_access.all()
    plain = found(lines, dead_ends=False)
    assert areas(plain) == [190 * 90.0]
    assert told(plain) == {"dead_ends_left_out": 1.0}


def test_dead_ends_of_dead_ends_are_left_out_too() -> None:
    tree = [line((100, 0), (100, 50)), line((100, 50), (130, 50)), line((100, 50), (70, 60))]
    out = found([*rectangle(200, 100), *tree], dead_ends=False)
    assert areas(out) == [190 * 90.0]


def test_a_street_within_a_block_makes_a_hole_with_access() -> None:
    out = found([*rectangle(200, 100), line((80, 50), (120, 50))])
    assert shapely.get_num_interior_rings(out.blocks.polygons).tolist() == [1]
    assert out.blocks.edge_access.all()
    ring = line((80, 40), (120, 40), (120, 60), (80, 60), (80, 40))
    nested = found([*rectangle(200, 100), ring])
    around = 190 * 90 - (50 * 30 - (4 - np.pi) * 25)
    assert areas(nested) == [pytest.approx(around, abs=2), 30 * 10.0]


@pytest.mark.parametrize("gap", [0.001, 0.4, 0.9])
def test_an_end_that_misses_another_street_is_joined(gap: float) -> None:
    lines = [*rectangle(200, 100), line((100, 0), (100, 100 - gap))]
    out = found(lines)
    assert areas(out) == [90 * 90.0] * 2
    assert told(out) == {"ends_joined": 1.0}
    assert "ends_joined" not in told(found(lines, snap_tolerance=gap / 2))


def test_ends_that_miss_each_other_are_joined() -> None:
    lines = [*rectangle(200, 100), line((100, 0), (100, 50)), line((100.3, 50.5), (100, 100))]
    out = found(lines)
    assert len(out.blocks) == 2
    assert told(out) == {"ends_joined": 1.0}


def test_an_end_is_not_joined_to_its_own_line() -> None:
    hook = line((100, 0), (100, 50), (100.8, 50), (100.8, 49.2))
    out = found([*rectangle(200, 100), hook])
    assert "ends_joined" not in told(out)
    assert len(out.blocks) == 1


def test_a_loop_that_does_not_close_is_closed() -> None:
    loop = line((60, 30), (140, 30), (140, 70), (60, 70), (60, 30.6))
    assert len(found([*rectangle(200, 100), loop]).blocks) == 2


def test_a_line_drawn_too_far_leaves_no_stub() -> None:
    lines = [*rectangle(200, 100), line((100, -4), (100, 104))]
    out = found(lines)
    assert areas(out) == [8100.0] * 2
    assert told(out) == {"crossings_noded": 2.0, "stubs_left_out": 2.0}


@pytest.mark.parametrize(
    ("between", "code"), [(15.0, "blocks_swallowed"), (20.0, "blocks_too_small")]
)
def test_the_strip_between_carriageways_is_no_block(between: float, code: str) -> None:
    sides = rectangle(200, 200)
    carriageways = [line((0, y), (200, y)) for y in (100 - between / 2, 100 + between / 2)]
    out = found([*sides, *carriageways], width=[10, 10, 10, 10, 16, 16])
    assert len(out.blocks) == 2
    assert told(out)[code] == 1
    assert shapely.area(out.right_of_way).sum() == pytest.approx(40000 - sum(areas(out)))


def test_a_block_falls_apart_where_a_dead_end_reaches_across() -> None:
    out = found([*rectangle(200, 100), line((100, 0), (100, 93))])
    assert told(out) == {"dead_ends": 1.0, "blocks_fall_apart": 1.0}
    assert len(out.blocks) == 2


def test_a_neck_is_cut_on_both_sides() -> None:
    out = found([*rectangle(200, 100), line((100, 0), (100, 86))])
    assert told(out) == {"dead_ends": 1.0, "blocks_too_small": 1.0, "blocks_fall_apart": 1.0}
    assert len(out.blocks) == 2
    assert out.blocks.edge_access.all()
    assert len(found([*rectangle(200, 100), line((100, 0), (100, 86))], min_width=3).blocks) == 1


def test_a_tail_between_streets_that_part_is_cut_off() -> None:
    wedge = [line((0, 0), (400, 0)), line((0, 0), (400, 60)), line((400, 0), (400, 60))]
    whole, cut = found(wedge, min_width=0, min_area=0), found(wedge, min_width=8)
    assert (
        shapely.bounds(cut.blocks.polygons)[0, 0] > shapely.bounds(whole.blocks.polygons)[0, 0] + 15
    )
    assert areas(cut)[0] > 0.97 * areas(whole)[0]


def test_streets_without_width_for_a_block_are_an_error() -> None:
    with pytest.raises(BoundaryError, match="No block is left"):
        found(rectangle(30, 30), width=40)


def test_streets_that_enclose_nothing_are_an_error() -> None:
    with pytest.raises(BoundaryError, match="enclose nothing"):
        found([line((0, 0), (100, 0)), line((50, -50), (50, 50))])


def test_the_rim_of_land_is_street_only_where_one_runs() -> None:
    land = [shapely.box(0, 0, 200, 100)]
    out = found([line((0, 0), (200, 0)), line((100, -50), (100, 150))], land=land)
    assert areas(out) == [95 * 95.0] * 2
    assert [s for s, (_, _, access) in sorted(by_direction(out).items()) if access] == [
        "east",
        "south",
    ]
    alone = found([], land=land)
    assert areas(alone) == [20000.0]
    assert not alone.blocks.edge_access.any()
    assert len(alone.right_of_way) == 0


@pytest.mark.parametrize(
    ("away", "area", "access"), [(2, 97, True), (5.5, 100, True), (7, 100, False)]
)
def test_a_street_beside_the_land_takes_what_it_reaches(
    away: float, area: float, access: bool
) -> None:
    out = found([line((-50, -away), (150, -away))], land=[shapely.box(0, 0, 100, 100)])
    assert areas(out) == [100.0 * area]
    assert by_direction(out)["south"][2] == access
    assert not by_direction(out)["north"][2]


def test_a_street_that_meets_the_rim_gives_it_no_access() -> None:
    out = found([line((100, -50), (100, 150))], land=[shapely.box(0, 0, 200, 100)])
    assert [s for s, (_, _, access) in by_direction(out).items() if access] == ["east"]


def test_parts_of_land_stay_parts() -> None:
    land = [shapely.box(0, 0, 200, 100), shapely.box(300, 0, 400, 100)]
    out = found([line((-10, 50), (410, 50))], land=land)
    assert out.part.tolist() == [0, 0, 1, 1]
    assert sorted(out.right_of_way_part.tolist()) == [0, 1]
    apart = found(
        [*rectangle(100, 100), *[shapely.affinity.translate(g, 300) for g in rectangle(200, 100)]]
    )
    assert apart.part.tolist() == [0, 1]
    assert areas(apart) == [190 * 90.0, 8100.0]


def test_streets_of_one_name_are_one_street() -> None:
    lines = rectangle(200, 100)
    numbers = [found(lines, known={"name": names}) for names in (["", "A", "", "A"], [""] * 4)]
    sides = [by_direction(out) for out in numbers]
    assert sides[0]["east"][1] == sides[0]["west"][1]
    assert sides[1]["east"][1] != sides[1]["west"][1]


def test_a_street_goes_on_straight_at_a_junction() -> None:
    lines = [line((0, 0), (100, 0)), line((100, 0), (200, 5)), line((100, 0), (100, 100))]
    lines += [line((0, 0), (0, 100)), line((0, 100), (100, 100)), line((100, 100), (200, 100))]
    out = found([*lines, line((200, 5), (200, 100))])
    assert by_direction(out, 0)["south"][1] == int(
        out.blocks.edge_street[np.flatnonzero(out.blocks.rings.edge_block == 1)[0]]
    )


def test_bridges_are_noded_and_told() -> None:
    streets = street_lines([*grid(1), line((-50, 50), (150, 50))], width=10)
    off = np.array([False] * 4 + [True])
    out = find_blocks(StreetLines(**{**vars(streets), "off_ground": off}), BlocksParams())
    assert len(out.blocks) == 2
    assert told(out)["bridges_on_ground"] == 1


def test_corners_are_rounded_if_wanted() -> None:
    plain, rounded = found(grid(2)), found(grid(2), corner_radius=6)
    lost = 4 * (1 - np.pi / 4) * 36
    assert areas(rounded)[0] == pytest.approx(areas(plain)[0] - lost, abs=1)
    assert rounded.blocks.edge_access.all()
    assert (rounded.blocks.edge_width == 10).all()


def test_neither_order_nor_direction_of_lines_matters() -> None:
    streets = network("wuhan")
    rng = np.random.default_rng(5)
    order = rng.permutation(len(streets))
    flipped = rng.random(len(streets)) < 0.5
    lines = np.where(flipped, shapely.reverse(streets.lines), streets.lines)
    other = StreetLines(**{**vars(streets), "lines": lines}).take(order)
    a, b = (find_blocks(s, BlocksParams()) for s in (streets, other))
    assert shapely.to_wkb(a.blocks.polygons).tolist() == shapely.to_wkb(b.blocks.polygons).tolist()
    np.testing.assert_array_equal(a.blocks.edge_width, b.blocks.edge_width)
    np.testing.assert_array_equal(a.blocks.edge_street, b.blocks.edge_street)
    assert shapely.to_wkb(a.right_of_way).tolist() == shapely.to_wkb(b.right_of_way).tolist()


@pytest.mark.parametrize("city", CITIES)
def test_blocks_of_real_streets_tile_what_they_enclose(city: str) -> None:
    streets = network(city)
    out = found(streets)
    faces = shapely.get_parts(
        shapely.polygonize(shapely.get_parts(shapely.union_all(streets.lines)))
    )
    land = shapely.union_all(faces).area
    covered = shapely.area(out.blocks.polygons).sum() + shapely.area(out.right_of_way).sum()
    assert covered == pytest.approx(land, rel=1e-3)
    assert 0.4 * len(faces) < len(out.blocks) <= 1.1 * len(faces)
    assert out.blocks.edge_access.all()
    assert shapely.area(out.blocks.polygons).min() >= 100
    assert rings_of(out.blocks.polygons).offsets[-1] == len(out.blocks.edge_access)


def test_streets_that_leave_the_land_are_no_dead_ends() -> None:
    land = [shapely.box(0, 0, 200, 100)]
    lines = [line((100, -50), (100, 150)), line((100, 50), (150, 50)), line((0.5, 20), (99.5, 20))]
    lines += [line((1000, 0), (1300, 0))]
    kept = found(lines, land=land)
    assert told(kept) == {"ends_joined": 1.0, "dead_ends": 1.0, "blocks_fall_apart": 1.0}
    pruned = found(lines, land=land, dead_ends=False)
    assert "dead_ends_left_out" in told(pruned)
    assert sorted(areas(pruned)) == [pytest.approx(a, abs=8) for a in (1425, 7125, 9500)]


@pytest.mark.parametrize("degrees", [17.0, 90.0, 211.0])
def test_blocks_turn_with_their_streets(degrees: float) -> None:
    lines = [
        *grid(3),
        line((50, 0), (50, 60)),
        line((130, 100), (130, 196)),
        line((0, 0), (300, 80)),
    ]
    width = np.linspace(6, 14, len(lines))
    turned = [shapely.affinity.rotate(g, degrees, origin=(0, 0)) for g in lines]
    turned = shapely.transform(turned, snap_to_grid).tolist()
    a, b = found(lines, width=width), found(turned, width=width)
    assert sorted(areas(a)) == pytest.approx(sorted(areas(b)), rel=1e-4, abs=0.5)
    assert told(a) == told(b)
    lengths = [
        np.bincount(
            np.searchsorted(width, out.blocks.edge_width),
            weights=np.hypot(
                *(out.blocks.rings.xy[out.blocks.rings.following] - out.blocks.rings.xy).T
            ),
        )
        for out in (a, b)
    ]
    np.testing.assert_allclose(*lengths, atol=1.0)
