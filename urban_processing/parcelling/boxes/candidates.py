"""Where a face may be cut: places along the axes of its box."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.boxes.line_cuts import TOUCH
from urban_processing.parcelling.boxes.oriented import Boxes
from urban_processing.parcelling.boxes.sweep import Sweep, sweep_along
from urban_processing.parcelling.rings import Rings, changes
from urban_processing.site import AREA_ROUNDING

CLEAR_OF_LEAST = 1e-6
"""Share by which cuts moved to keep the smallest area stay clear of it."""

WITHIN_HOLE = 0.2
"""A cut through a hole stays away from its ends by this share of the hole's extent."""


@dataclass(frozen=True, eq=False)
class Contour:
    """What is known of vertices and edges of the ground; those added later come after them.

    Parameters
    ----------
    is_corner
        (N + 1,) whether the contour bends at a vertex; the last is for all others.
    is_access
        (N + 1,) whether an edge is a street side; the last is for cuts.
    """

    is_corner: BoolArray
    is_access: BoolArray

    def corners(self, vertex: IntArray) -> BoolArray:
        """Return which vertices are corners of the contour."""
        return self.is_corner[np.minimum(vertex, len(self.is_corner) - 1)]

    def access(self, segment: IntArray) -> BoolArray:
        """Return which edges are street sides, from their segments."""
        return self.is_access[np.minimum(segment, len(self.is_access) - 1)]


@dataclass(frozen=True, eq=False)
class Faces:
    """K faces that are to be halved, and what holds for each.

    Parameters
    ----------
    rings, boxes
        Their rings and their smallest boxes.
    area
        (K,) in m².
    least, largest
        (K,) smallest area of a piece, and the largest that is not halved again.
    min_width, snap
        (K,) smallest width, and distance within which cuts go through corners.
    narrowest
        (K,) width that pieces may have if `min_width` cannot be kept.
    shift
        (K,) distance in metres by which a cut is moved along the axis it halves.
    needs_access
        (K,) faces of which each piece must be reached by street.
    """

    rings: Rings
    boxes: Boxes
    area: FloatArray
    least: FloatArray
    largest: FloatArray
    min_width: FloatArray
    snap: FloatArray
    narrowest: FloatArray
    shift: FloatArray
    needs_access: BoolArray

    def __len__(self) -> int:
        """Return the number of faces."""
        return len(self.area)

    def take(self, rows: IntArray) -> Faces:
        """Return some of the faces."""
        return Faces(
            rings=self.rings.take(rows),
            boxes=self.boxes.take(rows),
            area=self.area[rows],
            least=self.least[rows],
            largest=self.largest[rows],
            min_width=self.min_width[rows],
            snap=self.snap[rows],
            narrowest=self.narrowest[rows],
            shift=self.shift[rows],
            needs_access=self.needs_access[rows],
        )


@dataclass(frozen=True, eq=False)
class View:
    """Faces along one axis of their boxes, and where the regular cut across it goes.

    Parameters
    ----------
    faces, sweep
        The faces, and lines swept over them.
    regular
        (K,) the middle, moved, with the smallest area on both sides.
    snapped
        (K,) the same through a corner of the contour where one is near.
    turned
        (K,) whether the axis is the other one.
    """

    faces: Faces
    sweep: Sweep
    regular: FloatArray
    snapped: FloatArray
    turned: BoolArray

    def take(self, rows: IntArray) -> View:
        """Return the view of some of the faces."""
        return View(
            faces=self.faces.take(rows),
            sweep=self.sweep.take(rows),
            regular=self.regular[rows],
            snapped=self.snapped[rows],
            turned=self.turned[rows],
        )

    def at_shares(self, rows: IntArray, shares: FloatArray) -> FloatArray:
        """Places with shares of the area before them, or as near as the smallest area allows.

        `rows`: the face of each; where a face comes up several times, so do its places.
        """
        if not len(rows):
            return np.empty(0)
        faces, sweep = self.faces.take(rows), self.sweep.take(rows)
        least = _clear_of_least(faces)
        wanted = np.minimum(np.maximum(shares * faces.area, least), faces.area - least)
        return _through_holes(faces, sweep, sweep.places(wanted, np.zeros(len(rows))))


def view_along(faces: Faces, xy: FloatArray, contour: Contour, *, turned: BoolArray) -> View:
    """Look at faces along the axes of their boxes; where `turned` (K,), along the other ones."""
    boxes = faces.boxes.turned(turned) if turned.any() else faces.boxes
    sweep = sweep_along(faces.rings, xy, boxes)
    regular = _regular(faces, sweep)
    return View(faces, sweep, regular, _snapped(faces, sweep, regular, contour), turned)


def _regular(faces: Faces, sweep: Sweep) -> FloatArray:
    place = _through_holes(faces, sweep, faces.shift)
    area = sweep.areas(place)
    least = _clear_of_least(faces)
    wanted = np.minimum(np.maximum(area, least), faces.area - least)
    off = ((wanted != area) & (faces.rings.n_rings == 1)).nonzero()[0]
    if len(off):
        place = place.copy()
        place[off] = sweep.take(off).places(wanted[off], place[off])
    return place


def _clear_of_least(faces: Faces) -> FloatArray:
    return np.minimum(faces.least * (1.0 + CLEAR_OF_LEAST), 0.5 * faces.area)


def _snapped(faces: Faces, sweep: Sweep, place: FloatArray, contour: Contour) -> FloatArray:
    """Move places to the nearest corner of the contour, where that is near enough.

    Not where one side would be too small, nor in faces with holes.
    """
    first = faces.rings.face_nodes
    count = first[1:] - first[:-1]
    away = np.abs(sweep.along - place.repeat(count))
    near = contour.corners(faces.rings.vertex) & (away <= faces.snap.repeat(count))
    if not near.any():
        return place
    steps = np.where(near, np.round(away / TOUCH), np.inf)
    least = np.minimum.reduceat(steps, first[:-1]).repeat(count)
    nearest = np.where(near & (steps <= least), sweep.along, np.inf)
    corner = np.minimum.reduceat(nearest, first[:-1])
    moved = np.isfinite(corner) & (faces.rings.n_rings == 1)
    area = sweep.areas(np.where(moved, corner, place))
    floor = faces.least * (1.0 - AREA_ROUNDING)
    moved &= (area >= floor) & (faces.area - area >= floor)
    return np.where(moved, corner, place)


def _through_holes(faces: Faces, sweep: Sweep, place: FloatArray) -> FloatArray:
    """Move places so that cuts go through the nearest hole of faces with holes."""
    rings = faces.rings
    if (rings.n_rings == 1).all():
        return place
    hole = np.flatnonzero(~rings.is_shell)
    begin = rings.offsets[:-1]
    low = np.minimum.reduceat(sweep.along, begin)[hole]
    high = np.maximum.reduceat(sweep.along, begin)[hole]
    face = rings.face[hole]
    margin = WITHIN_HOLE * (high - low)
    moved = np.clip(place[face], low + margin, high - margin)
    way = np.round(np.abs(moved - place[face]) / TOUCH)
    order = np.lexsort((moved, way, face))
    nearest = order[np.flatnonzero(changes(face[order]))]
    out = place.copy()
    out[face[nearest]] = moved[nearest]
    return out
