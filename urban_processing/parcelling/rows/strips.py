"""Strips: what lies behind one logical street each (Vanegas 2012, section 4.2)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.streets import Side, Street

RIDGE = math.cos(math.radians(100.0))
"""Cosine of the angle from which two sides of one street have their backs to each other."""


Edge = tuple[int, int]
Guide = tuple[float, float, float]


@dataclass
class Strip:
    """A simple polygon with its front on one logical street.

    Parameters
    ----------
    front
        Vertices along the street, counter-clockwise.
    back
        The rest of the ring: from the last vertex of the front on to the first.
    guides
        For vertices of the front where it bends: where the line that parts the parcels on both
        sides of the bend meets the back, as a position along it (a whole number is a vertex),
        and its coordinates. Positions do not increase along the front.
    street
        The street.
    """

    front: list[int]
    back: list[int]
    guides: dict[int, Guide]
    street: Street
    rank: int = 0
    corners: dict[int, tuple[float, float]] = field(default_factory=dict)
    """Direction into the block at each vertex where the front bends."""

    @property
    def ring(self) -> list[int]:
        """Vertices of the whole ring."""
        return self.front[:-1] + self.back[:-1]

    def splice(self, sheet: Sheet, ends: tuple[int, int], between: Sequence[int]) -> None:
        """Put other vertices between two of the back; guides that ended there end anew."""
        start, stop = ends
        self.back[start + 1 : stop] = between
        shift = len(between) - (stop - start - 1)
        for vertex, (at, x, y) in self.guides.items():
            if at >= stop:
                self.guides[vertex] = (at + shift, x, y)
            elif at > start:
                section = range(start, start + len(between) + 1)
                self.guides[vertex] = self._prolonged(sheet, vertex, section)

    def _prolonged(self, sheet: Sheet, vertex: int, section: range) -> Guide:
        """Where the guide of a vertex meets a section of the back, led on as it was."""
        _, gx, gy = self.guides[vertex]
        dx, dy = self.corners[vertex]
        best: tuple[float, float] | None = None
        for k in section:
            u, v = self.back[k], self.back[k + 1]
            ax, ay = sheet.x[u] - gx, sheet.y[u] - gy
            ex, ey = sheet.x[v] - sheet.x[u], sheet.y[v] - sheet.y[u]
            det = dx * ey - dy * ex
            if det == 0.0:
                continue
            along = (ax * ey - ay * ex) / det
            share = (ax * dy - ay * dx) / det
            if along > -1e-6 and -1e-9 <= share <= 1.0 + 1e-9 and (best is None or along < best[0]):
                best = (along, k + min(max(share, 0.0), 1.0))
        if best is None:
            near = min(
                range(section.start, section.stop + 1),
                key=lambda k: math.hypot(sheet.x[self.back[k]] - gx, sheet.y[self.back[k]] - gy),
            )
            return (float(near), sheet.x[self.back[near]], sheet.y[self.back[near]])
        return (best[1], gx + best[0] * dx, gy + best[0] * dy)


class FaceMap:
    """Which face of a skeleton lies left of each directed edge, and which edge follows.

    Parameters
    ----------
    faces
        Rings of the faces.
    """

    def __init__(self, faces: Sequence[Sequence[int]]) -> None:
        self.face: dict[Edge, int] = {}
        self.following: dict[Edge, int] = {}
        self.neighbours: dict[int, list[int]] = {}
        for number, ring in enumerate(faces):
            u, v = ring[-2], ring[-1]
            for w in ring:
                self.following[u, v] = w
                self.face[v, w] = number
                self.neighbours.setdefault(v, []).append(w)
                u, v = v, w


def alpha_strips(
    sheet: Sheet, faces: Sequence[Sequence[int]], streets: Sequence[Street]
) -> list[Strip]:
    """Unite the faces of each logical street to a strip (Vanegas 2012, section 4.2.1)."""
    mesh = FaceMap(faces)
    street_of = {side.face: k for k, street in enumerate(streets) for side in street.sides}
    sides = {side.face: side for street in streets for side in street.sides}
    glued = _glued(mesh, streets, street_of=street_of, sides=sides)
    strips = []
    for number, street in enumerate(streets):
        if street.closed:
            _open(sheet, mesh, street.front[0], glued=glued)
        own = {edge for edge, face in mesh.face.items() if street_of[face] == number}
        strips.append(_strip(sheet, street, own, mesh=mesh, glued=glued))
    return strips


def _glued(
    mesh: FaceMap,
    streets: Sequence[Street],
    *,
    street_of: dict[int, int],
    sides: dict[int, Side],
) -> set[Edge]:
    """Directed arcs within a strip: those that are not between sides back to back."""
    bends = {side.run[0] for street in streets for side in street.sides[1:]}
    glued = set()
    for (u, v), face in mesh.face.items():
        other = mesh.face.get((v, u))
        if other is None or other == face or street_of[face] != street_of[other]:
            continue
        a, b = sides[face], sides[other]
        if a.dx * b.dx + a.dy * b.dy > RIDGE or u in bends or v in bends:
            glued.add((u, v))
    return glued


def _open(sheet: Sheet, mesh: FaceMap, start: int, *, glued: set[Edge]) -> None:
    """Cut a closed street open along the arcs from a vertex of the contour up to its back."""
    u = start
    while True:
        ahead = [w for w in mesh.neighbours[u] if (u, w) in glued]
        ahead = [w for w in ahead if sheet.height[w] > sheet.height[u]]
        if not ahead:
            return
        w = max(ahead, key=lambda v: sheet.height[v])
        glued -= {(u, w), (w, u)}
        if any((w, z) not in glued for z in mesh.neighbours[w] if z != u):
            return
        u = w


def _strip(
    sheet: Sheet, street: Street, own: set[Edge], *, mesh: FaceMap, glued: set[Edge]
) -> Strip:
    """Walk around the faces of a street and find where its guides end."""
    rim = {edge for edge in own if edge not in glued}
    while True:
        walk, passed = _walk(mesh, glued, street.front[:2])
        left = rim - set(pairwise(walk))
        way = _way(sheet, mesh, glued & own, left=left, goal=set(walk[len(street.front) - 1 :]))
        if not way:
            break
        glued -= way
        rim |= way
    n = len(street.front)
    strip = Strip(street.front, walk[n - 1 :], {}, street)
    for before, side in pairwise(street.sides):
        vertex = side.run[0]
        end = _guide_end(sheet, mesh, vertex, passed=passed)
        x, y = before.dx + side.dx, before.dy + side.dy
        size = math.hypot(x, y)
        strip.corners[vertex] = (-y / size, x / size)
        if end is not None:
            at, node = end
            strip.guides[vertex] = (float(at - (n - 1)), sheet.x[node], sheet.y[node])
    return strip


def _walk(
    mesh: FaceMap, glued: set[Edge], start: Sequence[int]
) -> tuple[list[int], dict[Edge, int]]:
    """Walk once around; also return where arcs within are passed, by their directed edge."""
    first = (start[0], start[1])
    u, v = first
    walk = [u]
    passed: dict[Edge, int] = {}
    while True:
        walk.append(v)
        w = mesh.following[u, v]
        while (v, w) in glued:
            passed[v, w] = len(walk) - 1
            w = mesh.following[w, v]
        u, v = v, w
        if (u, v) == first:
            return walk, passed


def _guide_end(
    sheet: Sheet, mesh: FaceMap, vertex: int, *, passed: dict[Edge, int]
) -> tuple[int, int] | None:
    """Follow the arcs from a bend of the front up to the back."""
    u = vertex
    while True:
        ahead = [w for w in mesh.neighbours[u] if sheet.height[w] > sheet.height[u]]
        if not ahead:
            return None
        w = max(ahead, key=lambda z: sheet.height[z])
        if (w, u) in passed:
            return passed[w, u], w
        u = w


def _way(
    sheet: Sheet,
    mesh: FaceMap,
    arcs: set[Edge],
    *,
    left: set[Edge],
    goal: set[int],
) -> set[Edge]:
    """Shortest way of arcs, in both directions, from a part of the rim not walked to the walk."""
    reached = {u: (0.0, -1) for edge in left for u in edge if u not in goal}
    todo = sorted(reached)
    while todo:
        u = min(todo, key=lambda v: (round(reached[v][0], 6), v))
        todo.remove(u)
        if u in goal:
            way = set()
            while reached[u][1] >= 0:
                before = reached[u][1]
                way |= {(u, before), (before, u)}
                u = before
            return way
        for w in mesh.neighbours[u]:
            length = reached[u][0] + sheet.distance(u, w)
            if (u, w) in arcs and (w not in reached or length < reached[w][0] - 1e-9):
                reached[w] = (length, u)
                if w not in todo:
                    todo.append(w)
    return set()
