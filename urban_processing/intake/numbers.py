"""Numbers of polygons that layers hold, those of several pieces among them."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import IntArray
from urban_processing.mesh.polygons import by_place

TOO_LARGE = 2**62
"""Numbers stay below, so that new ones fit above them."""


def is_whole(value: Any) -> bool:
    """Whether an attribute is a whole number that can be that of a polygon.

    >>> [is_whole(value) for value in (7, 7.0, 7.5, float("nan"), "7", None, True, 2**62)]
    [True, True, False, False, False, False, False, False]
    """
    if isinstance(value, bool | np.bool_) or not isinstance(value, int | float | np.number):
        return False
    return float(value).is_integer() and abs(int(value)) < TOO_LARGE


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
    placed = by_place(polygons)
    size = np.round(shapely.area(polygons[placed]), 6)
    largest = placed[np.lexsort((np.arange(len(size)), -size, row[placed]))]
    _, first = np.unique(row[largest], return_index=True)
    extra = len(polygons) - len(first)
    if given_id is None:
        return np.arange(1, len(polygons) + 1), placed, extra
    keeps = np.isin(placed, largest[first])
    number = np.where(keeps, given_id[row[placed]], 0)
    number[~keeps] = max(0, int(given_id[row].max())) + 1 + np.arange(extra)
    order = np.argsort(number, kind="stable")
    return number[order], placed[order], extra
