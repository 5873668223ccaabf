"""Rims and given streets as one planar graph that grows and shrinks."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.constraints.lines import SAME, Piece
from urban_processing.mesh.places import segments_on
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import GRID, Issue

ON = 1e-5
"""Noded segments lie within this many metres of the line that they come from."""


@dataclass
class Linework:
    """Vertices and edges; what is removed stays in the lists, with `alive` false.

    Parameters
    ----------
    z
        Positions as complex numbers.
    ends
        Two vertices of each edge.
    street
        Number of the given street that an edge is on, -1 for none.
    firm
        Edges of rims and of locked land, which cannot be removed.
    root
        Edges of outer rings.
    alive
        Edges that are there.
    out
        Neighbours of each vertex, with the edges that lead to them.
    issues
        What was left out.
    """

    z: list[complex]
    ends: list[tuple[int, int]]
    street: list[int]
    firm: list[bool]
    root: list[bool]
    alive: list[bool] = field(default_factory=list)
    out: dict[int, list[tuple[int, int]]] = field(default_factory=dict)
    issues: list[Issue] = field(default_factory=list)

    def __post_init__(self) -> None:
        """Begin with all edges."""
        self.alive = [True] * len(self.ends)
        for e in range(len(self.ends)):
            self._link(e)

    def _link(self, edge: int) -> None:
        a, b = self.ends[edge]
        self.out.setdefault(a, []).append((b, edge))
        self.out.setdefault(b, []).append((a, edge))

    def _unlink(self, edge: int) -> None:
        a, b = self.ends[edge]
        self.out[a].remove((b, edge))
        self.out[b].remove((a, edge))

    def edges(self) -> list[int]:
        """Edges that are there."""
        return [e for e, here in enumerate(self.alive) if here]

    def segments(self) -> tuple[FloatArray, IntArray]:
        """(S, 2, 2) ends of all edges, and (S,) the given street of each."""
        on = self.edges()
        z = np.array(self.z)[np.array([self.ends[e] for e in on])]
        return np.stack([z.real, z.imag], axis=-1), np.array([self.street[e] for e in on])

    def polygons(self) -> npt.NDArray[np.object_]:
        """All faces, holes of the land among them."""
        lines = shapely.linestrings(self.segments()[0])
        return np.asarray(shapely.get_parts(shapely.polygonize(lines)), dtype=object)

    def clip(self, ground: shapely.Geometry) -> None:
        """Remove streets beside the ground: ends that were moved may cut a corner of the rim."""
        z = np.array(self.z)[np.array(self.ends)].mean(axis=1)
        beside = ~shapely.dwithin(ground, shapely.points(z.real, z.imag), ON)
        for e in np.flatnonzero(beside).tolist():
            if not self.firm[e]:
                self.remove(e)

    def add(self, a: int, b: int) -> int:
        """Add an edge that is no street; return it."""
        edge = len(self.ends)
        self.ends.append((a, b))
        self.street.append(-1)
        self.firm.append(False)
        self.root.append(False)
        self.alive.append(True)
        self._link(edge)
        return edge

    def split(self, edge: int, z: complex) -> int:
        """Put a vertex on an edge; return it."""
        a, b = self.ends[edge]
        vertex, new = len(self.z), len(self.ends)
        self._unlink(edge)
        self.z.append(z)
        self.ends[edge] = (a, vertex)
        self.ends.append((vertex, b))
        self.street.append(self.street[edge])
        for values in (self.firm, self.root, self.alive):
            values.append(values[edge])
        self._link(edge)
        self._link(new)
        return vertex

    def join(self, edge: int, vertex: int) -> None:
        """Take back the last split of an edge, at a vertex that nothing else meets."""
        new = next(e for _, e in self.out[vertex] if e != edge)
        a, b = self.ends[edge][0], self.ends[new][1]
        self.remove(new)
        self._unlink(edge)
        self.ends[edge] = (a, b)
        self._link(edge)

    def remove(self, edge: int) -> None:
        """Take an edge away."""
        self.alive[edge] = False
        self._unlink(edge)

    def contract(self, vertex: int, into: int) -> None:
        """Move the edges of a vertex to another; of two that fall together one stays."""
        for w, edge in list(self.out[vertex]):
            self._unlink(edge)
            same = next((e for v, e in self.out[into] if v == w), None)
            if w == into or same is not None:
                self.alive[edge] = False
            else:
                self.ends[edge] = (into, w)
                self._link(edge)
            if same is not None:
                self.firm[same] |= self.firm[edge]
                self.root[same] |= self.root[edge]
                if self.street[same] < 0:
                    self.street[same] = self.street[edge]

    def without_short_edges(self, length: float, corners: set[complex]) -> None:
        """Contract edges that are shorter than a length in metres, besides those of the rings.

        Noding leaves such edges where a street ends, bends or is crossed beside a vertex. A
        cut beside them would be no longer than a rounding error.

        Parameters
        ----------
        length
            Edges from this length on stay.
        corners
            Vertices of the rings, which stay where they are.
        """
        short = [(abs(self.z[b] - self.z[a]), e) for e, (a, b) in enumerate(self.ends)]
        for _, edge in sorted(pair for pair in short if pair[0] < length):
            a, b = self.ends[edge]
            gone = abs(self.z[b] - self.z[a]) >= length or not self.alive[edge]
            if gone or {self.z[a], self.z[b]} <= corners:
                continue
            self.contract(*sorted((a, b), key=lambda v: (self._hold(v, corners), -v)))

    def _hold(self, vertex: int, corners: set[complex]) -> int:
        """How little a vertex may move: 0 freely, 1 along a ring, 2 not at all."""
        on_ring = any(self.firm[e] for _, e in self.out[vertex])
        return 2 if self.z[vertex] in corners else int(on_ring)

    def loop(self, edge: int, start: int) -> tuple[float, set[tuple[int, int]]]:
        """Area of the loop to the left of an edge that leaves a vertex, and its steps.

        Negative where the loop runs around something from outside; holes count as area.
        """
        twice = 0.0
        steps: set[tuple[int, int]] = set()
        base = self.z[start]
        u, e = start, edge
        while (u, e) not in steps:
            steps.add((u, e))
            a, b = self.ends[e]
            v = b if u == a else a
            twice += ((self.z[u] - base).conjugate() * (self.z[v] - base)).imag
            u, e = v, self._next(v, u, e)
        return 0.5 * twice, steps

    def _next(self, v: int, came: int, edge: int) -> int:
        """The edge that comes next clockwise at a vertex after the one it was reached by."""
        back = (self.z[came] - self.z[v]).conjugate()
        best, least = edge, math.inf
        for w, e in self.out[v]:
            if e == edge:
                continue
            turn = (self.z[w] - self.z[v]) * back
            angle = -math.atan2(turn.imag, turn.real) % math.tau
            if angle < least:
                best, least = e, angle
        return best


def node_lines(
    outer: Sequence[shapely.Geometry], inner: Sequence[shapely.Geometry], pieces: Sequence[Piece]
) -> Linework:
    """Cut rings and streets where they meet.

    Parameters
    ----------
    outer
        Outer rings of the land.
    inner
        Rings of holes and of locked land.
    pieces
        Given streets.
    """
    lines = [p.line for p in pieces]
    noded = shapely.union_all([*outer, *inner, *lines], grid_size=GRID)
    xy, line = shapely.get_coordinates(shapely.get_parts(noded), return_index=True)
    z = xy[:, 0] + 1j * xy[:, 1] + 0.0
    here = np.flatnonzero((line[1:] == line[:-1]) & (z[1:] != z[:-1]))
    places, index = np.unique(np.concatenate([z[here], z[here + 1]]), return_inverse=True)
    pairs = np.unique(np.sort(index.reshape(2, -1).T, axis=1), axis=0)
    segments = np.stack([places[pairs].real, places[pairs].imag], axis=-1)
    street = np.full(len(pairs), -1)
    which, edge = segments_on(segments, lines, ON)
    order = np.lexsort((-which, edge))
    street[edge[order]] = np.array([p.street for p in pieces], dtype=np.int64)[which[order]]
    is_root, is_inner = np.zeros((2, len(pairs)), dtype=bool)
    is_root[segments_on(segments, outer, ON)[1]] = True
    is_inner[segments_on(segments, inner, ON)[1]] = True
    work = Linework(
        z=places.tolist(),
        ends=[(int(a), int(b)) for a, b in pairs],
        street=street.tolist(),
        firm=(is_root | is_inner).tolist(),
        root=is_root.tolist(),
    )
    corners = shapely.get_coordinates([*outer, *inner])
    work.without_short_edges(SAME, set((corners[:, 0] + 1j * corners[:, 1] + 0.0).tolist()))
    return work
