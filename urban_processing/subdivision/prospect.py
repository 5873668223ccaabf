"""What becomes of a half in later levels: the best that straight cuts of a rectangle can do.

A half is rated not only for the shape it has but for the parcels that it can be cut into. For
rectangles this is a small dynamic programme over aspect ratio and content (area in smallest
parcels, or number of parcels wanted): a parcel of 2:1 that is to become four gives four of
2:1 whatever is done, while one that is to become two gives two squares.
"""

from __future__ import annotations

from functools import cache

import numpy as np

from urban_processing.mesh.corners import side_irregularity
from urban_processing.mesh.planar import FloatArray, IntArray

LARGEST = 48
"""Number of parcels from which on the prospect no longer changes."""

LARGEST_AREA = 16.0
"""The same for areas, in smallest parcels."""

_LOG_ASPECT = np.linspace(0.0, np.log(8.0), 43)
_LOG_AREA = np.linspace(0.0, np.log(LARGEST_AREA), 41)


def prospect_of_quota(aspect: FloatArray, quota: IntArray) -> FloatArray:
    """Mean irregularity of the side lengths (Eq. 1, second term) of the best equal division.

    Parameters
    ----------
    aspect
        Long over short side of a rectangle, at least 1.
    quota
        Number of parcels that it is to become.
    """
    table = _quota_table()
    n = np.clip(quota, 1, LARGEST)
    x = np.clip(np.log(np.maximum(aspect, 1.0)) / _LOG_ASPECT[1], 0, len(_LOG_ASPECT) - 1.001)
    i = x.astype(np.int64)
    return np.asarray(table[n, i] + (x - i) * (table[n, i + 1] - table[n, i]))


def prospect_of_area(aspect: FloatArray, content: FloatArray) -> FloatArray:
    """The same where only the smallest area is given.

    Parameters
    ----------
    content
        Area over the smallest area allowed; cutting goes on until it is below 2.
    """
    return _interpolated(_area_table(), np.log(np.maximum(content, 1.0)), aspect)


def _interpolated(table: FloatArray, log_area: FloatArray, aspect: FloatArray) -> FloatArray:
    folded = np.abs(np.log(aspect))
    x = np.clip(folded / _LOG_ASPECT[1], 0, len(_LOG_ASPECT) - 1.001)
    y = np.clip(log_area / _LOG_AREA[1], 0, len(_LOG_AREA) - 1.001)
    i, j = x.astype(np.int64), y.astype(np.int64)
    a, b = x - i, y - j
    low = table[j, i] + a * (table[j, i + 1] - table[j, i])
    high = table[j + 1, i] + a * (table[j + 1, i + 1] - table[j + 1, i])
    return np.asarray(low + b * (high - low))


@cache
def _quota_table() -> FloatArray:
    """(LARGEST + 1, aspects) prospect of n equal parcels; row 0 is not used."""
    aspect = np.exp(_LOG_ASPECT)
    table = np.zeros((LARGEST + 1, len(aspect)))
    table[1] = side_irregularity(aspect)

    def row(n: int, r: FloatArray) -> FloatArray:
        return np.asarray(np.interp(np.abs(np.log(r)), _LOG_ASPECT, table[n]))

    for n in range(2, LARGEST + 1):
        best = np.full(len(aspect), np.inf)
        for n1 in range(max(1, n // 4), n // 2 + 1):
            s = n1 / n
            across = s * row(n1, aspect * s) + (1 - s) * row(n - n1, aspect * (1 - s))
            along = s * row(n1, aspect / s) + (1 - s) * row(n - n1, aspect / (1 - s))
            best = np.minimum(best, np.minimum(across, along))
        table[n] = best
    return table


@cache
def _area_table() -> FloatArray:
    """(areas, aspects) prospect of cutting until every piece is below two smallest areas."""
    aspect = np.exp(_LOG_ASPECT)
    area = np.exp(_LOG_AREA)
    table = np.tile(side_irregularity(aspect), (len(area), 1))
    for j in np.flatnonzero(area >= 2.0):
        least = max(1.0 / area[j], 0.25)
        best = np.full(len(aspect), np.inf)
        for s in np.linspace(least, 0.5, 13):
            value = {}
            for name, first, second in (
                ("across", aspect * s, aspect * (1 - s)),
                ("along", aspect / s, aspect / (1 - s)),
            ):
                value[name] = s * _interpolated(
                    table, np.full(len(aspect), np.log(area[j] * s)), first
                ) + (1 - s) * _interpolated(
                    table, np.full(len(aspect), np.log(area[j] * (1 - s))), second
                )
            best = np.minimum(best, np.minimum(value["across"], value["along"]))
        table[j] = best
    return table
