"""Stand-ins for streets that nobody has: the lines halfway between blocks of parcels."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import Voronoi

STEP = 2.0
"""Metres between the places on the outlines of blocks that the lines keep away from."""

Geometries = npt.NDArray[np.object_]


def medial_streets(parcels: Geometries, *, gap: float = 4.0) -> Geometries:
    """Lines between blocks: parcels that lie no further apart than `gap` metres are one block."""
    united = shapely.buffer(shapely.union_all(shapely.buffer(parcels, gap / 2)), -gap / 2)
    blocks = shapely.get_parts(united)
    rings, owner = shapely.get_rings(blocks, return_index=True)
    rings = shapely.segmentize(rings, STEP)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    xy, first = np.unique(np.round(xy, 3), axis=0, return_index=True)
    block = owner[ring[first]]
    cells = Voronoi(xy)
    ridges = np.asarray(cells.ridge_vertices)
    between = (block[cells.ridge_points[:, 0]] != block[cells.ridge_points[:, 1]]) & (
        ridges >= 0
    ).all(axis=1)
    ends = cells.vertices[ridges[between]]
    wide = np.hypot(*(xy[cells.ridge_points[between, 0]] - ends[:, 0]).T) < 40.0
    lines = shapely.line_merge(shapely.multilinestrings(list(ends[wide])))
    return np.asarray(shapely.simplify(shapely.get_parts(lines), 0.5), dtype=object)
