"""Taking over parcels and streets that were edited by hand in layers."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.assembly import assemble_layout, kept_of, land_changes
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
from urban_processing.mesh.places import edges_on
from urban_processing.mesh.planar import IntArray
from urban_processing.pipelines.hand_edits import ParcelMatch, match_parcels
from urban_processing.pipelines.levels import State
from urban_processing.session.moment import PARTS_OF_CUT, Moment
from urban_processing.site import Issue

Geometries = npt.NDArray[np.object_]

UNFIT = {
    "parcels_overlap": "Parcels overlap at {n} places, {value:,.0f} m² in all: mend their "
    "outlines.",
    "hole_between_parcels": "{value:,.0f} m² at {n} places between parcels belong to none: close "
    "the gaps.",
    "parcel_lost": "{n} parcels are too small or too narrow to be parcels: leave them out.",
    "parcel_in_pieces": "{n} parcels are in several pieces or cross themselves: make each piece a "
    "parcel.",
    "street_off_boundaries": "About {value:,.0f} m of streets run along no parcel boundary: split "
    "the parcels that they cross.",
}
"""Why layers are not taken over, by the code of the issue of putting them together."""


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
            kept=kept_of(before),
        )
    except BoundaryError as error:
        raise EditError(error.problems) from error
    unfit = _unfit(drawn.issues)
    if unfit:
        raise EditError(unfit)
    _check_land(before, drawn, snap)
    match = match_parcels(before, drawn)
    layout = _with_faces(_with_edges(before, drawn, snap), moment, match)
    return dataclasses.replace(moment.state, layout=layout), (
        f"Layers were taken over; of the parcels {match.in_words}"
    )


def _with_edges(before: Layout, drawn: Layout, snap: float) -> Layout:
    """The drawn layout with what is known of streets that were there, are new, or are gone."""
    mesh, street = drawn.mesh, drawn.edge_street
    fixed, level = drawn.edge_fixed.copy(), drawn.edge_level.copy()
    edge, of = edges_on(mesh, before.mesh, before.edge_street, 2 * snap)
    known = np.zeros(mesh.n_edges, dtype=bool)
    known[edge] = True
    fixed[edge], level[edge] = before.edge_fixed[of], before.edge_level[of]
    new, gone = street & ~known, known & ~street
    fixed[new] = len(before.fixed_streets)
    steering = drawn.edge_steering.copy()
    steering[street] &= ~np.uint8(Steering.NO_STREET)
    steering[new] |= np.uint8(Steering.KEPT)
    steering[gone] |= np.uint8(Steering.NO_STREET)
    given = before.fixed_streets
    return drawn.replace(
        edge_fixed=np.where(street, fixed, NOT_FIXED),
        edge_level=np.where(street, level, -1).astype(np.int16),
        edge_steering=steering,
        fixed_streets=(*given, GivenStreet()) if new.any() else given,
        land_uses=before.land_uses,
        issues=before.issues,
    )


def _unfit(issues: Sequence[Issue]) -> list[str]:
    """What stands against taking layers over, one sentence for each kind."""
    problems = []
    for code, sentence in UNFIT.items():
        found = [issue.value or 0.0 for issue in issues if issue.code == code]
        if found:
            problems.append(sentence.format(n=len(found), value=sum(found)))
    return problems


def _check_land(before: Layout, drawn: Layout, snap: float) -> None:
    """Raise `EditError` unless the parcels cover the land that there was."""
    land = shapely.coverage_union_all(before.mesh.face_polygons())
    missing, more = land_changes(land, drawn, snap)
    if missing:
        raise EditError(
            f"{missing:,.0f} m² of the land belong to no parcel: give the layer of all parcels."
        )
    if more:
        raise EditError(f"Parcels reach {more:,.0f} m² beyond the land: cut them at its rim.")


def _with_faces(layout: Layout, moment: Moment, match: ParcelMatch) -> Layout:
    """The layout with what is known of its parcels."""
    before = moment.state.layout
    own = match.source
    from_face = np.where(own >= 0, own, match.part_of)
    known = from_face >= 0
    lineage = np.where(own >= 0, before.face_lineage[own], 0).astype(np.uint64)
    taken = set(moment.known)
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
