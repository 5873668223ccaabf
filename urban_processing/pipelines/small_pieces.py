"""Pieces of a strategy that came out too small, joined to their neighbours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import IntArray
from urban_processing.parcelling.ground import Pieces
from urban_processing.site import AREA_ROUNDING


@dataclass(frozen=True, eq=False)
class Whole:
    """Polygons that tile the ground, and the piece that gives each its path and level.

    Parameters
    ----------
    polygons
        (n,) polygons, noded like the pieces.
    piece
        (n,) a piece for each, rising.
    """

    polygons: npt.NDArray[np.object_]
    piece: IntArray


def join_small(pieces: Pieces, min_area: float) -> Whole:
    """Join every piece that is too small to the neighbour with which it shares most.

    The smallest piece is joined first; what is still too small then is joined again. Pieces of
    different polygons of the ground are never joined, so a polygon that is too small itself
    becomes one piece. A neighbour with which a piece would enclose another comes last.

    Parameters
    ----------
    pieces
        Noded pieces.
    min_area
        Smallest area in m².
    """
    polygons = pieces.polygons()
    area = shapely.area(polygons)
    least = min_area * (1.0 - AREA_ROUNDING)
    there = np.ones(len(polygons), dtype=bool)
    for block in np.unique(pieces.block[area < least]).tolist():
        own = np.flatnonzero(pieces.block == block)
        while len(own) > 1 and area[own].min() < least:
            small = own[np.lexsort((pieces.lineage[own], np.round(area[own], 6)))[0]]
            others = own[own != small]
            k, joined = _best(polygons[small], polygons[others])
            if k is not None:
                polygons[others[k]] = joined
                area[others[k]] = joined.area
                there[small] = False
            own = others
    piece = np.flatnonzero(there)
    return Whole(polygons[piece], piece)


def _best(
    small: shapely.Polygon, others: npt.NDArray[np.object_]
) -> tuple[int | None, shapely.Geometry]:
    """Which polygon shares most with a small one, first such as enclose nothing with it.

    None, with the small one itself, where no other shares an edge with it.
    """
    ranked = []
    near = np.flatnonzero(shapely.intersects(small, others)).tolist()
    for k in near:
        joined = shapely.get_geometry(shapely.coverage_union_all([small, others[k]]), 0)
        if joined.area < 0.5 * small.area + others[k].area:
            continue  # they meet at a point
        encloses = len(joined.interiors) > len(small.interiors) + len(others[k].interiors)
        shared = 0.5 * (small.length + others[k].length - joined.length)
        ranked.append((encloses, -round(shared, 6), -round(others[k].area, 6), k, joined))
    if not ranked:
        return None, small
    best = min(ranked, key=lambda row: row[:4])
    return best[3], best[4]
