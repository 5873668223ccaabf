"""Numbers of polygons that layers hold, those of several pieces among them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import IntArray


def numbered(
    polygons: npt.NDArray[np.object_], row: IntArray, given_id: IntArray | None
) -> tuple[IntArray, IntArray, int]:
    """Number single polygons.

    The numbers are those given, or else count the polygons by place. Of several pieces of one row
    the largest keeps its number, the others get new ones.

    Parameters
    ----------
    polygons, row
        (P,) polygons, and the row of the layer that each comes from.
    given_id
        (n,) numbers of the rows, unique; None for none.

    Returns
    -------
    number, order
        (P,) numbers, ascending, and the polygon that has each.
    extra
        How many polygons there are beyond one for each row.
    """
    west, south, east, north = shapely.bounds(polygons).T
    by_place = np.lexsort((shapely.area(polygons), north, east, south, west))
    size = np.round(shapely.area(polygons[by_place]), 6)
    largest = by_place[np.lexsort((np.arange(len(size)), -size, row[by_place]))]
    _, first = np.unique(row[largest], return_index=True)
    extra = len(polygons) - len(first)
    if given_id is None:
        return np.arange(1, len(polygons) + 1), by_place, extra
    keeps = np.isin(by_place, largest[first])
    number = np.where(keeps, given_id[row[by_place]], 0)
    number[~keeps] = max(0, int(given_id[row].max())) + 1 + np.arange(extra)
    order = np.argsort(number, kind="stable")
    return number[order], by_place[order], extra
