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

OTHER_SHARES = (1 / 3, 2 / 3)
"""Shares of the area before the cut that are tried where halves will not do."""


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

    def take(self, which: IntArray) -> _Choice:
        return _Choice(self.row[which], self.place[which], self.turned[which])


def halve(faces: Faces, xy: FloatArray, contour: Contour) -> list[Halved]:
    """Halve faces by the first cut that keeps all bounds; those that have none are left out.

    Tried in turn: the regular cut through a corner of the contour, where one is near; the
    regular cut; the one that halves the area, if a piece was too small; the regular cut along
    the other axis, through a corner if near; that cut without it; cuts at half of the area along
    both axes, then at other shares of it. Where none keeps `min_width`, the first that keeps
    `narrowest` is made.
    """
    everyone = np.arange(len(faces))
    along = view_along(faces, xy, contour, turned=False)
    choice = _choice([(everyone, along.snapped, False)])
    halved, spare, small = _try(faces, choice, xy, contour)
    done, spares = [halved], [spare]
    rest = _left(everyone, done)
    if len(rest):
        along = along.take(rest)
        across = view_along(along.faces, xy, contour, turned=True)
        choice = _second_choice(rest, along, across, small[rest])
        halved, spare, _ = _try(faces, choice, xy, contour)
        done.append(halved)
        spares.append(spare)
        still = _left(rest, done)
        if len(still):
            at = np.searchsorted(rest, still)
            choice = _last_choice(still, along.take(at), across.take(at))
            halved, spare, _ = _try(faces, choice, xy, contour)
            done.append(halved)
            spares.append(spare)
        done.append(_at_a_pinch(faces, xy, _left(still, done), spares))
    return [part for part in done if len(part.rows)]


def street_sides(rings: Rings, xy: FloatArray, axis: FloatArray, contour: Contour) -> StreetSides:
    """Measure the street sides of faces.

    They are told apart by the four sides of a box with the given axis (F, 2), each edge belonging
    to the side that it faces most, and are measured along the box. So the second side of a corner
    parcel does not add to its width, and a rounded corner has two sides.
    """
    node = np.flatnonzero(contour.access(rings.segment))
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
    turned = np.concatenate([np.full(len(rows), turned) for rows, _, turned in parts])
    order = np.argsort(row, kind="stable")
    return _Choice(row[order], place[order], turned[order])


def _second_choice(rows: IntArray, along: View, across: View, small: BoolArray) -> _Choice:
    """Other cuts of faces whose first one would not do; `small`: as a piece was too small."""
    moved = np.abs(along.regular - along.snapped) > TOUCH
    halves = along.take(np.flatnonzero(small)).at_share(0.5) if small.any() else np.empty(0)
    return _choice(
        [
            (rows[moved], along.regular[moved], False),
            (rows[small], halves, False),
            (rows, across.snapped, True),
        ]
    )


def _last_choice(rows: IntArray, along: View, across: View) -> _Choice:
    """All that is left to be tried."""
    moved = np.abs(across.regular - across.snapped) > TOUCH
    parts = [
        (rows[moved], across.regular[moved], True),
        (rows, along.at_share(0.5), False),
        (rows, across.at_share(0.5), True),
    ]
    for share in OTHER_SHARES:
        parts += [(rows, along.at_share(share), False), (rows, across.at_share(share), True)]
    return _choice(parts)


def _left(rows: IntArray, done: list[Halved]) -> IntArray:
    """Return the rows that are not among those done."""
    left = np.zeros(rows[-1] + 1 if len(rows) else 0, dtype=bool)
    left[rows] = True
    for part in done:
        left[part.rows[part.rows < len(left)]] = False
    return left.nonzero()[0]


def _try(
    faces: Faces, choice: _Choice, xy: FloatArray, contour: Contour
) -> tuple[Halved, _Choice, BoolArray]:
    """Halve faces by the first cut that keeps all bounds.

    Returns also, for each face, the first cut whose pieces are only too narrow, and (C,) cuts
    with a piece that is too small.
    """
    copies = faces.take(choice.row)
    lines = _lines(copies, choice)
    tried = cut(copies.rings, xy, lines)
    good, fair, small = _verdict(copies, tried, xy, contour)
    best = _first_of_each(choice.row, good)
    halved = Halved(
        choice.row[best], _cut_of(tried, best), Lines(lines.point[best], lines.normal[best])
    )
    return halved, choice.take(_first_of_each(choice.row, fair)), small


def _first_of_each(row: IntArray, chosen: BoolArray) -> IntArray:
    """Return the first chosen place of each row; rows are in order."""
    places = chosen.nonzero()[0]
    return places[changes(row[places])]


def _at_a_pinch(faces: Faces, xy: FloatArray, rows: IntArray, spares: list[_Choice]) -> Halved:
    """Halve what can be halved, by the first cut whose pieces are only too narrow."""
    row = np.concatenate([spare.row for spare in spares])
    order = np.argsort(row, kind="stable")
    order = order[_first_of_each(row[order], np.isin(row[order], rows))]
    choice = _Choice(
        row[order],
        np.concatenate([spare.place for spare in spares])[order],
        np.concatenate([spare.turned for spare in spares])[order],
    )
    copies = faces.take(choice.row)
    lines = _lines(copies, choice)
    return Halved(choice.row, cut(copies.rings, xy, lines), lines)


def _lines(copies: Faces, choice: _Choice) -> Lines:
    axis = copies.boxes.turned(choice.turned).axis
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
    doubtful = np.flatnonzero(fair[parent])
    if len(doubtful):
        invalid = doubtful[~pieces.take(doubtful).are_valid(points)]
        fair[parent[invalid]] = False
    good = fair & ~_any(front < faces.min_width[parent] - MEASURED_M, parent, k)
    return good, fair, _any(too_small, parent, k)


def _any(piece: BoolArray, parent: IntArray, n_faces: int) -> BoolArray:
    """(n_faces,) faces with such a piece."""
    out = np.zeros(n_faces, dtype=bool)
    out[parent[piece]] = True
    return out
