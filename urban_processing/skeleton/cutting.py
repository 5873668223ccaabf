"""Faces of a straight skeleton up to a depth, and the patios that lie deeper."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.errors import ParameterError
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import FINE_GRID
from urban_processing.skeleton.model import Skeleton

LEVEL = 2.0**-19
"""Distance in metres within which a node is on the offset contour."""


def cut_at_depth(
    skeleton: Skeleton, depth: float
) -> tuple[Skeleton, tuple[tuple[IntArray, ...], ...]]:
    """Cut the faces of a skeleton off at a distance from the contour.

    Parameters
    ----------
    skeleton
        The straight skeleton of a polygon.
    depth
        Distance in metres, positive; infinite for no cut.

    Returns
    -------
    skeleton
        The faces up to that depth; new vertices, on `FINE_GRID`, follow the nodes that are left.
    patios
        What lies deeper, inside the offset contour: for each part its rings of vertices, the
        shell first, which is counter-clockwise, holes clockwise. Faces and patios tile the
        polygon and share vertices by index.

    Raises
    ------
    ParameterError
        The depth is not positive.

    References
    ----------
    C. A. Vanegas et al. (2012), section 4.2.1: the roof model cut by a level plane.
    """
    if not depth > 0:
        raise ParameterError(f"The depth of rows of parcels must be positive, not {depth:g} m.")
    if depth >= float(skeleton.height.max()) - LEVEL:
        return skeleton, ()
    cut = _Cut(skeleton, depth)
    faces = [cut.clipped(face.tolist()) for face in skeleton.faces]
    old = np.flatnonzero(np.array(cut.side[: len(skeleton.xy)]) <= 0)
    number = dict(zip(old.tolist(), range(len(old)), strict=True))
    new = sorted({k for face in faces for k in face} - number.keys())
    number.update(zip(new, range(len(old), len(old) + len(new)), strict=True))
    xy = np.array(cut.xy)[[*old, *new]]
    height = np.append(skeleton.height[old], np.full(len(new), depth))
    patios = _patios(xy, [(number[b], number[a]) for a, b in cut.level])
    lower = tuple(np.array([number[k] for k in face]) for face in faces)
    return Skeleton(xy, height, lower, skeleton.edge_face, skeleton.following), patios


class _Cut:
    """Clips faces at a depth; `level` collects the edges that makes, in the order of the face."""

    def __init__(self, skeleton: Skeleton, depth: float) -> None:
        self.depth = depth
        self.xy: list[tuple[float, float]] = [(x, y) for x, y in skeleton.xy.tolist()]
        self.height: list[float] = skeleton.height.tolist()
        self.at = {place: k for k, place in enumerate(self.xy)}
        self.crossing: dict[tuple[int, int], int] = {}
        self.level: list[tuple[int, int]] = []
        above = self.height
        # nodes about as high are part of the offset contour themselves
        self.side = [0 if abs(h - depth) <= LEVEL else math.copysign(1, h - depth) for h in above]
        n = len(skeleton.edge_face)
        self.side[:n] = [-1] * n

    def clipped(self, ring: list[int]) -> list[int]:
        """Return the part of a face up to the depth; it is one piece and has no hole."""
        side = self.side
        if all(side[k] <= 0 for k in ring):
            return ring
        # None stands for what is left out; the first vertex is one of the contour
        kept: list[int | None] = []
        for u, v in zip(ring, [*ring[1:], ring[0]], strict=True):
            kept.append(u if side[u] <= 0 else None)
            if side[u] * side[v] < 0:
                kept.append(self._crossing(u, v))
        below = [ring[0]]
        gap = False
        for k in [*kept[1:], ring[0]]:
            if k is None:
                gap = True
                continue
            if k != below[-1]:
                if gap:
                    self.level.append((below[-1], k))
                below.append(k)
            gap = False
        return below[:-1]

    def _crossing(self, u: int, v: int) -> int:
        """Return the vertex where an arc is as high as the depth."""
        low, high = (u, v) if self.height[u] < self.height[v] else (v, u)
        found = self.crossing.get((low, high))
        if found is None:
            share = (self.depth - self.height[low]) / (self.height[high] - self.height[low])
            place = tuple(
                round((a + share * (b - a)) / FINE_GRID) * FINE_GRID
                for a, b in zip(self.xy[low], self.xy[high], strict=True)
            )
            found = self.at.setdefault((place[0], place[1]), len(self.xy))
            if found == len(self.xy):
                self.xy.append((place[0], place[1]))
                self.side.append(0)
            self.crossing[low, high] = found
        return found


def _patios(xy: FloatArray, edges: list[tuple[int, int]]) -> tuple[tuple[IntArray, ...], ...]:
    """Return the polygons whose boundary edges are, with their inside to the left."""
    rings = [np.array(ring) for ring in _simple_rings(xy, edges)]
    polygons = shapely.polygons([shapely.linearrings(xy[ring]) for ring in rings])
    is_hole = [not shapely.is_ccw(polygon.exterior) for polygon in polygons]
    shells = [k for k, hole in enumerate(is_hole) if not hole]
    patios = {k: [rings[k]] for k in shells}
    for k, hole in enumerate(is_hole):
        if hole:
            # a hole may touch its shell
            inside = shapely.area(shapely.intersection(polygons[shells], polygons[k]))
            patios[shells[int(np.argmax(inside))]].append(rings[k])
    return tuple(tuple(patio) for patio in patios.values())


def _simple_rings(xy: FloatArray, edges: list[tuple[int, int]]) -> list[list[int]]:
    """Return rings that directed edges make; where they touch themselves they are parted."""
    after: dict[int, list[int]] = {}
    for a, b in edges:
        after.setdefault(a, []).append(b)
    rings = []
    for first in after:
        path = [first]
        while after[path[-1]]:
            choice = after[path[-1]]
            node = choice.pop(_turn(xy, path, choice))
            if node not in path:
                path.append(node)
                continue
            ring = path[path.index(node) :]
            path = path[: path.index(node) + 1]
            if len(ring) > 2:
                rings.append(ring)
    return rings


def _turn(xy: FloatArray, path: list[int], choice: list[int]) -> int:
    """Return which edge bounds the same land as the one that led to a vertex: the leftmost."""
    if len(choice) == 1 or len(path) == 1:
        return 0
    back = xy[path[-2]] - xy[path[-1]]
    begin = math.atan2(back[1], back[0])
    ways = [xy[k] - xy[path[-1]] for k in choice]
    turns = [(begin - math.atan2(way[1], way[0])) % (2 * math.pi) for way in ways]
    return int(np.argmin(turns))
