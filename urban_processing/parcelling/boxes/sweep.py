"""Lines swept over many polygons at once: how much area lies behind each, and where it must be."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.parcelling.boxes.oriented import Boxes
from urban_processing.parcelling.rings import Rings, ranges

AREA_PRECISION = 1e-12
"""Share of a face's area to which the place of a line is found."""

MAX_STEPS = 60


@dataclass(frozen=True, eq=False)
class Sweep:
    """Lines across the axes of boxes, each moved over a face; places count from the centres.

    Parameters
    ----------
    rings
        Rings of K faces.
    along, across
        (N,) places of their vertices along the axis, and to the left of it.
    """

    rings: Rings
    along: FloatArray
    across: FloatArray

    def take(self, faces: IntArray) -> Sweep:
        """Return the sweep over some of the faces."""
        first = self.rings.face_nodes[faces]
        node = ranges(first, self.rings.face_nodes[faces + 1] - first)
        return Sweep(self.rings.take(faces), self.along[node], self.across[node])

    @cached_property
    def _count(self) -> IntArray:
        """(K,) number of vertices of each face."""
        return self.rings.face_nodes[1:] - self.rings.face_nodes[:-1]

    @cached_property
    def _edges(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Where edges end, and how they slope against the axis."""
        after = self.rings.following
        end = self.along[after]
        run = end - self.along
        flat = run == 0.0
        slope = (self.across[after] - self.across) / np.where(flat, 1.0, run)
        return end, run, np.where(flat, 0.0, slope)

    def areas(self, place: FloatArray) -> FloatArray:
        """(K,) area of each face before the line at `place`."""
        end, _, slope = self._edges
        at = place.repeat(self._count)
        a, b = np.minimum(self.along, at), np.minimum(end, at)
        height = self.across + (0.5 * (a + b) - self.along) * slope
        return np.asarray(-np.add.reduceat((b - a) * height, self.rings.face_nodes[:-1]))

    def spans(self, place: FloatArray) -> FloatArray:
        """(K,) length of each line within its face."""
        end, run, slope = self._edges
        at = place.repeat(self._count)
        crosses = (self.along <= at) != (end <= at)
        height = np.where(crosses, self.across + (at - self.along) * slope, 0.0)
        return np.asarray(-np.add.reduceat(np.sign(run) * height, self.rings.face_nodes[:-1]))

    def places(self, area: FloatArray, start: FloatArray) -> FloatArray:
        """(K,) place of the line before which `area` lies, searched from `start` on.

        Newton's method; where it leaves the bracket the bracket is halved.
        """
        node = self.rings.face_nodes[:-1]
        low = np.minimum.reduceat(self.along, node)
        high = np.maximum.reduceat(self.along, node)
        whole = self.areas(high)
        place = np.clip(start, low, high)
        for _ in range(MAX_STEPS):
            miss = self.areas(place) - area
            done = np.abs(miss) <= AREA_PRECISION * whole
            if done.all():
                break
            low = np.where(miss < 0, place, low)
            high = np.where(miss > 0, place, high)
            span = self.spans(place)
            step = place - miss / np.where(span > 0, span, np.inf)
            inside = (span > 0) & (step > low) & (step < high)
            place = np.where(done, place, np.where(inside, step, 0.5 * (low + high)))
        return place


def sweep_along(rings: Rings, xy: FloatArray, boxes: Boxes) -> Sweep:
    """Sweep lines along the axes of the faces' boxes."""
    face = rings.edge_face
    at = xy[rings.vertex] - boxes.centre[face]
    axis = boxes.axis[face]
    return Sweep(
        rings=rings,
        along=at[:, 0] * axis[:, 0] + at[:, 1] * axis[:, 1],
        across=at[:, 1] * axis[:, 0] - at[:, 0] * axis[:, 1],
    )
