"""Straight cuts across a parcel from points of its boundary, where streamlines find none."""

from __future__ import annotations

import numpy as np

from urban_processing.fields.rings import cross
from urban_processing.mesh.planar import IntArray
from urban_processing.subdivision.cuts import Cuts
from urban_processing.subdivision.parcels import Boundary

CHORDS = 48
"""Number of points, spread over a parcel's boundary, that chords are drawn from."""


def chord_cuts(boundary: Boundary, parcel: IntArray) -> Cuts:
    """Cut each parcel from points of its boundary, at right angles, to the boundary ahead.

    They need no field, whose grid is too coarse for parcels that are long and winding.
    """
    rows = np.repeat(parcel, CHORDS)
    share = (np.tile(np.arange(CHORDS), len(parcel)) + 0.5) / CHORDS
    t_a = share * boundary.perimeter[rows]
    edge, _ = boundary.locate(rows, t_a)
    along = boundary.edge[rows, edge]
    inward = 1j * along / np.abs(along)
    a = boundary.position(rows, t_a)
    z, e = boundary.rings.z[rows], boundary.edge[rows]
    ray = np.broadcast_to(inward[:, None], e.shape)
    denominator = cross(ray, e)
    with np.errstate(divide="ignore", invalid="ignore"):
        reach = cross(z - a[:, None], e) / denominator
        place = cross(z - a[:, None], ray) / denominator
    own = np.arange(e.shape[1])[None] == edge[:, None]
    hits = (denominator > 0) & ~own & (reach > 0) & (place >= 0) & (place <= 1)
    reach = np.where(hits, reach, np.inf)
    index = np.arange(len(rows))
    far = reach.argmin(axis=1)
    good = np.isfinite(reach[index, far])
    rows, index, far, a, inward = rows[good], index[good], far[good], a[good], inward[good]
    start, stop = boundary.t[rows, far], boundary.t[rows, far + 1]
    t_b = start + place[index, far] * (stop - start)
    b = boundary.position(rows, t_b)
    return Cuts(
        parcel=rows,
        t_a=t_a[good],
        t_b=t_b,
        leaving=inward,
        arriving=inward,
        bulge=np.zeros(len(rows)),
        clearance=np.full(len(rows), np.inf),
        paths=lambda chosen: [np.array([a[i], b[i]]) for i in chosen],
    )
