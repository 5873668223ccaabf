"""Blocks of a layer of parcels that says nothing about blocks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.components import components
from urban_processing.mesh.planar import IntArray

TOUCH = 0.01
"""Parcels that come this near to each other, in metres, touch."""


def touching(polygons: npt.NDArray[np.object_]) -> IntArray:
    """(n,) group of each polygon; polygons that touch, and those that touch these, are one."""
    a, b = shapely.STRtree(polygons).query(polygons, predicate="dwithin", distance=TOUCH)
    return components(len(polygons), np.column_stack([a[a < b], b[a < b]]))


def dissolved(polygons: npt.NDArray[np.object_]) -> shapely.Polygon:
    """The outline of parcels of one block; of several pieces the hull of all.

    Parcels that share vertices are joined quickly; where they do not fit, they are joined with
    what lies between.
    """
    if shapely.coverage_is_valid(polygons):
        joined = shapely.coverage_union_all(polygons)
    else:
        wider = shapely.union_all(shapely.buffer(polygons, TOUCH, join_style="mitre"))
        joined = shapely.buffer(wider, -TOUCH, join_style="mitre")
    return joined if joined.geom_type == "Polygon" else joined.convex_hull
