"""First cuts of land with holes: they go through the holes, so that every parcel has one ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.fields.rings import ComplexArray, cross
from urban_processing.layout import Layout
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray, PlanarMesh
from urban_processing.site import Issue

DIRECTIONS = 12
"""Number of directions, over 180°, that a cut through a hole is tried in."""

SNAP = 0.02
"""The far end of such a cut moves to a vertex within this many √area of the parcel."""


def cut_through_holes(layout: Layout, *, min_area: float) -> tuple[Layout, IntArray]:
    """Cut parcels along straight lines through their holes until each has one ring.

    Of the directions tried, the one with the shortest cuts that meet the far boundary squarely
    is taken, if no half falls below `min_area`. Parcels that are too small to be cut keep
    their holes, as do those where no direction serves: these are listed in the issues.

    Returns
    -------
    layout, parent
        The cut layout and (F,) the face before of each face.
    """
    parent = np.arange(layout.mesh.n_faces)
    while True:
        mesh = layout.mesh
        ringed = (mesh.face_n_loops > 1) | (_slits(layout) > 0)
        eligible = ringed & (mesh.face_area >= 2 * min_area) & ~layout.face_locked
        if not eligible.any():
            return layout, parent
        face = int(np.flatnonzero(eligible)[0])
        cut = _cut_one(layout, face, min_area)
        if cut is None:
            issue = Issue(
                code="hole_not_cut",
                message="No straight cut through a hole leaves parcels large enough; "
                "the parcel stays whole.",
                part=int(layout.face_part[face]),
                parcel_id=face + 1,
                geometry=mesh.face_polygons()[face],
            )
            locked = layout.face_locked.copy()
            locked[face] = True
            layout = layout.replace(face_locked=locked, issues=(*layout.issues, issue))
        else:
            layout, source = cut
            parent = parent[source]


def _slits(layout: Layout) -> IntArray:
    """(F,) number of edges that have the same face on both sides."""
    sides = layout.mesh.face.reshape(-1, 2)
    own = sides[sides[:, 0] == sides[:, 1], 0]
    return np.bincount(own, minlength=layout.mesh.n_faces)


@dataclass(frozen=True)
class _Ray:
    """A straight cut from a vertex of the hole to the boundary seen from there."""

    vertex: int
    half_edge: int
    point: complex
    length: float
    skew: float


def _cut_one(layout: Layout, face: int, min_area: float) -> tuple[Layout, IntArray] | None:
    """Cut a face through its largest hole; None if no direction is legal.

    A hole gets cuts in two opposite directions. Where two holes are joined by both of theirs,
    or one leads into the other, the face still touches itself along a slit: then a single
    further cut is made from one of its holes.
    """
    scale = float(np.sqrt(layout.mesh.face_area[face]))
    n_slits = int(_slits(layout)[face])
    for rays in _options(layout, face, scale):
        cut = _drawn(layout, face, rays, SNAP * scale)
        if cut is None or not _legal(layout, cut[0], min_area):
            continue
        pieces = np.flatnonzero(cut[1] == face)
        if layout.mesh.face_n_loops[face] > 1 or int(_slits(cut[0])[pieces].sum()) < n_slits:
            return cut
    return None


def _options(layout: Layout, face: int, scale: float) -> list[tuple[_Ray, ...]]:
    """Pairs of opposite rays from a hole, or single ones from joined holes; best first."""
    mesh = layout.mesh
    loops = mesh.loops
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    segments = np.flatnonzero(mesh.face == face)
    directions = np.exp(1j * np.pi * np.arange(2 * DIRECTIONS) / DIRECTIONS)
    paired = mesh.face_n_loops[face] > 1
    if paired:
        own = np.flatnonzero(
            (loops.face == face) & (np.arange(len(loops.face)) != mesh.face_loop[face])
        )
        holes = [int(own[np.argmax(np.abs(mesh.loop_area[own]))])]
    else:
        hole = (mesh.loop_area > 0) & (loops.face == OUTSIDE)
        at_face = np.zeros(mesh.n_vertices, dtype=bool)
        at_face[mesh.origin[segments]] = True
        holes = [
            i for i in np.flatnonzero(hole).tolist() if at_face[mesh.origin[loops.ring(i)]].any()
        ]
    options: list[tuple[float, int, tuple[_Ray, ...]]] = []
    for hole_loop in holes:
        vertices = mesh.origin[loops.ring(hole_loop)]
        rays = [_ray(z, vertices, segments, mesh, complex(d)) for d in directions]
        for k, ray in enumerate(rays):
            back = rays[(k + DIRECTIONS) % len(rays)] if paired else None
            if ray is None or (paired and (back is None or back.vertex == ray.vertex)):
                continue
            both = (ray,) if back is None else (ray, back)
            cost = sum(r.length / scale + r.skew for r in both)
            options.append((round(cost, 9), len(options), both))
    return [rays for _, _, rays in sorted(options, key=lambda o: o[:2])]


def _ray(
    z: ComplexArray,
    vertices: IntArray,
    segments: IntArray,
    mesh: PlanarMesh,
    direction: complex,
) -> _Ray | None:
    """Shoot from the hole's farthest vertex in a direction."""
    heights: FloatArray = (z[vertices] * np.conj(direction)).real
    vertex = int(vertices[int(np.argmax(np.round(heights, 6)))])
    origin, target = mesh.origin[segments], mesh.target[segments]
    a, b = z[origin], z[target]
    away = (origin != vertex) & (target != vertex)
    e = b - a
    ray = np.full(len(e), direction)
    denominator = cross(ray, e)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = cross(a - z[vertex], e) / denominator
        s = cross(a - z[vertex], ray) / denominator
    hits = away & (denominator > 0) & (t > 0) & (s >= 0) & (s <= 1)
    if not hits.any():
        return None
    i = int(np.argmin(np.where(hits, t, np.inf)))
    square = abs(float(cross(ray[i : i + 1], e[i : i + 1] / np.abs(e[i : i + 1]))[0]))
    point = complex(a[i] + s[i] * e[i])
    return _Ray(vertex, int(segments[i]), point, float(t[i]), 1.0 - square)


def _drawn(
    layout: Layout, face: int, rays: tuple[_Ray, ...], snap: float
) -> tuple[Layout, IntArray] | None:
    """Draw the cuts; the loops of the face that fall to the new side follow it."""
    editor = MeshEditor(layout.mesh)
    ends = [_end_vertex(editor, layout, ray, snap) for ray in rays]
    if len(set(ends)) < len(ends):
        return None
    for ray, end in zip(rays, ends, strict=True):
        start = _leaving_towards(editor, ray.vertex, end, face)
        stop = _leaving_towards(editor, end, ray.vertex, face)
        if start is None or stop is None:
            return None
        new = editor.connect(start, stop, [])
        if new >= 0:
            _reassign_loops(editor, face, new)
    mesh, remap = editor.commit()
    return layout.with_mesh(mesh, remap), remap.face


def _end_vertex(editor: MeshEditor, layout: Layout, ray: _Ray, snap: float) -> int:
    """Vertex at the far end of a cut: one that is near, or a new one."""
    h = ray.half_edge
    # an edge already split for the other cut: find the piece that holds the point
    last = int(layout.mesh.target[h])
    start = _at(editor, editor.origin[h])
    reach = abs(ray.point - start)
    while editor.origin[h ^ 1] != last and abs(_at(editor, editor.origin[h ^ 1]) - start) < reach:
        h = editor.next[h]
    for vertex in (editor.origin[h], editor.origin[h ^ 1]):
        if abs(_at(editor, vertex) - ray.point) < snap and vertex != ray.vertex:
            return vertex
    return editor.origin[editor.split_edge(h, ray.point.real, ray.point.imag)]


def _at(editor: MeshEditor, vertex: int) -> complex:
    return complex(editor.x[vertex], editor.y[vertex])


def _leaving_towards(editor: MeshEditor, vertex: int, towards: int, face: int) -> int | None:
    """The half-edge that leaves a vertex such that the direction lies in the face beside it."""
    at = _at(editor, vertex)
    way = _at(editor, towards) - at
    for h in editor.outgoing(vertex):
        if editor.face[h] != face:
            continue
        ahead = _at(editor, editor.origin[h ^ 1]) - at
        back = _at(editor, editor.origin[editor.prev[h]]) - at
        opening = np.angle(back / ahead) % (2 * np.pi) or 2 * np.pi
        if np.angle(way / ahead) % (2 * np.pi) < opening:
            return h
    return None


def _reassign_loops(editor: MeshEditor, face: int, new: int) -> None:
    """Give the loops that lie in the new face (holes not yet cut) to it."""
    seen: set[int] = set()
    outer: list[int] = []
    others: list[list[int]] = []
    for h, f in enumerate(editor.face):
        if f not in (face, new) or h in seen or not editor.is_edge(h):
            continue
        ring = editor.ring(h)
        seen.update(ring)
        xy = editor.coordinates(ring)
        area = np.sum(xy[:, 0] * np.roll(xy[:, 1], -1) - xy[:, 1] * np.roll(xy[:, 0], -1))
        if f == new and area > 0:
            outer = ring
        elif area < 0:
            others.append(ring)
    shell = shapely.Polygon(editor.coordinates(outer))
    for ring in others:
        inside = shapely.contains_xy(shell, *editor.coordinates(ring[:1])[0])
        for h in ring:
            editor.face[h] = new if inside else face


def _legal(before: Layout, after: Layout, min_area: float) -> bool:
    """Whether the new faces are large enough and simple."""
    mesh = after.mesh
    n_before = before.mesh.n_faces
    touched = np.ones(mesh.n_faces, dtype=bool)
    touched[:n_before] = mesh.face_area[:n_before] != before.mesh.face_area
    large = mesh.face_area[touched] >= min_area
    simple = shapely.is_valid(mesh.face_polygons()[touched])
    # while holes are being joined, a ring may touch itself along a slit
    joined = (mesh.face_n_loops > 1) | (_slits(after) > 0)
    return bool(large.all() and (simple | joined[touched]).all())
