"""Faces of a straight skeleton from the arcs of its wavefront, and the proof that they are ones."""

from __future__ import annotations

import math

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.skeleton.contour import Contour
from urban_processing.skeleton.wavefront import Arcs, Unresolved

SAME_PLACE = 2.0**-18
"""Distance in metres by which the lines of the faces of two nodes may miss one place that stands
for both. On contours whose vertices are rounded to the grid of all coordinates, events that are
meant to be one are parted by so much."""

SHORT = 2.0**-7
"""Length in metres of arcs whose ends may be one place: lines cross at low angles."""

HEIGHT_TOLERANCE = 2.0**-15
"""Distance in metres by which a node may miss its height over an edge."""

FLAT = 1e-10
"""Determinant of normal equations below which lines do not tell where they meet."""


def contracted(contour: Contour, arcs: Arcs) -> list[int]:
    """Return the node that stands for each one where nodes that are meant to be one are joined.

    Parameters
    ----------
    contour
        The merged edges.
    arcs
        What the wavefront traced.
    """
    m = len(contour)
    group = list(range(len(arcs.x)))
    length = [
        math.hypot(arcs.x[a] - arcs.x[b], arcs.y[a] - arcs.y[b])
        for a, b in zip(arcs.start, arcs.end, strict=True)
    ]
    short = [k for k, s in enumerate(length) if s < SHORT and arcs.start[k] >= m]
    if not short:
        return group
    edges = _edges_of_nodes(arcs, group)

    def find(node: int) -> int:
        while group[node] != node:
            node = group[node]
        return node

    for k in sorted(short, key=lambda k: length[k]):
        a, b = sorted((find(arcs.start[k]), find(arcs.end[k])))
        if a == b:
            continue
        both = edges[a] | edges[b]
        x, y, t = _balanced(contour, sorted(both), (arcs.x[a], arcs.y[a], arcs.t[a]))
        if all(
            abs(contour.dx[e] * y - contour.dy[e] * x - contour.c[e] - t) <= SAME_PLACE
            for e in both
        ):
            group[b] = a
            edges[a] = both
    return [find(node) for node in range(len(group))]


def refined(contour: Contour, arcs: Arcs, group: list[int]) -> Arcs:
    """Put each node where its distances to the lines of all its faces agree best.

    Parameters
    ----------
    contour
        The merged edges.
    arcs
        What the wavefront traced.
    group
        (V,) for each node the one that stands for it.
    """
    m = len(contour)
    x, y, t = list(arcs.x), list(arcs.y), list(arcs.t)
    for node, around in _edges_of_nodes(arcs, group).items():
        if node >= m:
            place = _balanced(contour, sorted(around), (x[node], y[node], t[node]))
            x[node], y[node], t[node] = place
    return Arcs(x, y, t, arcs.start, arcs.end, arcs.left, arcs.right)


def _edges_of_nodes(arcs: Arcs, group: list[int]) -> dict[int, set[int]]:
    """Return the merged edges whose faces meet at each node."""
    edges: dict[int, set[int]] = {}
    for ends in (arcs.start, arcs.end):
        for node, left, right in zip(ends, arcs.left, arcs.right, strict=True):
            edges.setdefault(group[node], set()).update((left, right))
    return edges


def _balanced(
    contour: Contour, edges: list[int], place: tuple[float, float, float]
) -> tuple[float, float, float]:
    """Return place and time where the misfit to the lines of edges is least (normal equations)."""
    x, y, t = place
    xx = xy = yy = xt = yt = rx = ry = rt = 0.0
    for e in edges:
        nx, ny = -contour.dy[e], contour.dx[e]
        miss = nx * x + ny * y - contour.c[e] - t
        xx += nx * nx
        xy += nx * ny
        yy += ny * ny
        xt -= nx
        yt -= ny
        rx -= nx * miss
        ry -= ny * miss
        rt += miss
    tt = float(len(edges))
    # cofactors of the symmetric 3 x 3 matrix
    a, b, c = yy * tt - yt * yt, xt * yt - xy * tt, xy * yt - yy * xt
    det = xx * a + xy * b + xt * c
    if det < FLAT:
        return place
    d, e2, f = xx * tt - xt * xt, xy * xt - xx * yt, xx * yy - xy * xy
    return (
        x + (a * rx + b * ry + c * rt) / det,
        y + (b * rx + d * ry + e2 * rt) / det,
        t + (c * rx + e2 * ry + f * rt) / det,
    )


def rings_of_faces(contour: Contour, arcs: Arcs, group: list[int]) -> list[list[int]]:
    """Return the ring of nodes of each merged edge's face, from both ends of the edge on.

    Raises
    ------
    Unresolved
        The arcs of an edge do not make one ring that passes each node once.
    """
    after: list[dict[int, int]] = [{} for _ in range(len(contour))]
    for start, end, left, right in zip(arcs.start, arcs.end, arcs.left, arcs.right, strict=True):
        a, b = group[start], group[end]
        if a == b:
            continue
        if a in after[left] or b in after[right]:
            raise Unresolved
        after[left][a] = b
        after[right][b] = a
    rings = []
    for e, follow in enumerate(after):
        ring = [e, contour.following[e]]
        for _ in range(len(follow)):
            node = follow.get(ring[-1])
            if node is None:
                raise Unresolved
            ring.append(node)
        if ring.pop() != e or len(set(ring)) != len(ring) or len(ring) < 3:
            raise Unresolved
        rings.append(ring)
    return rings


def check_faces(
    xy: FloatArray, height: FloatArray, faces: list[list[int]], contour: Contour
) -> None:
    """Raise `Unresolved` unless faces are those of a straight skeleton.

    Each ring must be simple and turn counter-clockwise, all its vertices must be as high as they
    are far from the line of its edge, and it must be monotone along that line. Their areas
    must add up: as their arcs fit together by construction, they then tile the polygon.

    Parameters
    ----------
    xy
        (V, 2) vertices, as they are given to the caller.
    height
        (V,) distances from the contour.
    faces
        Rings of vertices.
    contour
        The merged edges.
    """
    size = np.array([len(ring) for ring in faces])
    offsets = np.append(0, np.cumsum(size))
    vertex = np.concatenate([np.array(ring) for ring in faces])
    at = np.insert(np.arange(len(vertex)), offsets[1:], offsets[:-1])
    closed = offsets + np.arange(len(offsets))
    points = xy[vertex] - contour.origin
    polygons: npt.NDArray[np.object_] = shapely.from_ragged_array(
        shapely.GeometryType.POLYGON, points[at], (closed, np.arange(len(offsets)))
    )
    dx, dy, c = (
        np.repeat(np.array(values), size) for values in (contour.dx, contour.dy, contour.c)
    )
    miss = dx * points[:, 1] - dy * points[:, 0] - c - height[vertex]
    if np.abs(miss).max() > HEIGHT_TOLERANCE or not shapely.is_valid(polygons).all():
        raise Unresolved
    ring = points[at]
    along = np.append(dx, 0.0)[at] * ring[:, 0] + np.append(dy, 0.0)[at] * ring[:, 1]
    whole = sum(
        contour.x[e] * contour.y[after] - contour.y[e] * contour.x[after]
        for e, after in enumerate(contour.following)
    )
    if abs(2 * shapely.area(polygons).sum() - whole) > 8 * HEIGHT_TOLERANCE * contour.size:
        raise Unresolved
    _check_monotone(along, ring, closed)


def _check_monotone(along: FloatArray, ring: FloatArray, closed: IntArray) -> None:
    """Raise `Unresolved` unless closed rings turn left and go forth and back but once."""
    step = np.diff(along)
    step[np.abs(step) < HEIGHT_TOLERANCE] = 0.0
    cross = ring[:-1, 0] * ring[1:, 1] - ring[:-1, 1] * ring[1:, 0]
    for first, last in zip(closed[:-1].tolist(), closed[1:].tolist(), strict=True):
        sign = [s > 0 for s in step[first : last - 1].tolist() if s]
        turns = sum(a != b for a, b in zip(sign, sign[1:] + sign[:1], strict=True))
        if turns > 2 or cross[first : last - 1].sum() <= 0:
            raise Unresolved
