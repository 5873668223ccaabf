"""Inserting the cuts of a level into the mesh, each against the mesh as it then is."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.layout import Layout
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, linear_rings
from urban_processing.site import AREA_ROUNDING, GRID, snap_to_grid
from urban_processing.subdivision.attach import BARE, usable_edges
from urban_processing.subdivision.parcels import ParcelRings
from urban_processing.subdivision.streamline import Cut

TEE_SNAP = 0.08
"""A cut's end moves, within this many √area, to where a neighbour's cut of the same level ends:
T-junctions in a brick pattern become crossings."""

VERTEX_SNAP = 0.02
"""A cut's end moves, within this many √area, to a vertex of the ring that is no corner."""

LEAST_CLEARANCE = 32 * GRID
"""Half-parcels narrower than this somewhere (m) could be turned over by rounding."""

PATH_TOLERANCE = 0.006
"""Streamlines are simplified by this share of √area before they are inserted."""


@dataclass(frozen=True, eq=False)
class _Draft:
    """A cut with its ends resolved to vertices of the mesh being edited."""

    row: int
    start: int
    stop: int
    path: FloatArray


def insert_cuts(
    layout: Layout,
    parcels: ParcelRings,
    ranked: Sequence[Sequence[Cut]],
    *,
    min_area: float,
    tee_snap: float = TEE_SNAP,
    attached: bool = True,
) -> tuple[Layout, BoolArray, IntArray]:
    """Cut each parcel by the first of its ranked cuts that leaves two legal halves.

    A half is legal if its ring is simple and its area at least `min_area` after all snapping
    and rounding. With `attached`, a cut begins or ends where streets may run, if they may run
    anywhere along its parcel. A cut that fails is tried again without snapping, then the next
    one.

    Returns
    -------
    layout, done, parent
        The cut layout, (P,) which parcels were cut, and (F,) the face before of each face.
    """
    inserter = _Inserter(layout, parcels, min_area, attached=attached)
    done = np.zeros(len(parcels.face), dtype=bool)
    most = max((len(cuts) for cuts in ranked), default=0)
    for place in range(most):
        for snap in (tee_snap, 0.0):
            rows = [r for r in range(len(ranked)) if not done[r] and place < len(ranked[r])]
            drafts = [inserter.draft(r, ranked[r][place], snap) for r in rows]
            for row in inserter.apply([d for d in drafts if d is not None]):
                done[row] = True
    cut, parent = inserter.commit()
    return cut, done, parent


@dataclass(frozen=True, eq=False)
class Trial:
    """A cut as it would be drawn.

    Parameters
    ----------
    path
        (n, 2) points of the cut, its ends on the ring of the parcel.
    areas
        Areas in m² of the halves to its left and to its right.
    snap
        Distance within which its ends were moved, in √area.
    """

    path: FloatArray
    areas: tuple[float, float]
    snap: float


def try_cuts(
    layout: Layout,
    parcels: ParcelRings,
    cuts: Sequence[Cut],
    *,
    min_area: float,
    tee_snap: float = TEE_SNAP,
) -> list[Trial | None]:
    """Draw each of several cuts of one parcel as `insert_cuts` would, the layout unchanged.

    None stands for a cut that leaves no two legal halves.
    """
    inserter = _Inserter(layout, parcels, min_area, attached=True)
    untouched = inserter.editor
    out: list[Trial | None] = []
    for cut in cuts:
        found = None
        for snap in (tee_snap, 0.0):
            inserter.editor = untouched.copy()
            found = inserter.trial(cut, snap)
            if found is not None:
                break
        out.append(found)
    return out


class _Inserter:
    """The editor with what is needed to draft, check and draw cuts."""

    def __init__(
        self, layout: Layout, parcels: ParcelRings, min_area: float, *, attached: bool
    ) -> None:
        self.layout, self.parcels, self.min_area = layout, parcels, min_area
        self.editor = MeshEditor(layout.mesh)
        self.scale = np.sqrt(layout.mesh.face_area[parcels.face]).tolist()
        self.corner: list[bool] = layout.vertex_corner.tolist()
        self.n_old = layout.mesh.n_vertices
        self.tees: list[int] = []
        self.target = layout.mesh.target
        on = parcels.network != BARE
        has_network = np.logical_or.reduceat(on, parcels.offsets[:-1]) if len(on) else on
        # parcels whose cuts must begin or end on the graph of edges where streets may run
        must = has_network & ~np.logical_and.reduceat(on, parcels.offsets[:-1]) if len(on) else on
        self.must_attach: list[bool] = (must & attached).tolist()
        self.usable: list[bool] = usable_edges(layout).tolist()

    def draft(self, row: int, cut: Cut, snap: float) -> _Draft | None:
        """Resolve both ends; None where they fall together."""
        start = self._end(row, cut.edge_a, cut.along_a, snap)
        stop = self._end(row, cut.edge_b, cut.along_b, snap)
        if start == stop:
            return None
        if self.must_attach[row] and not (self._is_attached(start) or self._is_attached(stop)):
            return None
        path = _with_ends(cut.path, self._xy(start), self._xy(stop))
        return _Draft(row, start, stop, path)

    def _is_attached(self, vertex: int) -> bool:
        """Whether a street may lead to a vertex."""
        e = self.editor
        parents = (e.edge_parent[h >> 1] for h in e.outgoing(vertex))
        return any(parent < 0 or self.usable[parent] for parent in parents)

    def _xy(self, vertex: int) -> tuple[float, float]:
        return self.editor.x[vertex], self.editor.y[vertex]

    def _end(self, row: int, place: int, along: float, snap: float) -> int:
        """Vertex at a place of a parcel's ring: one that is near, or a new one."""
        e, mesh = self.editor, self.layout.mesh
        h = int(self.parcels.half_edge[self.parcels.offsets[row] + place])
        a, b = mesh.xy[mesh.origin[h]], mesh.xy[self.target[h]]
        x, y = (a + along * (b - a)).tolist()
        h = self._piece(h, x, y)
        scale = self.scale[row]
        vertex = self._near_vertex(h, x, y, snap * scale, VERTEX_SNAP * scale)
        if vertex is None:
            vertex = e.origin[e.split_edge(h, x, y)]
            self.tees.append(vertex)
        return vertex

    def _piece(self, h: int, x: float, y: float) -> int:
        """The piece of an edge (which neighbours may have split) that holds a point."""
        e, mesh = self.editor, self.layout.mesh
        first, last = int(mesh.origin[h]), int(self.target[h])
        while e.origin[h] != first:
            h = e.prev[h]
        ax, ay = self._xy(first)
        reach = math.hypot(x - ax, y - ay)
        while True:
            end = e.origin[h ^ 1]
            bx, by = self._xy(end)
            if end == last or math.hypot(bx - ax, by - ay) >= reach:
                return h
            h = e.next[h]

    def _near_vertex(
        self, h: int, x: float, y: float, snap: float, vertex_snap: float
    ) -> int | None:
        """Nearest vertex to snap to, walking both ways along the ring from a point."""
        e = self.editor
        best: tuple[float, int] | None = None
        for forward in (False, True):
            half = h
            walked, px, py = 0.0, x, y
            while True:
                vertex = e.origin[half ^ 1] if forward else e.origin[half]
                qx, qy = self._xy(vertex)
                walked += math.hypot(qx - px, qy - py)
                if walked > max(snap, vertex_snap):
                    break
                tolerance = max(snap, vertex_snap) if self._is_node(vertex) else vertex_snap
                if walked <= tolerance and (best is None or walked < best[0]):
                    best = (walked, vertex)
                px, py = qx, qy
                half = e.next[half] if forward else e.prev[half]
        return None if best is None else best[1]

    def _is_node(self, vertex: int) -> bool:
        return vertex >= self.n_old or self.editor.valence[vertex] > 2 or self.corner[vertex]

    def apply(self, drafts: list[_Draft]) -> list[int]:
        """Draw the legal drafts; returns the rows that were cut."""
        drafts = self._simplified(drafts)
        rings = [self._ring_vertices(d) for d in drafts]
        legal = self._legal(drafts, rings)
        done = []
        for draft, ok in zip(drafts, legal, strict=True):
            if ok:
                face = int(self.parcels.face[draft.row])
                ha = self._leaving(draft.start, face)
                hb = self._leaving(draft.stop, face)
                self.editor.connect(ha, hb, [(x, y) for x, y in draft.path[1:-1].tolist()])
                done.append(draft.row)
        return done

    def trial(self, cut: Cut, snap: float) -> Trial | None:
        """The cut of the only parcel as it would be drawn; None where it is not legal."""
        draft = self.draft(0, cut, snap)
        if draft is None:
            return None
        [draft] = self._simplified([draft])
        ring = self._ring_vertices(draft)
        if not self._legal([draft], [ring])[0]:
            return None
        k = ring.index(draft.stop)
        left = np.concatenate([draft.path[:-1], [self._xy(v) for v in ring[k:]]])
        area = float(shapely.area(shapely.polygons(left)))
        whole = float(self.layout.mesh.face_area[self.parcels.face[0]])
        return Trial(draft.path, (area, whole - area), snap)

    def _simplified(self, drafts: list[_Draft]) -> list[_Draft]:
        if not drafts:
            return drafts
        tolerance = [PATH_TOLERANCE * self.scale[d.row] for d in drafts]
        counts = [len(d.path) for d in drafts]
        lines = shapely.linestrings(
            np.concatenate([d.path for d in drafts]),
            indices=np.repeat(np.arange(len(drafts)), counts),
        )
        lines = shapely.simplify(lines, np.array(tolerance), preserve_topology=False)
        xy, of = shapely.get_coordinates(lines, return_index=True)
        cuts = np.cumsum(np.bincount(of, minlength=len(drafts)))[:-1]
        paths = np.split(snap_to_grid(xy), cuts)
        return [_Draft(d.row, d.start, d.stop, path) for d, path in zip(drafts, paths, strict=True)]

    def _ring_vertices(self, draft: _Draft) -> list[int]:
        """Vertices of the parcel's ring, from the cut's start."""
        face = int(self.parcels.face[draft.row])
        return [self.editor.origin[h] for h in self.editor.ring(self._leaving(draft.start, face))]

    def _leaving(self, vertex: int, face: int) -> int:
        """The half-edge that leaves a vertex with a face on its left."""
        return next(h for h in self.editor.outgoing(vertex) if self.editor.face[h] == face)

    def _legal(self, drafts: list[_Draft], rings: list[list[int]]) -> BoolArray:
        """Whether both halves are simple polygons of at least the smallest area."""
        x, y = self.editor.x, self.editor.y
        points: list[FloatArray] = []
        usable = np.ones(len(drafts), dtype=bool)
        for i, (draft, ring) in enumerate(zip(drafts, rings, strict=True)):
            k = ring.index(draft.stop) if draft.stop in ring else -1
            along_edge = len(draft.path) == 2 and k in (1, len(ring) - 1)
            if k < 1 or along_edge:
                usable[i] = False
                continue
            boundary = np.array([(x[v], y[v]) for v in ring])
            middle = draft.path[1:-1]
            # left of the cut: along it from start to stop, then the ring back to the start
            left = np.concatenate([draft.path[:-1], boundary[k:]])
            right = np.concatenate([boundary[: k + 1], middle[::-1]])
            points += [left, right]
        if not points:
            return usable
        legal = _legal_rings(points, self.min_area).reshape(-1, 2).all(axis=1)
        usable[usable] = legal
        return usable

    def commit(self) -> tuple[Layout, IntArray]:
        """The layout with the cuts; ends of cuts that came to nothing are taken away."""
        for vertex in self.tees:
            if self.editor.valence[vertex] == 2:
                self.editor.dissolve_vertex(vertex)
        mesh, remap = self.editor.commit()
        return self.layout.with_mesh(mesh, remap), remap.face


def _legal_rings(points: list[FloatArray], min_area: float) -> BoolArray:
    offsets = np.append(0, np.cumsum([len(p) for p in points]))
    rings = linear_rings(np.concatenate(points), offsets)
    polygons = shapely.polygons(rings)
    signed = shapely.is_ccw(rings)
    return np.asarray(
        shapely.is_valid(polygons)
        & (shapely.area(polygons) >= min_area * (1.0 - AREA_ROUNDING))
        & (shapely.minimum_clearance(polygons) > LEAST_CLEARANCE)
        & signed,
        dtype=bool,
    )


def _with_ends(
    path: FloatArray, start: tuple[float, float], stop: tuple[float, float]
) -> FloatArray:
    """Move the ends of a path; the points between follow in proportion to the length."""
    step = np.hypot(*np.diff(path, axis=0).T)
    length = np.append(0.0, np.cumsum(step))
    s = (length / length[-1])[:, None] if length[-1] > 0 else np.linspace(0, 1, len(path))[:, None]
    return np.asarray(path + (1 - s) * (start - path[0]) + s * (stop - path[-1]))
