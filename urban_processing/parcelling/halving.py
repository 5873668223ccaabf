"""Halve many faces at once: which of the possible cuts is made, and what must hold for pieces."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.access_rule import MEASURED_M, reached_frontage
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.candidates import Contour, Faces, View, view_along
from urban_processing.parcelling.line_cuts import TOUCH, Cut, Lines, cut
from urban_processing.parcelling.rings import Rings, changes, ranges
from urban_processing.site import AREA_ROUNDING

SHARES = (1 / 2, 1 / 3, 2 / 3)
"""Shares of the area before the cut that are tried where the regular cut will not do."""


@dataclass(frozen=True, eq=False)
class StreetSides:
    """Sides of F faces along streets, in metres.

    Parameters
    ----------
    frontage
        (F,) length of the edges along streets.
    front
        (F,) longest street side, which is the width of the front.
    total
        (F,) all street sides together.
    """

    frontage: FloatArray
    front: FloatArray
    total: FloatArray


@dataclass(frozen=True, eq=False)
class Halved:
    """Faces that were halved: the `rows` (H,), the pieces by place in `rows`, and the cuts."""

    rows: IntArray
    cut: Cut
    lines: Lines


@dataclass(frozen=True, eq=False)
class _Choice:
    """C cuts that may be made: of which face, where along its axis, and if along the other one.

    Those of a face are one after the other, the best first.
    """

    row: IntArray
    place: FloatArray
    turned: BoolArray


@dataclass(frozen=True, eq=False)
class _Trial:
    """Cuts that were tried: whether all bounds hold, all but the width, or no area is too small."""

    choice: _Choice
    lines: Lines
    cut: Cut
    good: BoolArray
    fair: BoolArray
    small: BoolArray

    def made(self, chosen: BoolArray) -> Halved:
        """Make the first of the chosen cuts of each face."""
        row = self.choice.row
        best = chosen.nonzero()[0]
        best = best[changes(row[best])]
        lines = Lines(self.lines.point[best], self.lines.normal[best])
        return Halved(row[best], _cut_of(self.cut, best), lines)


def halve(faces: Faces, xy: FloatArray, contour: Contour) -> list[Halved]:
    """Halve faces by the first cut that keeps all bounds; those that have none are left out.

    Tried in turn: the regular cut through a corner of the contour, where one is near; the
    regular cut; the one that halves the area, if a piece was too small; the regular cut along
    the other axis, through a corner if near; that cut without it; cuts at half of the area along
    both axes, then at other shares of it. A cut will do if its pieces keep `least` and `min_width`
    and, where access is needed, have it, and have fronts for all the parcels they will become. If
    none will, the first is made whose pieces keep `least` and `narrowest` and have access.
    """
    left = np.ones(len(faces), dtype=bool)
    along = view_along(faces, xy, contour, turned=False)
    choice = _choice([(np.arange(len(faces)), along.snapped, False)])
    trials = [_tried(faces, choice, xy, contour)]
    done = [trials[0].made(trials[0].good)]
    left[done[0].rows] = False
    rest = left.nonzero()[0]
    if len(rest):
        along = along.take(rest)
        across = view_along(along.faces, xy, contour, turned=True)
        choice = _second_choice(rest, along, across, trials[0].small[rest])
        trials.append(_tried(faces, choice, xy, contour))
        done.append(trials[1].made(trials[1].good))
        left[done[1].rows] = False
        still = left[rest].nonzero()[0]
        if len(still):
            choice = _last_choice(rest[still], along.take(still), across.take(still))
            trials.append(_tried(faces, choice, xy, contour))
            done.append(trials[2].made(trials[2].good))
            left[done[2].rows] = False
        for trial in trials:
            done.append(trial.made(trial.fair & left[trial.choice.row]))
            left[done[-1].rows] = False
    return [part for part in done if len(part.rows)]


def street_sides(rings: Rings, xy: FloatArray, axis: FloatArray, contour: Contour) -> StreetSides:
    """Measure the street sides of faces.

    They are told apart by the four sides of a box with the given axis (F, 2), each edge belonging
    to the side that it faces most, and are measured along the box. So the second side of a corner
    parcel does not add to its width, and a rounded corner has two sides.
    """
    node = contour.access(rings.segment).nonzero()[0]
    face = rings.edge_face[node]
    edge = xy[rings.vertex[rings.following[node]]] - xy[rings.vertex[node]]
    along = edge[:, 0] * axis[face, 0] + edge[:, 1] * axis[face, 1]
    across = edge[:, 1] * axis[face, 0] - edge[:, 0] * axis[face, 1]
    is_along = np.abs(along) >= np.abs(across)
    part = np.where(is_along, along, across)
    n = rings.n_faces
    side = 4 * face + 2 * is_along + (part > 0)
    sides = np.bincount(side, weights=np.abs(part), minlength=4 * n).reshape(n, 4)
    length = np.sqrt(along * along + across * across)
    frontage = np.bincount(face, weights=length, minlength=n).astype(np.float64)
    return StreetSides(frontage, sides.max(axis=1), sides.sum(axis=1))


def _choice(parts: list[tuple[IntArray, FloatArray, bool]]) -> _Choice:
    """Put cuts together, the better ones first: rows, places and if along the other axis."""
    row = np.concatenate([rows for rows, _, _ in parts])
    place = np.concatenate([places for _, places, _ in parts])
    turned = np.repeat([turned for _, _, turned in parts], [len(rows) for rows, _, _ in parts])
    if len(parts) == 1:
        return _Choice(row, place, turned)
    order = np.argsort(row, kind="stable")
    return _Choice(row[order], place[order], turned[order])


def _second_choice(rows: IntArray, along: View, across: View, small: BoolArray) -> _Choice:
    """Other cuts of faces whose first one would not do; `small`: as a piece was too small."""
    moved = np.abs(along.regular - along.snapped) > TOUCH
    return _choice(
        [
            (rows[moved], along.regular[moved], False),
            (rows[small], along.at_shares(small.nonzero()[0], np.array(0.5)), False),
            (rows, across.snapped, True),
        ]
    )


def _last_choice(rows: IntArray, along: View, across: View) -> _Choice:
    """All that is left to be tried."""
    moved = np.abs(across.regular - across.snapped) > TOUCH
    n, k = len(SHARES), len(rows)
    each, share = np.tile(np.arange(k), n), np.repeat(SHARES, k)
    parts = [(rows[moved], across.regular[moved], True)]
    places = [view.at_shares(each, share).reshape(n, k) for view in (along, across)]
    for at_along, at_across in zip(*places, strict=True):
        parts += [(rows, at_along, False), (rows, at_across, True)]
    return _choice(parts)


def _tried(faces: Faces, choice: _Choice, xy: FloatArray, contour: Contour) -> _Trial:
    """Cut faces and see what comes of it."""
    is_all = len(choice.row) == len(faces) and len(changes(choice.row).nonzero()[0]) == len(faces)
    copies = faces if is_all else faces.take(choice.row)
    lines = _lines(copies, choice)
    found = cut(copies.rings, xy, lines)
    return _Trial(choice, lines, found, *_verdict(copies, found, xy, contour))


def _lines(copies: Faces, choice: _Choice) -> Lines:
    axis = copies.boxes.turned(choice.turned).axis if choice.turned.any() else copies.boxes.axis
    return Lines(copies.boxes.centre + choice.place[:, None] * axis, axis)


def _cut_of(tried: Cut, faces: IntArray) -> Cut:
    """Return the pieces of some of the faces that were cut, these numbered anew."""
    first = np.searchsorted(tried.parent, faces)
    count = np.searchsorted(tried.parent, faces, side="right") - first
    picked = tried.select(ranges(first, count))
    parent = np.repeat(np.arange(len(faces)), count)
    return Cut(picked.pieces, parent, picked.added, picked.n_vertices)


def _verdict(
    faces: Faces, tried: Cut, xy: FloatArray, contour: Contour
) -> tuple[BoolArray, BoolArray, BoolArray]:
    """(K,) faces whose pieces keep all bounds, that are only too narrow, and with small ones."""
    points = np.concatenate([xy, tried.added])
    pieces, parent = tried.pieces, tried.parent
    k = len(faces)
    area = pieces.areas(points)
    sides = street_sides(pieces, points, faces.boxes.axis[parent], contour)
    reached = sides.frontage >= reached_frontage(area) - MEASURED_M
    too_small = area < faces.least[parent] * (1.0 - AREA_ROUNDING)
    front = np.where(reached, sides.front, np.inf)
    bad = too_small | (~reached & faces.needs_access[parent])
    bad |= front < faces.narrowest[parent] - MEASURED_M
    fair = ~_any(bad, parent, k) & (np.bincount(parent, minlength=k) > 1)
    doubtful = fair[parent].nonzero()[0]
    if len(doubtful):
        invalid = doubtful[~pieces.take(doubtful).are_valid(points)]
        fair[parent[invalid]] = False
    bad = front < faces.min_width[parent] - MEASURED_M
    # so many parcels a piece will be at least, and each needs a front
    n_parcels = np.ceil(area / faces.largest[parent] * (1.0 - AREA_ROUNDING))
    cramped = sides.total < n_parcels * faces.narrowest[parent] - MEASURED_M
    bad |= cramped & faces.needs_access[parent]
    good = fair & ~_any(bad, parent, k)
    return good, fair, _any(too_small, parent, k)


def _any(piece: BoolArray, parent: IntArray, n_faces: int) -> BoolArray:
    """(n_faces,) faces with such a piece."""
    out = np.zeros(n_faces, dtype=bool)
    out[parent[piece]] = True
    return out
