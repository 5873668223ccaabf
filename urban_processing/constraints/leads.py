"""Streets led on until every street parts two faces.

A street that ends inside a face, or leads to a hole, has that face on both sides. Its end is
prolonged by a line to the boundary ahead, which is no street: only then does the graph divide
the land into parcels that have the street on their boundaries.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.constraints.blocks import Blocks
from urban_processing.constraints.linework import ON, Linework
from urban_processing.mesh.planar import BoolArray
from urban_processing.site import AREA_ROUNDING, GRID, Issue

ANGLES = (0, 15, -15, 30, -30, 45, -45, 60, -60, 75, -75, 90, -90, 105, -105, 120, -120)
"""Directions in degrees, from straight on, in which an end may be prolonged."""

BEND_COST, SKEW_COST, TREE_COST = 1.5, 0.5, 0.5
"""Cost of a right-angled bend, of meeting a line at a slant, and of meeting one that does not
bound a face itself; a line across the land costs 1."""

LEAST_ANGLE = math.radians(5.0)
"""A line leaves a vertex at no smaller angle to what is there already."""

AROUND = 8
"""Number of points of a ring of streets from which it is tied to what is around it."""

ComplexArray = npt.NDArray[np.complex128]


def lead_on(work: Linework, *, min_area: float, snap: float, holes: float) -> None:
    """Prolong street ends, and tie rings of streets, until every street parts two faces.

    Streets whose face is too small to be divided are dropped and listed in the issues.

    Parameters
    ----------
    work
        The graph; it is changed.
    min_area
        Smallest area in m² of the faces that a line makes.
    snap
        Distance in metres within which a line ends at a vertex.
    holes
        Area in m² of all holes and locked land, which the faces of the graph contain until they
        are tied to it.
    """
    scale = math.sqrt(_extent(work))
    while True:
        blocks = Blocks(work)
        leaves = blocks.leaves()
        if not leaves:
            return
        tips = [leaf for leaf in leaves if len(leaf) == 1]
        # rings are tied one by one, since each changes what the blocks are
        for leaf in tips or leaves[:1]:
            if len(leaf) == 1 and len(work.out[leaf[0]]) != 1:
                continue  # a line has met it
            rays = _rays(work, blocks, leaf, scale, snap)
            if not any(_drawn(work, ray, min_area, holes) for ray in rays):
                _drop(work, blocks, leaf)


@dataclass(frozen=True)
class _Ray:
    """A line from a vertex to a point of an edge, or to one of its ends."""

    cost: float
    start: int
    edge: int
    place: complex


def _extent(work: Linework) -> float:
    z = np.array(work.z)
    return float(max(np.ptp(z.real) * np.ptp(z.imag), GRID))


def _rays(work: Linework, blocks: Blocks, leaf: list[int], scale: float, snap: float) -> list[_Ray]:
    """Lines from a block to what is around it, the cheapest first."""
    on = work.edges()
    ends = np.array([work.ends[e] for e in on])
    z = np.array(work.z)
    a, b = z[ends[:, 0]], z[ends[:, 1]]
    inside: BoolArray = np.asarray(np.isin(ends, leaf).all(axis=1))
    rays = []
    for v, ahead in _starts(work, leaf):
        away = (ends != v).all(axis=1)
        known = np.array([z[w] - z[v] for w, _ in work.out[v]])
        for degrees in ANGLES:
            direction = ahead * np.exp(1j * math.radians(degrees))
            if np.abs(np.angle(known * np.conj(direction))).min() < LEAST_ANGLE:
                continue
            hit = _hit(z[v], direction, a, b, away)
            if hit is None:
                continue
            k, length = hit
            place = z[v] + length * direction
            near = _vertex_near(z[v], direction, length + snap, a, b, away, snap)
            if near is not None and _is_clear(z[v], near[1], a, b, away):
                k, place, _ = near
            elif near is not None and near[2] < ON:
                continue  # it would run over a street that lies in line
            if inside[k]:
                continue
            edge = b[k] - a[k]
            slant = 1.0 - abs((np.conj(direction) * edge).imag) / abs(edge)
            cost = length / scale + BEND_COST * abs(degrees) / 90.0 + SKEW_COST * slant
            cost += TREE_COST * (on[k] in blocks.bridges)
            rays.append(_Ray(round(cost, 9), v, on[k], complex(place)))
    return sorted(rays, key=lambda r: (r.cost, r.start, r.edge, r.place.real, r.place.imag))


def _starts(work: Linework, leaf: list[int]) -> list[tuple[int, complex]]:
    """Vertices to draw lines from, with the direction that leads on from each."""
    z = work.z
    if len(leaf) == 1:
        v = leaf[0]
        d = z[v] - z[work.out[v][0][0]]
        return [(v, d / abs(d))]
    centre = sum(z[v] for v in leaf) / len(leaf)
    some = leaf if len(leaf) <= AROUND else _spread(leaf, z, centre)
    return [(v, (z[v] - centre) / abs(z[v] - centre)) for v in some if z[v] != centre]


def _spread(leaf: list[int], z: list[complex], centre: complex) -> list[int]:
    """The outermost vertices in directions all around."""
    turns = np.exp(2j * np.pi * np.arange(AROUND) / AROUND)
    return sorted(
        {max(leaf, key=lambda v: (((z[v] - centre) * np.conj(t)).real, v)) for t in turns}
    )


def _hit(
    start: complex, direction: complex, a: ComplexArray, b: ComplexArray, away: BoolArray
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


def _vertex_near(
    start: complex,
    direction: complex,
    reach: float,
    a: ComplexArray,
    b: ComplexArray,
    away: BoolArray,
    snap: float,
) -> tuple[int, complex, float] | None:
    """The first vertex within a distance of a ray: an edge there, its place, how far off it is."""
    best = None
    for ends in (a, b):
        seen = (ends - start) * np.conj(direction)
        off = np.abs(seen.imag)
        ok = away & (seen.real > GRID) & (seen.real <= reach) & (off <= snap)
        if ok.any():
            k = int(np.argmin(np.where(ok, seen.real, np.inf)))
            if best is None or seen.real[k] < best[0]:
                best = (float(seen.real[k]), k, complex(ends[k]), float(off[k]))
    return None if best is None else best[1:]


def _is_clear(
    start: complex, stop: complex, a: ComplexArray, b: ComplexArray, away: BoolArray
) -> bool:
    """Whether a line meets nothing before it stops at a vertex."""
    length = abs(stop - start)
    if length <= GRID:
        return False
    hit = _hit(start, (stop - start) / length, a, b, away & (a != stop) & (b != stop))
    return hit is None or hit[1] > length


def _drawn(work: Linework, ray: _Ray, min_area: float, holes: float) -> bool:
    """Draw a line if the faces beside it are large enough; else change nothing."""
    known = {work.z[v]: v for v in work.ends[ray.edge]}
    place = complex(round(ray.place.real / GRID) * GRID, round(ray.place.imag / GRID) * GRID)
    if place == work.z[ray.start]:
        return False
    vertex = known[place] if place in known else work.split(ray.edge, place)
    if any(w == vertex for w, _ in work.out[ray.start]):
        return False
    line = work.add(ray.start, vertex)
    if _leaves_enough(work, line, min_area, holes):
        return True
    work.remove(line)
    if place not in known:
        work.join(ray.edge, vertex)
    return False


def _leaves_enough(work: Linework, line: int, min_area: float, holes: float) -> bool:
    """Whether the two faces beside a line are large enough, if it parts a face."""
    a, b = work.ends[line]
    left, steps = work.loop(line, a)
    if (b, line) in steps:
        return True
    right, _ = work.loop(line, b)
    least = min_area * (1 - AREA_ROUNDING)
    # a loop that runs around something is that of a face which is larger
    if any(0 < area < least for area in (left, right)):
        return False
    if all(area <= 0 or area - holes >= least for area in (left, right)):
        return True
    middle = 0.5 * (work.z[a] + work.z[b])
    faces = work.polygons()
    beside = faces[shapely.dwithin(faces, shapely.Point(middle.real, middle.imag), ON)]
    return bool(shapely.area(beside).min(initial=np.inf) >= least)


def _drop(work: Linework, blocks: Blocks, leaf: list[int]) -> None:
    """Remove a block of streets that cannot be led on, and the way to it."""
    inside = set(leaf)
    gone = [e for e in work.edges() if not work.firm[e] and set(work.ends[e]) <= inside]
    v, way = leaf[0], list(blocks.bridges_of.get(blocks.block[leaf[0]], []))
    if len(leaf) == 1:
        way = [work.out[v][0][1]]
    if way:
        a, b = work.ends[way[0]]
        v = b if a in inside else a
    # the way goes back to where something else meets it
    while way and len(work.out[v]) == 2:
        w, e = next((w, e) for w, e in work.out[v] if e != way[-1])
        if work.firm[e]:
            break
        way.append(e)
        v = w
    lines = []
    for e in [*gone, *way]:
        work.remove(e)
        if work.street[e] >= 0:
            p, q = (work.z[v] for v in work.ends[e])
            lines.append(shapely.LineString([(p.real, p.imag), (q.real, q.imag)]))
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
