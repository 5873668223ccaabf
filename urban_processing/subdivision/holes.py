"""First cuts of land with holes: they go through the holes, so that every parcel has one ring.

A cut runs from the outer ring through one hole or several to the outer ring again, so it always
parts the land in two. Every cut is tried on the parcel's polygon alone and drawn only if all its
pieces are valid and large enough; otherwise the layout stays as it was.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.fields.rings import ComplexArray, cross
from urban_processing.layout import Layout
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.edit import MeshEditor, Remap
from urban_processing.mesh.planar import FloatArray, IntArray, PlanarMesh
from urban_processing.site import GRID, Issue

DIRECTIONS = 24
"""Number of directions, over 360°, that a cut leaves a hole in."""

SNAP = 0.02
"""An end of a cut moves to a vertex within this many √area of the parcel…"""

SNAP_OF_EDGE = 0.3
"""… if it is also within this share of the edge that it lies on."""

NO_SNAP = 1e-6
"""Distance in √area within which a vertex counts as met exactly."""

BEND_COST = 1.5
"""Cost, in √area of length, of a right-angled bend of a cut within its hole."""

MOST_HOLES = 8
"""A parcel stays whole if so many of its holes, the largest first, cannot be cut."""

MOST_TRIES = 150
"""Number of cuts that are tried from one point within a hole."""

AREA_ROUNDING = 1e-9
"""Share of a parcel's area that its pieces may differ from it by rounding."""

Polygons = npt.NDArray[np.object_]


def cut_through_holes(layout: Layout, *, min_area: float) -> tuple[Layout, IntArray]:
    """Cut parcels along straight lines through their holes until each has one ring.

    Of the cuts tried, the one with the shortest and straightest lines that meet the outer ring
    squarely is taken, if no piece falls below `min_area`. Parcels smaller than two of
    `min_area` keep their holes, as do those that no cut serves: these are locked and listed in
    the issues. All parcels are valid polygons, and no edge has one parcel on both sides.

    Returns
    -------
    layout, parent
        The cut layout and (F,) the face before of each face.
    """
    parent = np.arange(layout.mesh.n_faces)
    while True:
        mesh = layout.mesh
        large = mesh.face_area >= 2 * min_area
        eligible = np.flatnonzero((mesh.face_n_loops > 1) & large & ~layout.face_locked)
        if len(eligible) == 0:
            return layout, parent
        face = int(eligible[0])
        cut = _find_cut(mesh, face, min_area)
        if cut is None:
            layout = _locked(layout, face)
        else:
            layout, source = _drawn(layout, face, cut)
            parent = parent[source]


def _locked(layout: Layout, face: int) -> Layout:
    """Keep a parcel with its holes and say so."""
    issue = Issue(
        code="hole_not_cut",
        message="No straight cut through a hole leaves parcels large enough; "
        "the parcel stays whole.",
        part=int(layout.face_part[face]),
        parcel_id=face + 1,
        geometry=layout.mesh.face_polygons()[face],
    )
    locked = layout.face_locked.copy()
    locked[face] = True
    return layout.replace(face_locked=locked, issues=(*layout.issues, issue))


@dataclass(frozen=True, eq=False)
class _Sides:
    """The edges of one face: n half-edges from a to b, each with the loop it belongs to."""

    polygon: shapely.Polygon
    half_edge: IntArray
    ring: IntArray
    a: ComplexArray
    b: ComplexArray
    outer: int
    scale: float


@dataclass(frozen=True)
class _End:
    """An end of a segment: a place on a side, which is one of its vertices if `new` is false."""

    side: int
    point: complex
    new: bool


@dataclass(frozen=True)
class _Chain:
    """Segments from a hole, by way of others perhaps, to the outer ring; cost in √area."""

    segments: tuple[tuple[_End, _End], ...]
    cost: float


@dataclass(frozen=True, eq=False)
class _Cut:
    """The ends on sides that are new vertices, by half-edge, and the pieces of the face."""

    new_vertices: tuple[tuple[int, complex], ...]
    pieces: Polygons


def _find_cut(mesh: PlanarMesh, face: int, min_area: float) -> _Cut | None:
    """Best legal cut through a hole of a face, the largest hole first; None if there is none."""
    sides = _sides(mesh, face)
    own = np.unique(sides.ring)
    holes = own[own != sides.outer]
    largest = holes[np.argsort(mesh.loop_area[holes], kind="stable")][:MOST_HOLES]
    for hole in largest.tolist():
        touches = _touches(sides, hole)
        for anchor in _anchors(sides, hole):
            for snap in (SNAP, NO_SNAP):
                chains = [
                    _chain(sides, hole, anchor, complex(d), snap * sides.scale)
                    for d in np.exp(2j * np.pi * np.arange(DIRECTIONS) / DIRECTIONS)
                ]
                for segments in _options(chains, alone=touches):
                    cut = _tried(sides, segments, min_area)
                    if cut is not None:
                        return cut
    return None


def _sides(mesh: PlanarMesh, face: int) -> _Sides:
    half_edge = np.flatnonzero(mesh.face == face)
    z = _complex(mesh.xy)
    return _Sides(
        polygon=mesh.face_polygons()[face],
        half_edge=half_edge,
        ring=mesh.loops.of_half_edge[half_edge],
        a=z[mesh.origin[half_edge]],
        b=z[mesh.target[half_edge]],
        outer=int(mesh.face_loop[face]),
        scale=float(np.sqrt(mesh.face_area[face])),
    )


def _touches(sides: _Sides, hole: int) -> bool:
    """Whether a hole meets another ring of the face at a point."""
    own = sides.ring == hole
    return bool(np.isin(sides.a[own], sides.a[~own]).any())


def _anchors(sides: _Sides, hole: int) -> list[complex]:
    """Points within a hole that cuts start from: its centre, then some towards its vertices."""
    start = np.flatnonzero(sides.ring == hole)
    following = {complex(sides.a[i]): complex(sides.b[i]) for i in start.tolist()}
    ring = [complex(sides.a[start[0]])]
    while len(ring) < len(following):
        ring.append(following[ring[-1]])
    z = np.array(ring)
    polygon = shapely.Polygon(np.column_stack([z.real, z.imag]))
    inner = shapely.point_on_surface(polygon)
    points = [complex(p.x, p.y) for p in (polygon.centroid, inner)]
    some = z[np.unique(np.linspace(0, len(z), 4, endpoint=False).astype(np.int64))]
    points += [0.4 * points[0] + 0.6 * complex(v) for v in some]
    unique = dict.fromkeys(points)
    return [p for p in unique if shapely.contains_xy(polygon, p.real, p.imag)]


def _chain(
    sides: _Sides, hole: int, anchor: complex, direction: complex, snap: float
) -> _Chain | None:
    """Follow a ray from within a hole to the outer ring; None if it meets no outer ring.

    Where the ray comes back to a ring that it has met before, what lies between is left out,
    so that no ring is met twice by segments.
    """
    e = sides.b - sides.a
    ray = np.full(len(e), direction)
    denominator = cross(ray, e)
    with np.errstate(divide="ignore", invalid="ignore"):
        t = cross(sides.a - anchor, e) / denominator
        s = cross(sides.a - anchor, ray) / denominator
    hits = np.flatnonzero((denominator != 0) & (t > 0) & (s >= 0) & (s <= 1))
    hits = hits[np.lexsort((hits, t[hits]))]
    at_outer = np.flatnonzero(sides.ring[hits] == sides.outer)
    if len(at_outer) == 0:
        return None
    hits = hits[: at_outer[0] + 1]
    last = {int(r): i for i, r in enumerate(sides.ring[hits].tolist())}
    i = last.get(hole, -1)
    segments, length = [], 0.0
    while 0 <= i < len(hits) - 1:
        ends = _end(sides, int(hits[i]), s, snap), _end(sides, int(hits[i + 1]), s, snap)
        if ends[0].point != ends[1].point:
            segments.append(ends)
            length += abs(ends[1].point - ends[0].point)
        i = last[int(sides.ring[hits[i + 1]])]
    far = int(hits[-1])
    skew = 1.0 - abs(float(denominator[far])) / abs(complex(e[far]))
    return _Chain(tuple(segments), length / sides.scale + skew) if segments else None


def _end(sides: _Sides, side: int, s: FloatArray, snap: float) -> _End:
    """The place at share s of a side, on the grid, or a vertex of the side that is near."""
    a, b = complex(sides.a[side]), complex(sides.b[side])
    z = a + float(s[side]) * (b - a)
    near = min(snap, SNAP_OF_EDGE * abs(b - a))
    for vertex in (a, b):
        if abs(z - vertex) <= near:
            return _End(side, vertex, new=False)
    z = complex(round(z.real / GRID) * GRID, round(z.imag / GRID) * GRID)
    return _End(side, z, new=z not in (a, b))


def _options(
    chains: list[_Chain | None], *, alone: bool
) -> Iterator[tuple[tuple[_End, _End], ...]]:
    """Pairs of chains, best first; single ones too from a hole that touches another ring."""
    options: list[tuple[float, int, tuple[tuple[_End, _End], ...]]] = []
    for k, first in enumerate(chains):
        if first is None:
            continue
        if alone:
            options.append((round(first.cost, 9), len(options), first.segments))
        for j in range(k + 1, len(chains)):
            second = chains[j]
            if second is None:
                continue
            bend = abs(j - k - DIRECTIONS / 2) / (DIRECTIONS / 4)
            cost = first.cost + second.cost + BEND_COST * bend
            options.append((round(cost, 9), len(options), first.segments + second.segments))
    for _, _, segments in sorted(options, key=lambda o: o[:2])[:MOST_TRIES]:
        yield segments


def _tried(sides: _Sides, segments: tuple[tuple[_End, _End], ...], min_area: float) -> _Cut | None:
    """Cut the polygon of a face; None unless all pieces are valid, large and have fewer holes."""
    ends = [end for segment in segments for end in segment if end.new]
    added = sorted(
        {
            (e.side, abs(e.point - complex(sides.a[e.side])), e.point.real, e.point.imag)
            for e in ends
        }
    )
    at = np.array([i for i, *_ in added], dtype=np.int64)
    points = np.array([complex(x, y) for *_, x, y in added], dtype=np.complex128)
    tails = np.insert(sides.a, at + 1, points)
    heads = np.insert(sides.b, at, points)
    cuts = np.array([[p.point, q.point] for p, q in segments])
    lines = _lines(np.vstack([np.column_stack([tails, heads]), cuts]))
    polygon = sides.polygon
    found = shapely.get_parts(shapely.polygonize(lines))
    pieces = found[shapely.intersects(polygon, shapely.point_on_surface(found))]
    area = shapely.area(pieces)
    rings = shapely.get_rings(pieces)
    # every side belongs to one piece and every segment of the cut to two of them
    n_lines = int((shapely.get_num_coordinates(rings) - 1).sum())
    n_holes = int(shapely.get_num_interior_rings(pieces).sum())
    if (
        len(pieces) < 2
        or float(area.min()) < min_area
        or n_holes >= shapely.get_num_interior_rings(polygon)
        or n_lines != len(tails) + 2 * len(cuts)
        or abs(float(area.sum()) - polygon.area) > AREA_ROUNDING * polygon.area
        or not shapely.is_valid(pieces).all()
        or not shapely.coverage_is_valid(pieces)
    ):
        return None
    vertices = tuple((int(sides.half_edge[i]), complex(p)) for i, p in zip(at, points, strict=True))
    return _Cut(vertices, pieces)


def _lines(ends: ComplexArray) -> Polygons:
    """(n,) segments between (n, 2) complex points."""
    return np.asarray(shapely.linestrings(np.stack([ends.real, ends.imag], axis=-1)))


def _drawn(layout: Layout, face: int, cut: _Cut) -> tuple[Layout, IntArray]:
    """The layout with a face replaced by its pieces, and the face before of each face."""
    editor = MeshEditor(layout.mesh)
    # of several vertices on one half-edge the farthest comes first: it keeps its origin
    for half_edge, point in reversed(cut.new_vertices):
        editor.split_edge(half_edge, point.real, point.imag)
    noded = layout.with_mesh(*editor.commit())
    n_faces = layout.mesh.n_faces
    polygons = noded.mesh.face_polygons()
    polygons[face] = cut.pieces[0]
    mesh = mesh_from_polygons([*polygons, *cut.pieces[1:]])
    source = np.append(np.arange(n_faces), np.full(len(cut.pieces) - 1, face))
    return noded.with_mesh(mesh, _remap(noded.mesh, mesh, source)), source


def _remap(before: PlanarMesh, after: PlanarMesh, source: IntArray) -> Remap:
    """Where vertices and edges come from, by their coordinates."""
    vertex_at = {z: i for i, z in enumerate(_complex(before.xy).tolist())}
    edge_at = {key: i for i, key in enumerate(_edge_keys(before))}
    return Remap(
        vertex=np.array([vertex_at.get(z, -1) for z in _complex(after.xy).tolist()]),
        edge=np.array([edge_at.get(key, -1) for key in _edge_keys(after)]),
        face=source,
    )


def _complex(xy: FloatArray) -> ComplexArray:
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _edge_keys(mesh: PlanarMesh) -> list[frozenset[complex]]:
    """The two ends of each edge in either order."""
    ends = _complex(mesh.xy)[mesh.origin].reshape(-1, 2)
    return [frozenset(pair) for pair in ends.tolist()]
