"""Fabrics of plain layers: the same figures as of layouts, and what real towns ask besides."""

from __future__ import annotations

import math
from functools import cache
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from shapely import LineString, Polygon, box
from shapely.affinity import rotate, translate

import urban_processing as up
from tests.unit.medial_streets import medial_streets
from tests.unit.real_parcels import real_parcels
from urban_processing.blocks.streets import StreetLines, street_lines
from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import Fabric
from urban_processing.fabric.observed import observed_parcels, street_parcels
from urban_processing.fabric.of_layers import fabric_of_layers
from urban_processing.mesh.overlap import find_overlaps, segments_of
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.measures import FabricMeasures, LayoutMeasures
from urban_processing.params.measure import MeasureParams
from urban_processing.streets.classes import NodeKind

Geometries = npt.NDArray[np.object_]

LANDS = {
    "notched": Polygon([(0, 0), (600, 20), (640, 300), (420, 380), (300, 330), (90, 400)]),
    "with a hole": Polygon(box(0, 0, 420, 300).exterior, [box(150, 100, 230, 190).exterior]),
}

MADE = {
    "min_area_m2", "deepest_level", "seconds", "area_max_over_min_area",
    "above_2_min_area_pct", "above_3_min_area",
}  # fmt: skip
"""What only the file of a layout says: what was promised, and how it was made."""

EXACT = {"street_share_pct"}
"""Needs parcels that share their boundaries exactly."""

CORNERS = {
    "right_of_way_m2", "right_of_way_pct", "land_use_streets_pct", "land_use_parcels_pct",
    "net_area_mean_m2", "net_area_min_m2",
}  # fmt: skip
"""Rounded corners and turning heads of rights-of-way are no widths of streets."""

NETWORK = {
    "perimeter_m", "area_m2", "parcels", "streets", "junctions", "street_ends", "street_length_m",
    "street_length_mean_m", "junction_deviation_deg", "junction_deviation_max_deg", "unreached",
    "blocks", "block_parcels_median", "block_parcels_max", "small_blocks_pct",
    "block_length_median_m", "block_length_max_m", "block_area_mean_m2", "block_area_median_m2",
    "blocks_per_km2", "block_perimeter_max_m", "block_perimeter_mean_m", "block_perimeter_min_m",
    "parcels_per_km2", "street_km_per_km2", "intersections", "intersections_3_pct", "dead_ends",
    "segment_length_mean_m", "circuity", "orientation_entropy", "orientation_order", "meshedness",
    "network_detour", "neighbours_mean", "parcels_interior", "neighbours_mean_interior",
    "right_of_way_m2", "land_use_streets_pct", "land_use_parcels_pct", "net_area_mean_m2",
    "net_area_min_m2",
}  # fmt: skip
"""What is the same whether parcels run to the centreline or stop at the right-of-way."""


@cache
def layout(land: str, pattern: str) -> Any:
    made = up.cogenerate(LANDS[land], min_area=900, right_of_way=True, pattern=pattern)
    values = LayoutMeasures(made.layout).of_fabric.values
    streets = made.streets
    lines = street_lines(
        list(streets.geometry),
        width=streets.width_m.to_numpy(),
        street_class=streets["class"].to_numpy().astype(np.str_),
    )
    return made, values, lines


def values_of(fabric: Fabric) -> Any:
    return FabricMeasures(fabric).values


def fabric(
    parcels: list[Polygon] | None, streets: list[LineString] | None, land: Any = None, **kw: Any
) -> Fabric:
    lines = None if streets is None else street_lines(streets, width=kw.pop("width", 12))
    known = None if parcels is None else observed_parcels(parcels)
    return fabric_of_layers(lines, known, land, MeasureParams(**kw))


def codes(made: Fabric) -> set[str]:
    return {issue.code for issue in made.issues}


def base(name: str) -> str:
    return name.removesuffix("_interior")


@pytest.mark.parametrize("pattern", ["loop", "tree"])
@pytest.mark.parametrize("land", sorted(LANDS))
@pytest.mark.parametrize("known_land", [True, False])
def test_gross_layers_of_a_layout_have_its_figures(
    land: str, pattern: str, known_land: bool
) -> None:
    made, values, lines = layout(land, pattern)
    ground = list(made.boundary.geometry) if known_land else None
    found = values_of(
        fabric_of_layers(lines, observed_parcels(list(made.parcels.geometry)), ground)
    )
    for name, value in values.items():
        if base(name) in MADE | EXACT:
            assert math.isnan(found[name])
        elif base(name) in CORNERS:
            # 9 m turning heads and corners of 6 m, of a layout of some hundred parcels
            assert found[name] == pytest.approx(value, rel=0.06), name
        else:
            assert found[name] == pytest.approx(value, rel=1e-3, abs=2e-3, nan_ok=True), name


@pytest.mark.parametrize("pattern", ["loop", "tree"])
@pytest.mark.parametrize("land", sorted(LANDS))
@pytest.mark.parametrize("known_land", [True, False])
def test_net_layers_of_a_layout_have_the_figures_that_do_not_depend_on_shape(
    land: str, pattern: str, known_land: bool
) -> None:
    made, values, lines = layout(land, pattern)
    ground = list(made.boundary.geometry) if known_land else None
    net = observed_parcels(list(made.net_parcels.geometry))
    found = values_of(fabric_of_layers(lines, net, ground))
    for name in sorted(NETWORK):
        # of neighbours that share little, the right-of-way may leave nothing
        rel = 0.03 if "neighbours" in name else 1e-3
        assert found[name] == pytest.approx(values[name], rel=rel, abs=1e-3, nan_ok=True), name
    # ways begin opposite the frontage, which is shorter by the streets beside corner parcels
    for name in ("rim_distance_m", "parcel_distance_m", "parcel_detour"):
        assert found[name] == pytest.approx(values[name], rel=0.1), name
    # the right-of-way takes half its width of every parcel
    assert 0.7 * values["frontage_mean_m"] < found["frontage_mean_m"] < values["frontage_mean_m"]
    assert found["area_mean_m2"] == pytest.approx(values["net_area_mean_m2"], rel=1e-4)


def turned(geometries: list[Any], degrees: float) -> list[Any]:
    return [translate(rotate(g, degrees, origin=(0, 0)), 5000, 7000) for g in geometries]


def test_turned_layers_have_the_same_figures() -> None:
    made, _, lines = layout("notched", "tree")
    net = list(made.net_parcels.geometry)
    before = values_of(fabric_of_layers(lines, observed_parcels(net)))
    line = street_lines(
        turned(list(lines.lines), 33.0), width=lines.width, street_class=lines.street_class
    )
    after = values_of(fabric_of_layers(line, observed_parcels(turned(net, 33.0))))
    free = {"orientation_entropy", "orientation_order"}  # of bearings in bins
    for name, value in before.items():
        if base(name) not in free:
            rel = 0.01 if "thinness" in name else 1e-3  # found within a tolerance
            assert after[name] == pytest.approx(value, rel=rel, abs=1e-3, nan_ok=True), name


def test_order_of_rows_directions_and_starting_vertices_do_not_matter() -> None:
    made, _, lines = layout("with a hole", "tree")
    net = list(made.net_parcels.geometry)
    before = fabric_of_layers(lines, observed_parcels(net))
    rng = np.random.default_rng(4)
    order, rows = rng.permutation(len(net)), rng.permutation(len(lines))
    shifted = [Polygon(np.roll(np.array(net[i].exterior.coords)[:-1], 2, axis=0)) for i in order]
    back = np.array([lines.lines[i].reverse() for i in rows])
    again = street_lines(back, width=lines.width[rows], street_class=lines.street_class[rows])
    after = fabric_of_layers(again, observed_parcels(shifted))
    assert before.parcels is not None
    assert after.parcels is not None
    assert (after.network.edge_length == before.network.edge_length).all()
    assert after.parcels.rings.frontage == pytest.approx(before.parcels.rings.frontage[order])
    assert (after.parcels.block == before.parcels.block[order]).all()
    assert (after.parcels.neighbours == before.parcels.neighbours[order]).all()


# frontage, case by case


def test_frontage_reaches_over_wide_rights_of_way_as_far_as_is_said() -> None:
    street, lot = [LineString([(-50, 0), (70, 0)])], [box(0, 14, 20, 40)]
    near = fabric(lot, street, street_reach=10)
    assert near.parcels is not None
    assert near.parcels.rings.frontage.tolist() == [20]
    far = fabric(lot, street, street_reach=7)
    assert far.parcels is not None
    assert far.parcels.rings.frontage.tolist() == [0]


def test_a_parcel_behind_another_has_no_frontage_and_one_behind_a_gap_of_a_hair_neither() -> None:
    front, back = box(0, 6, 20, 12), box(0, 12.05, 20, 40)
    made = fabric([front, back], [LineString([(-50, 0), (70, 0)])])
    assert made.parcels is not None
    assert made.parcels.rings.frontage.tolist() == [20, 0]
    assert made.parcels.neighbours.tolist() == [1, 1]


def test_a_parcel_beyond_another_that_stands_apart_has_no_frontage() -> None:
    front, back = box(0, 6, 20, 9), box(0, 11, 20, 40)
    made = fabric([front, back], [LineString([(-50, 0), (70, 0)])])
    assert made.parcels is not None
    assert made.parcels.rings.frontage.tolist() == [20, 0]


def test_a_parcel_half_hidden_has_the_frontage_that_is_left() -> None:
    kiosk, shop = box(0, 6, 8, 9), box(0, 11, 20, 40)
    made = fabric([kiosk, shop], [LineString([(-50, 0), (70, 0)])])
    assert made.parcels is not None
    assert made.parcels.rings.frontage == pytest.approx([8, 12], abs=2)


@pytest.mark.parametrize(("degrees", "fronts"), [(0, True), (44, True), (70, False)])
def test_only_what_runs_about_along_the_street_is_frontage(degrees: float, fronts: bool) -> None:
    lot = rotate(box(0, 8, 10, 18), degrees, origin=(0, 8))
    made = fabric([lot], [LineString([(-80, 0), (80, 0)])], [box(-80, -10, 80, 40)])
    assert made.parcels is not None
    ring = made.parcels.rings
    corner = np.flatnonzero((ring.xy == [0.0, 8.0]).all(axis=1))[0]
    assert (ring.on_street[corner] > 0) == fronts


def test_parcels_around_the_end_of_a_street_front_it() -> None:
    street = LineString([(-60, 0), (0, 0)])
    beside = [box(-60, 8, 12, 40), box(-60, -40, 12, -8)]
    beyond = box(12, -40, 40, 40)
    made = fabric([*beside, beyond], [street])
    assert made.parcels is not None
    assert made.parcels.rings.frontage[2] == pytest.approx(16)
    assert made.parcels.fronts.edge[made.parcels.fronts.parcel == 2].tolist() == [0]


def test_a_parcel_between_two_streets_fronts_both_at_the_right_metres() -> None:
    streets = [LineString([(-9, 0), (109, 0)]), LineString([(-9, 60), (109, 60)])]
    lots = [box(x, 6, x + 20, 54) for x in range(0, 100, 20)]
    made = fabric(lots, streets, [box(-9, 0, 109, 60)])
    assert made.parcels is not None
    fronts = made.parcels.fronts
    assert len(fronts.parcel) == 10
    places = shapely.line_interpolate_point(made.street_lines[fronts.edge], fronts.at)
    middle = shapely.centroid(np.array(lots, dtype=object))[fronts.parcel]
    assert shapely.get_x(places) == pytest.approx(shapely.get_x(middle))
    assert (FabricMeasures(made).values["through_lots"], made.parcels.rings.rim.all()) == (5, True)


def test_a_corner_that_is_cut_off_is_on_a_street() -> None:
    lot = Polygon([(12, 6), (60, 6), (60, 60), (6, 60), (6, 12)])
    made = fabric([lot], [LineString([(0, -60), (0, 90)]), LineString([(-60, 0), (90, 0)])])
    assert made.parcels is not None
    assert made.parcels.rings.frontage[0] == pytest.approx(48 + 48 + math.hypot(6, 6))


# streets and the rim


def test_streets_near_the_rim_are_on_it_and_those_that_meet_them_still_do() -> None:
    land = box(0, 0, 300, 200)
    streets = [
        LineString([(-80, 2), (150, -2), (380, 2.5)]),  # along the rim, in and out
        LineString([(100, 1), (100, 150), (200, 150), (200, -1)]),
    ]
    made = fabric(None, streets, [land])
    net = made.network
    assert net.edge_length[net.edge_rim].sum() == pytest.approx(300, abs=1e-3)
    assert len(made.blocks) == 2
    assert shapely.area(made.blocks.polygons).sum() == pytest.approx(land.area)
    assert net.edge_length[~net.edge_rim].sum() == pytest.approx(400, abs=4)
    assert (net.node_kind == NodeKind.ENTRY).sum() == 2
    assert (net.node_kind == NodeKind.END).sum() == 0


def test_a_street_around_the_land_is_on_its_whole_rim() -> None:
    land = box(0, 0, 300, 200)
    around = shapely.buffer(land, 2.0, join_style="mitre").exterior
    inner = LineString([(150, -2), (150, 202)])
    made = fabric(None, [LineString(around.coords), inner], [land])
    net = made.network
    assert net.edge_length[net.edge_rim].sum() == pytest.approx(1000, abs=1e-3)
    assert net.edge_length[~net.edge_rim].tolist() == pytest.approx([200])
    assert len(made.blocks) == 2
    assert values_of(made)["junctions"] == 2


@pytest.mark.parametrize("degrees", [0, 20, 45, 70])
def test_streets_that_cross_the_rim_are_cut_there_and_enter(degrees: float) -> None:
    land = box(-100, -100, 100, 100)
    street = rotate(LineString([(-400, 3), (400, 3)]), degrees, origin=(0, 0))
    made = fabric(None, [street], [land])
    assert (made.network.node_kind == NodeKind.ENTRY).sum() == 2
    assert not made.network.edge_rim.any()
    inside = shapely.length(shapely.intersection(street, land))
    assert made.network.edge_length.sum() == pytest.approx(inside, abs=0.01)
    assert len(made.blocks) == 2
    assert "streets_outside" in codes(made)


def test_a_short_street_beside_a_wide_one_is_counted() -> None:
    streets = street_lines(
        [LineString([(0, 0), (200, 0)]), LineString([(100, 0), (100, 9)])], width=[30, 8]
    )
    made = fabric_of_layers(streets, None, [box(0, -50, 200, 50)])
    assert values_of(made)["dead_ends"] == 1


def test_class_and_width_of_an_edge_are_those_of_its_longest_stretch() -> None:
    streets = street_lines(
        [LineString([(0, 0), (30, 0)]), LineString([(30, 0), (100, 0)])],
        width=[30, 8],
        street_class=["primary", "service"],
    )
    made = fabric_of_layers(streets, None, [box(-10, -50, 110, 50)])
    assert made.network.edge_class.tolist() == ["service"]
    assert made.network.edge_width.tolist() == [8]


def test_no_street_in_the_land_is_an_error_of_streets_and_an_issue_of_parcels() -> None:
    land, away = [box(0, 0, 100, 100)], [LineString([(0, 160), (100, 160)])]
    with pytest.raises(BoundaryError, match="No street enters the land"):
        fabric(None, away, land)
    made = fabric([box(10, 10, 30, 30)], away, land)
    assert "no_street_enters" in codes(made)
    assert values_of(made)["unreached"] == 1


# the land of a town


def rows_of_houses() -> list[Polygon]:
    """Two blocks of five lots on both sides of a street along y = 0."""
    return [box(x, y, x + 20, y + 30) for x in range(0, 100, 20) for y in (-36, 6)]


def test_land_goes_to_the_centreline_of_streets_around_parcels_and_no_further() -> None:
    lots = [box(x, 6, x + 20, 54) for x in range(6, 106, 20)]
    around = LineString(box(0, 0, 112, 60).exterior.coords)
    away = [LineString([(112, 60), (400, 60)]), LineString([(0, 0), (-200, -200)])]
    made = fabric(lots, [around, *away])
    assert len(made.land) == 1
    assert shapely.equals_exact(
        shapely.normalize(made.land[0].simplify(0.01)), shapely.normalize(box(0, 0, 112, 60)), 0.02
    )
    assert made.network.edge_rim.all()
    values = values_of(made)
    assert values["land_use_other_pct"] == pytest.approx(0, abs=1e-6)
    assert (values["unreached"], values["blocks"]) == (0, 1)


def test_streets_that_lead_away_are_cut_where_parcels_end() -> None:
    made = fabric(rows_of_houses(), [LineString([(-500, 0), (600, 0)])])
    assert shapely.area(made.land).sum() == pytest.approx(100 * 72)
    assert made.network.edge_length.sum() == pytest.approx(100)
    assert (made.network.node_kind == NodeKind.ENTRY).all()
    assert "land_assumed" in codes(made)


def test_a_lake_is_no_land_and_a_junction_without_parcels_is() -> None:
    ring = [box(x, y, x + 50, y + 50) for x in range(0, 250, 50) for y in range(0, 250, 50)]
    lots = [p for p in ring if not box(51, 51, 199, 199).contains(p.centroid)]
    lake = fabric(lots, [LineString([(-20, 0), (270, 0)])])
    assert shapely.area(lake.land).sum() == pytest.approx(250**2 - 150**2, rel=0.01)
    through = fabric(lots, [LineString([(50, 120), (200, 120)]), LineString([(0, 0), (250, 0)])])
    assert shapely.area(through.land).sum() == pytest.approx(250**2, rel=0.01)


def test_without_streets_there_is_no_frontage_and_that_is_said() -> None:
    made = fabric(rows_of_houses(), None)
    values = values_of(made)
    assert codes(made) == {"no_streets_given", "land_assumed"}
    assert values["parcels"] == 10
    assert values["p_angle_deg"] == pytest.approx(0)
    unknown = (
        "unreached", "frontage_mean_m", "land_use_streets_pct", "rim_distance_m",
        "through_lots", "through_lots_pct", "street_length_relative",
    )  # fmt: skip
    for name in unknown:
        assert math.isnan(values[name]), name
    assert values["blocks"] == 0
    assert len(fabric_layers(FabricMeasures(made)).tables) == 7


def test_streets_alone_lie_in_their_convex_hull() -> None:
    grid = [LineString([(x, 0), (x, 200)]) for x in (0, 100, 200)]
    grid += [LineString([(0, y), (200, y)]) for y in (0, 100, 200)]
    made = fabric(None, grid)
    values = values_of(made)
    assert values["area_m2"] == pytest.approx(40_000)
    assert (values["blocks"], values["intersections"], values["streets"]) == (4, 1, 2)
    assert values["right_of_way_m2"] == pytest.approx(40_000 - 4 * 88**2)


# parcels


def test_parcels_outside_count_not_and_those_cut_stay_whole() -> None:
    lots = rows_of_houses()
    made = fabric(lots, [LineString([(-50, 0), (150, 0)])], [box(0, -40, 55, 40)])
    assert made.parcels is not None
    assert len(made.parcels) == 6
    assert {"parcels_outside", "parcels_cut"} <= codes(made)
    assert made.parcels.rings.area.tolist() == [600] * 6


def test_no_parcel_in_the_land_is_an_error() -> None:
    with pytest.raises(BoundaryError, match="No parcel lies in the land"):
        fabric(rows_of_houses(), [LineString([(0, 0), (9, 0)])], [box(0, 50, 9, 90)])


def test_parcels_that_overlap_are_told_of() -> None:
    made = fabric([box(0, 6, 20, 36), box(10, 6, 30, 36)], [LineString([(0, 0), (30, 0)])])
    assert "parcels_overlap" in codes(made)


def test_parcels_of_streets_are_land_of_streets() -> None:
    road, avenue = box(0, -6, 100, 6), box(106, -400, 136, 400)
    lots = [*rows_of_houses(), road, avenue]
    streets = [LineString([(-20, 0), (121, 0)]), LineString([(121, -500), (121, 500)])]
    made = fabric(lots, streets)
    assert made.parcels is not None
    assert len(made.parcels) == 10
    assert "street_parcels" in codes(made)
    assert values_of(made)["unreached"] == 0


def test_a_drive_or_a_campus_makes_no_street_of_a_parcel() -> None:
    campus, flag = box(0, 0, 300, 300), Polygon([(400, 0), (408, 0), (408, 30), (440, 30),
                                                 (440, 70), (400, 70)])  # fmt: skip
    drives = [
        LineString([(0, 100), (300, 100)]),
        LineString([(150, 0), (150, 300)]),
        LineString([(404, -10), (404, 35)]),
    ]
    work = fabric_work(street_lines(drives, width=8))
    assert not street_parcels(np.array([campus, flag]), *work, snap=1.0).any()


def fabric_work(streets: StreetLines) -> Any:
    from urban_processing.blocks.noding import node_lines

    work = node_lines(streets.lines, streets.width)
    return work, streets.width[work.line]


@pytest.mark.parametrize("name", ["eatonville_wa_us", "tehran_farahzad_ir", "santa_rosa_ca_us"])
def test_real_parcels_are_kept_and_the_land_adds_up(name: str) -> None:
    parcels = real_parcels(name)
    parcels = parcels[np.unique(shapely.to_wkb(shapely.normalize(parcels)), return_index=True)[1]]
    made = fabric(list(parcels), list(medial_streets(parcels)))
    assert made.parcels is not None
    assert len(made.parcels) >= 0.99 * len(parcels)
    values = values_of(made)
    total = sum(values[f"land_use_{use}_pct"] for use in ("streets", "parcels", "parks", "other"))
    if "parcels_overlap" not in codes(made):
        assert total == pytest.approx(100, abs=0.2)
    assert made.right_of_way is not None
    inside = shapely.union_all(made.land)
    outside = shapely.difference(shapely.union_all(made.right_of_way), inside)
    assert shapely.area(outside) < 1
    assert 0 < values["unreached"] < 0.8 * len(parcels)
    assert (made.parcels.block >= 0).all()
    front = np.bincount(made.parcels.fronts.parcel, weights=made.parcels.fronts.length,
                        minlength=len(made.parcels))  # fmt: skip
    assert front == pytest.approx(made.parcels.rings.frontage)
    assert (made.parcels.rings.frontage <= shapely.length(made.parcels.rings.polygons) + 1e-6).all()
    at, edge = made.parcels.fronts.at, made.parcels.fronts.edge
    assert ((at >= 0) & (at <= made.network.edge_length[edge] + 1e-6)).all()


def test_streets_among_the_parcels_of_gangnam_are_told_apart() -> None:
    parcels = real_parcels("seoul_gangnam_kr")
    roundness = 4 * np.pi * shapely.area(parcels) / shapely.length(parcels) ** 2
    thin = (roundness < 0.3) & (shapely.area(parcels) > 300)
    streets = medial_streets(parcels[~thin], gap=1.9)
    work = fabric_work(street_lines(streets, width=12))
    found = street_parcels(parcels, *work, snap=1.0)
    assert found.sum() >= 10
    assert (thin | ~found).mean() > 0.98
    assert shapely.area(parcels[found & thin]).sum() > 0.9 * shapely.area(parcels[found]).sum()


def test_overlaps_are_clipped_where_that_is_asked_for() -> None:
    along = segments_of(np.array([LineString([(0, 0), (100, 0)])]))
    aslant = segments_of(np.array([LineString([(0, -5), (100, 5)])]))
    assert not len(find_overlaps(along, aslant, 1.0).first)
    found = find_overlaps(along, aslant, 1.0, clipped=True)
    assert (found.low.tolist(), found.high.tolist()) == ([0.4], [0.6])
    assert found.far.tolist() == pytest.approx([1.0])
