"""Blocks with holes that touch their shells, or each other, at vertices: divided like any other."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st
from parcel_grounds import assert_tiled, ground_of, with_touching_holes

import urban_processing as up
from urban_processing.blocks.model import rings_of
from urban_processing.mesh.touches import joined_at_touches
from urban_processing.params.subdivide import Patio, Strategy, SubdivideParams
from urban_processing.parcelling.divide import divide
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.rules import resolve_rules

SHELL = [(0, 0), (60, 0), (120, 0), (120, 80), (0, 80)]
BLOCKS = {
    "tiny": "POLYGON ((40.524 70.031, 154.944 127.9, 25.443 36.069, 27.746 98.131, 40.404 69.965, "
    "40.524 70.031), (40.524 70.031, 40.583 69.909, 42.666 71.001, 42.622 71.086, 40.524 70.031))",
    "shell": shapely.Polygon(SHELL, [[(60, 0), (40, 30), (75, 25)]]).wkt,
    "two at one place": shapely.Polygon(
        SHELL, [[(60, 0), (30, 30), (40, 40)], [(60, 0), (70, 40), (90, 30)]]
    ).wkt,
    "each other": shapely.Polygon(
        SHELL, [[(60, 40), (40, 30), (40, 50)], [(60, 40), (80, 50), (80, 30)]]
    ).wkt,
    "a chain": shapely.Polygon(
        SHELL, [[(60, 0), (55, 20), (65, 20)], [(55, 20), (40, 45), (60, 40)]]
    ).wkt,
    "most of it": shapely.Polygon(SHELL, [[(0, 0), (20, 60), (100, 60), (100, 20)]]).wkt,
}
ACCESS = ("shell", "all", "some")
ROWS = (Strategy.SKELETON, Strategy.HYBRID)


def ground(block: shapely.Polygon, access: str = "shell", seed: int = 0) -> Ground:
    """The block as ground whose shell is street, or all its edges, or some of them."""
    made = ground_of(block)
    n = len(made.access)
    given = {"all": np.ones(n, dtype=bool), "some": np.random.default_rng(seed).random(n) < 0.5}
    return ground_of(block, access=given.get(access))


def divided(land: Ground, seed: int = 0, **values: object) -> Pieces:
    pieces = divide(land, resolve_rules(SubdivideParams(**values), 1), seed=seed)
    assert_tiled(pieces, land)
    assert_noded(pieces, land)
    return pieces


def assert_noded(pieces: Pieces, land: Ground) -> None:
    """By the numbers of vertices, each edge is on the contour or has a neighbour the other way."""
    edges = list(zip(pieces.vertex.tolist(), pieces.vertex[pieces.following].tolist(), strict=True))
    known = set(edges)
    assert len(known) == len(edges)
    rim = np.array([edge for edge in edges if edge[::-1] not in known])
    length = np.hypot(*(pieces.xy[rim[:, 0]] - pieces.xy[rim[:, 1]]).T).sum()
    rings = land.rings
    assert length == pytest.approx(np.hypot(*(rings.xy[rings.following] - rings.xy).T).sum())


def in_order(pieces: Pieces) -> npt.NDArray[np.object_]:
    return np.asarray(pieces.polygons()[np.argsort(pieces.lineage)], dtype=object)


@pytest.mark.parametrize("name", BLOCKS)
@pytest.mark.parametrize("strategy", list(Strategy))
@pytest.mark.parametrize("access", ["shell", "all"])
def test_each_strategy_divides_it(name: str, strategy: Strategy, access: str) -> None:
    block = shapely.set_precision(shapely.from_wkt(BLOCKS[name]), 2.0**-20)
    pieces = divided(ground(block, access), strategy=strategy, min_area=150)
    assert pieces.n_faces > block.area / 800
    assert shapely.area(pieces.polygons()).min() >= 150 * (1 - 1e-9)


def test_the_block_that_could_not_be_divided() -> None:
    given = {"min_area": 46.44, "max_area": 630.05, "min_width": 1.67, "max_width": 15.11}
    block = shapely.from_wkt(BLOCKS["tiny"])
    made = up.subdivide(block, **given)
    parcels = made.parcels.geometry.to_numpy()
    assert len(parcels) > 4
    assert shapely.coverage_is_valid(joined_at_touches(parcels))
    difference = shapely.symmetric_difference(shapely.union_all(parcels), block)
    assert difference.area < 1e-4  # coordinates go to the grid
    assert made.parcels.frontage_m.min() > 0


@settings(max_examples=60, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    seed=st.integers(0, 10**6),
    holes=st.integers(1, 9),
    access=st.sampled_from(ACCESS),
    min_area=st.sampled_from([60.0, 150.0, 400.0]),
    strategy=st.sampled_from([*ROWS, Strategy.OBB]),
    offset=st.one_of(st.none(), st.floats(4.0, 30.0)),
    patio=st.sampled_from([Patio.OPEN, Patio.OBB, Patio.SKELETON]),
)
def test_any_block_is_tiled(
    seed: int,
    holes: int,
    access: str,
    min_area: float,
    strategy: Strategy,
    offset: float | None,
    patio: Patio,
) -> None:
    block = with_touching_holes(np.random.default_rng(seed), holes)
    assume(block.interiors)
    values = {"strategy": strategy, "min_area": min_area}
    if strategy is Strategy.SKELETON and offset is not None:
        values |= {"offset": offset, "patio": patio}
    pieces = divided(ground(block, access, seed), seed, **values)
    if access != "some" and block.area > 6 * min_area:
        assert pieces.n_faces > 1
    if strategy in ROWS and "offset" not in values:
        area = shapely.area(pieces.polygons())
        assert area.min() >= min(min_area, block.area) * (1 - 1e-9)


@settings(max_examples=25, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(
    seed=st.integers(0, 10**6),
    access=st.sampled_from(["shell", "all"]),
    strategy=st.sampled_from([*ROWS, Strategy.OBB]),
)
def test_where_rings_begin_and_the_order_of_holes_do_not_matter(
    seed: int, access: str, strategy: Strategy
) -> None:
    rng = np.random.default_rng(seed)
    block = shapely.orient_polygons(with_touching_holes(rng, 6))
    assume(block.interiors)
    rings = [shapely.get_coordinates(ring)[:-1] for ring in shapely.get_rings(block)]
    shell, *holes = [np.roll(ring, rng.integers(len(ring)), axis=0) for ring in rings]
    other = shapely.Polygon(shell, [holes[k] for k in rng.permutation(len(holes))])
    made = []
    for polygon in (block, other):
        n = len(shapely.get_coordinates(polygon)) - len(rings)
        given = np.ones(n, dtype=bool) if access == "all" else None
        land = ground_of(polygon, access=given, keep_order=True)
        made.append(in_order(divided(land, strategy=strategy, min_area=120)))
    one, two = made
    assert len(one) == len(two)
    assert shapely.area(shapely.symmetric_difference(one, two)).max() < 1e-6


def test_a_hole_at_the_shell_is_a_part_of_its_ring() -> None:
    block = shapely.orient_polygons(shapely.from_wkt(BLOCKS["a chain"]))
    rings = rings_of(np.array([block], dtype=object))
    assert sorted(set(rings.place.tolist())) == np.unique(rings.place).tolist()
    assert (rings.xy[rings.place] == rings.xy).all()
    assert len(set(rings.place.tolist())) == len(rings.xy) - 2
    around, at = [], 0
    while at not in around:
        around.append(at)
        at = int(rings.along_land[at])
    assert len(around) == len(rings.xy)  # one ring goes along all three
    assert (rings.xy[rings.along_land] == rings.xy[rings.following]).all()
    (joined,) = joined_at_touches(np.array([block], dtype=object))
    assert len(joined.interiors) == 0
    assert joined.area == pytest.approx(block.area)


def test_touching_vertices_of_two_blocks_stay_their_own() -> None:
    block = shapely.from_wkt(BLOCKS["shell"])
    beside = shapely.box(60, -40, 120, 0)
    land = ground_of([block, beside])
    place = land.rings.place
    assert (land.rings.edge_block[place] == land.rings.edge_block).all()
    params = SubdivideParams(min_area=150, strategy=Strategy.OBB)
    pieces = divide(land, resolve_rules(params, 2), seed=0)
    assert_tiled(pieces, land)
    assert set(np.unique(pieces.block).tolist()) == {0, 1}
