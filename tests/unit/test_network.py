"""Streets, junctions and ends of layouts that were counted by hand."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from grid_layouts import SIDE, boxes, cut_square, grid, layout_of, with_streets

from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork


def counts(net: StreetNetwork) -> tuple[int, int, int]:
    """Streets, junctions and ends as Chen counts them."""
    kind = net.node_kind[net.node_interior]
    return (
        int((~net.street_rim).sum()),
        int((kind == NodeKind.JUNCTION).sum()),
        int((kind == NodeKind.END).sum()),
    )


def classes(net: StreetNetwork) -> list[str]:
    return sorted(net.edge_class[~net.edge_rim].tolist())


def test_a_bare_rim_is_one_rim_street_without_junctions() -> None:
    net = street_network(grid(2, 2))
    assert counts(net) == (0, 0, 0)
    assert net.edge_rim.tolist() == [True]
    assert net.edge_class.tolist() == ["rim"]
    assert net.start.tolist() == net.end.tolist() == [0]
    assert net.node_kind.tolist() == [NodeKind.POINT]
    assert net.node_number.tolist() == [0]
    assert net.edge_length.tolist() == [8 * SIDE]


def test_no_street_gives_an_empty_network() -> None:
    layout = grid(2, 2, rim=False)
    net = street_network(layout)
    assert counts(net) == (0, 0, 0)
    assert net.n_edges == net.n_nodes == 0
    assert len(net.lines(layout.mesh)) == len(net.street_length) == len(net.edge_class) == 0


def test_a_street_from_rim_to_rim_has_two_junctions() -> None:
    net = street_network(grid(2, 2, [(0, 1), (2, 1)]))
    assert counts(net) == (1, 2, 0)
    assert net.edge_length[~net.edge_rim].tolist() == [2 * SIDE]
    assert sorted(net.edge_length[net.edge_rim].tolist()) == [4 * SIDE, 4 * SIDE]
    assert net.node_degree.tolist() == [3, 3]
    assert np.allclose(net.node_deviation, 0.0)
    # the rim goes straight on at both junctions and stays one street
    assert len(np.unique(net.edge_street[net.edge_rim])) == 1


def test_the_straightest_pairs_continue_at_a_crossing() -> None:
    net = street_network(grid(2, 2, [(0, 1), (2, 1)], [(1, 0), (1, 2)]))
    assert counts(net) == (2, 5, 0)
    assert sorted(net.node_degree.tolist()) == [3, 3, 3, 3, 4]
    interior = net.street_length[~net.street_rim]
    assert interior.tolist() == [2 * SIDE, 2 * SIDE]
    assert net.n_edges == 4 + 4


def test_a_right_angled_bend_divides_streets() -> None:
    net = street_network(grid(3, 3, [(0, 1), (1, 1), (1, 0)]))
    assert counts(net) == (2, 3, 0)
    assert 2 in net.node_degree.tolist()
    assert classes(net) == ["collector", "collector"]


def test_a_dead_end_is_a_cul_de_sac_back_to_its_junction() -> None:
    net = street_network(grid(3, 3, [(0, 1), (1, 1), (1, 2)]))
    assert counts(net) == (2, 2, 1)
    assert classes(net) == ["cul_de_sac", "cul_de_sac"]
    assert net.node_degree[net.node_kind == NodeKind.END].tolist() == [1]


def test_a_street_between_junctions_is_no_cul_de_sac_though_one_hangs_on_it() -> None:
    net = street_network(grid(4, 2, [(0, 1), (4, 1)], [(2, 1), (2, 2)]))
    assert classes(net) == ["collector"] * 3
    net = street_network(grid(4, 3, [(0, 1), (4, 1)], [(2, 1), (2, 2)]))
    assert classes(net) == ["collector", "collector", "cul_de_sac"]


def test_collectors_are_the_first_half_of_the_levels() -> None:
    layout = grid(4, 4)
    layout = with_streets(layout, [(0, 1), (4, 1)], level=3)
    layout = with_streets(layout, [(0, 2), (4, 2)], level=5)
    layout = with_streets(layout, [(0, 3), (4, 3)], level=9)
    net = street_network(layout)
    by_level = dict(zip(net.edge_level.tolist(), net.edge_class.tolist(), strict=True))
    assert by_level == {0: "rim", 3: "collector", 5: "collector", 9: "local"}
    assert net.edge_width[net.edge_level == 3] > net.edge_width[net.edge_level == 9]


def test_the_level_of_an_edge_is_the_lowest_of_its_mesh_edges() -> None:
    layout = with_streets(grid(2, 2), [(0, 1), (1, 1)], level=4)
    layout = with_streets(layout, [(1, 1), (2, 1)], level=2)
    net = street_network(layout)
    assert net.edge_level[~net.edge_rim].tolist() == [2]


@pytest.mark.parametrize(("included", "streets"), [(140.0, 1), (130.0, 2)])
def test_a_bend_divides_a_street_from_135_degrees_on(included: float, streets: int) -> None:
    rise = 50.0 / np.tan(np.radians(included / 2))
    net = street_network(cut_square(100, [(0, 50), (50, 50 + rise), (100, 50)]))
    assert counts(net) == (streets, 1 + streets, 0)


def test_of_two_straight_continuations_the_straighter_is_taken() -> None:
    def arm(degrees: float) -> list[tuple[float, float]]:
        t = np.radians(degrees)
        r = 50 / max(abs(np.cos(t)), abs(np.sin(t)))
        return [(50, 50), (50 + r * np.cos(t), 50 + r * np.sin(t))]

    layout = cut_square(100, arm(0), arm(172), arm(200))
    net = street_network(layout)
    assert counts(net) == (2, 4, 0)
    lines = net.lines(layout.mesh)
    inner = ~net.edge_rim
    ends_low = np.array([shapely.bounds(line)[1] < 49 for line in lines])  # the arm at 200°
    assert len(np.unique(net.edge_street[inner & ~ends_low])) == 1


def test_junction_deviation_is_that_of_the_chord() -> None:
    # 10 m square off the rim, then slanting: the chord ends 10 m along the slant
    slant = 10 * np.array([np.cos(np.radians(60)), np.sin(np.radians(60))])
    layout = cut_square(100, [(50, 0), (50, 10), (100, 10 + 10 * slant[1])])
    net = street_network(layout)
    by_hand = np.degrees(np.arctan2(slant[0], 10 + slant[1]))
    at_start = layout.mesh.xy[net.node_vertex][:, 1] == 0
    assert net.node_deviation[at_start] == pytest.approx([by_hand], abs=1e-3)


def test_a_slanting_street_deviates_by_its_slant_on_both_sides() -> None:
    offset = 100 * np.tan(np.radians(20))
    net = street_network(cut_square(100, [(30, 0), (30 + offset, 100)]))
    assert net.pair_deviation == pytest.approx([20.0] * 4, abs=1e-3)


def test_a_closed_round_street_has_no_junction() -> None:
    ring = shapely.Point(50, 50).buffer(25)
    layout = cut_square(100, list(ring.exterior.coords))
    net = street_network(layout)
    assert counts(net) == (1, 0, 0)
    assert net.node_kind.tolist() == [NodeKind.POINT, NodeKind.POINT]
    lines = net.lines(layout.mesh)
    assert shapely.is_closed(lines).all()


def test_a_closed_square_street_has_four_bends() -> None:
    net = street_network(grid(3, 3, [(1, 1), (2, 1), (2, 2), (1, 2), (1, 1)]))
    assert counts(net) == (4, 4, 0)


def test_a_ring_with_one_bend_closes_in_a_junction() -> None:
    drop = [*shapely.Point(50, 50).buffer(20).exterior.coords][:-1]
    drop = [p for p in drop if p[0] <= 60]
    layout = cut_square(100, [(90, 50), *drop, (90, 50)])
    net = street_network(layout)
    assert counts(net) == (1, 1, 0)


def test_streets_on_a_hole_are_not_rim_streets() -> None:
    polygons = boxes(3, 3, without=[(1, 1)])
    layout = layout_of(polygons, [(1, 1), (2, 1), (2, 2), (1, 2), (1, 1)], [(0, 1), (1, 1)])
    net = street_network(layout)
    assert counts(net)[0] == 4 - 1 + 1  # the way in goes on along the hole
    assert net.edge_length[net.edge_rim].sum() == 12 * SIDE


def test_a_street_never_goes_on_along_the_rim() -> None:
    layout = grid(2, 2, rim=False)
    layout = with_streets(layout, [(0, 1), (2, 1)], [(2, 1), (2, 2)])
    net = street_network(layout)
    assert sorted(net.street_rim.tolist()) == [False, True]
    assert counts(net) == (1, 1, 1)


def test_a_street_that_prolongs_the_rim_at_a_notch_does_not_deviate_from_it() -> None:
    layout = layout_of(boxes(2, 2, without=[(1, 0)]), [(0, 1), (1, 1)])
    net = street_network(layout)
    assert counts(net) == (1, 2, 0)
    assert net.pair_deviation == pytest.approx(np.zeros(4))


def test_the_angle_between_two_rim_streets_is_not_counted() -> None:
    # a street out of the corner of the land, whose sides meet at 30° there
    corner = np.array([100 * np.cos(np.radians(30)), 100 * np.sin(np.radians(30))])
    middle = (corner + np.array([100.0, 0.0])) / 2
    halves = [
        shapely.Polygon([(0, 0), (100, 0), middle]),
        shapely.Polygon([(0, 0), middle, corner]),
    ]
    net = street_network(layout_of(halves, [(0, 0), tuple(middle)], unit=1.0))
    assert sorted(net.pair_deviation.tolist()) == pytest.approx([0, 0, 60, 75, 75], abs=1e-3)
    assert sorted(net.node_deviation.tolist()) == pytest.approx([0, 75], abs=1e-3)


def test_parts_keep_their_streets_apart() -> None:
    polygons = boxes(2, 2) + boxes(2, 2, at=(2, 2))  # they touch at a single point
    layout = layout_of(polygons, [(0, 1), (2, 1)], [(2, 3), (4, 3)], part=[0] * 4 + [1] * 4)
    net = street_network(layout)
    assert counts(net) == (2, 4, 0)
    assert net.street_part[~net.street_rim].tolist() == [0, 1]
    assert sorted(net.node_part.tolist()) == [0, 0, 1, 1]
    assert net.edge_part.tolist() == sorted(net.edge_part.tolist())


def test_numbers_do_not_depend_on_the_order_of_the_mesh() -> None:
    lines = [[(0, 1), (1, 1), (1, 0)], [(1, 1), (1, 2), (3, 2)]]
    polygons = boxes(3, 3)
    expected = None
    for seed in range(5):
        order = np.random.default_rng(seed).permutation(9)
        layout = layout_of([polygons[i] for i in order], *lines)
        net = street_network(layout)
        found = (
            shapely.to_wkt(net.lines(layout.mesh)).tolist(),
            net.edge_street.tolist(),
            net.edge_class.tolist(),
            layout.mesh.xy[net.node_vertex].tolist(),
            net.start.tolist(),
            net.end.tolist(),
        )
        expected = expected or found
        assert found == expected


def test_every_street_edge_lies_in_one_network_edge() -> None:
    layout = grid(4, 4, [(0, 1), (4, 1)], [(1, 1), (1, 3), (3, 3)], [(2, 0), (2, 4)])
    net = street_network(layout)
    edges = net.half_edges >> 1
    assert sorted(edges.tolist()) == np.flatnonzero(layout.edge_street).tolist()
    mesh = layout.mesh
    inner = np.setdiff1d(np.arange(len(net.half_edges)), net.offsets)
    assert (mesh.target[net.half_edges[inner - 1]] == mesh.origin[net.half_edges[inner]]).all()
