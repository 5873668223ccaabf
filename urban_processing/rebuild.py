"""Layouts from their parcels and streets, with a numbering that depends on these alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import TopologyError
from urban_processing.layout import Layout, edge_kinds
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import Frame, Issue, snap_to_grid


@dataclass(frozen=True, eq=False)
class LayoutParts:
    """What a layout is made of, without the mesh; all coordinates are local.

    F parcels, S street segments, C corners.

    Parameters
    ----------
    polygons
        (F,) parcels that share their vertices exactly.
    face_part, face_level, face_lineage, face_locked
        (F,) as in `Layout`.
    segments
        (S, 2, 2) ends of the mesh edges that are street.
    segment_level
        (S,) level at which a segment became street.
    corners
        (C, 2) corners of the land.
    """

    polygons: npt.NDArray[np.object_]
    face_part: IntArray
    face_level: IntArray
    face_lineage: npt.NDArray[np.uint64]
    face_locked: BoolArray
    segments: FloatArray
    segment_level: npt.NDArray[np.int16]
    corners: FloatArray


def canonical(layout: Layout) -> Layout:
    """Return the same layout with the numbering that its parcels alone decide.

    Vertices and edges are numbered in the order in which the parcels' rings, each from its
    lowest vertex, meet them. A layout that was written and read again has this numbering.
    """
    mesh = layout.mesh
    street = np.flatnonzero(layout.edge_street)
    parts = LayoutParts(
        polygons=mesh.face_polygons(),
        face_part=layout.face_part,
        face_level=layout.face_level,
        face_lineage=layout.face_lineage,
        face_locked=layout.face_locked,
        segments=mesh.xy[mesh.origin.reshape(-1, 2)[street]],
        segment_level=layout.edge_level[street],
        corners=mesh.xy[layout.vertex_corner],
    )
    rebuilt = rebuild_layout(parts, frame=layout.frame, min_area=layout.min_area)
    if _same_numbering(rebuilt, layout):
        return layout
    return rebuilt.replace(
        street_rules=layout.street_rules,
        corners_given=layout.corners_given,
        issues=layout.issues,
        history=layout.history,
        input_parts=layout.input_parts,
    )


def _same_numbering(a: Layout, b: Layout) -> bool:
    return all(
        np.array_equal(getattr(a.mesh, name), getattr(b.mesh, name))
        for name in ("xy", "origin", "next", "face")
    ) and all(
        np.array_equal(getattr(a, name), getattr(b, name))
        for name in ("vertex_corner", "edge_street", "edge_kind", "edge_level")
    )


def rebuild_layout(
    parts: LayoutParts, *, frame: Frame, min_area: float, issues: tuple[Issue, ...] = ()
) -> Layout:
    """Build the layout whose parcels and streets are given.

    Raises
    ------
    TopologyError
        If parcels overlap, or a street segment is no edge of a parcel.
    """
    mesh = mesh_from_polygons(list(canonical_rings(parts.polygons)))
    level = _edge_levels(mesh, parts.segments, parts.segment_level)
    return Layout(
        mesh=mesh,
        frame=frame,
        vertex_corner=_at(mesh.xy, parts.corners),
        edge_street=level >= 0,
        edge_kind=edge_kinds(mesh),
        edge_level=level,
        face_part=np.asarray(parts.face_part, dtype=np.int64),
        face_level=np.asarray(parts.face_level, dtype=np.int64),
        face_lineage=np.asarray(parts.face_lineage, dtype=np.uint64),
        face_locked=np.asarray(parts.face_locked, dtype=bool),
        min_area=min_area,
        issues=issues,
    )


def canonical_rings(polygons: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Start every ring at its lowest vertex; shells counter-clockwise."""
    return np.asarray(shapely.orient_polygons(shapely.normalize(polygons)), dtype=object)


def _edge_levels(
    mesh: PlanarMesh, segments: FloatArray, level: npt.NDArray[np.int16]
) -> npt.NDArray[np.int16]:
    """(E,) level of the street segment that lies on each edge, -1 for none."""
    edges = mesh.xy[mesh.origin.reshape(-1, 2)]
    keys = _sorted_ends(np.concatenate([edges, snap_to_grid(segments)]))
    unique, index = np.unique(keys, axis=0, return_inverse=True)
    edge_of = np.full(len(unique), -1)
    index = index.ravel()
    edge_of[index[: mesh.n_edges]] = np.arange(mesh.n_edges)
    hit = edge_of[index[mesh.n_edges :]]
    if (hit < 0).any():
        raise TopologyError(
            f"{int((hit < 0).sum())} pieces of street do not lie on parcel boundaries."
        )
    out = np.full(mesh.n_edges, -1, dtype=np.int16)
    out[hit] = level
    return out


def _sorted_ends(segments: FloatArray) -> FloatArray:
    """(n, 4) ends of segments, the lower one first."""
    a, b = segments[:, 0] + 0.0, segments[:, 1] + 0.0  # no negative zeros
    swap = (a[:, 0] > b[:, 0]) | ((a[:, 0] == b[:, 0]) & (a[:, 1] > b[:, 1]))
    return np.hstack([np.where(swap[:, None], b, a), np.where(swap[:, None], a, b)])


def _at(xy: FloatArray, places: FloatArray) -> BoolArray:
    """(V,) which vertices lie exactly at one of some places."""
    keys = np.concatenate([xy, snap_to_grid(places).reshape(-1, 2)]) + 0.0
    _, index = np.unique(keys, axis=0, return_inverse=True)
    index = index.ravel()
    return np.isin(index[: len(xy)], index[len(xy) :])
