"""Edits of parcels: another cut, a cut undone, a park, parcels made one (Chen 2024, section 6).

Each takes a moment and gives the state after the edit, without the streets that it may need, and
a sentence that says what was done. What cannot be done is an `EditError`.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np

from urban_processing.errors import EditError
from urban_processing.layout import NOT_FIXED, PARCEL_USE, Layout, Stage
from urban_processing.mesh.planar import FloatArray
from urban_processing.pipelines.levels import State
from urban_processing.quotas import divided
from urban_processing.session.candidates import candidates
from urban_processing.session.cutting import check_can_be_cut, cut_faces, path_across
from urban_processing.session.halves import ahead, with_kept_cuts
from urban_processing.session.joining import joined, streets_between
from urban_processing.session.lineage import descendants, merged, parents
from urban_processing.session.model import Candidate
from urban_processing.session.moment import Moment
from urban_processing.session.wording import beginning, locked_as, parcels_named
from urban_processing.subdivision.insert import insert_cuts
from urban_processing.subdivision.parcels import parcel_rings
from urban_processing.subdivision.short_edges import remove_short_edges

Edited = tuple[State, str]


def cuts_of(moment: Moment, face: int) -> tuple[Candidate, ...]:
    """Candidate cuts of a parcel; none where it is locked, too small, or around a lake."""
    if face not in moment.cuts:
        moment.cuts[face] = _cuts(moment, face)
    return moment.cuts[face]


def _cuts(moment: Moment, face: int) -> tuple[Candidate, ...]:
    layout = moment.state.layout
    barred = layout.face_locked[face] or layout.mesh.face_n_loops[face] > 1
    too_small = layout.mesh.face_area[face] < 2.0 * moment.state.floor
    return () if barred or too_small else candidates(moment.state, face)


def choose(moment: Moment, face: int, rank: int) -> Edited:
    """Cut a parcel by one of its candidates."""
    state, number = moment.state, moment.number(face)
    check_can_be_cut(moment, [face])
    found = cuts_of(moment, face)
    if not 1 <= rank <= len(found):
        raise EditError(_no_candidate(moment, face, rank, len(found)))
    chosen = found[rank - 1]
    cut, done, parent = insert_cuts(
        state.layout,
        parcel_rings(state.layout, np.array([face])),
        [[chosen.cut]],
        min_area=state.floor,
        tee_snap=chosen.tee_snap,
    )
    if not done[0]:
        raise EditError(f"Candidate {rank} of parcel {number} leaves no two legal halves.")
    halves = np.flatnonzero(parent == face)
    cut = remove_short_edges(with_kept_cuts(cut, parent), min_area=state.floor, faces=halves)
    small, large = chosen.areas
    sentence = f"Parcel {number} was cut into halves of {small:,.0f} and {large:,.0f} m²"
    quota = divided(state.layout.face_quota, parent, cut.mesh.face_area)
    after = dataclasses.replace(state, layout=cut.replace(face_quota=quota))
    return ahead(state, after), sentence


def draw_cut(moment: Moment, face: int, line: FloatArray, *, snap: float) -> Edited:
    """Cut a parcel along a line that somebody drew."""
    path = path_across(moment, face, line, snap=snap)
    after = ahead(moment.state, cut_faces(moment, {face: path}))
    return after, f"Parcel {moment.number(face)} was cut along a line"


def undo_cut(moment: Moment, face: int) -> Edited:
    """Make the halves of the cut that a parcel came of one again, and all that became of them."""
    state, layout, number = moment.state, moment.state.layout, moment.number(face)
    parent = parents(layout.face_lineage, moment.known)
    lineage = int(layout.face_lineage[face])
    if lineage not in parent:
        raise EditError(f"Parcel {number} did not come of a cut: there is none to undo.")
    faces = descendants(layout.face_lineage, parent[lineage], parent)
    locked = [f for f in faces if layout.face_locked[f]]
    if locked:
        named = moment.number(locked[0])
        raise EditError(f"Parcel {named} came of the same cut and is locked: unlock it first.")
    _check_no_given_street(moment, faces)
    one, kept = joined(moment, faces)
    stage, quota = _as_before(moment, parent[lineage], faces)
    after = _with_face(
        one,
        kept,
        face_lineage=parent[lineage],
        face_level=int(layout.face_level[face]) - 1,
        face_stage=stage,
        face_quota=quota,
    )
    halves = f"{len(faces)} parcels are" if len(faces) > 2 else "its halves are"
    sentence = f"The cut that parcel {number} came of was undone: {halves} one again"
    return dataclasses.replace(state, layout=after), sentence


def _as_before(moment: Moment, lineage: int, faces: Sequence[int]) -> tuple[Stage, int]:
    """Stage and quota of a parcel whose cut is undone, as they would be had it not been cut."""
    state, layout = moment.state, moment.state.layout
    was = moment.uncut.get(lineage)
    # what is too small for a parcel, and was finished, is one all the same
    quota = max(int(layout.face_quota[faces].sum()), len(faces)) if state.has_quota else 0
    if was is None:  # cut before the session began
        ahead = (layout.face_stage[faces] == Stage.AHEAD).all()
        return (Stage.OPEN if ahead else Stage.BEHIND), quota
    quota = was.quota if was.quota > 0 else quota
    if was.level == state.level or was.stage == Stage.DONE:
        return was.stage, quota
    is_due = was.stage == Stage.AHEAD and was.level + 1 == state.level
    return (Stage.OPEN if is_due else Stage.BEHIND), quota


def lock(moment: Moment, face: int, land_use: str) -> Edited:
    """Keep a parcel as it is, for a use such as a park."""
    state = moment.state
    layout, use = _with_use(state.layout, land_use)
    if layout.face_locked[face] and layout.face_use[face] == use:
        raise EditError(f"Parcel {moment.number(face)} is {locked_as(land_use)} already.")
    after = _with_face(layout, face, face_locked=True, face_use=use)
    sentence = f"Parcel {moment.number(face)} is kept as {land_use}"
    return dataclasses.replace(state, layout=after), sentence


def unlock(moment: Moment, face: int) -> Edited:
    """Let a locked parcel be a parcel like any other."""
    state, layout = moment.state, moment.state.layout
    if not layout.face_locked[face]:
        raise EditError(f"Parcel {moment.number(face)} is not locked.")
    after = _with_face(layout, face, face_locked=False, face_use=0)
    sentence = f"Parcel {moment.number(face)} may be cut again"
    return dataclasses.replace(state, layout=after), sentence


def merge(moment: Moment, faces: Sequence[int], land_use: str | None) -> Edited:
    """Make neighbours one parcel, which stays as it is until it is unlocked."""
    state, layout = moment.state, moment.state.layout
    if len(set(faces)) < 2:
        raise EditError("Give at least two parcels to be merged.")
    faces = sorted(set(faces))
    streets = streets_between(layout, faces)
    if len(streets):
        a, b = _beside(moment, streets[0])
        raise EditError(f"A street runs between parcels {a} and {b}: remove it first.")
    use = _common_use(moment, faces) if land_use is None else land_use
    one, kept = joined(moment, faces)
    one, number = _with_use(one, use)
    after = _with_face(
        one,
        kept,
        face_lineage=merged(layout.face_lineage[faces]),
        face_level=int(layout.face_level[faces].min()),
        face_quota=int(layout.face_quota[faces].sum()),
        face_stage=int(layout.face_stage[faces].max()),
        face_locked=True,
        face_use=number,
    )
    named = parcels_named(moment.number(f) for f in faces)
    what = "not cut unless it is unlocked" if use == PARCEL_USE else f"kept as {use}"
    sentence = f"{beginning(named)} are one now, {what}"
    return dataclasses.replace(state, layout=after), sentence


def _common_use(moment: Moment, faces: Sequence[int]) -> str:
    """The land use that several parcels have between them."""
    layout = moment.state.layout
    uses = {layout.land_uses[layout.face_use[face]] for face in faces} - {PARCEL_USE}
    if len(uses) > 1:
        raise EditError(
            f"These parcels are kept for different uses ({', '.join(sorted(uses))}): say which use "
            "they have together."
        )
    return uses.pop() if uses else PARCEL_USE


def _with_use(layout: Layout, land_use: str) -> tuple[Layout, int]:
    """The layout with a land use among its own, and the number that it has there."""
    uses = layout.land_uses
    if land_use not in uses:
        layout = layout.replace(land_uses=(*uses, land_use))
    return layout, layout.land_uses.index(land_use)


def _beside(moment: Moment, edge: int) -> tuple[int, int]:
    """Numbers of the parcels on both sides of an edge."""
    left, right = moment.state.layout.mesh.face.reshape(-1, 2)[edge].tolist()
    return moment.number(left), moment.number(right)


def _with_face(layout: Layout, face: int, **values: int | bool) -> Layout:
    """The layout with some values of one face changed."""
    changed = {}
    for name, value in values.items():
        column = getattr(layout, name).copy()
        column[face] = value
        changed[name] = column
    return layout.replace(**changed)


def _no_candidate(moment: Moment, face: int, rank: int, count: int) -> str:
    number, area = moment.number(face), moment.state.layout.mesh.face_area[face]
    if count:
        return f"Parcel {number} has {count} candidates, counted from 1; there is no {rank}."
    return (
        f"Parcel {number} ({area:,.0f} m²) cannot be cut: no cut leaves two halves of at least "
        f"{moment.state.floor:,.0f} m²."
    )


def _check_no_given_street(moment: Moment, faces: Sequence[int]) -> None:
    layout = moment.state.layout
    streets = streets_between(layout, faces)
    given = streets[layout.edge_fixed[streets] != NOT_FIXED]
    if len(given):
        a, b = _beside(moment, given[0])
        raise EditError(
            f"A street that was given runs between parcels {a} and {b}, which would be one: "
            "remove it first."
        )
