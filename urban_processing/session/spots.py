"""Places on parcel boundaries that become vertices: ends of cuts, and corners that streets pass."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.subdivision.insert import TEE_SNAP, VERTEX_SNAP


@dataclass(frozen=True, eq=False)
class Spot:
    """A place on boundaries: a vertex, or a point of an edge that is to become one.

    Parameters
    ----------
    vertex
        The vertex; -1 where there is none yet.
    edge
        The edge that the place is on.
    xy
        (2,) the place.
    reach
        Other new vertices of the edge within so many metres are the same.
    """

    vertex: int
    edge: int
    xy: FloatArray
    reach: float


def spot_on(
    layout: Layout, half_edges: IntArray, place: FloatArray, *, reach: float, among: IntArray
) -> Spot:
    """Where some edges are nearest to a place: a vertex close by, or a point of an edge.

    Parameters
    ----------
    layout
        The layout.
    half_edges
        The edges, such as those around a parcel.
    place
        (2,) local coordinates.
    reach
        Parcel corners within so many metres are taken; nearer ones are in any case, and so are
        other vertices if they are very near.
    among
        Vertices that may be taken.
    """
    mesh = layout.mesh
    a, b = mesh.xy[mesh.origin[half_edges]], mesh.xy[mesh.target[half_edges]]
    edge = b - a
    along = np.clip(((place - a) * edge).sum(axis=1) / (edge**2).sum(axis=1), 0.0, 1.0)
    feet = a + along[:, None] * edge
    off = np.round(np.hypot(*(feet - place).T), 9)
    k = int(np.lexsort((feet[:, 1], feet[:, 0], off))[0])
    foot, h = feet[k], int(half_edges[k])
    sides = mesh.face.reshape(-1, 2)[h >> 1]
    # not that of the parcel: what is far for the smallest one, somebody may have meant
    scale = math.sqrt(min(float(mesh.face_area[sides[sides >= 0]].min()), 2.0 * layout.min_area))
    far = np.round(np.hypot(*(mesh.xy[among] - foot).T), 9)
    node = (mesh.valence[among] > 2) | layout.vertex_corner[among]
    near = far <= np.where(node, max(reach, TEE_SNAP * scale), VERTEX_SNAP * scale)
    if near.any():
        own, far = among[near], far[near]
        x, y = mesh.xy[own].T
        vertex = int(own[np.lexsort((y, x, far))[0]])
        return Spot(vertex, h >> 1, mesh.xy[vertex], 0.0)
    return Spot(-1, h >> 1, foot, VERTEX_SNAP * scale)


def with_vertices(layout: Layout, spots: Sequence[Spot]) -> tuple[Layout, list[int]]:
    """The layout with a vertex at each spot, and the vertices.

    Vertices and edges keep their numbers; what is new comes after them.
    """
    if all(spot.vertex >= 0 for spot in spots):
        return layout, [spot.vertex for spot in spots]
    editor = MeshEditor(layout.mesh)
    on_edge: dict[int, list[int]] = {}
    vertices = []
    for spot in spots:
        vertex = spot.vertex
        if vertex < 0:
            made = on_edge.setdefault(spot.edge, [])
            x, y = spot.xy.tolist()
            near = [v for v in made if math.dist((editor.x[v], editor.y[v]), (x, y)) <= spot.reach]
            vertex = near[0] if near else _split(editor, layout, spot)
            made.append(vertex)
        vertices.append(vertex)
    return layout.with_mesh(*editor.commit()), vertices


def _split(editor: MeshEditor, layout: Layout, spot: Spot) -> int:
    """Put a vertex on an edge, which others may have split already."""
    first, last = layout.mesh.origin[2 * spot.edge : 2 * spot.edge + 2].tolist()
    x, y = spot.xy.tolist()
    start = editor.x[first], editor.y[first]
    reach = math.dist(start, (x, y))
    h = 2 * spot.edge
    while True:
        end = editor.origin[h ^ 1]
        if end == last or math.dist(start, (editor.x[end], editor.y[end])) >= reach:
            return editor.origin[editor.split_edge(h, x, y)]
        h = editor.next[h]
