"""The contour of a polygon as the lines that a wavefront starts from."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urban_processing.errors import TopologyError
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.mesh.touches import cycles, turns_at_touches

STRAIGHT = 2.0**-20
"""Distance in metres within which vertices between two others are on one straight edge with
them: what rounding to the grid of all coordinates moves a point by."""

EXACTLY_STRAIGHT = 1e-12
"""Sine of the bend of two edges that are one even among many."""

NO_RING = "A ring of a block has fewer than three corners: repair the block or leave it out."


@dataclass(frozen=True, eq=False)
class Contour:
    """Merged edges of a polygon's rings, M in all, in coordinates that the result does not show.

    Rings are those that bound the land (`turns_at_touches`), taken from their lowest vertex on and
    in the order of these, so that nothing depends on where a ring begins.

    Parameters
    ----------
    origin
        Where the coordinates below lie on the map of the caller.
    size
        Largest extent in metres.
    x, y
        (M,) first vertex of each merged edge: the corners.
    dx, dy
        (M,) direction of each, of unit length.
    c
        (M,) ``-dy * x + dx * y`` of the points on it: their distance to the left of the origin.
    following, previous
        (M,) next and last merged edge in the ring.
    run
        (M,) vertices of each merged edge in the order of the caller, both ends included.
    after
        (N,) next vertex after each of the caller's, as `turns_at_touches` says.
    """

    origin: tuple[float, float]
    size: float
    x: list[float]
    y: list[float]
    dx: list[float]
    dy: list[float]
    c: list[float]
    following: list[int]
    previous: list[int]
    run: list[list[int]]
    after: list[int]

    def __len__(self) -> int:
        """Return the number of merged edges."""
        return len(self.x)


def contour_of(xy: FloatArray, offsets: IntArray, straight: float) -> Contour:
    """Merge collinear edges of the rings of one polygon, the shell counter-clockwise.

    Parameters
    ----------
    xy
        (N, 2) vertices of the rings.
    offsets
        (R + 1,) where rings begin.
    straight
        Distance in metres within which vertices are on one straight edge. Where it is more than
        `STRAIGHT`, shorter edges belong to those before them, whatever their direction.

    Raises
    ------
    TopologyError
        A ring is less than a triangle, or two of its vertices in a row are the same.
    """
    if len(xy) < 3:
        raise TopologyError(NO_RING)
    low, high = xy.min(axis=0), xy.max(axis=0)
    # the middle in whole metres, so that nothing is lost to the shift
    origin = np.floor((low + high) / 2)
    points = [(x, y) for x, y in (xy - origin).tolist()]
    after = turns_at_touches(points, offsets.tolist())

    def begin(k: int) -> tuple[tuple[float, float], tuple[float, float]]:
        return points[k], points[after[k]]

    rings = []
    for ring in cycles(after):
        start = min(range(len(ring)), key=lambda k: begin(ring[k]))
        rings.append(ring[start:] + ring[:start])
    rings.sort(key=lambda ring: begin(ring[0]))
    runs: list[list[int]] = []
    following: list[int] = []
    for ring in rings:
        new = _runs(points, ring, straight)
        first = len(runs)
        following += [*range(first + 1, first + len(new)), first]
        runs += new
    place = ((float(origin[0]), float(origin[1])), float((high - low).max()))
    return _lines(points, runs, following, place, after)


def _lines(
    points: list[tuple[float, float]],
    runs: list[list[int]],
    following: list[int],
    place: tuple[tuple[float, float], float],
    turns: list[int],
) -> Contour:
    """Return the lines of runs of vertices; `place` is the origin and the extent."""
    previous = [0] * len(runs)
    for e, after in enumerate(following):
        previous[after] = e
    x, y = ([points[run[0]][axis] for run in runs] for axis in (0, 1))
    dx, dy, c = [], [], []
    for x0, y0, after in zip(x, y, following, strict=True):
        x1, y1 = x[after], y[after]
        length = math.hypot(x1 - x0, y1 - y0)
        ux, uy = (x1 - x0) / length, (y1 - y0) / length
        dx.append(ux)
        dy.append(uy)
        # the mean of both ends, so that a mirrored edge has the mirrored line
        c.append(((ux * y0 - uy * x0) + (ux * y1 - uy * x1)) / 2)
    origin, size = place
    return Contour(origin, size, x, y, dx, dy, c, following, previous, runs, turns)


def _runs(
    points: list[tuple[float, float]],
    ring: list[int],
    straight: float,
) -> list[list[int]]:
    """Return the vertices of each merged edge of a ring, both ends included."""
    n = len(ring)
    at = [points[k] for k in ring]
    bend = [_bend(a, b, c) for a, b, c in zip(at[-1:] + at[:-1], at, at[1:] + at[:1], strict=True)]
    exact = [abs(sine) <= EXACTLY_STRAIGHT and ahead for sine, _, ahead in bend]
    near = [distance <= straight and ahead for _, distance, ahead in bend]
    corners = [k for k in range(n) if not near[k]]
    cut = []
    for a, b in zip(corners, [*corners[1:], *(k + n for k in corners[:1])], strict=True):
        cut.append(a)
        between = [ring[k % n] for k in range(a, b + 1)]
        # many slight bends in a row are a curve
        if not _is_straight(points, between, straight):
            cut += [k % n for k in range(a + 1, b) if not exact[k % n]]
    cut = sorted(cut) if corners else [k for k in range(n) if not exact[k]]
    if straight > STRAIGHT:
        ends = cut[1:] + cut[:1]
        cut = [a for a, b in zip(cut, ends, strict=True) if math.dist(at[a], at[b]) > straight]
    if len(cut) < 3:
        raise TopologyError(NO_RING)
    ends = [*cut[1:], cut[0] + n]
    return [[ring[k % n] for k in range(a, b + 1)] for a, b in zip(cut, ends, strict=True)]


def _bend(
    a: tuple[float, float], b: tuple[float, float], c: tuple[float, float]
) -> tuple[float, float, bool]:
    """Return the sine of the bend at b, its distance from the line a-c, and whether it goes on."""
    ux, uy, vx, vy = b[0] - a[0], b[1] - a[1], c[0] - b[0], c[1] - b[1]
    u, v = math.hypot(ux, uy), math.hypot(vx, vy)
    if u == 0 or v == 0:
        raise TopologyError(
            "Two vertices in a row are the same in a ring of a block: remove repeated points."
        )
    cross, dot = ux * vy - uy * vx, ux * vx + uy * vy
    return cross / (u * v), abs(cross) / max(math.hypot(ux + vx, uy + vy), 1e-300), dot > 0


def _is_straight(points: list[tuple[float, float]], run: list[int], straight: float) -> bool:
    """Tell whether the inner vertices of a run lie on the line between its ends."""
    if len(run) == 2:
        return True
    (x0, y0), (x1, y1) = points[run[0]], points[run[-1]]
    length = math.hypot(x1 - x0, y1 - y0)
    if length == 0:
        return False
    return all(
        abs((x1 - x0) * (points[k][1] - y0) - (y1 - y0) * (points[k][0] - x0)) <= straight * length
        for k in run[1:-1]
    )
