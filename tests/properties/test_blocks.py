"""What must hold of blocks between any lines."""

from __future__ import annotations

import numpy as np
import shapely
from hypothesis import HealthCheck, assume, given, settings
from hypothesis import strategies as st

from urban_processing.blocks.find import FoundBlocks, find_blocks
from urban_processing.blocks.model import UNKNOWN_STREET
from urban_processing.blocks.streets import street_lines
from urban_processing.errors import BoundaryError
from urban_processing.mesh.build import canonical_rings
from urban_processing.params.blocks import BlocksParams
from urban_processing.site import snap_to_grid

FEW = settings(
    max_examples=20, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)

COORDINATES = st.one_of(
    st.integers(0, 12).map(lambda k: 20.0 * k),
    st.floats(0, 240).map(lambda x: float(snap_to_grid(x))),
)
LINES = st.lists(
    st.lists(st.tuples(COORDINATES, COORDINATES), min_size=2, max_size=5).map(shapely.LineString),
    min_size=1,
    max_size=14,
)
WIDTHS = st.lists(st.sampled_from([3.0, 8.0, 12.0, 25.0]), min_size=14, max_size=14)
PARAMS = st.builds(
    BlocksParams,
    snap_tolerance=st.sampled_from([0.0, 1.0, 5.0]),
    corner_radius=st.sampled_from([0.0, 4.0]),
    turning_radius=st.sampled_from([0.0, 9.0]),
    min_area=st.sampled_from([0.0, 100.0]),
    min_width=st.sampled_from([0.0, 6.0]),
    dead_ends=st.booleans(),
)
LAND = st.sampled_from(
    [
        None,
        [shapely.box(10, 10, 230, 230)],
        [shapely.box(0, 0, 150, 240) - shapely.box(40, 40, 90, 100), shapely.box(180, 30, 240, 90)],
    ]
)


def blocks_of(
    lines: list[shapely.LineString],
    widths: list[float],
    params: BlocksParams,
    land: list[shapely.Polygon] | None,
) -> FoundBlocks:
    streets = street_lines(lines, width=widths[: len(lines)])
    try:
        return find_blocks(streets, params, land=land)
    except BoundaryError:
        assume(False)
        raise


@FEW
@given(lines=LINES, widths=WIDTHS, params=PARAMS, land=LAND)
def test_blocks_and_right_of_way_tile(
    lines: list[shapely.LineString],
    widths: list[float],
    params: BlocksParams,
    land: list[shapely.Polygon] | None,
) -> None:
    out = blocks_of(lines, widths, params, land)
    blocks = out.blocks
    pieces = np.append(blocks.polygons, out.right_of_way)
    assert shapely.is_valid(pieces).all()
    assert (shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON).all()
    assert shapely.coverage_is_valid(pieces)
    whole = shapely.union_all(pieces)
    total = shapely.area(pieces).sum()
    assert abs(whole.area - total) < 1e-6 * total
    if land is not None:
        given_land = shapely.union_all(land)
        assert shapely.symmetric_difference(whole, given_land).area < 1e-2
    assert shapely.equals_exact(canonical_rings(blocks.polygons), blocks.polygons).all()
    rings = blocks.rings
    assert len(rings.xy) == len(blocks.edge_access) == len(out.edge_class)
    np.testing.assert_array_equal(np.isnan(blocks.edge_width), ~blocks.edge_access)
    np.testing.assert_array_equal(blocks.edge_street == UNKNOWN_STREET, ~blocks.edge_access)
    if land is None:
        assert blocks.edge_access.all()
    assert set(blocks.edge_width[blocks.edge_access].tolist()) <= set(widths)
    assert (shapely.area(blocks.polygons) >= params.min_area).all()
    inner = shapely.buffer(blocks.polygons, -params.min_width / 2)
    assert not shapely.is_empty(inner).any()


@FEW
@given(lines=LINES, widths=WIDTHS, params=PARAMS, land=LAND, data=st.data())
def test_order_and_direction_of_lines_change_nothing(
    lines: list[shapely.LineString],
    widths: list[float],
    params: BlocksParams,
    land: list[shapely.Polygon] | None,
    data: st.DataObject,
) -> None:
    first = blocks_of(lines, widths, params, land)
    order = data.draw(st.permutations(range(len(lines))))
    turned = [lines[i].reverse() if i % 2 else lines[i] for i in order]
    again = blocks_of(turned, [widths[i] for i in order], params, land)
    a, b = first.blocks, again.blocks
    assert shapely.to_wkb(a.polygons).tolist() == shapely.to_wkb(b.polygons).tolist()
    np.testing.assert_array_equal(a.edge_width, b.edge_width)
    np.testing.assert_array_equal(a.edge_street, b.edge_street)
    np.testing.assert_array_equal(a.edge_access, b.edge_access)
    assert [(i.code, i.value) for i in a.issues] == [(i.code, i.value) for i in b.issues]
