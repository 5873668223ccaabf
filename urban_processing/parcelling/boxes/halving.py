"""Halve many faces at once: all cuts that may be made are judged, and the best ones made."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.boxes.candidates import Contour, Faces, View, view_along
from urban_processing.parcelling.boxes.line_cuts import TOUCH, Cut, Lines, cut
from urban_processing.parcelling.boxes.quality import (
    BAD,
    GOOD,
    quality_of_halves,
    quality_of_pieces,
)
from urban_processing.parcelling.rings import changes, ranges
from urban_processing.site import AREA_ROUNDING

SHARES = np.array([1 / 2, 1 / 3, 2 / 3])
"""Shares of the area before the cut that are tried where the regular cut will not do."""

SNAPPED_ALONG, ALONG, SNAPPED_ACROSS, ACROSS, BY_SHARE = range(5)
"""Order in which cuts are preferred; those by shares alternate between both axes."""


@dataclass(frozen=True, eq=False)
class Halved:
    """Faces that were halved: the `rows` (H,), the pieces by place in `rows`, and the cuts."""

    rows: IntArray
    cut: Cut
    lines: Lines


@dataclass(frozen=True, eq=False)
class _Options:
    """C cuts that may be made.

    Of which face, where along its axis, if along the other axis, which are preferred, and
    how good they are as far as is known.
    """

    row: IntArray
    place: FloatArray
    turned: BoolArray
    order: IntArray
    quality: IntArray

    def best(self, left: BoolArray) -> IntArray:
        """Return the best option of each face that is left and has one, in order of faces."""
        usable = ((self.quality < BAD) & left[self.row]).nonzero()[0]
        row = self.row[usable]
        order = np.lexsort((self.order[usable], self.quality[usable], row))
        return usable[order[changes(row[order])]]

    def called(self, rows: IntArray) -> _Options:
        """Return the options of faces that are called otherwise."""
        return replace(self, row=rows[self.row])

    def lacking(self, left: BoolArray) -> IntArray:
        """Return the faces left that have no option which keeps all bounds."""
        lacks = left.copy()
        lacks[self.row[self.quality == GOOD]] = False
        return lacks.nonzero()[0]


def halve(faces: Faces, xy: FloatArray, contour: Contour) -> list[Halved]:
    """Halve faces by the first cut that keeps all bounds; those that have none are left out.

    In order of preference: the regular cut through a corner of the contour, where one is near;
    the regular cut; these two along the other axis; cuts at half of the area along both axes,
    and at other shares of it. A cut will do if its pieces keep `least` and `min_width` and,
    where access is needed, have it, and have fronts for all the parcels they will become. If none
    will, the first is made whose pieces keep `least` and `narrowest` and have access.
    """
    left = np.ones(len(faces), dtype=bool)
    along = view_along(faces, xy, contour, turned=~left)
    options = _judged(along, left.nonzero()[0], along.snapped, SNAPPED_ALONG, contour)
    more = [(left.copy(), _second_options), (left.copy(), _last_options)]
    done = []
    while left.any():
        for untold, others in more:
            lacking = options.lacking(left & untold)
            if len(lacking):
                untold[lacking] = False
                options = _joined([options, *others(along.take(lacking), lacking, xy, contour)])
        best = options.best(left)
        if not len(best):
            break
        part = _made(faces, options, best, xy, contour)
        left[part.rows] = False
        done.append(part)
    return [part for part in done if len(part.rows)]


def _second_options(
    along: View, rows: IntArray, xy: FloatArray, contour: Contour
) -> list[_Options]:
    """Judge regular cuts, but for the first; `rows`: what the faces of the view are called."""
    everyone = np.arange(len(rows))
    across = view_along(along.faces, xy, contour, turned=everyone >= 0)
    found = [_judged(across, everyone, across.snapped, SNAPPED_ACROSS, contour)]
    for view, order in ((along, ALONG), (across, ACROSS)):
        moved = (np.abs(view.regular - view.snapped) > TOUCH).nonzero()[0]
        if len(moved):
            found.append(_judged(view, moved, view.regular[moved], order, contour))
    return [part.called(rows) for part in found]


def _last_options(along: View, rows: IntArray, xy: FloatArray, contour: Contour) -> list[_Options]:
    """Judge cuts by shares of the area; `rows`: what the faces of the view are called."""
    k, n = len(rows), len(SHARES)
    twice = along.faces.take(np.tile(np.arange(k), 2))
    turned = np.arange(2 * k) >= k
    both = view_along(twice, xy, contour, turned=turned)
    row, share = np.tile(np.arange(2 * k), n), np.repeat(SHARES, 2 * k)
    order = BY_SHARE + 2 * np.repeat(np.arange(n), 2 * k) + np.tile(turned, n)
    place = both.at_shares(row, share)
    return [_judged(both, row, place, order, contour).called(np.tile(rows, 2))]


def _judged(
    view: View, row: IntArray, place: FloatArray, order: int | IntArray, contour: Contour
) -> _Options:
    """Judge cuts by what lies on both sides of the line."""
    if len(row) == len(view.faces) and (row[1:] > row[:-1]).all():
        faces, sweep = view.faces, view.sweep
    else:
        faces, sweep = view.faces.take(row), view.sweep.take(row)
    n = len(row)
    return _Options(
        row=row,
        place=place,
        turned=view.turned[row],
        order=np.broadcast_to(np.asarray(order), n),
        quality=quality_of_halves(faces, sweep, place, contour),
    )


def _joined(parts: list[_Options]) -> _Options:
    return _Options(
        *(
            np.concatenate([getattr(part, name) for part in parts])
            for name in ("row", "place", "turned", "order", "quality")
        )
    )


def _made(
    faces: Faces, options: _Options, chosen: IntArray, xy: FloatArray, contour: Contour
) -> Halved:
    """Make cuts, unless the pieces turn out worse than the sides of the line; that is noted."""
    row, turned = options.row[chosen], options.turned[chosen]
    copies = faces if len(row) == len(faces) else faces.take(row)
    boxes = copies.boxes.turned(turned) if turned.any() else copies.boxes
    lines = Lines(boxes.centre + options.place[chosen][:, None] * boxes.axis, boxes.axis)
    made = cut(copies.rings, xy, lines)
    points = np.concatenate([xy, made.added])
    quality = options.quality[chosen]
    count = np.bincount(made.parent, minlength=len(row))
    several = (count > 2).nonzero()[0]
    if len(several):
        found = quality_of_pieces(copies.take(several), _pieces_of(made, several), points, contour)
        quality[several] = np.maximum(quality[several], found)
    flawed = made.pieces.areas(points) < copies.least[made.parent] * (1.0 - AREA_ROUNDING)
    flawed |= ~made.pieces.are_valid(points)
    quality[made.parent[flawed]] = BAD
    quality[count < 2] = BAD
    as_said = quality == options.quality[chosen]
    options.quality[chosen] = quality
    if as_said.all():
        return Halved(row, made, lines)
    kept = as_said.nonzero()[0]
    return Halved(row[kept], _pieces_of(made, kept), Lines(lines.point[kept], lines.normal[kept]))


def _pieces_of(made: Cut, faces: IntArray) -> Cut:
    """Return the pieces of some of the faces that were cut, these numbered anew."""
    first = np.searchsorted(made.parent, faces)
    count = np.searchsorted(made.parent, faces, side="right") - first
    picked = made.select(ranges(first, count))
    parent = np.repeat(np.arange(len(faces)), count)
    return Cut(picked.pieces, parent, picked.added, picked.n_vertices)
