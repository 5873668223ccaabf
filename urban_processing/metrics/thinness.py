"""Thinness of parcels: the largest circle that fits in, relative to the area."""

from __future__ import annotations

from itertools import combinations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray

CIRCLE_TOLERANCE = 0.004
OUTLINE_TOLERANCE = 0.003
"""Accuracy of the inscribed circle and of the outline it is fitted to, relative to √area."""

MOST_SIDES = 6
"""Circles of convex outlines with so many sides or fewer are worked out exactly."""

FITS = 1e-9
"""A circle may overlap a side by this share of √area."""


def inscribed_thinness(polygons: npt.NDArray[np.object_], area: FloatArray) -> FloatArray:
    """Diameter of the largest inscribed circle over √area, within about 1 %.

    The outline is simplified first, by less than the accuracy asked for. The circle of a convex
    outline touches three of its sides: all of them are tried, for all parcels at once. Other
    outlines are searched for the place that is farthest from the boundary, which takes a hundred
    times as long.
    """
    side = np.sqrt(area)
    outline = np.asarray(shapely.simplify(polygons, OUTLINE_TOLERANCE * side), dtype=object)
    radius = np.full(len(outline), np.nan)
    plain = shapely.get_num_interior_rings(outline) == 0
    count = np.where(plain, shapely.get_num_coordinates(outline) - 1, 0)
    for k in range(3, MOST_SIDES + 1):
        rows = np.flatnonzero(count == k)
        if len(rows):
            xy = shapely.get_coordinates(outline[rows]).reshape(-1, k + 1, 2)[:, :k]
            radius[rows] = _largest_radius((xy - xy[:, :1]) / side[rows, None, None])
    left = np.isnan(radius)
    circles = shapely.maximum_inscribed_circle(outline[left], CIRCLE_TOLERANCE * side[left])
    radius[left] = shapely.length(circles) / side[left]
    return np.asarray(2.0 * radius)


def _largest_radius(xy: FloatArray) -> FloatArray:
    """(n,) radius of the largest circle in each of (n, k, 2) rings; NaN where one is not convex."""
    edge = np.roll(xy, -1, axis=1) - xy
    turn = _cross(edge, np.roll(edge, -1, axis=1))
    convex = (turn >= 0).all(axis=1) | (turn <= 0).all(axis=1)
    sense = np.sign(turn.sum(axis=1))[:, None, None]
    normal = sense * np.stack([-edge[..., 1], edge[..., 0]], axis=-1)
    normal = normal / np.hypot(edge[..., 0], edge[..., 1])[..., None]
    offset = (normal * xy).sum(axis=-1)
    best = np.full(len(xy), np.nan)
    rows = np.flatnonzero(convex)
    best[rows] = 0.0
    for triple in combinations(range(xy.shape[1]), 3):
        found, fits = _touching(normal[rows], offset[rows], list(triple))
        best[rows] = np.where(fits, np.maximum(best[rows], found), best[rows])
    return best


def _touching(
    normal: FloatArray, offset: FloatArray, triple: list[int]
) -> tuple[FloatArray, BoolArray]:
    """Radius of the circle that touches three sides of each ring, and whether it fits in."""
    n, c = normal[:, triple], offset[:, triple]
    # two differences of n·x - r = c leave a system for the centre
    a, b = n[:, 0] - n[:, 2], n[:, 1] - n[:, 2]
    p, q = c[:, 0] - c[:, 2], c[:, 1] - c[:, 2]
    det = _cross(a, b)
    sound = np.abs(det) > FITS
    safe = np.where(sound, det, 1.0)
    x = np.stack([(p * b[:, 1] - q * a[:, 1]) / safe, (q * a[:, 0] - p * b[:, 0]) / safe], axis=-1)
    distance = (normal * x[:, None]).sum(axis=-1) - offset
    radius = distance[:, triple[2]]
    return radius, sound & (distance >= radius[:, None] - FITS).all(axis=1)


def _cross(a: FloatArray, b: FloatArray) -> FloatArray:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])
