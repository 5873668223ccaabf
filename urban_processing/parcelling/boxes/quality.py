"""What pieces of a face must keep, and how well they do; street sides and the width of fronts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.access_rule import MEASURED_M, reached_frontage
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.parcelling.boxes.candidates import Contour, Faces
from urban_processing.parcelling.boxes.line_cuts import TOUCH, Cut
from urban_processing.parcelling.boxes.sweep import Sweep
from urban_processing.parcelling.rings import Rings
from urban_processing.site import AREA_ROUNDING

GOOD, FAIR, BAD = 0, 1, 2
"""Cuts whose pieces keep all bounds, those whose pieces are only too narrow, and the rest."""


@dataclass(frozen=True, eq=False)
class Fronts:
    """Sides of faces along streets, in metres.

    Parameters
    ----------
    frontage
        Length of the edges along streets.
    front
        Longest street side, which is the width of the front.
    total
        All street sides together.
    """

    frontage: FloatArray
    front: FloatArray
    total: FloatArray


def fronts_of(rings: Rings, xy: FloatArray, axis: FloatArray, contour: Contour) -> Fronts:
    """Measure the street sides of faces.

    They are told apart by the four sides of a box with the given axis (F, 2), each edge belonging
    to the side that it faces most, and are measured along the box. So the second side of a corner
    parcel does not add to its width, and a rounded corner has two sides.
    """
    node = contour.access(rings.segment).nonzero()[0]
    face = rings.edge_face[node]
    a, b = rings.vertex[node], rings.vertex[rings.following[node]]
    x, y = xy[:, 0], xy[:, 1]
    x, y = x[b] - x[a], y[b] - y[a]
    cos, sin = axis[:, 0][face], axis[:, 1][face]
    share = np.ones((1, len(node)))
    return _measured(x * cos + y * sin, y * cos - x * sin, (face, share), rings.n_faces)[0]


def quality_of_halves(faces: Faces, sweep: Sweep, place: FloatArray, contour: Contour) -> IntArray:
    """(K,) how well the two parts of faces, before a line and beyond it, keep what they must."""
    node = contour.access(faces.rings.segment).nonzero()[0]
    face = faces.rings.edge_face[node]
    after = faces.rings.following[node]
    begin, end, at = sweep.along[node], sweep.along[after], place[face]
    run, rise = end - begin, sweep.across[after] - sweep.across[node]
    before = np.minimum(end, at) - np.minimum(begin, at)
    flat = run == 0.0
    before = np.where(flat, begin <= at, before / np.where(flat, 1.0, run))
    on = (np.abs(begin - at) <= TOUCH) & (np.abs(end - at) <= TOUCH)
    before[on] = rise[on] > 0.0  # an edge along the line is on the side of its face
    share = np.stack([before, 1.0 - before])
    sides = _measured(run, rise, (face, share), len(faces))
    area = np.minimum(np.maximum(sweep.areas(place), 0.0), faces.area)
    return np.maximum(_quality(faces, area, sides[0]), _quality(faces, faces.area - area, sides[1]))


def quality_of_pieces(faces: Faces, made: Cut, xy: FloatArray, contour: Contour) -> IntArray:
    """(K,) how well the pieces of faces that were cut keep what they must."""
    pieces, parent = made.pieces, made.parent
    sides = fronts_of(pieces, xy, faces.boxes.axis[parent], contour)
    area = np.maximum(pieces.areas(xy), 0.0)  # slivers may turn over by rounding
    each = _quality(faces.take(parent), area, sides)
    worst = np.full(len(faces), GOOD)
    np.maximum.at(worst, parent, each)
    return worst


def _measured(
    along: FloatArray, across: FloatArray, of: tuple[IntArray, FloatArray], n: int
) -> list[Fronts]:
    """Add up edges by face; `of`: the face of each, and (T, N) the shares that T sums take."""
    face, shares = of
    is_along = np.abs(along) >= np.abs(across)
    part = np.where(is_along, along, across)
    side = 4 * face + 2 * is_along + (part > 0.0)
    part = np.abs(part)
    length = np.sqrt(along * along + across * across)
    out = []
    for share in shares:
        sides = np.bincount(side, weights=part * share, minlength=4 * n).reshape(n, 4)
        frontage = np.bincount(face, weights=length * share, minlength=n)
        out.append(Fronts(frontage.astype(np.float64), sides.max(axis=1), sides.sum(axis=1)))
    return out


def _quality(faces: Faces, area: FloatArray, sides: Fronts) -> IntArray:
    """How well one piece of each face keeps what it must."""
    reached = sides.frontage >= reached_frontage(area) - MEASURED_M
    bad = area < faces.least * (1.0 - AREA_ROUNDING)
    bad |= faces.needs_access & ~reached
    bad |= reached & (sides.front < faces.narrowest - MEASURED_M)
    fair = reached & (sides.front < faces.min_width - MEASURED_M)
    # so many parcels the piece will be at least, and each needs a front
    n_parcels = np.ceil(area / faces.largest * (1.0 - AREA_ROUNDING))
    fair |= faces.needs_access & (sides.total < n_parcels * faces.narrowest - MEASURED_M)
    return np.where(bad, BAD, np.where(fair, FAIR, GOOD))
