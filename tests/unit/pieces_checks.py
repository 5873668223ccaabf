"""Blocks to be divided, and what holds of the pieces of any of them."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks, plain_blocks
from urban_processing.mesh.build import canonical_rings
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.pipelines.subdivide import ground_of_blocks

AREA_TOLERANCE = 1e-9


def blocks_of(*polygons: shapely.Polygon, **columns: object) -> Blocks:
    """Blocks of some polygons on the grid, all shells street."""
    on_grid = shapely.set_precision(np.array(polygons, dtype=object), 2.0**-20)
    values = {k: np.array(v, dtype=object) for k, v in columns.items()}
    return plain_blocks(canonical_rings(on_grid), columns=values)


def city(columns: int = 4, rows: int = 3) -> list[shapely.Polygon]:
    """Blocks of a city: quadrilaterals of many sizes, none of them a rectangle."""
    out = []
    for i in range(columns):
        for j in range(rows):
            x, y, w, h = 130.0 * i, 110.0 * j, 90.0 + 9 * i, 70.0 + 7 * j
            skew = 5.0 * math.sin(3 * i + j)
            out.append(
                shapely.Polygon([(x, y), (x + w, y + skew), (x + w - skew, y + h), (x + 2, y + h)])
            )
    return out


def odd_shapes() -> list[shapely.Polygon]:
    """L, U, a triangle, a round block, one with a hole, a thin one and a star."""
    u = shapely.box(0, 0, 120, 90).difference(shapely.box(40, 30, 80, 90))
    star = [
        (
            (70 if k % 2 else 35) * math.cos(k * math.pi / 5),
            (70 if k % 2 else 35) * math.sin(k * math.pi / 5),
        )
        for k in range(10)
    ]
    return [
        shapely.box(0, 0, 150, 120).difference(shapely.box(70, 60, 150, 120)),
        u,
        shapely.Polygon([(0, 0), (140, 0), (40, 110)]),
        shapely.Point(0, 0).buffer(70),
        shapely.box(0, 0, 140, 120).difference(shapely.box(50, 45, 90, 75)),
        shapely.box(0, 0, 300, 14),
        shapely.Polygon(star),
    ]


def assert_tile(pieces: Pieces, ground: Ground, blocks: npt.NDArray[np.object_]) -> None:
    """Check that pieces tile the ground exactly and share their vertices."""
    polygons = pieces.polygons()
    assert shapely.is_valid(polygons).all()
    assert (np.diff(pieces.block) >= 0).all()
    assert len(np.unique(pieces.lineage)) == pieces.n_faces
    n = len(ground.rings.xy)
    assert np.array_equal(pieces.xy[:n], ground.rings.xy)
    area = np.bincount(pieces.block, weights=shapely.area(polygons), minlength=len(blocks))
    np.testing.assert_allclose(area, shapely.area(blocks), rtol=AREA_TOLERANCE)
    for block, outline in enumerate(blocks):
        own = polygons[pieces.block == block]
        assert shapely.coverage_is_valid(own)
        outer = shapely.coverage_simplify(own, 0.0) if len(own) == 1 else own
        assert shapely.union_all(outer).symmetric_difference(outline).area < 1e-8 * outline.area
    street = np.zeros(len(blocks))
    after = np.arange(1, len(pieces.vertex) + 1)
    after[pieces.offsets[1:] - 1] = pieces.offsets[:-1]
    length = np.hypot(*(pieces.xy[pieces.vertex[after]] - pieces.xy[pieces.vertex]).T)
    of_edge = pieces.block[np.repeat(pieces.face, np.diff(pieces.offsets))]
    np.add.at(street, of_edge, np.where(pieces.access, length, 0.0))
    rings = ground.rings
    side = np.hypot(*(rings.xy[rings.following] - rings.xy).T)
    expected = np.bincount(rings.edge_block, weights=np.where(ground.access, side, 0.0))
    np.testing.assert_allclose(street, expected, rtol=1e-9, atol=1e-6)


__all__ = ["assert_tile", "blocks_of", "city", "ground_of_blocks", "odd_shapes"]
