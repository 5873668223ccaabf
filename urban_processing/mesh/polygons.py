"""Sets of polygons: their order by place, and their unions by owner."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import IntArray

Geometries = npt.NDArray[np.object_]


def by_place(polygons: Geometries) -> IntArray:
    """(n,) rows of polygons, from west to east, then south to north, then by size."""
    west, south, east, north = np.round(shapely.bounds(polygons).reshape(-1, 4), 6).T
    area = np.round(shapely.area(polygons), 6)
    return np.lexsort((area, north, east, south, west))


def united_by_owner(polygons: Geometries, owner: IntArray, n: int) -> Geometries:
    """(n,) union of the polygons of each owner, empty where it has none."""
    out = np.full(n, shapely.Polygon(), dtype=object)
    order = np.argsort(owner, kind="stable")
    found, first = np.unique(owner[order], return_index=True)
    groups = np.split(polygons[order], first[1:])
    for k, group in zip(found.tolist(), groups, strict=False):
        out[k] = shapely.union_all(group)
    return out
