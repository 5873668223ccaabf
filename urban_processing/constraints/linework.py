"""Rims and given streets as one planar graph, led on until its faces have simple outlines.

A street that ends inside a face, or leads to a hole, has that face on both sides. Its end is
prolonged by a line to the boundary ahead, which is no street: only then does the graph divide
the land into parcels that have the street on their boundaries.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import shapely

from urban_processing.constraints.lines import Piece
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import GRID, Issue

ON = 1e-5
"""Noded segments lie within this many metres of the line that they come from."""

ANGLES = (0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75, 90, -90, 105, -105, 120, -120)
"""Directions in degrees, from straight on, in which an end may be prolonged."""

BEND_COST, SKEW_COST, TREE_COST = 1.5, 0.5, 0.5
"""Cost of a right-angled bend, of meeting a line at a slant, and of meeting one that does not
bound a face itself; a line across the land costs 1."""

LEAST_ANGLE = math.radians(5.0)
"""A line leaves a vertex at no smaller angle to what is there already."""

AROUND = 8
"""Number of points of a ring of streets from which it is tied to what is around it."""

AREA_ROUNDING = 1e-9
"""Share of the smallest area that may be lost to rounding."""


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
    """

    z: list[complex]
    ends: list[tuple[int, int]]
    street: list[int]
    firm: list[bool]
    root: list[bool]
    alive: list[bool] = field(default_factory=list)
    issues: list[Issue] = field(default_factory=list)

    def segments(self) -> tuple[FloatArray, IntArray]:
        """(S, 2, 2) ends of all edges, and (S,) the given street of each."""
        on = [e for e, here in enumerate(self.alive) if here]
        z = np.array(self.z)[np.array([self.ends[e] for e in on])]
        return np.stack([z.real, z.imag], axis=-1), np.array([self.street[e] for e in on])

    def polygons(self) -> list[shapely.Polygon]:
        """All faces, holes of the land among them."""
        return list(shapely.get_parts(shapely.polygonize(shapely.linestrings(self.segments()[0]))))

    def clip(self, ground: shapely.Geometry) -> None:
        """Remove streets beside the ground: ends that were moved may cut a corner of the rim."""
        z = np.array(self.z)[np.array(self.ends)].mean(axis=1)
        beside = ~shapely.dwithin(ground, shapely.points(z.real, z.imag), ON)
        for e in np.flatnonzero(beside).tolist():
            self.alive[e] = self.alive[e] and self.firm[e]

    def add(self, a: int, b: int) -> None:
        """Add an edge that is no street."""
        self.ends.append((a, b))
        self.street.append(-1)
        self.firm.append(False)
        self.root.append(False)
        self.alive.append(True)

    def split(self, edge: int, z: complex) -> int:
        """Put a vertex on an edge; return it."""
        a, b = self.ends[edge]
        vertex = len(self.z)
        self.z.append(z)
        self.ends[edge] = (a, vertex)
        self.ends.append((vertex, b))
        self.street.append(self.street[edge])
        for values in (self.firm, self.root, self.alive):
            values.append(values[edge])
        return vertex


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
    ends = places[pairs]
    street = np.full(len(pairs), -1)
    which, edge = _on_lines(lines, ends)
    order = np.lexsort((-which, edge))
    street[edge[order]] = np.array([p.street for p in pieces], dtype=np.int64)[which[order]]
    is_root, is_inner = (
        np.isin(np.arange(len(pairs)), _on_lines(rings, ends)[1]) for rings in (outer, inner)
    )
    return Linework(
        z=places.tolist(),
        ends=[(int(a), int(b)) for a, b in pairs],
        street=street.tolist(),
        firm=(is_root | is_inner).tolist(),
        root=is_root.tolist(),
        alive=[True] * len(pairs),
    )


def _on_lines(lines: Sequence[shapely.Geometry], ends: np.ndarray) -> tuple[IntArray, IntArray]:
    """Pairs of a line and a segment that lies on it; ends are (n, 2) complex."""
    none = np.empty(0, dtype=np.int64)
    if not len(lines):
        return none, none
    tree = shapely.STRtree([shapely.LineString(g) for g in lines])
    found = []
    for place in (ends[:, 0], ends.mean(axis=1), ends[:, 1]):
        points = shapely.points(place.real, place.imag)
        segment, line = tree.query(points, predicate="dwithin", distance=ON)
        found.append(set(zip(line.tolist(), segment.tolist(), strict=True)))
    both = sorted(set.intersection(*found))
    pairs = np.array(both, dtype=np.int64).reshape(-1, 2)
    return pairs[:, 0], pairs[:, 1]


def lead_on(work: Linework, *, min_area: float, snap: float) -> None:
    """Prolong street ends, and tie rings of streets, until every street parts two faces.

    Streets whose face is too small to be divided are dropped and listed in the issues.
    """
    while True:
        graph = _Blocks(work)
        leaf = graph.first_leaf()
        if leaf is None:
            return
        scale = math.sqrt(_extent(work))
        for ray in _rays(work, graph, leaf, scale, snap):
            if _drawn(work, ray, min_area):
                break
        else:
            _drop(work, graph, leaf)


@dataclass(frozen=True)
class _Ray:
    """A line from a vertex to a point of an edge, or to one of its ends."""

    cost: float
    start: int
    edge: int
    place: complex


class _Blocks:
    """Blocks: sets of vertices that stay connected without any one edge."""

    def __init__(self, work: Linework) -> None:
        self.work = work
        self.out: dict[int, list[tuple[int, int]]] = {}
        for e, here in enumerate(work.alive):
            if here:
                a, b = work.ends[e]
                self.out.setdefault(a, []).append((b, e))
                self.out.setdefault(b, []).append((a, e))
        self.bridges = self._find_bridges()
        self.block = self._flood(self.bridges)
        self.component = self._flood(set())
        self.bridges_of: dict[int, list[int]] = {}
        for e in sorted(self.bridges):
            for v in work.ends[e]:
                self.bridges_of.setdefault(self.block[v], []).append(e)

    def _find_bridges(self) -> set[int]:
        """Edges that are the only link between what lies beyond them (Tarjan 1974)."""
        order: dict[int, int] = {}
        low: dict[int, int] = {}
        bridges = set()
        for root in self.out:
            if root in order:
                continue
            order[root] = low[root] = len(order)
            stack = [(root, -1, iter(self.out[root]))]
            while stack:
                v, came, rest = stack[-1]
                for w, e in rest:
                    if e == came:
                        continue
                    if w in order:
                        low[v] = min(low[v], order[w])
                    else:
                        order[w] = low[w] = len(order)
                        stack.append((w, e, iter(self.out[w])))
                        break
                else:
                    stack.pop()
                    if stack:
                        parent = stack[-1][0]
                        low[parent] = min(low[parent], low[v])
                        if low[v] > order[parent]:
                            bridges.add(came)
        return bridges

    def _flood(self, without: set[int]) -> dict[int, int]:
        label: dict[int, int] = {}
        for first in self.out:
            if first in label:
                continue
            label[first] = first
            front = [first]
            for v in front:
                for w, e in self.out[v]:
                    if e not in without and w not in label:
                        label[w] = first
                        front.append(w)
        return label

    def first_leaf(self) -> int | None:
        """A block of streets that hangs on one bridge, or stands free; None if there is none."""
        work = self.work
        rooted, with_street = set(), set()
        for e, here in enumerate(work.alive):
            if here:
                v = work.ends[e][0]
                if work.root[e]:
                    rooted.add(self.block[v])
                if not work.firm[e]:
                    with_street.add(self.component[v])
        for v in sorted(self.out, key=lambda v: (work.z[v].real, work.z[v].imag)):
            b = self.block[v]
            n = len(self.bridges_of.get(b, []))
            if b not in rooted and n <= 1 and self.component[v] in with_street:
                return b
        return None

    def members(self, block: int) -> list[int]:
        """Vertices of a block, by their coordinates."""
        z = self.work.z
        inside = [v for v, b in self.block.items() if b == block]
        return sorted(inside, key=lambda v: (z[v].real, z[v].imag))


def _extent(work: Linework) -> float:
    z = np.array(work.z)
    return float(max(np.ptp(z.real) * np.ptp(z.imag), GRID))


def _rays(work: Linework, graph: _Blocks, leaf: int, scale: float, snap: float) -> list[_Ray]:
    """Lines from a block to what is around it, the cheapest first."""
    members = graph.members(leaf)
    on = [e for e, here in enumerate(work.alive) if here]
    ends = np.array([work.ends[e] for e in on])
    z = np.array(work.z)
    a, b = z[ends[:, 0]], z[ends[:, 1]]
    own = np.array([graph.block[v] == leaf == graph.block[w] for v, w in ends.tolist()])
    rays = []
    for v, ahead in _starts(work, graph, members):
        away = (ends[:, 0] != v) & (ends[:, 1] != v)
        known = np.array([z[w] - z[v] for w, _ in graph.out[v]])
        for degrees in ANGLES:
            direction = ahead * np.exp(1j * math.radians(degrees))
            if np.abs(np.angle(known * np.conj(direction))).min() < LEAST_ANGLE:
                continue
            hit = _hit(z[v], direction, a, b, away)
            if hit is None or own[hit[0]]:
                continue
            k, length = hit
            place = z[v] + length * direction
            edge = b[k] - a[k]
            slant = 1.0 - abs((np.conj(direction) * edge).imag) / abs(edge)
            cost = length / scale + BEND_COST * abs(degrees) / 90.0 + SKEW_COST * slant
            cost += TREE_COST * (on[k] in graph.bridges)
            near = [w for w in (a[k], b[k]) if abs(w - place) <= snap]
            if near and _is_clear(z[v], near[0], a, b, away):
                place = near[0]
            rays.append(_Ray(round(cost, 9), v, on[k], complex(place)))
    return sorted(rays, key=lambda r: (r.cost, r.start, r.edge, r.place.real, r.place.imag))


def _starts(work: Linework, graph: _Blocks, members: list[int]) -> list[tuple[int, complex]]:
    """Vertices to draw lines from, with the direction that leads on from each."""
    z = work.z
    if len(members) == 1:
        v = members[0]
        bridge = graph.out[v][0]
        d = z[v] - z[bridge[0]]
        return [(v, d / abs(d))]
    centre = sum(z[v] for v in members) / len(members)
    some = members if len(members) <= AROUND else _spread(members, z, centre)
    return [(v, (z[v] - centre) / abs(z[v] - centre)) for v in some if z[v] != centre]


def _spread(members: list[int], z: list[complex], centre: complex) -> list[int]:
    """The outermost vertices in directions all around."""
    turns = np.exp(2j * np.pi * np.arange(AROUND) / AROUND)
    return sorted(
        {max(members, key=lambda v: (((z[v] - centre) * np.conj(t)).real, v)) for t in turns}
    )


def _hit(
    start: complex, direction: complex, a: np.ndarray, b: np.ndarray, away: BoolArray
) -> tuple[int, float] | None:
    """The first segment that a ray meets, and how far it goes."""
    e = b - a
    across = (np.conj(direction) * e).imag
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (np.conj(a - start) * e).imag / across
        s = (np.conj(a - start) * direction).imag / across
    ok = away & (across != 0) & (t > GRID) & (s >= -1e-12) & (s <= 1 + 1e-12)
    if not ok.any():
        return None
    k = int(np.argmin(np.where(ok, t, np.inf)))
    return k, float(t[k])


def _is_clear(start: complex, stop: complex, a: np.ndarray, b: np.ndarray, away: BoolArray) -> bool:
    """Whether a line meets nothing before it stops at a vertex."""
    length = abs(stop - start)
    if length <= GRID:
        return False
    hit = _hit(start, (stop - start) / length, a, b, away & (a != stop) & (b != stop))
    return hit is None or hit[1] > length


def _drawn(work: Linework, ray: _Ray, min_area: float) -> bool:
    """Draw a line if the faces beside it are large enough; else change nothing."""
    ends = work.ends[ray.edge]
    known = {work.z[v]: v for v in ends}
    place = complex(round(ray.place.real / GRID) * GRID, round(ray.place.imag / GRID) * GRID)
    if place == work.z[ray.start]:
        return False
    before = len(work.z), len(work.ends), ends
    vertex = known[place] if place in known else work.split(ray.edge, place)
    if any(
        here and {ray.start, vertex} == set(pair)
        for here, pair in zip(work.alive, work.ends, strict=True)
    ):
        return False
    work.add(ray.start, vertex)
    middle = 0.5 * (work.z[ray.start] + place)
    faces = np.array(work.polygons(), dtype=object)
    beside = faces[shapely.dwithin(faces, shapely.Point(middle.real, middle.imag), ON)]
    if shapely.area(beside).min(initial=np.inf) >= min_area * (1 - AREA_ROUNDING):
        return True
    n_points, n_edges, work.ends[ray.edge] = before
    del work.z[n_points:]
    del work.ends[n_edges:], work.street[n_edges:]
    for values in (work.firm, work.root, work.alive):
        del values[n_edges:]
    return False


def _drop(work: Linework, graph: _Blocks, leaf: int) -> None:
    """Remove a block of streets that cannot be led on, and the way to it."""
    members = set(graph.members(leaf))
    gone = [
        e
        for e, here in enumerate(work.alive)
        if here and not work.firm[e] and set(work.ends[e]) <= members
    ]
    chain = list(graph.bridges_of.get(leaf, []))
    v = next((v for e in chain for v in work.ends[e] if v not in members), None)
    # the way goes back to where something else meets it
    while v is not None and len(graph.out[v]) == 2:
        step = next((w, e) for w, e in graph.out[v] if e != chain[-1])
        if step[1] not in graph.bridges:
            break
        chain.append(step[1])
        v = step[0]
    lines = []
    for e in [*gone, *chain]:
        work.alive[e] = False
        if work.street[e] >= 0:
            a, b = (work.z[v] for v in work.ends[e])
            lines.append(shapely.LineString([(a.real, a.imag), (b.real, b.imag)]))
    if lines:
        line = shapely.line_merge(shapely.union_all(lines))
        work.issues.append(
            Issue(
                "fixed_street_dropped",
                f"{line.length:.0f} m of a given street end inside a block that is too small to be "
                "divided there, and were left out.",
                value=float(line.length),
                geometry=shapely.point_on_surface(line),
            )
        )
