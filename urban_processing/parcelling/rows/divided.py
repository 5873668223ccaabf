"""Polygons of the ground one by one, what they are divided into, and `Pieces` made of it."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.rows.sheet import Sheet

STRAIGHT = 1e-7
"""Distance in metres within which a vertex that was added is on a straight line."""


@dataclass(frozen=True)
class Polygon:
    """One polygon of the ground, shifted near to the origin; N vertices, R rings.

    Parameters
    ----------
    first
        Number of its first vertex in the ground.
    shift
        What was taken off its coordinates.
    xy
        (N, 2) vertices.
    offsets
        (R + 1,) where rings begin.
    place
        First vertex at the place of each: more than one is there where rings touch.
    access, width, street
        (N,) what is known of each edge, as in `Ground`.
    lineage
        Seed of its random numbers.
    """

    first: int
    shift: FloatArray
    xy: FloatArray
    offsets: IntArray
    place: list[int]
    access: list[bool]
    width: list[float]
    street: list[int]
    lineage: int

    @property
    def following(self) -> list[int]:
        """Next vertex in the ring of each vertex."""
        after = list(range(1, len(self.xy) + 1))
        for start, stop in pairwise(self.offsets.tolist()):
            after[stop - 1] = start
        return after


@dataclass(frozen=True)
class Face:
    """A piece of a polygon: its rings of vertices, the shell first, and what `Pieces` says.

    A vertex of the contour that begins an edge of a ring is that which begins the edge of the
    contour, also where others are at the same place.
    """

    rings: list[list[int]]
    lineage: int
    level: int
    patio: bool = False


@dataclass(frozen=True)
class Divided:
    """A polygon, the vertices that it has now, and its faces."""

    polygon: Polygon
    sheet: Sheet
    faces: list[Face]


def polygons_of(ground: Ground) -> Iterator[Polygon]:
    """Take the polygons of the ground one by one."""
    rings = ground.rings
    bounds = np.searchsorted(rings.block, np.arange(len(ground) + 1))
    for k, (low, high) in enumerate(pairwise(bounds.tolist())):
        offsets = rings.offsets[low : high + 1]
        first, stop = int(offsets[0]), int(offsets[-1])
        xy = rings.xy[first:stop]
        shift = np.floor(xy.min(axis=0))
        yield Polygon(
            first=first,
            shift=shift,
            xy=xy - shift,
            offsets=offsets - first,
            place=(rings.place[first:stop] - first).tolist(),
            access=ground.access[first:stop].tolist(),
            width=ground.width[first:stop].tolist(),
            street=ground.street[first:stop].tolist(),
            lineage=int(ground.lineage[k]),
        )


def whole(polygon: Polygon) -> Divided:
    """Return a polygon as one face."""
    height = np.zeros(len(polygon.xy))
    sheet = Sheet(polygon.xy, height, polygon.following, place=polygon.place)
    rings = [list(range(a, b)) for a, b in pairwise(polygon.offsets.tolist())]
    return Divided(polygon, sheet, [Face(rings, polygon.lineage, 0)])


def straightened(sheet: Sheet, faces: Sequence[Face]) -> None:
    """Take away vertices that were added, on straight lines where nothing meets any more."""
    beside: dict[int, set[int]] = {}
    for face in faces:
        for ring in face.rings:
            u, v = ring[-2], ring[-1]
            for w in ring:
                if v >= sheet.n_contour:
                    beside.setdefault(v, set()).update((u, w))
                u, v = v, w
    gone = {v for v, ends in beside.items() if len(ends) == 2 and _between(sheet, v, *ends)}
    if gone:
        for face in faces:
            for ring in face.rings:
                ring[:] = [v for v in ring if v not in gone]


def _between(sheet: Sheet, v: int, u: int, w: int) -> bool:
    x, y = sheet.x, sheet.y
    ax, ay, bx, by = x[u] - x[v], y[u] - y[v], x[w] - x[v], y[w] - y[v]
    return abs(ax * by - ay * bx) <= STRAIGHT * sheet.distance(u, w) and ax * bx + ay * by < 0.0


def assembled(ground: Ground, parts: Sequence[Divided]) -> Pieces:
    """Put the faces of all polygons together."""
    added: list[FloatArray] = []
    vertex: list[int] = []
    size: list[int] = []
    face: list[int] = []
    access: list[bool] = []
    count, n_faces = len(ground.rings.xy), 0
    for part in parts:
        polygon, sheet = part.polygon, part.sheet
        n = sheet.n_contour
        used = sorted({v for f in part.faces for ring in f.rings for v in ring if v >= n})
        number = dict(zip(used, range(count, count + len(used)), strict=True))
        number.update((k, polygon.first + place) for k, place in enumerate(polygon.place))
        count += len(used)
        if used:
            xy = np.array([(sheet.x[v], sheet.y[v]) for v in used])
            added.append(xy + polygon.shift)
        for k, f in enumerate(part.faces, start=n_faces):
            for ring in f.rings:
                vertex += [number[v] for v in ring]
                size.append(len(ring))
                face.append(k)
                sides = (sheet.contour_side(u, v) for u, v in pairwise([*ring, ring[0]]))
                access += [side >= 0 and polygon.access[side] for side in sides]
        n_faces += len(part.faces)
    faces = [f for part in parts for f in part.faces]
    return Pieces(
        xy=np.concatenate([ground.rings.xy, *added]),
        vertex=np.array(vertex, dtype=np.int64),
        offsets=np.append(0, np.cumsum(np.array(size, dtype=np.int64))),
        face=np.array(face, dtype=np.int64),
        access=np.array(access, dtype=bool),
        block=np.repeat(np.arange(len(parts)), [len(part.faces) for part in parts]),
        lineage=np.array([f.lineage for f in faces], dtype=np.uint64),
        level=np.array([f.level for f in faces], dtype=np.int64),
        patio=np.array([f.patio for f in faces], dtype=bool),
    )
