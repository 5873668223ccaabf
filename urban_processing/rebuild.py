"""Layouts from their parcels and streets, with a numbering that depends on these alone."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import TopologyError
from urban_processing.layout import (
    NOT_FIXED,
    PARCEL_USE,
    GivenStreet,
    Layout,
    Steering,
    edge_kinds,
)
from urban_processing.mesh.build import canonical_rings, mesh_from_polygons
from urban_processing.mesh.places import edges_at, vertices_at
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import Frame, Issue


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
    segment_fixed
        (S,) entry of `fixed_streets` that a segment is on, -1 for others.
    corners
        (C, 2) corners of the land.
    entries
        (N, 2) places where the network meets the outside.
    face_use
        (F,) entry of `land_uses`.
    face_stage, face_quota
        (F,) as in `Layout`.
    steered
        (T, 2, 2) ends of the mesh edges that a planner decided something of.
    steering
        (T,) what that is, as in `Layout`.
    obstacles, fixed_streets, land_uses
        As in `Layout`.
    """

    polygons: npt.NDArray[np.object_]
    face_part: IntArray
    face_level: IntArray
    face_lineage: npt.NDArray[np.uint64]
    face_locked: BoolArray
    segments: FloatArray
    segment_level: npt.NDArray[np.int16]
    segment_fixed: IntArray
    corners: FloatArray
    entries: FloatArray
    face_use: IntArray
    face_stage: npt.NDArray[np.int8]
    face_quota: IntArray
    steered: FloatArray
    steering: npt.NDArray[np.uint8]
    obstacles: tuple[shapely.Polygon, ...] = ()
    fixed_streets: tuple[GivenStreet, ...] = ()
    land_uses: tuple[str, ...] = (PARCEL_USE,)


def canonical(layout: Layout) -> Layout:
    """Return the same layout with the numbering that its parcels alone decide.

    Vertices and edges are numbered in the order in which the parcels' rings, each from its
    lowest vertex, meet them. A layout that was written and read again has this numbering.
    """
    mesh = layout.mesh
    street = np.flatnonzero(layout.edge_street)
    steered = np.flatnonzero(layout.edge_steering)
    parts = LayoutParts(
        polygons=mesh.face_polygons(),
        face_part=layout.face_part,
        face_level=layout.face_level,
        face_lineage=layout.face_lineage,
        face_locked=layout.face_locked,
        segments=mesh.xy[mesh.origin.reshape(-1, 2)[street]],
        segment_level=layout.edge_level[street],
        segment_fixed=layout.edge_fixed[street],
        corners=mesh.xy[layout.vertex_corner],
        entries=mesh.xy[layout.vertex_entry],
        face_use=layout.face_use,
        face_stage=layout.face_stage,
        face_quota=layout.face_quota,
        steered=mesh.xy[mesh.origin.reshape(-1, 2)[steered]],
        steering=layout.edge_steering[steered],
        obstacles=layout.obstacles,
        fixed_streets=layout.fixed_streets,
        land_uses=layout.land_uses,
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
        for name in ("vertex_corner", "edge_street", "edge_kind", "edge_level", "edge_steering")
    )


def rebuild_layout(
    parts: LayoutParts, *, frame: Frame, min_area: float, issues: tuple[Issue, ...] = ()
) -> Layout:
    """Build the layout whose parcels and streets are given.

    Raises
    ------
    TopologyError
        If parcels overlap, or a street segment or steered edge is no edge of a parcel.
    """
    mesh = mesh_from_polygons(list(canonical_rings(parts.polygons)))
    edge = edges_at(mesh, parts.segments)
    if (edge < 0).any():
        raise TopologyError(
            f"{int((edge < 0).sum())} pieces of street do not lie on parcel boundaries."
        )
    level = np.full(mesh.n_edges, -1, dtype=np.int16)
    level[edge] = parts.segment_level
    fixed = np.full(mesh.n_edges, NOT_FIXED)
    fixed[edge] = parts.segment_fixed
    steered = edges_at(mesh, parts.steered)
    if (steered < 0).any():
        raise TopologyError(
            f"{int((steered < 0).sum())} pieces of boundary that were decided of are none any more."
        )
    steering = np.full(mesh.n_edges, Steering.NONE, dtype=np.uint8)
    steering[steered] = parts.steering
    return Layout(
        mesh=mesh,
        frame=frame,
        vertex_corner=vertices_at(mesh.xy, parts.corners),
        vertex_entry=vertices_at(mesh.xy, parts.entries),
        edge_street=level >= 0,
        edge_kind=edge_kinds(mesh, parts.obstacles),
        edge_level=level,
        edge_fixed=fixed,
        edge_steering=steering,
        face_part=np.asarray(parts.face_part, dtype=np.int64),
        face_level=np.asarray(parts.face_level, dtype=np.int64),
        face_lineage=np.asarray(parts.face_lineage, dtype=np.uint64),
        face_locked=np.asarray(parts.face_locked, dtype=bool),
        face_use=np.asarray(parts.face_use, dtype=np.int64),
        face_stage=np.asarray(parts.face_stage, dtype=np.int8),
        face_quota=np.asarray(parts.face_quota, dtype=np.int64),
        min_area=min_area,
        issues=issues,
        obstacles=parts.obstacles,
        fixed_streets=parts.fixed_streets,
        land_uses=parts.land_uses,
    )
