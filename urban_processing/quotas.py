"""Numbers of parcels, shared out over areas and divided as these are cut."""

from __future__ import annotations

import numpy as np

from urban_processing.mesh.planar import FloatArray, IntArray


def shared_out(area: FloatArray, total: int) -> IntArray:
    """Divide a number of parcels over areas in proportion, at least one each."""
    exact = area * (total / area.sum())
    quota: IntArray = np.maximum(np.floor(exact).astype(np.int64), 1)
    missing = total - int(quota.sum())
    if missing > 0:
        order = np.argsort(np.round(quota - exact, 9), kind="stable")
        quota[order[:missing]] += 1
    while missing < 0 and (quota > 1).any():
        # parts too small for a parcel still are one: the others give way
        rest = np.where(quota > 1, exact / quota, np.inf)
        quota[int(np.argmin(rest))] -= 1
        missing += 1
    return quota


def divided(quota: IntArray, parent: IntArray, area: FloatArray) -> IntArray:
    """Divide the quotas of cut faces over their pieces in proportion to the area; 0 stays 0."""
    order = np.argsort(parent, kind="stable")
    start = np.flatnonzero(np.diff(parent[order], prepend=-1))
    stop = np.append(start[1:], len(order))
    out = quota[parent]
    several = np.flatnonzero((stop - start > 1) & (out[order[start]] > 0))
    for k in several.tolist():
        pieces = order[start[k] : stop[k]]
        out[pieces] = shared_out(area[pieces], int(quota[parent[pieces[0]]]))
    return out
