"""Taking over parcels and streets that were edited by hand in layers."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.assembly import assemble_layout
from urban_processing.errors import BoundaryError, EditError
from urban_processing.hashing import child
from urban_processing.layout import (
    NOT_FIXED,
    PARCEL_USE,
    GivenStreet,
    Layout,
    Stage,
    Steering,
)
from urban_processing.mesh.places import segments_on, vertices_at
from urban_processing.mesh.planar import BoolArray, IntArray, PlanarMesh
from urban_processing.pipelines.hand_edits import ParcelMatch, match_parcels
from urban_processing.pipelines.levels import State
from urban_processing.session.moment import PARTS_OF_CUT, Moment

Geometries = npt.NDArray[np.object_]

UNFIT = frozenset(
    {
        *("parcels_overlap", "hole_between_parcels", "parcel_lost", "street_off_boundaries"),
        "parcel_in_pieces",
    }
)
"""Issues of putting layers together that stand against taking them over."""


def adopt(
    moment: Moment, parcels: Geometries, streets: Geometries, *, snap: float
) -> tuple[State, str]:
    """The state with the parcels and streets of layers in place of its own.

    Parcels that are the same as before, moved or not, keep all that is known of them; a piece of
    a parcel is like its parcel, and what was merged is one of those that it was. Streets that
    are new stay where they are; where one is gone, none is laid again.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    parcels, streets
        Polygons and lines in local coordinates.
    snap
        Metres within which they fit together.

    Raises
    ------
    EditError
        If the parcels overlap or leave gaps, or a street runs through a parcel.
    """
    before = moment.state.layout
    if not len(parcels):
        raise EditError("No parcel is given: give the layer of all parcels.")
    try:
        drawn = assemble_layout(
            parcels,
            streets,
            frame=before.frame,
            snap=snap,
            min_area=before.min_area,
            obstacles=before.obstacles,
        )
    except BoundaryError as error:
        raise EditError(error.problems) from error
    unfit = [issue.message for issue in drawn.issues if issue.code in UNFIT]
    if unfit:
        raise EditError(unfit)
    match = match_parcels(before, drawn)
    layout = _with_faces(_with_edges(before, drawn, snap), before, match)
    return dataclasses.replace(moment.state, layout=layout), (
        f"Layers were taken over; of the parcels {match.in_words}"
    )


def _with_edges(before: Layout, drawn: Layout, snap: float) -> Layout:
    """The layout before on the drawn mesh, with what is known of its edges and vertices."""
    mesh, old = drawn.mesh, before.mesh
    fixed, level = drawn.edge_fixed.copy(), drawn.edge_level.copy()
    edge, of = _edges_on(mesh, old, before.edge_street, snap)
    known = np.zeros(mesh.n_edges, dtype=bool)
    known[edge] = True
    fixed[edge], level[edge] = before.edge_fixed[of], before.edge_level[of]
    street = drawn.edge_street
    new = street & ~known
    fixed[new] = len(before.fixed_streets)
    gone = known & ~street
    steering = np.zeros(mesh.n_edges, dtype=np.uint8)
    edge, of = _edges_on(mesh, old, before.edge_steering != Steering.NONE, snap)
    steering[edge] = before.edge_steering[of]
    steering[street] &= ~np.uint8(Steering.NO_STREET)
    steering[new] |= np.uint8(Steering.KEPT)
    steering[gone] |= np.uint8(Steering.NO_STREET)
    given = before.corners_given
    places = old.xy[before.vertex_corner]
    return drawn.replace(
        vertex_corner=vertices_at(mesh.xy, places) if given else drawn.vertex_corner,
        vertex_entry=vertices_at(mesh.xy, old.xy[before.vertex_entry]),
        edge_fixed=np.where(street, fixed, NOT_FIXED),
        edge_level=np.where(street, level, -1).astype(np.int16),
        edge_steering=steering,
        street_rules=before.street_rules,
        corners_given=given,
        issues=before.issues,
        history=before.history,
        input_parts=before.input_parts,
        fixed_streets=(*before.fixed_streets, GivenStreet()) if new.any() else before.fixed_streets,
        land_uses=before.land_uses,
    )


def _edges_on(
    mesh: PlanarMesh, old: PlanarMesh, chosen: BoolArray, snap: float
) -> tuple[IntArray, IntArray]:
    """Edges of a mesh that lie on chosen edges of another one, and on which."""
    some = np.flatnonzero(chosen)
    lines = shapely.linestrings(old.xy[old.origin.reshape(-1, 2)[some]])
    on, edge = segments_on(mesh.xy[mesh.origin.reshape(-1, 2)], lines, 2 * snap)
    return edge, some[on]


def _with_faces(layout: Layout, before: Layout, match: ParcelMatch) -> Layout:
    """The layout with what is known of its parcels."""
    own = match.source
    from_face = np.where(own >= 0, own, match.part_of)
    known = from_face >= 0
    lineage = np.where(own >= 0, before.face_lineage[own], 0).astype(np.uint64)
    taken = set(before.face_lineage.tolist())
    for face in np.flatnonzero(own < 0).tolist():
        parent = int(before.face_lineage[from_face[face]]) if known[face] else face
        lineage[face] = _free_child(parent, taken)
    piece = (own < 0) & known
    return layout.replace(
        face_lineage=lineage,
        face_level=np.where(known, before.face_level[from_face] + piece, 0),
        face_locked=known & before.face_locked[from_face],
        face_use=np.where(known, before.face_use[from_face], before.land_uses.index(PARCEL_USE)),
        face_stage=np.where(known, before.face_stage[from_face], Stage.OPEN).astype(np.int8),
        face_quota=_quota(layout, before, from_face),
    )


def _free_child(parent: int, taken: set[int]) -> int:
    """A lineage for a piece of a parcel that no cut gives, and no other piece has."""
    rank = len(PARTS_OF_CUT)
    while (lineage := child(parent, rank)) in taken:
        rank += 1
    taken.add(lineage)
    return lineage


def _quota(layout: Layout, before: Layout, from_face: IntArray) -> IntArray:
    """Parcels that each is to become, in proportion to the area it has of what it came of."""
    wanted = before.face_quota[from_face]
    share = layout.mesh.face_area / before.mesh.face_area[from_face]
    quota = np.maximum(np.round(wanted * np.minimum(share, 1.0)), np.minimum(wanted, 1))
    return np.where(from_face >= 0, quota, np.minimum(before.face_quota.max(initial=0), 1)).astype(
        np.int64
    )
