"""Streamline subdivision of blocks (Chen 2024, section 4.1; Yang 2013, section 5)."""

from __future__ import annotations

import dataclasses
from itertools import pairwise

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import BlockRings, ragged_rows
from urban_processing.layout import Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray, PlanarMesh, linear_rings
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.parcelling.ground import (
    Ground,
    Pieces,
    Rules,
    join_parts,
    sort_faces,
)
from urban_processing.site import AREA_ROUNDING, FINE_GRID, GRID, Frame
from urban_processing.subdivision.holes import cut_through_holes
from urban_processing.subdivision.level import cut_level
from urban_processing.subdivision.recut import recut_irregular

SCALE = GRID / FINE_GRID
"""Blocks are divided enlarged by this factor, so that the grid of the mesh is `FINE_GRID`."""

APART = 64.0
"""Space in metres between blocks while they are divided, so that those which touch stay apart."""

ON_EDGE = 2.0 * FINE_GRID
"""A vertex of the contour within this many metres of an edge of a parcel lies on it."""


def divide_by_streamlines(ground: Ground, rules: Rules, *, seed: int) -> Pieces:
    """Cut polygons in two along streamlines of a cross field while they are too large.

    The cuts are those of co-generation, and so is the cutting anew of irregular parcels in the
    end; no streets are added. A parcel is cut while its area is above `Rules.max_area` and a cut
    leaves both halves `Rules.min_area`.

    Parameters
    ----------
    ground
        Polygons; where street is, cuts that leave both halves some of it are preferred.
    rules
        Bounds of the areas; widths, ω and ξ play no role.
    seed
        Random seed.
    """
    parts = []
    for least in np.unique(rules.min_area).tolist():
        rows = np.flatnonzero(rules.min_area == least)
        some = ground.of(rows)
        place = _places_apart(some.rings)
        layout = _enlarged(some, place, least)
        most = rules.max_area[rows] * SCALE**2
        layout = _cut(layout, most, CogenerateParams(min_area=layout.min_area, seed=seed))
        parts.append((rows, _pieces(layout, some, place)))
    return join_parts(parts, ground)


def _places_apart(rings: BlockRings) -> FloatArray:
    """(B, 2) shift in whole metres that puts the polygons in a row, apart from each other."""
    first = rings.offsets[np.flatnonzero(rings.is_shell)]
    low = np.floor(np.minimum.reduceat(rings.xy, first))
    high = np.ceil(np.maximum.reduceat(rings.xy, first))
    east = np.cumsum(high[:, 0] - low[:, 0] + APART)
    start = np.column_stack([np.append(0.0, east[:-1]), np.zeros(len(east))])
    return np.asarray(start - low)


def _enlarged(ground: Ground, place: FloatArray, least: float) -> Layout:
    """A layout whose parts are the polygons, each in its place and enlarged."""
    rings = ground.rings
    xy = (rings.xy + place[rings.edge_block]) * SCALE
    shapes = linear_rings(xy, rings.offsets)
    first = np.append(np.flatnonzero(rings.is_shell), len(shapes))
    polygons = [shapely.Polygon(shapes[a], shapes[a + 1 : b]) for a, b in pairwise(first)]
    mesh = mesh_from_polygons(polygons)
    layout = layout_from_mesh(
        mesh,
        frame=Frame(),
        face_part=np.arange(len(polygons)),
        min_area=least * SCALE**2,
        rim_is_street=False,
    )
    street = _street_edges(mesh, xy, rings, ground)
    return layout.replace(
        edge_street=street,
        edge_level=np.where(street, 0, -1).astype(np.int16),
        face_lineage=ground.lineage,
    )


def _cut(layout: Layout, most: FloatArray, params: CogenerateParams) -> Layout:
    """Cut all faces level by level; `most` is the largest area of each part."""
    layout, _ = cut_through_holes(layout, min_area=layout.min_area)
    active = np.ones(layout.mesh.n_faces, dtype=bool)
    while True:
        area = layout.mesh.face_area
        can = active & ~layout.face_locked & (layout.mesh.face_n_loops == 1)
        can &= area > most[layout.face_part] * (1.0 + AREA_ROUNDING)
        can &= area >= 2.0 * layout.min_area * (1.0 - AREA_ROUNDING)
        faces = np.flatnonzero(can)
        if not len(faces):
            break
        layout, cut, parent = cut_level(layout, faces, min_area=layout.min_area, params=params)
        was_cut = np.zeros(len(active), dtype=bool)
        was_cut[faces[cut]] = True
        active = was_cut[parent]
    return recut_irregular(layout, min_area=layout.min_area, params=params)


def _street_edges(
    mesh: PlanarMesh, xy: FloatArray, rings: BlockRings, ground: Ground
) -> npt.NDArray[np.bool_]:
    """(E,) edges of the mesh that are street sides of the ground."""
    number = _numbers(mesh.xy, xy)
    n = len(xy) + 1
    sides = rings.place * n + rings.place[rings.following]
    start, end = number[mesh.origin], number[mesh.target]
    runs = np.isin(start * n + end, sides[ground.access]) & (start >= 0) & (end >= 0)
    return np.asarray(runs.reshape(-1, 2).any(axis=1))


def _numbers(places: FloatArray, known: FloatArray) -> IntArray:
    """(n,) which of the known places each is, the first of those that are the same; -1 for none."""
    both = np.concatenate([known, places]) + 0.0
    _, first, inverse = np.unique(both, axis=0, return_index=True, return_inverse=True)
    number = first[inverse.ravel()[len(known) :]]
    return np.where(number < len(known), number, -1)


def _pieces(layout: Layout, ground: Ground, place: FloatArray) -> Pieces:
    """The faces of the mesh, back on the ground; vertices of the contour keep their numbers."""
    mesh, rings = layout.mesh, ground.rings
    n = len(rings.xy)
    part = np.zeros(mesh.n_vertices, dtype=np.int64)
    inside = mesh.face != OUTSIDE
    part[mesh.origin[inside]] = layout.face_part[mesh.face[inside]]
    xy = mesh.xy / SCALE - place[part]
    number = _numbers(mesh.xy, (rings.xy + place[rings.edge_block]) * SCALE)
    added = np.flatnonzero(number < 0)
    number[added] = n + np.arange(len(added))
    loops = mesh.loops
    shell = np.zeros(len(loops.face), dtype=bool)
    shell[mesh.face_loop] = True
    order = np.lexsort((~shell, layout.face_part[loops.face], loops.face))
    order = order[loops.face[order] != OUTSIDE]
    half_edges = loops.half_edges[ragged_rows(loops.offsets, order)]
    pieces = Pieces(
        xy=np.concatenate([rings.xy, xy[added]]),
        vertex=number[mesh.origin[half_edges]],
        offsets=np.append(0, np.cumsum(np.diff(loops.offsets)[order])),
        face=loops.face[order],
        access=(layout.edge_street & mesh.edge_is_boundary)[half_edges >> 1],
        block=layout.face_part,
        lineage=layout.face_lineage,
        level=layout.face_level,
        patio=np.zeros(mesh.n_faces, dtype=bool),
    )
    return sort_faces(_with_contour(pieces, ground))


def _with_contour(pieces: Pieces, ground: Ground) -> Pieces:
    """Give rings back the vertices of the contour that straight runs of the rim have lost."""
    lost = np.setdiff1d(ground.rings.place, pieces.vertex)
    rings = [r.tolist() for r in np.split(pieces.vertex, pieces.offsets[1:-1])]
    access = [a.tolist() for a in np.split(pieces.access, pieces.offsets[1:-1])]
    ring_block = pieces.block[pieces.face]
    for v in lost.tolist():
        for k in np.flatnonzero(ring_block == ground.rings.edge_block[v]).tolist():
            at = _edge_with(pieces.xy, rings[k], v)
            if at is not None:
                rings[k].insert(at + 1, v)
                access[k].insert(at, access[k][at])
                break
    if not len(lost):
        return pieces
    return dataclasses.replace(
        pieces,
        vertex=np.concatenate([np.array(r, dtype=np.int64) for r in rings]),
        access=np.concatenate([np.array(a, dtype=bool) for a in access]),
        offsets=np.append(0, np.cumsum([len(r) for r in rings])),
    )


def _edge_with(xy: FloatArray, ring: list[int], vertex: int) -> int | None:
    """Place in a ring of the edge that a vertex lies on."""
    a = xy[ring]
    d = np.roll(a, -1, axis=0) - a
    to = xy[vertex] - a
    length = np.hypot(d[:, 0], d[:, 1])
    beside = np.abs(d[:, 0] * to[:, 1] - d[:, 1] * to[:, 0]) / length
    along = (d * to).sum(axis=1) / length
    hit = np.flatnonzero((beside < ON_EDGE) & (along > 0) & (along < length))
    return int(hit[0]) if len(hit) else None
