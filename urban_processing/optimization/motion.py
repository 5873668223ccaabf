"""Which vertices of a layout may move, and how (Chen 2024, Eqs. 9 and 10)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.layout import NOT_FIXED, Layout
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import GRID

STRAIGHT_M = 4 * GRID
"""Vertices of a rim run that lie within this many metres of its chord make it exactly straight:
as near as the coordinate grid lets them."""

STAYS = -1
"""In place of the number of an unknown."""


@dataclass(frozen=True, eq=False)
class Motion:
    """The unknowns that move the V vertices of a mesh.

    Parameters
    ----------
    unknown
        (V, 2) two unknowns of a vertex that is free, one of a vertex that slides, `STAYS`
        elsewhere.
    direction
        (V, 2, 2) ``direction[v, :, k]`` is the way that a vertex goes for a unit of its k-th
        unknown.
    """

    unknown: IntArray
    direction: FloatArray

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return int(self.unknown.max(initial=STAYS)) + 1

    def displacement(self, x: FloatArray) -> FloatArray:
        """(V, 2) how far every vertex goes."""
        value = np.append(x, 0.0)[self.unknown]
        return np.asarray(np.einsum("vdk,vk->vd", self.direction, value))


def free_motion(layout: Layout) -> Motion:
    """Free inside the land, sliding on straight runs of the rim, fixed elsewhere.

    Vertices of locked parcels, of given streets, and of parcels around a hole, stay.
    """
    mesh = layout.mesh
    free = ~mesh.vertex_is_boundary
    slide = _slides(layout)
    stays = layout.face_locked | (mesh.face_n_loops > 1)
    held = mesh.vertices_of(layout.edge_fixed != NOT_FIXED)
    held[mesh.origin[(mesh.face != OUTSIDE) & stays[mesh.face]]] = True
    free &= ~held
    slides = (slide != 0).any(axis=1) & ~held
    unknown = np.full((mesh.n_vertices, 2), STAYS)
    count = np.where(free, 2, np.where(slides, 1, 0))
    first = np.cumsum(count) - count
    unknown[free] = first[free, None] + np.arange(2)
    unknown[slides, 0] = first[slides]
    direction = np.zeros((mesh.n_vertices, 2, 2))
    direction[free] = np.eye(2)
    direction[slides, :, 0] = slide[slides]
    return Motion(unknown, direction)


def _slides(layout: Layout) -> FloatArray:
    """(V, 2) unit direction in which a rim vertex may slide, 0 where it may not.

    A vertex slides where parcels meet at it within an exactly straight run of the rim, whose
    two boundary edges are alike.
    """
    mesh = layout.mesh
    loops = mesh.loops
    outside = loops.face[loops.of_half_edge[loops.half_edges]] == OUTSIDE
    half = loops.half_edges[outside]
    loop = loops.of_half_edge[half]
    vertex = mesh.origin[half]
    out = np.zeros((mesh.n_vertices, 2))
    anchored = _anchored(layout, vertex, mesh.previous[half] >> 1, half >> 1)
    a, b = _ends_of_runs(anchored, loop)
    known = (a >= 0) & ~anchored
    chord = np.zeros((len(half), 2))
    chord[known] = mesh.xy[vertex[b[known]]] - mesh.xy[vertex[a[known]]]
    length = np.hypot(chord[:, 0], chord[:, 1])
    known &= length > 0
    unit = np.divide(chord, length[:, None], out=np.zeros_like(chord), where=known[:, None])
    offset = np.zeros((len(half), 2))
    offset[known] = mesh.xy[vertex[known]] - mesh.xy[vertex[a[known]]]
    off = np.abs(unit[:, 0] * offset[:, 1] - unit[:, 1] * offset[:, 0])
    bent = np.zeros(len(half), dtype=bool)  # runs with a vertex off their chord, by their start
    bent[a[known & (off > STRAIGHT_M)]] = True
    slides = known & ~bent[a]
    out[vertex[slides]] = unit[slides]
    return out


def _anchored(layout: Layout, vertex: IntArray, before: IntArray, after: IntArray) -> BoolArray:
    """Which rim vertices, between two edges each, cannot slide whatever the run is."""
    mesh = layout.mesh
    visits = np.bincount(vertex, minlength=mesh.n_vertices)
    alike = (layout.edge_street[before] == layout.edge_street[after]) & (
        layout.edge_kind[before] == layout.edge_kind[after]
    )
    return np.asarray(
        layout.vertex_corner[vertex]
        | layout.vertex_entry[vertex]
        | (visits[vertex] > 1)
        | (mesh.valence[vertex] < 3)
        | ~alike
        | ~_nearly_straight(mesh, vertex, before, after)
    )


def _nearly_straight(
    mesh: PlanarMesh, vertex: IntArray, before: IntArray, after: IntArray
) -> BoolArray:
    """Which vertices lie within `STRAIGHT_M` of the line between their neighbours."""
    ends = mesh.origin.reshape(-1, 2)
    p = mesh.xy[ends[before].sum(axis=1) - vertex]
    q = mesh.xy[ends[after].sum(axis=1) - vertex]
    v = mesh.xy[vertex]
    u, w = p - v, q - v
    cross = np.abs(u[:, 0] * w[:, 1] - u[:, 1] * w[:, 0])
    between = (u * w).sum(axis=1) < 0
    return np.asarray(between & (cross <= STRAIGHT_M * np.hypot(*(q - p).T)))


def _ends_of_runs(anchored: BoolArray, loop: IntArray) -> tuple[IntArray, IntArray]:
    """Place of the anchored vertex before and after each one of its loop, -1 without any."""
    n = len(anchored)
    place = np.arange(n)
    first = np.flatnonzero(np.diff(loop, prepend=-1)) if n else place
    start = np.repeat(first, np.diff(np.append(first, n)))
    end = np.repeat(np.append(first[1:], n), np.diff(np.append(first, n)))
    at = np.flatnonzero(anchored)
    if len(at) == 0:
        return np.full(n, -1), np.full(n, -1)
    low, high = np.searchsorted(at, start), np.searchsorted(at, end)  # anchors of the own loop
    i = np.searchsorted(at, place, side="right") - 1
    j = np.searchsorted(at, place, side="right")
    has = high > low
    before = np.where(i >= low, i, high - 1)
    after = np.where(j < high, j, low)
    clip = len(at) - 1
    return (
        np.where(has, at[np.clip(before, 0, clip)], -1),
        np.where(has, at[np.clip(after, 0, clip)], -1),
    )
