"""Rings of a polygon that touch at vertices, as the rings that bound its land."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely


def turns_at_touches(points: Sequence[tuple[float, float]], offsets: Sequence[int]) -> list[int]:
    """Return the vertex after each one along the land, which is to the left.

    Where rings touch at a vertex, each of the vertices there stands for one of the corners of the
    land: the edge that ends there is followed by the one that bounds the same corner, which may be
    of another ring. So a hole that touches the shell is a part of the ring of the shell, and what
    lies on both sides of a touch has no vertex in common.

    Parameters
    ----------
    points
        (N,) vertices of the rings of one polygon, the shell counter-clockwise, holes clockwise.
    offsets
        (R + 1,) where rings begin.
    """
    after = list(range(1, len(points) + 1))
    for first, stop in pairwise(offsets):
        after[stop - 1] = first
    at: dict[tuple[float, float], list[int]] = {}
    for k, place in enumerate(points):
        at.setdefault(place, []).append(k)
    touches = {place: there for place, there in at.items() if len(there) > 1}
    if not touches:
        return after
    before = {k: vertex for vertex, k in enumerate(after)}
    turned = list(after)
    for place, there in touches.items():
        ways = [(k, _angle(place, points[after[k]])) for k in there]
        for k in there:
            back = _angle(place, points[before[k]])
            # clockwise from the edge that ends here, through the land
            turned[before[k]] = min((((back - way) % math.tau), j) for j, way in ways)[1]
    return turned


def _angle(origin: tuple[float, float], end: tuple[float, float]) -> float:
    return math.atan2(end[1] - origin[1], end[0] - origin[0])


def cycles(after: Sequence[int]) -> list[list[int]]:
    """Return the rings that a next vertex for each makes, each from its first vertex on."""
    rings = []
    left = set(range(len(after)))
    for first in range(len(after)):
        ring = []
        while first in left:
            left.remove(first)
            ring.append(first)
            first = after[first]
        if ring:
            rings.append(ring)
    return rings


def loops_of(ring: Sequence[int], place: Sequence[int]) -> list[list[int]]:
    """Take a ring apart where it comes to a place again; arcs walked to and fro fall away.

    Each vertex of a loop is the one that begins its edge in the ring.
    """
    loops = []
    chain: list[int] = []
    at: dict[int, int] = {}
    for v in [*ring, ring[0]]:
        if place[v] in at:
            start = at[place[v]]
            loop = chain[start:]
            del chain[start:]
            for u in loop:
                del at[place[u]]
            if len(loop) > 2:
                loops.append(loop)
        at[place[v]] = len(chain)
        chain.append(v)
    return loops


def joined_at_touches(polygons: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Return polygons with rings that touch joined to one, which comes to that place again.

    So each vertex of a ring stands for one corner of the land, as GEOS takes for granted where it
    looks whether polygons are a coverage: it calls the neighbours of one whose hole touches its
    shell invalid at that place. The others are returned as they are.

    Parameters
    ----------
    polygons
        Valid polygons.
    """
    out = np.array(polygons, dtype=object)
    for k in np.flatnonzero(shapely.get_num_interior_rings(out) > 0).tolist():
        rings = shapely.get_rings(shapely.orient_polygons(out[k]))
        offsets = np.append(0, np.cumsum(shapely.get_num_points(rings) - 1))
        points = [p for ring in rings for p in ring.coords[:-1]]
        joined = cycles(turns_at_touches(points, offsets.tolist()))
        if len(joined) < len(rings):
            shapes = [shapely.LinearRing([points[v] for v in ring]) for ring in joined]
            shell = next(n for n, ring in enumerate(joined) if 0 in ring)
            out[k] = shapely.Polygon(shapes[shell], shapes[:shell] + shapes[shell + 1 :])
    return out
