"""Candidate cuts of a batch of parcels: streamlines, and straight halvings."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from urban_processing.fields.cross import FieldGrid
from urban_processing.fields.rings import ComplexArray, RingBatch, cross
from urban_processing.fields.tracing import STEP, Traces, trace
from urban_processing.hashing import UintArray, uniform
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.subdivision.parcels import Boundary

CLEARANCE = 0.18
"""A cut nearer than this many √area to the boundary leaves a sliver."""

SATELLITE = 0.12
"""Distance in √area of the seeds beside the centroid."""

REFLEX_TURN = 0.6
"""Corners that turn inward by more than this (radians) seed cuts that prolong their edges."""

MOST_REFLEX, MOST_CONTINUED = 4, 6
"""Number of rooted seeds of either kind for each parcel."""


@dataclass(frozen=True, eq=False)
class Cuts:
    """C candidate cuts; each runs from a to b, lengths along the ring are in √area.

    Parameters
    ----------
    parcel
        (C,) row of the batch.
    t_a, t_b
        (C,) where the ends lie along the ring.
    leaving, arriving
        (C,) unit directions of travel at a and at b.
    bulge
        (C,) twice the signed area between the path and its chord.
    clearance
        (C,) least distance to the boundary away from the ends.
    paths
        Returns the points from a to b, ends included, of chosen cuts.
    """

    parcel: IntArray
    t_a: FloatArray
    t_b: FloatArray
    leaving: ComplexArray
    arriving: ComplexArray
    bulge: FloatArray
    clearance: FloatArray
    paths: Callable[[IntArray], list[ComplexArray]]


@dataclass(frozen=True, eq=False)
class Seeds:
    """Starts of streamlines: free ones inside, rooted ones on the boundary."""

    parcel: IntArray
    z: ComplexArray
    root_parcel: IntArray
    root_t: FloatArray
    root_z: ComplexArray
    root_direction: ComplexArray


def place_seeds(
    boundary: Boundary,
    field: FieldGrid,
    lineage: UintArray,
    *,
    seed: int,
    wanted: int,
    aligned: bool,
) -> Seeds:
    """Spread `wanted` seeds over each parcel on a jittered lattice (Yang 2013, section 5).

    With `aligned`, seeds are added at the centroid and beside it (cuts of neighbours then meet)
    and rooted ones where a neighbour's cut ends and at reflex corners, prolonging both edges.
    """
    rings = boundary.rings
    parcel, z = _lattice(field, rings, lineage, seed=seed, wanted=wanted)
    if not aligned:
        none = np.empty(0, dtype=np.complex128)
        nowhere = np.empty(0, dtype=np.int64)
        return Seeds(parcel, z, nowhere, np.empty(0), none, none)
    around = np.array([0, SATELLITE, 1j * SATELLITE, -SATELLITE, -1j * SATELLITE])
    rows = np.repeat(np.arange(len(rings.z)), len(around))
    near = np.tile(around, len(rings.z))
    inside = field.distances(rows, near) > 0.3 * STEP
    roots = [_continued(boundary, lineage, seed), _reflex(boundary)]
    return Seeds(
        np.concatenate([parcel, rows[inside]]),
        np.concatenate([z, near[inside]]),
        root_parcel=np.concatenate([r[0] for r in roots]),
        root_t=np.concatenate([r[1] for r in roots]),
        root_z=np.concatenate([r[2] for r in roots]),
        root_direction=np.concatenate([r[3] for r in roots]),
    )


def _lattice(
    field: FieldGrid, rings: RingBatch, lineage: UintArray, *, seed: int, wanted: int
) -> tuple[IntArray, ComplexArray]:
    """Cells of a lattice over the parcel's box in random order; the first inside are taken."""
    k = int(np.ceil(np.sqrt(wanted * 3)))
    n = len(rings.z)
    draws = uniform(seed, lineage, 3 * k * k)
    i = np.tile(np.arange(k), k)
    j = np.repeat(np.arange(k), k)
    fx = (i + 0.5 + 0.5 * (draws[:, : k * k] - 0.5)) / k
    fy = (j + 0.5 + 0.5 * (draws[:, k * k : 2 * k * k] - 0.5)) / k
    extent = field.step * (field.size - 1)
    z = field.low[:, None] + fx * extent.real[:, None] + 1j * fy * extent.imag[:, None]
    rows = np.repeat(np.arange(n), k * k)
    inside = (field.distances(rows, z.ravel()) > 0.5 * STEP).reshape(n, -1)
    rank = np.where(inside, draws[:, 2 * k * k :], 2.0)
    chosen = np.argsort(rank, axis=1, kind="stable")[:, :wanted]
    good = np.take_along_axis(inside, chosen, axis=1)
    return (
        np.broadcast_to(np.arange(n)[:, None], good.shape)[good],
        np.take_along_axis(z, chosen, axis=1)[good],
    )


Roots = tuple[IntArray, FloatArray, ComplexArray, ComplexArray]


def _continued(boundary: Boundary, lineage: UintArray, seed: int) -> Roots:
    """Roots where a neighbour's cut ends on the parcel's boundary."""
    has = boundary.inward != 0
    rank = np.where(has, uniform(seed + 1, lineage, has.shape[1]), 2.0)
    chosen = np.argsort(rank, axis=1, kind="stable")[:, :MOST_CONTINUED]
    good = np.take_along_axis(has, chosen, axis=1)
    rows = np.broadcast_to(np.arange(len(has))[:, None], good.shape)[good]
    k = chosen[good]
    return rows, boundary.t[rows, k], boundary.rings.z[rows, k], boundary.inward[rows, k]


def _reflex(boundary: Boundary) -> Roots:
    """Roots at reflex corners, prolonging the edge before and the edge after."""
    z = boundary.rings.z
    n = boundary.rings.count
    k = np.arange(z.shape[1])[None]
    before = z - np.take_along_axis(z, (k - 1) % n[:, None], axis=1)
    after = np.take_along_axis(z, (k + 1) % n[:, None], axis=1) - z
    turn = np.where(boundary.corner, np.angle(after * np.conj(before)), 0.0)
    chosen = np.argsort(turn, axis=1, kind="stable")[:, :MOST_REFLEX]
    good = np.take_along_axis(turn, chosen, axis=1) < -REFLEX_TURN
    rows = np.broadcast_to(np.arange(len(z))[:, None], good.shape)[good]
    k = chosen[good]
    ahead = before[rows, k] / np.abs(before[rows, k])
    back = -after[rows, k] / np.abs(after[rows, k])
    t, corner = boundary.t[rows, k], z[rows, k]
    return (
        np.concatenate([rows, rows]),
        np.concatenate([t, t]),
        np.concatenate([corner, corner]),
        np.concatenate([ahead, back]),
    )


def streamline_cuts(
    boundary: Boundary,
    field_rings: RingBatch,
    field: FieldGrid,
    field_t: FloatArray,
    seeds: Seeds,
) -> Cuts:
    """Trace both directions through each free seed, and inward from each root.

    Parameters
    ----------
    field_rings, field
        Rings (simplified) that the arms are traced in, and their field.
    field_t
        (B, N' + 1) length along the full ring of each vertex of `field_rings`; the last
        column continues beyond the perimeter to close the ring.
    """
    free, n_root = len(seeds.parcel), len(seeds.root_parcel)
    first = field.directions(seeds.parcel, seeds.z, np.ones(free, dtype=complex))
    inner = seeds.root_z + STEP * seeds.root_direction
    arms = trace(
        field_rings,
        field,
        np.concatenate([np.tile(seeds.parcel, 4), seeds.root_parcel]),
        np.concatenate([np.tile(seeds.z, 4), inner]),
        np.concatenate([first, 1j * first, -first, -1j * first, seeds.root_direction]),
        CLEARANCE,
        np.arange(4 * free + n_root) >= 4 * free,
    )
    arm_t = _ring_length(boundary, field_t, arms)
    forward = np.arange(2 * free)
    backward = forward + 2 * free
    rooted = 4 * free + np.arange(n_root)
    ok = (arms.edge[forward] >= 0) & (arms.edge[backward] >= 0)
    # backward arms run the other way: their turn counts against that of the forward ones
    ok &= np.abs(arms.turned[forward] - arms.turned[backward]) < np.pi
    forward, backward = forward[ok], backward[ok]
    inside = field.distances(seeds.root_parcel, inner) > 0.25 * STEP
    ok_root = (arms.edge[rooted] >= 0) & inside
    root, rooted = np.flatnonzero(ok_root), rooted[ok_root]
    a = np.concatenate([arms.end[backward], seeds.root_z[root]])
    b = np.concatenate([arms.end[forward], arms.end[rooted]])
    line = np.concatenate(
        [
            arms.twice_area[forward] - arms.twice_area[backward],
            arms.twice_area[rooted] + cross(seeds.root_z[root], arms.start[rooted]),
        ]
    )
    n_free = len(forward)

    def paths(chosen: IntArray) -> list[ComplexArray]:
        free_ = chosen[chosen < n_free]
        root_ = chosen[chosen >= n_free] - n_free
        wanted = np.concatenate([forward[free_], backward[free_], rooted[root_]])
        points = arms.paths(wanted)
        n = len(free_)
        both = [
            np.concatenate([back[:0:-1], ahead])
            for ahead, back in zip(points[:n], points[n : 2 * n], strict=True)
        ]
        single = [
            np.concatenate([seeds.root_z[root[r] : root[r] + 1], ahead])
            for r, ahead in zip(root_, points[2 * n :], strict=True)
        ]
        return both + single

    return Cuts(
        parcel=np.concatenate([arms.parcel[forward], seeds.root_parcel[root]]),
        t_a=np.concatenate([arm_t[backward], seeds.root_t[root]]),
        t_b=np.concatenate([arm_t[forward], arm_t[rooted]]),
        leaving=np.concatenate([-arms.direction[backward], seeds.root_direction[root]]),
        arriving=np.concatenate([arms.direction[forward], arms.direction[rooted]]),
        bulge=line - cross(a, b),
        clearance=np.concatenate(
            [np.minimum(arms.clearance[forward], arms.clearance[backward]), arms.clearance[rooted]]
        ),
        paths=paths,
    )


def _ring_length(boundary: Boundary, field_t: FloatArray, arms: Traces) -> FloatArray:
    """Length along the full ring at which arms hit the boundary."""
    edge = np.maximum(arms.edge, 0)
    start, stop = field_t[arms.parcel, edge], field_t[arms.parcel, edge + 1]
    t = start + arms.along * (stop - start)
    perimeter = boundary.perimeter[arms.parcel]
    return np.asarray(np.where(t >= perimeter, t - perimeter, t))


def halving_cuts(boundary: Boundary, field: FieldGrid, parcel: IntArray, share: FloatArray) -> Cuts:
    """Straight cuts along both local axes that leave `share` (n,) of the area below them.

    Lines that cross the boundary more than twice are left out.
    """
    rows = np.concatenate([parcel, parcel])
    normal = np.repeat(np.array([1.0 + 0j, 1j]), len(parcel))
    z = boundary.rings.z[rows]
    height = (z * np.conj(normal)[:, None]).real
    level = _level_at_share(
        z, boundary.rings.following()[rows], normal, np.concatenate([share, share])
    )
    above = height > level[:, None]
    crosses = above != np.roll(above, -1, axis=1)
    twice = crosses.sum(axis=1) == 2
    rows, normal, level = rows[twice], normal[twice], level[twice]
    height, crosses, above = height[twice], crosses[twice], above[twice]
    edge = np.argsort(~crosses, axis=1, kind="stable")[:, :2]
    index = np.arange(len(rows))[:, None]
    h0, h1 = height[index, edge], np.roll(height, -1, axis=1)[index, edge]
    along = (level[:, None] - h0) / (h1 - h0)
    t0, t1 = boundary.t[rows[:, None], edge], boundary.t[rows[:, None], edge + 1]
    t = t0 + along * (t1 - t0)
    # the cut leaves the edge that falls below the line, so that the lower half is on its left
    falls = above[index, edge]
    t_a = np.where(falls[:, 0], t[:, 0], t[:, 1])
    t_b = np.where(falls[:, 0], t[:, 1], t[:, 0])
    a, b = boundary.position(rows, t_a), boundary.position(rows, t_b)
    length = np.abs(b - a)
    direction = (b - a) / np.where(length > 0, length, 1.0)
    samples = np.linspace(0, 1, 7)[None, 1:-1]
    inset = np.minimum(CLEARANCE, 0.45 * length)[:, None]
    w = inset + samples * (length[:, None] - 2 * inset)
    points = a[:, None] + w * direction[:, None]
    distance = field.distances(np.repeat(rows, 5), points.ravel()).reshape(-1, 5)
    return Cuts(
        parcel=rows,
        t_a=t_a,
        t_b=t_b,
        leaving=direction,
        arriving=direction,
        bulge=np.zeros(len(rows)),
        clearance=distance.min(axis=1) if len(rows) else np.empty(0),
        paths=lambda chosen: [np.array([a[i], b[i]]) for i in chosen],
    )


def _level_at_share(
    z: ComplexArray, following: ComplexArray, normal: ComplexArray, share: FloatArray
) -> FloatArray:
    """Offset of the line across `normal` below which `share` of the area (1) lies."""
    height = (z * np.conj(normal)[:, None]).real
    side = (z * np.conj(normal)[:, None]).imag
    next_height = (following * np.conj(normal)[:, None]).real
    next_side = (following * np.conj(normal)[:, None]).imag
    low, high = height.min(axis=1), height.max(axis=1)
    for _ in range(40):
        middle = 0.5 * (low + high)
        a, b = height - middle[:, None], next_height - middle[:, None]
        below_a, below_b = np.minimum(a, 0.0), np.minimum(b, 0.0)
        # clip each edge to the half plane; the area below is ∮ h ds in the turned frame
        rise = np.where(a != b, b - a, 1.0)
        s_a = np.where((a > 0) & (b < 0), -a / rise, 0.0)
        s_b = np.where((a < 0) & (b > 0), -a / rise, 1.0)
        width = (next_side - side) * np.where((a > 0) & (b > 0), 0.0, s_b - s_a)
        area = (0.5 * (below_a + below_b) * width).sum(axis=1)
        too_small = np.abs(area) < share
        low, high = np.where(too_small, middle, low), np.where(too_small, high, middle)
    return np.asarray(0.5 * (low + high))


def join_cuts(sets: list[Cuts]) -> Cuts:
    """Put several sets of candidates into one."""
    starts = np.append(0, np.cumsum([len(c.parcel) for c in sets]))

    def paths(chosen: IntArray) -> list[ComplexArray]:
        out: list[ComplexArray] = [np.empty(0, dtype=complex)] * len(chosen)
        for cuts, start, stop in zip(sets, starts[:-1], starts[1:], strict=True):
            mine = np.flatnonzero((chosen >= start) & (chosen < stop))
            order = mine[np.argsort(chosen[mine], kind="stable")]
            for i, path in zip(order, cuts.paths(chosen[order] - start), strict=True):
                out[i] = path
        return out

    def joined(name: str) -> np.ndarray:
        return np.concatenate([getattr(c, name) for c in sets])

    return Cuts(
        parcel=joined("parcel"),
        t_a=joined("t_a"),
        t_b=joined("t_b"),
        leaving=joined("leaving"),
        arriving=joined("arriving"),
        bulge=joined("bulge"),
        clearance=joined("clearance"),
        paths=paths,
    )
