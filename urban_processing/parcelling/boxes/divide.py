"""Blocks to parcels by oriented bounding boxes (Vanegas 2012, section 4.3 and algorithm 2)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from urban_processing.access_rule import MEASURED_M, reached_frontage
from urban_processing.hashing import splitmix64, uniform
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.touches import cycles
from urban_processing.parcelling.boxes.candidates import Contour, Faces
from urban_processing.parcelling.boxes.cut_tree import (
    Level,
    Tree,
    collected,
    leaves_in_order,
    taken_back,
)
from urban_processing.parcelling.boxes.halving import Halved, halve
from urban_processing.parcelling.boxes.line_cuts import THE_CUT
from urban_processing.parcelling.boxes.oriented import Boxes, smallest_boxes
from urban_processing.parcelling.boxes.quality import fronts_of
from urban_processing.parcelling.ground import Ground, Pieces, Rules, join_parts
from urban_processing.parcelling.noding import Segments, node_rings
from urban_processing.parcelling.rings import Rings, join_rings, ranges, starts
from urban_processing.site import AREA_ROUNDING

STRAIGHT = 1e-3
"""Sine of the angle below which the contour does not bend at a vertex: no cut snaps to it."""

AT_A_PINCH = 0.5
"""Share of the smallest width that pieces of a face above the largest area may be down to, where
none keeps it: a front somewhat narrow is less of an evil than a parcel that is far too large."""

PARCELS_AT_ONCE = 50_000
"""About as many parcels, if all were as small as allowed, are worked on at once."""

_DRAWS = 2


@dataclass(frozen=True, eq=False)
class _Plane:
    """All vertices so far, and the segments that edges lie on."""

    xy: FloatArray
    segments: Segments


def divide_by_boxes(ground: Ground, rules: Rules, *, seed: int) -> Pieces:
    """Halve faces across their oriented boxes until they are small enough.

    A face is halved while its area is above `max_area`, its front (`quality.fronts_of`) is
    wider than `max_width`, or it has holes, if each piece keeps `min_area`. The cut goes across
    the longer side of the smallest box along an edge, through its middle, moved by ω·r
    times the *shorter* side with r between −½ and ½; so far only that `min_area` is left on both
    sides, and through a corner of the ground's contour within `snap`. Where a piece would not be
    reached by street (`access_rule.reached_frontage`), other cuts of the face are tried with
    probability ξ, first along the other axis, moved by as much; if no cut gives all pieces
    access, the face stays whole. Faces that are not reached themselves are halved without
    regard to access. `min_width` holds for the fronts of the pieces, unless the face
    is above `max_area` and can be halved in no other way. See `halving.halve` for all cuts tried.

    This departs from the paper, whose recursion divides what is outside of both ranges, thus
    also what is too small, and turns a cut without looking at what the turned one does.

    Parameters
    ----------
    ground
        Polygons to be divided, all at once.
    rules
        Bounds, ω, ξ and the snapping distance of each polygon.
    seed
        Seed of all random numbers; those of a face come from it and the face's own path.

    Returns
    -------
    Pieces
        Parcels in the order of their polygons; within one in the order of the cuts.
    """
    batches = _batches(ground, rules)
    if len(batches) <= 1:
        return _divide(ground, rules, seed)
    parts = [(rows, _divide(ground.of(rows), rules.of(rows), seed)) for rows in batches]
    return join_parts(parts, ground)


def _batches(ground: Ground, rules: Rules) -> list[IntArray]:
    """Polygons that are worked on together: as many as the processor's caches hold well."""
    area = _first_level(ground).rings.areas(ground.rings.xy)
    n_parcels = np.cumsum(area / rules.min_area)
    return np.split(
        np.arange(len(ground)), np.flatnonzero(np.diff(n_parcels // PARCELS_AT_ONCE)) + 1
    )


def _divide(ground: Ground, rules: Rules, seed: int) -> Pieces:
    """Divide all polygons together, level by level."""
    contour = _contour_of(ground)
    levels = [_first_level(ground)]
    plane = _Plane(ground.rings.xy, _edge_segments(ground))
    leaves = []
    while True:
        halved, whole, plane = _halve_level(levels[-1], rules, seed, (plane, contour))
        leaves.append(whole)
        if halved is None:
            break
        levels.append(halved)
    return _as_pieces(ground, contour, plane, Tree(levels, leaves))


def _contour_of(ground: Ground) -> Contour:
    """What cuts must know of the ground's vertices and edges."""
    rings = ground.rings
    edge = rings.xy[rings.following] - rings.xy
    previous = np.empty_like(rings.following)
    previous[rings.following] = np.arange(len(previous))
    before = edge[previous]
    sine = before[:, 0] * edge[:, 1] - before[:, 1] * edge[:, 0]
    length = np.sqrt((edge**2).sum(axis=1))
    bends = np.abs(sine) > STRAIGHT * length * length[previous]
    bends |= (before * edge).sum(axis=1) < 0
    shared = rings.place[rings.place != np.arange(len(bends))]
    bends[shared] = True
    return Contour(np.append(bends, False), np.append(ground.access, False))


def _first_level(ground: Ground) -> Level:
    """Return the polygons; rings that touch are one, so that no cut need open a hole there."""
    given, block = ground.rings, np.arange(len(ground))
    edge, offsets, face = np.arange(len(given.xy)), given.offsets, given.block
    if (given.place != edge).any():
        rings = cycles(given.along_land.tolist())
        edge, offsets = np.concatenate(rings), starts(np.array([len(ring) for ring in rings]))
        face = given.edge_block[edge[offsets[:-1]]]
    return Level(Rings(given.place[edge], edge, offsets, face), block, ground.lineage, block)


def _edge_segments(ground: Ground) -> Segments:
    """Return one segment for each edge of the contour."""
    rings = ground.rings
    edge = rings.xy[rings.following] - rings.xy
    length = np.sqrt((edge**2).sum(axis=1))
    return Segments(rings.xy, edge / np.where(length > 0, length, 1.0)[:, None], length)


def _halve_level(
    level: Level, rules: Rules, seed: int, known: tuple[_Plane, Contour]
) -> tuple[Level | None, BoolArray, _Plane]:
    """Return the pieces of all faces that are halved, which are not, and the vertices so far."""
    plane, contour = known
    area = level.rings.areas(plane.xy)
    least = rules.min_area[level.block]
    rows = np.flatnonzero(area >= 2.0 * least * (1.0 - AREA_ROUNDING))
    whole = np.ones(len(area), dtype=bool)
    faces, wanted = _faces_at(level, rows, area[rows], rules, seed, known)
    rows = rows[wanted]
    done = halve(faces, plane.xy, contour) if len(rows) else []
    if not done:
        return None, whole, plane
    parts = []
    for part in done:
        rings, plane = _added_to_plane(part, faces.boxes, plane)
        parts.append((rings, rows[part.rows][part.cut.parent]))
    rings = join_rings([rings for rings, _ in parts])
    parent = np.concatenate([parent for _, parent in parts])
    order = np.argsort(parent, kind="stable")
    parent = parent[order]
    whole[parent] = False
    rank = np.arange(len(parent)) - np.searchsorted(parent, parent)
    lineage = splitmix64(level.lineage[parent] ^ splitmix64((rank + 1).astype(np.uint64)))
    return Level(rings.take(order), level.block[parent], lineage, parent), whole, plane


def _faces_at(
    level: Level,
    rows: IntArray,
    area: FloatArray,
    rules: Rules,
    seed: int,
    known: tuple[_Plane, Contour],
) -> tuple[Faces, IntArray]:
    """Return faces that are to be halved, and which of the `rows` they are."""
    plane, contour = known
    rings, block = level.rings.take(rows), level.block[rows]
    boxes = smallest_boxes(rings, plane.xy)
    sides = fronts_of(rings, plane.xy, boxes.axis, contour)
    draws = uniform(seed, level.lineage[rows], _DRAWS)
    min_width = rules.min_width[block]
    too_large = area > rules.max_area[block] * (1.0 + AREA_ROUNDING)
    narrowest = np.where(too_large, AT_A_PINCH * min_width, min_width)
    narrowest[rings.n_rings > 1] = 0.0
    needs_access = sides.frontage >= reached_frontage(area) - MEASURED_M
    needs_access &= draws[:, 1] < rules.street_access[block]
    wanted = too_large | (rings.n_rings > 1)
    wanted |= sides.front > rules.max_width[block] + MEASURED_M
    # pieces that are reached share its sides along streets
    wanted &= ~needs_access | (sides.total >= 2.0 * narrowest - MEASURED_M)
    min_width = np.where(
        needs_access & (sides.total < 2.0 * min_width - MEASURED_M), narrowest, min_width
    )
    shift = rules.irregularity[block] * (draws[:, 0] - 0.5) * boxes.width
    faces = Faces(
        rings=rings,
        boxes=boxes,
        area=area,
        least=rules.min_area[block],
        largest=rules.max_area[block],
        min_width=min_width,
        snap=rules.snap[block],
        narrowest=narrowest,
        shift=shift,
        needs_access=needs_access,
    )
    chosen = np.flatnonzero(wanted)
    return faces.take(chosen), chosen


def _added_to_plane(part: Halved, boxes: Boxes, plane: _Plane) -> tuple[Rings, _Plane]:
    """Number the new vertices and segments of cuts on, and return the pieces with them."""
    rings, n = part.cut.pieces, len(plane.xy)
    vertex = np.where(
        rings.vertex >= part.cut.n_vertices, rings.vertex - part.cut.n_vertices + n, rings.vertex
    )
    of_edge = part.cut.parent[rings.edge_face] + len(plane.segments.length)
    segment = np.where(rings.segment == THE_CUT, of_edge, rings.segment)
    normal = part.lines.normal
    direction = np.column_stack([-normal[:, 1], normal[:, 0]])
    reach = boxes.length[part.rows] + boxes.width[part.rows]
    segments = Segments(
        np.concatenate([plane.segments.origin, part.lines.point - reach[:, None] * direction]),
        np.concatenate([plane.segments.direction, direction]),
        np.concatenate([plane.segments.length, 2.0 * reach]),
    )
    return (
        Rings(vertex, segment, rings.offsets, rings.face),
        _Plane(np.concatenate([plane.xy, part.cut.added]), segments),
    )


def _as_pieces(ground: Ground, contour: Contour, plane: _Plane, tree: Tree) -> Pieces:
    """Collect the faces that stayed whole, in the order of cuts, and node them.

    Where a face is valid no more with the vertices of its neighbours, as may be where it is
    narrower than coordinates are precise, the one it comes from stays whole instead.
    """
    n_ground = len(ground.rings.xy)
    while True:
        depth, face = leaves_in_order(tree)
        rings = collected(tree, depth, face)
        noded, _ = node_rings(rings, plane.xy, plane.segments, n_fixed=n_ground)
        broken = _broken(noded, plane.xy) & (depth > 0)
        if not broken.any():
            break
        tree = taken_back(tree, depth[broken], face[broken])
    noded = _from_lowest(noded.parted(plane.xy), plane.xy)
    xy, vertex = _used_vertices(plane.xy, noded.vertex, n_ground)
    first = starts(np.array([len(level.block) for level in tree.levels]))
    at = first[depth] + face
    return Pieces(
        xy=xy,
        vertex=vertex,
        offsets=noded.offsets,
        face=noded.face,
        access=contour.access(noded.segment),
        block=np.concatenate([level.block for level in tree.levels])[at],
        lineage=np.concatenate([level.lineage for level in tree.levels])[at],
        level=depth,
        patio=np.zeros(len(at), dtype=bool),
    )


def _broken(noded: Rings, xy: FloatArray) -> BoolArray:
    return ~noded.are_valid(xy)


def _from_lowest(rings: Rings, xy: FloatArray) -> Rings:
    """Start every ring at its lowest vertex, the leftmost of these."""
    x, y = xy[rings.vertex, 0], xy[rings.vertex, 1]
    begin = rings.offsets[:-1]
    low = y == np.repeat(np.minimum.reduceat(y, begin), rings.size)
    x = np.where(low, x, np.inf)
    low &= x == np.repeat(np.minimum.reduceat(x, begin), rings.size)
    first = np.flatnonzero(low)
    first = first[np.searchsorted(first, begin)] - begin
    node = ranges(np.zeros(len(begin), dtype=np.int64), rings.size) + np.repeat(first, rings.size)
    node = node % np.repeat(rings.size, rings.size) + np.repeat(begin, rings.size)
    return replace(rings, vertex=rings.vertex[node], segment=rings.segment[node])


def _used_vertices(xy: FloatArray, vertex: IntArray, n_ground: int) -> tuple[FloatArray, IntArray]:
    """Drop vertices that are on no ring, but those of the ground."""
    used = np.zeros(len(xy), dtype=bool)
    used[:n_ground] = True
    used[vertex] = True
    return xy[used], (np.cumsum(used) - 1)[vertex]
