"""A state of a session with the numbers of its parcels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import shapely

from urban_processing.errors import EditError
from urban_processing.hashing import child
from urban_processing.layout import Stage
from urban_processing.mesh.planar import FloatArray
from urban_processing.pipelines.levels import State
from urban_processing.session.model import Candidate
from urban_processing.session.wording import parcels_named

PARTS_OF_CUT = (0, 1)
"""Ranks of the halves of a cut parcel among its parts, as `hashing.child` counts them."""


@dataclass(frozen=True)
class Uncut:
    """What there was to know of a parcel before it was cut or merged.

    Parameters
    ----------
    stage, quota
        As in `Layout`.
    level
        Number of levels that there were.
    """

    stage: Stage
    quota: int
    level: int


@dataclass(frozen=True, eq=False)
class Moment:
    """A state, and the number of every parcel there is or was on the way to it.

    A parcel keeps its number as long as it is neither cut nor merged; one that comes back when
    its cut is undone has the number that it had.

    Parameters
    ----------
    state
        Layout and level.
    known
        Number, counted from 1, of each lineage (see `Layout.face_lineage`).
    uncut
        What was known of lineages that are no more.
    """

    state: State
    known: Mapping[int, int]
    uncut: Mapping[int, Uncut]

    @cached_property
    def parcels(self) -> tuple[int, ...]:
        """(F,) number of each face."""
        known = self.known
        return tuple(known[lineage] for lineage in self.state.layout.face_lineage.tolist())

    @cached_property
    def _face_of(self) -> dict[int, int]:
        return {number: face for face, number in enumerate(self.parcels)}

    @cached_property
    def _tree(self) -> shapely.STRtree:
        return shapely.STRtree(self.state.layout.mesh.face_polygons())

    @cached_property
    def cuts(self) -> dict[int, tuple[Candidate, ...]]:
        """Candidate cuts of faces, as far as they were asked for."""
        return {}

    def number(self, face: int) -> int:
        """Number of a face's parcel."""
        return self.parcels[face]

    def face(self, parcel: int) -> int:
        """Face of a parcel; `EditError` where there is no such parcel any more, or never was."""
        face = self._face_of.get(parcel)
        if face is None:
            raise EditError(self._unknown(parcel))
        return face

    def face_at(self, place: FloatArray) -> int | None:
        """Face at a place (x, y) in local coordinates; None where there is no parcel."""
        found = self._tree.query(shapely.Point(place), predicate="intersects")
        return int(found.min()) if len(found) else None

    def _unknown(self, parcel: int) -> str:
        lineage = next((key for key, number in self.known.items() if number == parcel), None)
        if lineage is None:
            verb = "is" if len(self.parcels) == 1 else "are"
            return f"There is no parcel {parcel}; now there {verb} {parcels_named(self.parcels)}."
        for whole, number in zip(
            self.state.layout.face_lineage.tolist(), self.parcels, strict=True
        ):
            if lineage in (child(whole, rank) for rank in PARTS_OF_CUT):
                return f"Parcel {parcel} is no more: it is part of parcel {number} again."
        halves = [self.known.get(child(lineage, rank)) for rank in PARTS_OF_CUT]
        if None in halves:
            return f"Parcel {parcel} is no more: it was merged with others, or divided anew."
        return f"Parcel {parcel} is no more: it was cut into {halves[0]} and {halves[1]}."


def first_moment(state: State) -> Moment:
    """The moment that a session begins with."""
    return _numbered(state, {}, {})


def next_moment(before: Moment, state: State) -> Moment:
    """The moment after an edit: new parcels get the next numbers, in the order of their faces."""
    layout = before.state.layout
    there = set(state.layout.face_lineage.tolist())
    gone = {
        lineage: Uncut(Stage(stage), quota, before.state.level)
        for lineage, stage, quota in zip(
            layout.face_lineage.tolist(),
            layout.face_stage.tolist(),
            layout.face_quota.tolist(),
            strict=True,
        )
        if lineage not in there
    }
    return _numbered(state, before.known, {**before.uncut, **gone})


def _numbered(state: State, numbers: Mapping[int, int], uncut: Mapping[int, Uncut]) -> Moment:
    known = dict(numbers)
    following = max(known.values(), default=0) + 1
    for lineage in state.layout.face_lineage.tolist():
        if lineage not in known:
            known[lineage] = following
            following += 1
    return Moment(state, known, uncut)
