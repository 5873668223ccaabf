"""First cuts of land with holes: they go through the holes, so that every parcel has one ring."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.fields.rings import ComplexArray, cross
from urban_processing.layout import Layout
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import FloatArray, IntArray
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
        eligible = (mesh.face_n_loops > 1) & (mesh.face_area >= 2 * min_area) & ~layout.face_locked
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


@dataclass(frozen=True)
class _Ray:
    """A straight cut from a vertex of the hole to the boundary seen from there."""

    vertex: int
    half_edge: int
    point: complex
    length: float
    skew: float


def _cut_one(layout: Layout, face: int, min_area: float) -> tuple[Layout, IntArray] | None:
    """Cut a face through its largest hole; None if no direction is legal."""
    mesh = layout.mesh
    loops = mesh.loops
    own = np.flatnonzero((loops.face == face) & (np.arange(len(loops.face)) != mesh.face_loop[face]))
    hole = own[np.argmax(np.abs(mesh.loop_area[own]))]
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    vertices = mesh.origin[loops.ring(int(hole))]
    segments = np.flatnonzero(mesh.face == face)
    scale = float(np.sqrt(mesh.face_area[face]))
    options = []
    for k in range(DIRECTIONS):
        direction = complex(np.exp(1j * np.pi * k / DIRECTIONS))
        rays = [
            _ray(z, vertices, segments, mesh.origin, mesh.target, d)
            for d in (direction, -direction)
        ]
        if rays[0] is None or rays[1] is None or rays[0].vertex == rays[1].vertex:
            continue
        cost = sum(r.length / scale + r.skew for r in rays if r is not None)
        options.append((round(cost, 9), k, rays[0], rays[1]))
    for _, _, ahead, back in sorted(options, key=lambda o: o[:2]):
        cut = _drawn(layout, face, (ahead, back), SNAP * scale)
        if cut is not None and _legal(layout, cut[0], min_area):
            return cut
    return None


def _ray(
    z: ComplexArray,
    vertices: IntArray,
    segments: IntArray,
    origin: IntArray,
    target: IntArray,
    direction: complex,
) -> _Ray | None:
    """Shoot from the hole's farthest vertex in a direction."""
    heights: FloatArray = (z[vertices] * np.conj(direction)).real
    vertex = int(vertices[int(np.argmax(np.round(heights, 6)))])
    a, b = z[origin[segments]], z[target[segments]]
    away = (origin[segments] != vertex) & (target[segments] != vertex)
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
    layout: Layout, face: int, rays: tuple[_Ray, _Ray], snap: float
) -> tuple[Layout, IntArray] | None:
    """Draw both cuts; the loops of the face that fall to the new side follow it."""
    editor = MeshEditor(layout.mesh)
    ends = []
    for ray in rays:
        ends.append(_end_vertex(editor, layout, ray, snap))
    if ends[0] == ends[1]:
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
    h = ray.half_edge
    # an edge already split for the other cut: find the piece that holds the point
    last = int(layout.mesh.target[h])
    z = lambda v: complex(editor.x[v], editor.y[v])  # noqa: E731
    start = z(editor.origin[h])
    while editor.origin[h ^ 1] != last and abs(z(editor.origin[h ^ 1]) - start) < abs(ray.point - start):
        h = editor.next[h]
    for vertex in (editor.origin[h], editor.origin[h ^ 1]):
        if abs(z(vertex) - ray.point) < snap and vertex != ray.vertex:
            return vertex
    return editor.origin[editor.split_edge(h, ray.point.real, ray.point.imag)]


def _leaving_towards(editor: MeshEditor, vertex: int, towards: int, face: int) -> int | None:
    """The half-edge that leaves a vertex such that the direction lies in the face beside it."""
    at = complex(editor.x[vertex], editor.y[vertex])
    way = complex(editor.x[towards], editor.y[towards]) - at
    for h in editor.outgoing(vertex):
        if editor.face[h] != face:
            continue
        ahead = complex(editor.x[editor.origin[h ^ 1]], editor.y[editor.origin[h ^ 1]]) - at
        before = editor.prev[h]
        back = complex(editor.x[editor.origin[before]], editor.y[editor.origin[before]]) - at
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
    touched = np.arange(mesh.n_faces) >= before.mesh.n_faces
    touched |= np.append(
        mesh.face_area[: before.mesh.n_faces] != before.mesh.face_area,
        np.zeros(mesh.n_faces - before.mesh.n_faces, dtype=bool),
    )
    polygons = mesh.face_polygons()[touched]
    large = mesh.face_area[touched] >= min_area
    if after.mesh.n_faces == before.mesh.n_faces:
        return bool(large.all())  # holes were joined: the ring may touch itself for now
    return bool(large.all() and (shapely.is_valid(polygons) | (mesh.face_n_loops[touched] > 1)).all())
