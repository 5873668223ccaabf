"""Street generation on small grids of square parcels, where the answer is known."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
import shapely

from urban_processing.access_rule import (
    ACCESS_SHARE,
    is_reached,
    reached_frontage,
    required_frontage,
    unreached_parcels_of,
)
from urban_processing.layout import EdgeKind, Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.params import CogenerateParams, Preset
from urban_processing.site import Frame
from urban_processing.streets.access import find_accesses
from urban_processing.streets.blocks import (
    LARGEST_BLOCK,
    flood_block,
    small_block_deficit,
    through_length,
)
from urban_processing.streets.ends import close_end, prune_tails, retract_ends
from urban_processing.streets.generate import extend_streets
from urban_processing.streets.groups import group_parcels, unreached_parcels
from urban_processing.streets.links import street_links
from urban_processing.streets.paths import find_paths, join_cost
from urban_processing.streets.prune import prune_streets
from urban_processing.streets.state import StreetState

PARAMS = CogenerateParams(parcels=10)
PRINTED = CogenerateParams(parcels=10, preset=Preset.CHEN2024)


def boxes(nx: int, ny: int, *, x: float = 0.0, size: float = 10.0) -> list[shapely.Polygon]:
    """Square parcels row by row: parcel ``j * nx + i`` is column i, row j."""
    return [
        shapely.box(x + i * size, j * size, x + (i + 1) * size, (j + 1) * size)
        for j in range(ny)
        for i in range(nx)
    ]


def make_layout(
    polygons: list[shapely.Polygon],
    *,
    rim: bool = True,
    part: list[int] | None = None,
    locked: set[int] | None = None,
) -> Layout:
    """A layout without streets but the rim."""
    layout = layout_from_mesh(
        mesh_from_polygons(polygons),
        frame=Frame(),
        face_part=np.array(part if part is not None else [0] * len(polygons)),
        min_area=1.0,
        rim_is_street=rim,
    )
    mask = np.isin(np.arange(len(polygons)), sorted(locked or ()))
    return layout.replace(face_locked=mask)


def chain_between(state: StreetState, a: tuple[float, float], b: tuple[float, float]) -> int:
    """The directed chain from one point to the other."""
    xy = state.layout.mesh.xy[state.graph.node_vertex]
    for i in range(len(state.start)):
        if np.allclose(xy[state.start[i]], a) and np.allclose(xy[state.end[i]], b):
            return i
    raise AssertionError(f"There is no chain from {a} to {b}.")


def lay(state: StreetState, *points: tuple[float, float]) -> list[int]:
    """Make the chains along points street."""
    chains = [chain_between(state, a, b) for a, b in itertools.pairwise(points)]
    for i in chains:
        state.add(i)
    return chains


def node_at(state: StreetState, point: tuple[float, float]) -> int:
    """The node at a point."""
    xy = state.layout.mesh.xy[state.graph.node_vertex]
    return int(np.argmin(np.hypot(*(xy - point).T)))


def degrees(layout: Layout) -> np.ndarray:
    """(N,) number of streets at each node of the corner graph."""
    graph = layout.corner_graph
    return np.bincount(graph.start, weights=layout.chain_street, minlength=graph.n_nodes)


def reached(layout: Layout) -> np.ndarray:
    """(F,) parcels that are reached."""
    return is_reached(layout.frontage, layout.mesh.face_area)


def test_rule_implies_the_published_definition() -> None:
    area = np.array([1.0, 100.0, 144.0, 10_000.0])
    need = required_frontage(area)
    assert (need >= np.minimum(3.0, 0.25 * np.sqrt(area))).all()
    assert need == pytest.approx(ACCESS_SHARE * np.sqrt(area))
    assert is_reached(need, area).all()
    assert not is_reached(0.99 * need, area).any()


def test_unreached_parcels_form_groups_across_shared_chains() -> None:
    # the inner 3 x 3 of 5 x 5 parcels; without its cross its four corners apart
    layout = make_layout(boxes(5, 5))
    state = StreetState(layout, PARAMS)
    unreached = unreached_parcels(state)
    assert unreached == [6, 7, 8, 11, 12, 13, 16, 17, 18]
    assert group_parcels(state, unreached) == [unreached]
    apart = StreetState(layout, PARAMS)
    for f in (7, 11, 12, 13, 17):
        apart.need[f] = 0.0
    assert group_parcels(apart, unreached_parcels(apart)) == [[6], [8], [16], [18]]


def test_one_straight_street_reaches_two_rows() -> None:
    layout = make_layout(boxes(6, 4))
    state = StreetState(layout, PRINTED)
    group = unreached_parcels(state)
    (access,) = find_accesses(state, group, state.network_distance(), keep_ends=False, count=1)
    xy = layout.mesh.xy[state.graph.node_vertex]
    nodes = [state.start[access.chains[0]]] + [state.end[i] for i in access.chains]
    assert len(access.chains) == 4
    assert (xy[nodes][:, 1] == 20.0).all()


def test_bent_group_gets_an_l_shaped_access() -> None:
    # parcels of an L within 5 x 5 others that need no access
    bent = {6, 7, 8, 13, 18}
    state = StreetState(make_layout(boxes(5, 5)), PRINTED)
    for f in set(range(25)) - bent:
        state.need[f] = 0.0
    (access,) = find_accesses(
        state, sorted(bent), state.network_distance(), keep_ends=False, count=1
    )
    turns = [b not in state.ahead[a] for a, b in itertools.pairwise(access.chains)]
    assert sum(turns) == 1
    for i in access.chains:
        state.add(i)
    assert unreached_parcels(state) == []


def test_group_too_large_for_one_access_is_reached_by_several() -> None:
    layout = extend_streets(make_layout(boxes(7, 7)), PRINTED, level=1, keep_ends=False)
    assert reached(layout).all()
    assert not (degrees(layout) == 1).any()


def brute_force(state: StreetState, starts: list[tuple[float, int]], blocked: set[int]) -> float:
    """Cost of the cheapest of all paths."""
    best = math.inf

    def walk(chain: int, cost: float, seen: frozenset[int]) -> None:
        nonlocal best
        cost += state.size[chain]
        node = state.end[chain]
        if node in blocked or node in seen or cost >= best:
            return
        if state.degree[node]:
            best = min(best, cost + join_cost(state, chain))
            return
        for j in state.ahead[chain]:
            walk(j, cost, seen | {node})
        for j in state.aside[chain]:
            walk(j, cost + state.turn_cost, seen | {node})

    for cost, first in starts:
        walk(first, cost, frozenset({state.start[first]}))
    return best


@pytest.mark.parametrize("junction_weight", [0.0, 0.3, 2.0])
@pytest.mark.parametrize("seed", range(6))
def test_paths_are_the_cheapest_with_exact_turns(seed: int, junction_weight: float) -> None:
    params = CogenerateParams(parcels=10, junction_weight=junction_weight)
    state = StreetState(make_layout(boxes(5, 4)), params)
    rng = np.random.default_rng(seed)
    size = rng.uniform(0.5, 2.0, len(state.size) // 2)
    state.size = np.repeat(size, 2).tolist()
    node = node_at(state, (20.0, 20.0))
    starts = [(float(rng.uniform(0, 1)), i) for i in state.out[node]]
    ((cost, path), *_) = find_paths(state, starts, {node})
    assert cost == pytest.approx(brute_force(state, starts, {node}))
    assert state.start[path[0]] == node
    assert all(state.end[a] == state.start[b] for a, b in itertools.pairwise(path))


def test_dead_end_is_led_straight_on() -> None:
    state = StreetState(make_layout(boxes(6, 4)), PARAMS)
    lay(state, (0, 20), (10, 20), (20, 20))
    way = close_end(state, node_at(state, (20.0, 20.0)))
    assert way is not None
    for i in way[1]:
        state.add(i)
    xy = state.layout.mesh.xy[state.graph.node_vertex]
    assert [tuple(xy[state.end[i]]) for i in way[1]] == [
        (30.0, 20.0), (40.0, 20.0), (50.0, 20.0), (60.0, 20.0),
    ]  # fmt: skip


def test_street_does_not_turn_back_into_its_own_tail() -> None:
    state = StreetState(make_layout(boxes(6, 4)), CogenerateParams(parcels=9, junction_weight=0.0))
    tail = lay(state, (0, 20), (10, 20), (20, 20), (30, 20))
    way = close_end(state, node_at(state, (30.0, 20.0)))
    assert way is not None
    assert state.end[way[1][-1]] not in {state.end[i] for i in tail}
    assert state.end[way[1][-1]] != state.start[tail[0]]


def test_tail_that_no_parcel_needs_is_pruned() -> None:
    state = StreetState(make_layout(boxes(6, 4)), PARAMS)
    lay(state, (0, 20), (10, 20), (20, 20), (30, 20), (40, 20), (50, 20), (60, 20))
    spare = lay(state, (30, 20), (30, 30))
    prune_tails(state)
    assert not state.street[spare[0]]
    assert unreached_parcels(state) == []


def test_prunes_back_to_the_last_parcel_that_needs_the_tail() -> None:
    state = StreetState(make_layout(boxes(6, 4)), PARAMS)
    chains = lay(state, (0, 20), (10, 20), (20, 20), (30, 20), (40, 20), (50, 20), (60, 20))
    state.remove(chains[-1])
    prune_tails(state)
    assert [state.street[i] for i in chains] == [True, True, True, True, True, False]


def test_retracts_ends_only_where_the_whole_rim_is_street() -> None:
    for rim, stays in ((True, False), (False, True)):
        state = StreetState(make_layout(boxes(6, 4), rim=rim), PARAMS)
        (chain,) = lay(state, (0, 20), (10, 20))
        retract_ends(state)
        assert state.street[chain] is stays


def test_journal_restores_everything() -> None:
    state = StreetState(make_layout(boxes(4, 4)), PARAMS)
    before = (list(state.street), list(state.degree), list(state.frontage))
    mark = len(state.journal)
    chains = lay(state, (0, 20), (10, 20), (20, 20))
    state.remove(chains[0])
    state.undo(mark)
    assert (state.street, state.degree) == before[:2]
    assert state.frontage == pytest.approx(before[2])


def test_small_blocks_and_through_lots_are_charged() -> None:
    state = StreetState(make_layout(boxes(4, 4)), PARAMS)
    corner = lay(state, (0, 10), (10, 10), (10, 0))
    assert small_block_deficit(state, corner) == 4
    across = lay(state, (0, 20), (10, 20), (20, 20), (30, 20), (40, 20))
    # one parcel side across the block's corner parcel, whose other side is street
    assert through_length(state, across) == pytest.approx(1.0)


def test_long_block_is_split() -> None:
    layout = extend_streets(make_layout(boxes(30, 2)), PARAMS, level=1, keep_ends=False)
    state = StreetState(layout, PARAMS)
    sizes = [len(flood_block(state, f)) for f in range(60)]
    assert max(sizes) <= LARGEST_BLOCK
    assert min(sizes) >= 5
    # the paper does not limit the length of blocks
    printed = extend_streets(make_layout(boxes(30, 2)), PRINTED, level=1, keep_ends=False)
    assert printed.edge_street.sum() == make_layout(boxes(30, 2)).edge_street.sum()


def test_redundant_links_go_and_blocks_stay_small() -> None:
    layout = make_layout(boxes(8, 8))
    everything = layout.replace(
        edge_street=np.ones_like(layout.edge_street), edge_level=layout.edge_level * 0 + 1
    )
    pruned = prune_streets(everything, PARAMS, keep_ends=False)
    assert reached(pruned).all()
    assert not (degrees(pruned) == 1).any()
    assert pruned.edge_street.sum() < 0.75 * everything.edge_street.sum()
    assert pruned.edge_street[pruned.edge_kind == EdgeKind.RIM].all()
    assert (pruned.edge_level[~pruned.edge_street] == -1).all()
    state = StreetState(pruned, PARAMS)
    assert max(len(flood_block(state, f)) for f in range(64)) <= LARGEST_BLOCK


def test_links_run_from_junction_to_junction() -> None:
    state = StreetState(make_layout(boxes(4, 4)), PARAMS)
    street = lay(state, (0, 20), (10, 20), (20, 20), (30, 20), (40, 20))
    assert [sorted(link) for link in street_links(state)] in (
        [sorted(street)],
        [sorted(i ^ 1 for i in street)],
    )


def test_first_access_is_the_network_where_the_rim_is_no_street() -> None:
    layout = extend_streets(make_layout(boxes(4, 2), rim=False), PARAMS, level=1, keep_ends=True)
    assert reached(layout).all()
    assert not layout.edge_street[layout.edge_kind == EdgeKind.RIM].any()
    assert layout.edge_street.sum() == 4


@pytest.mark.parametrize("keep_ends", [False, True])
def test_strips_that_only_the_rim_connects_stay_apart(keep_ends: bool) -> None:
    layout = make_layout(boxes(5, 1), rim=False)
    after = extend_streets(layout, PARAMS, level=1, keep_ends=keep_ends)
    # one street reaches the parcels on its two sides; no other can be connected with it
    assert after.edge_street.sum() == 1
    assert reached(after).sum() == 2


def test_parcel_with_a_tiny_contact_is_done_with_what_it_has() -> None:
    a = shapely.Polygon([(0, 0), (10, 0), (10, 9.5), (10, 10), (0, 10)])
    b = shapely.Polygon([(10, 9.5), (20, 9.5), (20, 20), (10, 20), (10, 10)])
    layout = extend_streets(make_layout([a, b], rim=False), PARAMS, level=1, keep_ends=False)
    assert layout.frontage == pytest.approx([0.5, 0.5])


@pytest.mark.parametrize("keep_ends", [False, True])
@pytest.mark.parametrize("rim", [False, True])
def test_each_part_has_its_own_network(rim: bool, keep_ends: bool) -> None:
    polygons = boxes(4, 4) + boxes(4, 4, x=100.0)
    layout = make_layout(polygons, rim=rim, part=[0] * 16 + [1] * 16)
    layout = extend_streets(layout, PARAMS, level=2, keep_ends=keep_ends)
    assert reached(layout).all()
    n, label = StreetState(layout, PARAMS).network_components()
    assert n == 2
    new = layout.edge_street & (layout.edge_kind == EdgeKind.INTERIOR)
    assert (layout.edge_level[new] == 2).all()
    assert (label >= 0).any()


def test_loose_components_are_joined() -> None:
    layout = make_layout(boxes(6, 6))
    state = StreetState(layout, PARAMS)
    (chain,) = lay(state, (20, 30), (30, 30))
    street = layout.edge_street.copy()
    street[state.graph.edges_of([chain])] = True
    loose = layout.replace(edge_street=street)
    for keep_ends in (False, True):
        joined = extend_streets(loose, PARAMS, level=1, keep_ends=keep_ends)
        assert StreetState(joined, PARAMS).network_components()[0] == 1
        assert reached(joined).all()


def test_layout_without_need_is_returned_as_it_is() -> None:
    layout = make_layout(boxes(2, 2))
    assert extend_streets(layout, PARAMS, level=1, keep_ends=False) is layout


def test_locked_parcels_are_reached_like_others() -> None:
    inner = {5, 6, 9, 10}
    layout = make_layout(boxes(4, 4), locked=inner)
    assert reached(extend_streets(layout, PARAMS, level=1, keep_ends=False)).all()


def test_streets_that_were_given_stay() -> None:
    # a street across 4 x 4 parcels with a dead end beside it, which nobody needs
    layout = make_layout(boxes(4, 4))
    state = StreetState(layout, PARAMS)
    across = lay(state, (0, 20), (10, 20), (20, 20), (30, 20), (40, 20))
    stub = lay(state, (10, 20), (10, 30))
    drawn = state.finish(level=1)
    fixed = np.full(layout.mesh.n_edges, -1)
    fixed[state.graph.edges_of([*across, *stub])] = 0
    given = drawn.replace(edge_fixed=fixed)
    for keep_ends in (False, True):
        after = prune_streets(
            extend_streets(given, PARAMS, level=2, keep_ends=keep_ends), PARAMS, keep_ends=keep_ends
        )
        assert after.edge_street[fixed >= 0].all()
    plain = prune_streets(drawn, PARAMS, keep_ends=True)
    assert not plain.edge_street[state.graph.edges_of(stub)].any()


def test_bridge_between_two_blocks_at_a_bare_rim_stays() -> None:
    # two streets from rim to rim and one that connects them: parcels on its two sides are
    # reached without it and lie in different blocks, yet it holds the network together
    layout = make_layout(boxes(3, 4), rim=False)
    state = StreetState(layout, PARAMS)
    for x in (10, 20):
        lay(state, *((x, y) for y in (0, 10, 20, 30, 40)))
    lay(state, (10, 20), (20, 20))
    pruned = prune_streets(state.finish(level=1), PARAMS, keep_ends=True)
    assert StreetState(pruned, PARAMS).network_components()[0] == 1
    assert reached(pruned).all()


def test_only_the_ratio_of_the_street_weights_matters() -> None:
    for preset in Preset:
        layouts = [
            extend_streets(
                make_layout(boxes(9, 7)),
                CogenerateParams(
                    parcels=10, preset=preset, length_weight=k, junction_weight=0.7 * k
                ),
                level=1,
                keep_ends=False,
            )
            for k in (1.0, 10.0, 0.1)
        ]
        for other in layouts[1:]:
            assert np.array_equal(other.edge_street, layouts[0].edge_street)


def lake_layout() -> Layout:
    """Parcels round a U-shaped lake; the parcel between its arms ends at the lake."""
    cells = [p for k, p in enumerate(boxes(5, 5)) if k > 4 and k not in (6, 8, 11, 12, 13)]
    west = [(0, 0), (25, 0), (25, 10), (20, 10), (10, 10), (0, 10)]
    east = [(50 - x, y) for x, y in reversed(west)]
    # the two vertices at x = 25 split the south side of the parcel between the arms
    south = shapely.Polygon([(20, 10), (25, 10), (30, 10), (30, 20), (20, 20)])
    cells[1] = south
    return make_layout([*cells, shapely.Polygon(west), shapely.Polygon(east)])


def test_dead_end_at_a_lake_is_led_along_the_shore_at_last() -> None:
    layout = lake_layout()
    extended = extend_streets(layout, PARAMS, level=1, keep_ends=False)
    final = prune_streets(extended, PARAMS, keep_ends=False)
    assert not (extended.edge_street & (extended.edge_kind == EdgeKind.HOLE)).any()
    assert (final.edge_street & (final.edge_kind == EdgeKind.HOLE)).any()
    assert reached(final).all()
    assert not (degrees(final) == 1).any()
    # dead ends stay where they are wanted
    kept = prune_streets(extended, PARAMS, keep_ends=True)
    assert not (kept.edge_street & (kept.edge_kind == EdgeKind.HOLE)).any()


def test_unreached_parcels_are_those_below_the_published_frontage() -> None:
    layout = make_layout(boxes(5, 5))
    assert unreached_parcels_of(layout).tolist() == [6, 7, 8, 11, 12, 13, 16, 17, 18]
    assert reached_frontage([4.0, 144.0, 1e4]) == pytest.approx([0.5, 3.0, 3.0])
    done = extend_streets(layout, PARAMS, level=1, keep_ends=False)
    assert len(unreached_parcels_of(done)) == 0
