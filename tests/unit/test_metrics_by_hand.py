"""Every metric of the registry on three small towns, worked out by hand."""

from __future__ import annotations

import dataclasses
import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import networkx as nx
import numpy as np
import pytest
import shapely
from grid_layouts import layout_of

from urban_processing.layout import PARCEL_USE, Layout
from urban_processing.metrics.measures import measure
from urban_processing.metrics.registry import INTERIOR, METRICS
from urban_processing.provenance import Step
from urban_processing.street_rules import StreetRules

NAN = math.nan
Place = tuple[float, float]
Front = Mapping[Place, float]


def cells(nx_: int, ny: int, width: float, depth: float) -> list[shapely.Polygon]:
    """Cells of a grid, row by row."""
    return [
        shapely.box(i * width, j * depth, (i + 1) * width, (j + 1) * depth)
        for j in range(ny)
        for i in range(nx_)
    ]


def ruled(layout: Layout, **rules: float) -> Layout:
    plain = StreetRules(corner_radius=0.0, turning_radius=0.0, laid_out=True)
    return layout.replace(street_rules=dataclasses.replace(plain, **rules))


def entropy(*metres: float) -> float:
    """Of streets that run to one side and to its opposite, by their metres in each direction."""
    shares = [m / sum(metres) / 2 for m in metres for _ in range(2)]
    return -sum(s * math.log(s) for s in shares)


def order(of_entropy: float) -> float:
    return 1 - ((of_entropy - math.log(4)) / (math.log(36) - math.log(4))) ** 2


@dataclass
class Streets:
    """Streets drawn from place to place, and parcels by metres of frontage at places on them."""

    lines: Sequence[Sequence[Place]]
    fronts: Sequence[Front]

    def ways(self) -> dict[Place, dict[Place, float]]:
        graph = nx.Graph()
        for line in self.lines:
            for a, b in itertools.pairwise(line):
                graph.add_edge(a, b, weight=math.dist(a, b))
        return dict(nx.all_pairs_dijkstra_path_length(graph))

    def between(self, parcels: Sequence[int]) -> tuple[float, float]:
        """Mean way and mean detour over pairs of parcels."""
        ways, way, pairs, detour, far = self.ways(), 0.0, 0.0, 0.0, 0.0
        for i, j in itertools.permutations(parcels, 2):
            one, other = self.fronts[i], self.fronts[j]
            for (a, m), (b, n) in itertools.product(one.items(), other.items()):
                weight = m / sum(one.values()) * n / sum(other.values())
                way += weight * ways[a][b]
                pairs += weight
                if a != b:
                    detour += weight * ways[a][b] / math.dist(a, b)
                    far += weight
        return way / pairs, detour / far


def mean_detour(ways: Mapping[tuple[Place, Place], float]) -> float:
    return float(np.mean([way / math.dist(a, b) for (a, b), way in ways.items()]))


def crossing() -> tuple[Layout, dict[str, float]]:
    """2 × 2 parcels of 100 m × 60 m, the rim and a cross between them streets."""
    layout = layout_of(
        cells(2, 2, 100, 60), [(0, 60), (200, 60)], [(100, 0), (100, 120)], unit=1.0, min_area=2000
    )
    layout = ruled(layout, rim=8.0, collector=10.0).replace(
        face_level=np.array([2, 2, 1, 1]),
        land_uses=(PARCEL_USE, "park", "school"),
        face_use=np.array([0, 0, 1, 2]),
        history=(Step("drawn", {}, 0, "1", "", 1.5), Step("drawn", {}, 0, "1", "", 0.25)),
    )
    # left of each parcel: 4 m go to the rim, 5 m to the cross, (100 - 9) (60 - 9)
    land, net = 200.0 * 120, 91.0 * 51
    streets = land - 4 * net
    side = math.sqrt(6000)
    # a parcel's four sides with their middles; the shorter ones hold 3/16 of its frontage each
    south_west = {(0.0, 30.0): 60, (50.0, 0.0): 100, (50.0, 60.0): 100, (100.0, 30.0): 60}
    fronts = [
        {(x + dx, y + dy): m for (x, y), m in south_west.items()}
        for dy in (0, 60)
        for dx in (0, 100)
    ]
    town = Streets(
        [
            [(0, 0), (50, 0), (100, 0), (150, 0), (200, 0)],
            [(0, 60), (50, 60), (100, 60), (150, 60), (200, 60)],
            [(0, 120), (50, 120), (100, 120), (150, 120), (200, 120)],
            [(0, 0), (0, 30), (0, 60), (0, 90), (0, 120)],
            [(100, 0), (100, 30), (100, 60), (100, 90), (100, 120)],
            [(200, 0), (200, 30), (200, 60), (200, 90), (200, 120)],
        ],
        fronts,
    )
    way, detour = town.between(range(4))
    # added up on paper: neighbours across the long street, across the short one, and at a corner
    beside = (9180 + 10400 + 10400 + 3840) / 256
    above = (5280 + 13700 + 6400 + 5280) / 256
    corner = (10080 + 15200 + 10400 + 5280) / 256
    assert way == pytest.approx((beside + above + corner) / 3)
    expected = {
        "perimeter_m": 640,
        "area_m2": land,
        "min_area_m2": 2000,
        "parcels": 4,
        "triangles": 0,
        "quads": 4,
        "pentagons": 0,
        "hexagons": 0,
        "more_sides": 0,
        "quads_pct": 100,
        # sides of 100 and 60: variance 400 over 80² by a quarter; angles do not vary
        "irregularity_min": 0.25 * 400 / 6400,
        "irregularity_mean": 0.25 * 400 / 6400,
        "irregularity_max": 0.25 * 400 / 6400,
        "irregular_pct": 0,
        "streets": 2,
        "junctions": 5,  # the crossing, and four with the rim
        "street_ends": 0,
        "street_length_m": 320,
        "street_length_mean_m": 160,
        "junction_deviation_deg": 0,
        "junction_deviation_deg_interior": 0,
        "junction_deviation_max_deg": 0,
        "deepest_level": 2,
        "seconds": 1.75,
        "unreached": 0,
        "frontage_mean_m": 320,
        "frontage_min_m": 320,
        "width_depth_median": 100 / 60,
        "width_depth_p10": 100 / 60,
        "width_depth_p90": 100 / 60,
        "thinness_mean": 60 / side,
        "thinness_min": 60 / side,
        "p_angle_deg": 0,
        "p_area": 1,
        "undesirable_pct": 0,
        "undesirable": 0,
        "neighbours_mean": 0,  # a street lies between any two
        "through_lots": 4,
        "through_lots_pct": 100,
        "area_mean_m2": 6000,
        "area_cv": 0,
        "area_min_over_mean": 1,
        "area_max_over_min_area": 3,
        "above_2_min_area_pct": 100,
        "above_3_min_area": 0,  # three times exactly is not above
        "net_area_mean_m2": net,
        "net_area_min_m2": net,
        "right_of_way_m2": streets,
        "right_of_way_pct": 100 * streets / land,
        "street_share_pct": 100,
        "parcels_per_street": 2,
        "street_length_relative": 320 / 4 / side,
        "blocks": 4,
        "block_parcels_median": 1,
        "block_parcels_max": 1,
        "block_length_median_m": 100,
        "block_length_max_m": 100,
        "small_blocks_pct": 100,
        "block_area_mean_m2": 6000,
        "block_area_median_m2": 6000,
        "blocks_per_km2": 4 / 0.024,
        "block_perimeter_max_m": 320,
        "block_perimeter_mean_m": 320,
        "block_perimeter_min_m": 320,
        "land_use_streets_pct": 100 * streets / land,
        "land_use_parcels_pct": 100 * 2 * net / land,
        "land_use_parks_pct": 100 * net / land,
        "land_use_other_pct": 100 * net / land,  # the school
        "parcels_per_km2": 4 / 0.024,
        "street_km_per_km2": 0.320 / 0.024,
        "intersections": 1,
        "intersections_per_km2": 1 / 0.024,
        "intersections_3_pct": 0,
        "intersections_4_pct": 100,
        "intersections_5_pct": 0,
        "dead_ends": 0,
        "dead_ends_per_km2": 0,
        "segment_length_mean_m": (100 + 100 + 60 + 60) / 4,
        "circuity": 1,
        "orientation_entropy": entropy(200, 120),
        "orientation_order": order(entropy(200, 120)),
        "meshedness": 0,  # four segments that meet in one place
        "network_pieces": 1,
        # from the crossing to four places on the rim and between opposite ones it is straight
        "network_detour": (6 + 4 * 160 / math.hypot(100, 60)) / 10,
        # half of the frontage is on the rim; the rest begins there and is 100 and 60 m long
        "rim_distance_m": (100 * 50 + 60 * 30) / 320,
        "parcel_distance_m": way,
        "parcel_detour": detour,
    }
    return layout, expected | no_interior_parcels()


def dead_end() -> tuple[Layout, dict[str, float]]:
    """4 × 2 parcels of 50 m × 40 m; a street through the middle, a dead end to the east of it."""
    layout = layout_of(
        cells(4, 2, 50, 40), [(100, 0), (100, 80)], [(100, 40), (150, 40)], unit=1.0, min_area=2000
    )
    layout = ruled(layout, rim=8.0, collector=10.0, cul_de_sac=6.0)
    land, side = 200.0 * 80, math.sqrt(2000)
    # in each row, from west to east: 4 m go to the rim, 5 m to the middle street, 3 m to the
    # dead end, which ends in a half circle at the last parcels
    end = math.pi * 3**2 / 4
    net = [46 * 36, 45 * 36, 45 * 33, 46 * 36 - end]
    streets = land - 2 * sum(net)
    west, east = {(0.0, 20.0): 40, (25.0, 0.0): 50}, {(200.0, 20.0): 40, (175.0, 0.0): 50}
    south = [
        west,
        {(75.0, 0.0): 50, (100.0, 20.0): 40},
        {(125.0, 0.0): 50, (100.0, 20.0): 40, (125.0, 40.0): 50},
        east,
    ]
    north = [{(x, 80 - y): m for (x, y), m in front.items()} for front in south]
    town = Streets(
        [
            [(0, 0), (25, 0), (75, 0), (100, 0), (125, 0), (175, 0), (200, 0)],
            [(0, 80), (25, 80), (75, 80), (100, 80), (125, 80), (175, 80), (200, 80)],
            [(0, 0), (0, 20), (0, 60), (0, 80)],
            [(200, 0), (200, 20), (200, 60), (200, 80)],
            [(100, 0), (100, 20), (100, 40), (100, 60), (100, 80)],
            [(100, 40), (125, 40)],
        ],
        [*south, *north],
    )
    way, detour = town.between(range(8))
    expected = {
        "perimeter_m": 560,
        "area_m2": land,
        "min_area_m2": 2000,
        "parcels": 8,
        "triangles": 0,
        "quads": 8,
        "pentagons": 0,
        "hexagons": 0,
        "more_sides": 0,
        "quads_pct": 100,
        "irregularity_min": 0.25 * 25 / 45**2,
        "irregularity_mean": 0.25 * 25 / 45**2,
        "irregularity_max": 0.25 * 25 / 45**2,
        "irregular_pct": 0,
        "streets": 2,
        "junctions": 3,
        "street_ends": 1,
        "street_length_m": 130,
        "street_length_mean_m": 65,
        "junction_deviation_deg": 0,
        "junction_deviation_deg_interior": 0,
        "junction_deviation_max_deg": 0,
        "deepest_level": 0,
        "seconds": NAN,  # it has no history
        "unreached": 0,
        "frontage_mean_m": (3 * 90 + 140) / 4,
        "frontage_min_m": 90,
        "width_depth_median": 1.25,
        "width_depth_p10": 1.25,
        "width_depth_p90": 1.25,
        "thinness_mean": 40 / side,
        "thinness_min": 40 / side,
        "p_angle_deg": 0,
        "p_area": 1,
        "undesirable_pct": 0,
        "undesirable": 0,
        # borders without a street: four along the rows, three across
        "neighbours_mean": 2 * (2 * 2 + 3) / 8,
        "through_lots": 2,  # beside the dead end
        "through_lots_pct": 25,
        "area_mean_m2": 2000,
        "area_cv": 0,
        "area_min_over_mean": 1,
        "area_max_over_min_area": 1,
        "above_2_min_area_pct": 0,
        "above_3_min_area": 0,
        "net_area_mean_m2": sum(net) / 4,
        "net_area_min_m2": 45 * 33,
        "right_of_way_m2": streets,
        "right_of_way_pct": 100 * streets / land,
        "street_share_pct": 100 * 130 / (3 * 80 + 200),
        "parcels_per_street": 4,
        "street_length_relative": 130 / 8 / side,
        "blocks": 2,
        "block_parcels_median": 4,
        "block_parcels_max": 4,
        "block_length_median_m": 100,
        "block_length_max_m": 100,
        "small_blocks_pct": 0,
        "block_area_mean_m2": 8000,
        "block_area_median_m2": 8000,
        "blocks_per_km2": 2 / 0.016,
        "block_perimeter_max_m": 360,
        "block_perimeter_mean_m": 360,
        "block_perimeter_min_m": 360,
        "land_use_streets_pct": 100 * streets / land,
        "land_use_parcels_pct": 100 * (land - streets) / land,
        "land_use_parks_pct": 0,
        "land_use_other_pct": 0,
        "parcels_per_km2": 8 / 0.016,
        "street_km_per_km2": 0.130 / 0.016,
        "intersections": 1,
        "intersections_per_km2": 1 / 0.016,
        "intersections_3_pct": 100,
        "intersections_4_pct": 0,
        "intersections_5_pct": 0,
        "dead_ends": 1,
        "dead_ends_per_km2": 1 / 0.016,
        "segment_length_mean_m": (40 + 40 + 50) / 3,
        "circuity": 1,
        "orientation_entropy": entropy(80, 50),
        "orientation_order": order(entropy(80, 50)),
        "meshedness": 0,
        "network_pieces": 1,
        "network_detour": mean_detour(
            {
                ((100, 0), (100, 40)): 40,
                ((100, 40), (100, 80)): 40,
                ((100, 0), (100, 80)): 80,
                ((100, 40), (150, 40)): 50,
                ((100, 0), (150, 40)): 90,
                ((100, 80), (150, 40)): 90,
            }
        ),
        # beside the middle street 20 m, beside the dead end 40 + 25 m
        "rim_distance_m": (40 * 20 / 90 + (40 * 20 + 50 * 65) / 140) / 4,
        "parcel_distance_m": way,
        "parcel_detour": detour,
    }
    return layout, expected | no_interior_parcels()


def entries() -> tuple[Layout, dict[str, float]]:
    """4 × 3 parcels of 30 m × 30 m; no street on the rim, one across the land between two entries
    and one from its middle to the rim, where it ends."""
    layout = layout_of(
        cells(4, 3, 30, 30),
        [(0, 30), (120, 30)],
        [(60, 30), (60, 90)],
        unit=1.0,
        rim=False,
        min_area=400,
    )
    gates = (layout.mesh.xy[:, 1] == 30) & np.isin(layout.mesh.xy[:, 0], [0, 120])
    layout = layout.replace(vertex_entry=gates)
    land = 120.0 * 90
    # metres from the junction, to the west, east and north
    w45, w15, e15, e45 = (15.0, 30.0), (45.0, 30.0), (75.0, 30.0), (105.0, 30.0)
    n15, n45 = (60.0, 45.0), (60.0, 75.0)
    fronts = [
        *({w45: 30}, {w15: 30}, {e15: 30}, {e45: 30}),
        *({w45: 30}, {w15: 30, n15: 30}, {e15: 30, n15: 30}, {e45: 30}),
        *({}, {n45: 30}, {n45: 30}, {}),
    ]
    town = Streets(
        [[(0, 30), w45, w15, (60, 30), e15, e45, (120, 30)], [(60, 30), n15, n45, (60, 90)]],
        fronts,
    )
    way, detour = town.between([i for i, front in enumerate(fronts) if front])
    expected = {
        "perimeter_m": 420,
        "area_m2": land,
        "min_area_m2": 400,
        "parcels": 12,
        "triangles": 0,
        "quads": 12,
        "pentagons": 0,
        "hexagons": 0,
        "more_sides": 0,
        "quads_pct": 100,
        "irregularity_min": 0,
        "irregularity_mean": 0,
        "irregularity_max": 0,
        "irregular_pct": 0,
        "streets": 2,
        "junctions": 1,
        "street_ends": 1,  # entries are none
        "street_length_m": 180,
        "street_length_mean_m": 90,
        "junction_deviation_deg": 0,
        "junction_deviation_deg_interior": 0,
        "junction_deviation_max_deg": 0,
        "deepest_level": 0,
        "seconds": NAN,
        "unreached": 2,
        "frontage_mean_m": (8 * 30 + 2 * 60) / 12,
        "frontage_min_m": 0,
        "width_depth_median": 1,
        "width_depth_p10": 1,
        "width_depth_p90": 1,
        "thinness_mean": 1,
        "thinness_min": 1,
        "p_angle_deg": 0,
        "p_area": 1,
        "undesirable_pct": 0,
        "undesirable": 0,
        # borders without a street: three, two and two along the rows, four across
        "neighbours_mean": 2 * (3 + 2 + 2 + 4) / 12,
        "through_lots": 0,
        "through_lots_pct": 0,
        "area_mean_m2": 900,
        "area_cv": 0,
        "area_min_over_mean": 1,
        "area_max_over_min_area": 2.25,
        "above_2_min_area_pct": 100,
        "above_3_min_area": 0,
        "net_area_mean_m2": NAN,  # nothing is laid out
        "net_area_min_m2": NAN,
        "right_of_way_m2": NAN,
        "right_of_way_pct": NAN,
        "street_share_pct": 100 * 180 / (3 * 90 + 2 * 120),
        "parcels_per_street": 6,
        "street_length_relative": 180 / 12 / 30,
        "blocks": 3,
        "block_parcels_median": 4,
        "block_parcels_max": 4,
        "block_length_median_m": 60,
        "block_length_max_m": 120,
        "small_blocks_pct": 0,
        "block_area_mean_m2": 3600,
        "block_area_median_m2": 3600,
        "blocks_per_km2": 3 / 0.0108,
        "block_perimeter_max_m": 300,
        "block_perimeter_mean_m": (300 + 240 + 240) / 3,
        "block_perimeter_min_m": 240,
        "land_use_streets_pct": NAN,
        "land_use_parcels_pct": NAN,
        "land_use_parks_pct": NAN,
        "land_use_other_pct": NAN,
        "parcels_per_km2": 12 / 0.0108,
        "street_km_per_km2": 0.180 / 0.0108,
        "intersections": 1,
        "intersections_per_km2": 1 / 0.0108,
        "intersections_3_pct": 100,
        "intersections_4_pct": 0,
        "intersections_5_pct": 0,
        "dead_ends": 1,
        "dead_ends_per_km2": 1 / 0.0108,
        "segment_length_mean_m": 60,
        "circuity": 1,
        "orientation_entropy": entropy(120, 60),
        "orientation_order": order(entropy(120, 60)),
        "meshedness": 0,
        "network_pieces": 1,
        # three arms of 60 m: along an arm and straight over it is 1, round the corner √2
        "network_detour": (4 + 2 * math.sqrt(2)) / 6,
        # to the entries, 60 m from the junction; two parcels have no frontage
        "rim_distance_m": (4 * 15 + 2 * 45 + 2 * (45 + 75) / 2 + 2 * 105) / 10,
        "parcel_distance_m": way,
        "parcel_detour": detour,
        # the two parcels in the middle, each with frontage on two streets
        **dict.fromkeys((f"{s.name}{INTERIOR}" for s in METRICS if s.of_parcels), 0.0),
        "parcels_interior": 2,
        "quads_interior": 2,
        "quads_pct_interior": 100,
        "frontage_mean_m_interior": 60,
        "frontage_min_m_interior": 60,
        "width_depth_median_interior": 1,
        "width_depth_p10_interior": 1,
        "width_depth_p90_interior": 1,
        "thinness_mean_interior": 1,
        "thinness_min_interior": 1,
        "p_area_interior": 1,
        "neighbours_mean_interior": 2,  # a street each to the south and to the middle
        "area_mean_m2_interior": 900,
        "area_min_over_mean_interior": 1,
        "area_max_over_min_area_interior": 2.25,
        "above_2_min_area_pct_interior": 100,
        "net_area_mean_m2_interior": NAN,
        "net_area_min_m2_interior": NAN,
        "parcels_per_km2_interior": 2 / 0.0108,
        "rim_distance_m_interior": (45 + 75) / 2,
        # 30 m, but where they face each other; round the corner over the diagonal
        "parcel_distance_m_interior": 3 * 30 / 4,
        "parcel_detour_interior": (1 + 2 * math.sqrt(2)) / 3,
    }
    return layout, expected


def no_interior_parcels() -> dict[str, float]:
    """Numbers of parcels are 0, and all else is not defined."""
    counts = {
        "parcels", "triangles", "quads", "pentagons", "hexagons", "more_sides", "unreached",
        "undesirable", "through_lots", "above_3_min_area", "parcels_per_km2",
    }  # fmt: skip
    return {s.name + INTERIOR: 0.0 if s.name in counts else NAN for s in METRICS if s.of_parcels}


TOWNS = {"crossing": crossing, "dead_end": dead_end, "entries": entries}


@pytest.mark.parametrize("town", TOWNS)
def test_every_metric_is_what_was_worked_out_by_hand(town: str) -> None:
    layout, expected = TOWNS[town]()
    found = {m.metric: m.value for m in measure(layout)}
    wrong = {
        name: (value, expected[name])
        for name, value in found.items()
        if name in expected and value != pytest.approx(expected[name], **near(name, town))
    }
    assert not wrong


def near(name: str, town: str) -> dict[str, float | bool]:
    """An inscribed circle is found to 1 %, and a half circle has straight sides."""
    loose = name.startswith("thinness")
    rounded = town == "dead_end" and name.startswith(("net_", "right_", "land_use"))
    return {
        "rel": 0.01 if loose else 1e-3 if rounded else 1e-9,
        "abs": 1e-6,
        "nan_ok": True,
    }


@pytest.mark.parametrize("town", TOWNS)
def test_no_metric_is_left_out_of_the_table(town: str) -> None:
    _, expected = TOWNS[town]()
    names = {s.name for s in METRICS} | {s.name + INTERIOR for s in METRICS if s.of_parcels}
    assert set(expected) == names


def test_what_is_undefined_in_one_town_is_defined_in_another() -> None:
    tables = [town()[1] for town in TOWNS.values()]
    never = {name for name in tables[0] if all(math.isnan(table[name]) for table in tables)}
    assert never == {"net_area_mean_m2_interior", "net_area_min_m2_interior"}
