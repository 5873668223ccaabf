"""Edits as data: what a session does, in the form in which it is saved and replayed."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, ClassVar

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import GivenStreet
from urban_processing.pipelines import levels
from urban_processing.pipelines.cogenerate import go_on
from urban_processing.pipelines.levels import State
from urban_processing.pipelines.stops import BLOCKS_DIVIDED, LEVEL
from urban_processing.progress import Progress
from urban_processing.session import adoption, parcel_edits, street_edits
from urban_processing.session.moment import Moment
from urban_processing.session.places import LEAST_SNAP, face_of, local, reach_of, snap_of
from urban_processing.session.reading import (
    Place,
    Rings,
    flag,
    land_use,
    land_use_or_none,
    lines,
    number_or_none,
    parcel,
    parcels,
    place,
    points,
    polygons,
    street_width,
    text,
    tolerance,
    whole,
)

PARK = "park"
"""Land use of a parcel that is locked without saying what for."""


@dataclass(frozen=True)
class Edit(abc.ABC):
    """One thing that a planner does; coordinates are on the map."""

    name: ClassVar[str]
    grows_streets: ClassVar[bool] = True
    """Whether the streets that the parcels then need are laid, and the requirements checked."""

    @abc.abstractmethod
    def apply(self, moment: Moment, progress: Progress) -> tuple[State, str]:
        """Return the state after the edit, and what was done; `EditError` where it cannot be."""

    def told(self) -> dict[str, Any]:
        """Return what provenance tells of the edit."""
        return self.as_dict()

    def as_dict(self) -> dict[str, Any]:
        """Return the edit for JSON; what has its default is left out."""
        values: dict[str, Any] = {"edit": self.name}
        for each in dataclasses.fields(self):
            value = getattr(self, each.name)
            if each.default is dataclasses.MISSING or value != each.default:
                values[each.name] = value
        return values


class PromptEdit(Edit):
    """An edit that takes no time worth telling of."""

    def apply(self, moment: Moment, progress: Progress) -> tuple[State, str]:
        """Do it."""
        del progress
        return self.done(moment)

    @abc.abstractmethod
    def done(self, moment: Moment) -> tuple[State, str]:
        """Return the state after the edit, and what was done; `EditError` where it cannot be."""


def _by(reader: Callable[[Any], Any]) -> Mapping[str, Any]:
    return {"reader": reader}


@dataclass(frozen=True)
class TakeStep(Edit):
    """Let the next level be laid out."""

    name: ClassVar[str] = "step"
    grows_streets: ClassVar[bool] = False

    def apply(self, moment: Moment, progress: Progress) -> tuple[State, str]:
        """Lay out the next level."""
        if moment.state.finished:
            further = "" if moment.state.completed else ": finish the layout"
            raise EditError(f"No parcel is left that the next level could cut{further}.")
        progress.update(0.0, f"Level {moment.state.level + 1}")
        after = levels.step(moment.state)
        return after, f"Level {after.level}: {after.layout.mesh.n_faces:,} parcels"


@dataclass(frozen=True)
class Choose(PromptEdit):
    """Cut a parcel by one of its candidates."""

    parcel: int | Place = field(metadata=_by(parcel))
    candidate: int = field(metadata=_by(whole))
    name: ClassVar[str] = "choose"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Cut the parcel."""
        return parcel_edits.choose(moment, face_of(moment, self.parcel), self.candidate)


@dataclass(frozen=True)
class Cut(PromptEdit):
    """Cut a parcel along a drawn line."""

    parcel: int | Place = field(metadata=_by(parcel))
    line: tuple[Place, ...] = field(metadata=_by(points))
    snap: float | None = field(default=None, metadata=_by(number_or_none))
    name: ClassVar[str] = "cut"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Cut the parcel."""
        face = face_of(moment, self.parcel)
        line = local(moment, self.line)
        return parcel_edits.draw_cut(moment, face, line, snap=snap_of(moment, self.snap))


@dataclass(frozen=True)
class UndoCut(PromptEdit):
    """Make one parcel again of all that came of the cut that a parcel came of."""

    parcel: int | Place = field(metadata=_by(parcel))
    name: ClassVar[str] = "undo_cut"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Undo the cut."""
        return parcel_edits.undo_cut(moment, face_of(moment, self.parcel))


@dataclass(frozen=True)
class Lock(PromptEdit):
    """Keep a parcel as it is, for a use."""

    parcel: int | Place = field(metadata=_by(parcel))
    land_use: str = field(default=PARK, metadata=_by(land_use))
    name: ClassVar[str] = "lock"
    grows_streets: ClassVar[bool] = False

    def done(self, moment: Moment) -> tuple[State, str]:
        """Lock the parcel."""
        return parcel_edits.lock(moment, face_of(moment, self.parcel), self.land_use)


@dataclass(frozen=True)
class Unlock(PromptEdit):
    """Let a locked parcel be one like any other."""

    parcel: int | Place = field(metadata=_by(parcel))
    name: ClassVar[str] = "unlock"
    grows_streets: ClassVar[bool] = False

    def done(self, moment: Moment) -> tuple[State, str]:
        """Unlock the parcel."""
        return parcel_edits.unlock(moment, face_of(moment, self.parcel))


@dataclass(frozen=True)
class Merge(PromptEdit):
    """Make neighbours one parcel that is not cut any more."""

    parcels: tuple[int | Place, ...] = field(metadata=_by(parcels))
    land_use: str | None = field(default=None, metadata=_by(land_use_or_none))
    name: ClassVar[str] = "merge"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Merge the parcels."""
        faces = [face_of(moment, each) for each in self.parcels]
        return parcel_edits.merge(moment, faces, self.land_use)


@dataclass(frozen=True)
class AddStreet(PromptEdit):
    """Lay a street along a drawn line, or along parcel boundaries from point to point."""

    line: tuple[Place, ...] = field(metadata=_by(points))
    follow: bool = field(default=False, metadata=_by(flag))
    street_class: str = field(default="", metadata=_by(text))
    width: float | None = field(default=None, metadata=_by(street_width))
    snap: float | None = field(default=None, metadata=_by(number_or_none))
    name: ClassVar[str] = "add_street"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Lay the street."""
        width = np.nan if self.width is None else self.width
        default = reach_of(moment, None) if self.follow else snap_of(moment, None)
        return street_edits.add_street(
            moment,
            local(moment, self.line),
            snap=default if self.snap is None else self.snap,
            follow=self.follow,
            given=GivenStreet(self.street_class, width),
        )


@dataclass(frozen=True)
class RemoveStreet(PromptEdit):
    """Take away the street at a place, from junction to junction."""

    place: Place = field(metadata=_by(place))
    reach: float | None = field(default=None, metadata=_by(number_or_none))
    name: ClassVar[str] = "remove_street"

    def done(self, moment: Moment) -> tuple[State, str]:
        """Remove the street."""
        at = local(moment, (self.place,))[0]
        return street_edits.remove_street(moment, at, reach=reach_of(moment, self.reach))


@dataclass(frozen=True)
class Adopt(PromptEdit):
    """Take over parcels and streets that were edited by hand."""

    parcels: tuple[Rings, ...] = field(metadata=_by(polygons))
    streets: tuple[tuple[Place, ...], ...] = field(metadata=_by(lines))
    snap: float = field(default=LEAST_SNAP, metadata=_by(tolerance))
    name: ClassVar[str] = "adopt"

    def told(self) -> dict[str, Any]:
        """Return how much was taken over; what it was stands in the layout."""
        counts = {"parcels": len(self.parcels), "streets": len(self.streets)}
        return {"edit": self.name, **counts, "snap": self.snap}

    def done(self, moment: Moment) -> tuple[State, str]:
        """Take them over."""
        shapes = [
            shapely.Polygon(local(moment, shell), [local(moment, hole) for hole in holes])
            for shell, *holes in self.parcels
        ]
        drawn = [shapely.LineString(local(moment, line)) for line in self.streets]
        return adoption.adopt(
            moment,
            np.array(shapes, dtype=object),
            np.array(drawn, dtype=object),
            snap=self.snap,
        )


@dataclass(frozen=True)
class Finish(Edit):
    """Lay out the levels that are still to come, clean up and optimize."""

    name: ClassVar[str] = "finish"
    grows_streets: ClassVar[bool] = False

    def apply(self, moment: Moment, progress: Progress) -> tuple[State, str]:
        """Finish the layout."""
        if moment.state.completed and moment.state.finished:
            raise EditError("The layout is finished already.")
        layout, results = go_on(moment.state, stop_at=None, progress=progress)
        after = dataclasses.replace(
            moment.state,
            layout=layout,
            level=int(results[LEVEL]),
            blocks_divided=bool(results[BLOCKS_DIVIDED]),
            completed=True,
        )
        return after, f"Finished: {layout.mesh.n_faces:,} parcels"


KINDS: Mapping[str, type[Edit]] = {
    kind.name: kind
    for kind in (
        *(TakeStep, Choose, Cut, UndoCut, Lock, Unlock, Merge, AddStreet, RemoveStreet),
        *(Adopt, Finish),
    )
}
"""All edits by the name that they have in files."""


def make_edit(name: str, values: Mapping[str, Any]) -> Edit:
    """Make an edit of values as people or files give them.

    Raises
    ------
    EditError
        With everything that is wrong with them.
    """
    kind = KINDS.get(name)
    if kind is None:
        raise EditError(f"There is no edit {name!r}; there are {', '.join(KINDS)}.")
    problems, read = [], {}
    known = {each.name: each for each in dataclasses.fields(kind)}
    for key in values:
        if key not in known:
            there = ", ".join(known) or "nothing"
            problems.append(f"{name} knows no {key}; it takes {there}.")
    for key, each in known.items():
        if key in values:
            try:
                read[key] = each.metadata["reader"](values[key])
            except EditError as error:
                problems += [f"{name}: {key} {problem}" for problem in error.problems]
        elif each.default is dataclasses.MISSING:
            problems.append(f"{name} needs {key}.")
    if problems:
        raise EditError(problems)
    return kind(**read)
