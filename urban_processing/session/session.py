"""`Session`: a layout that is steered level by level (Chen 2024, section 6, local control)."""

from __future__ import annotations

import copy
import dataclasses
from collections.abc import Iterable, Sequence
from os import PathLike
from pathlib import Path
from typing import Any, Self

import numpy.typing as npt
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import Layout
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.levels import State, begin
from urban_processing.pipelines.stops import ALGORITHM, progress_of, state_of
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.rebuild import canonical
from urban_processing.session import files
from urban_processing.session.edits import make_edit
from urban_processing.session.figures import figures, left_to_cut
from urban_processing.session.history import History
from urban_processing.session.model import Candidate, Change
from urban_processing.session.moment import Moment, first_moment
from urban_processing.session.parcel_edits import cuts_of
from urban_processing.session.places import face_of, local
from urban_processing.session.reading import named
from urban_processing.session.reading import parcel as read_parcel
from urban_processing.session.reading import place as read_place
from urban_processing.site import Site
from urban_processing.version import __version__

STEER = "steer"
"""Name of what a session did, in provenance."""

Place = tuple[float, float]


class Session(History):
    """A layout in the making: look at each level, change what is not liked, let it go on.

    Parcels have numbers that they keep until they are cut or merged; wherever a parcel is asked
    for, a place (x, y) in it does as well. Coordinates are map coordinates. Every edit is checked
    against the design requirements of Chen 2024, section 3: where a parcel would lose its
    street, the network fall apart or a parcel be too small, it raises an `EditError` that says
    so, and nothing has changed. What an edit needs in streets is laid at once.

    A session is begun with `begin`, `of_layout` or `load`.

    References
    ----------
    Chen, W. et al. (2024). Hierarchical co-generation of parcels and streets in urban modeling.
    Section 6, Fig. 15.
    """

    def __init__(self, state: State, start: files.Start) -> None:
        super().__init__(first_moment(state), start.sentence)
        self._start = start
        self._shown: tuple[Moment, int, Layout] | None = None

    @classmethod
    def begin(cls, site: Site, params: CogenerateParams) -> Self:
        """Begin with land: one parcel for each of its parts, before the first level.

        Raises
        ------
        InfeasibleError
            If the parameters do not go together on this land.
        """
        params = dataclasses.replace(params, stop_at_level=None)
        state = begin(site, params)
        entry = Step(
            algorithm=ALGORITHM,
            parameters=params.as_dict(),
            seed=params.seed,
            version=__version__,
            input_sha256=site.input_sha256,
            seconds=0.0,
            results=progress_of(state),
        )
        layout = state.layout.replace(history=(*state.layout.history, entry))
        state = dataclasses.replace(state, layout=layout)
        return cls(state, files.start_with_land(site, params))

    @classmethod
    def of_layout(cls, layout: Layout) -> Self:
        """Go on with a layout that co-generation made, stopped at a level or finished.

        Raises
        ------
        BoundaryError
            If co-generation did not make it.
        """
        # numbered by the parcels alone, so that the layout's file is the same start
        state = state_of(canonical(layout))
        return cls(state, files.start_with_layout(state.layout, state.params))

    # what there is now

    @property
    def layout(self) -> Layout:
        """Parcels and streets as they are now, with what was done in its provenance."""
        moment, now = self._moment, self._timeline.now
        if self._shown is None or self._shown[0] is not moment or self._shown[1] != now:
            self._shown = moment, now, self._told(moment.state)
        return self._shown[2]

    def _told(self, state: State) -> Layout:
        """The layout of a state with the edits in its provenance."""
        if not self.edits:
            return state.layout
        entry = Step(
            algorithm=STEER,
            parameters={"edits": [edit.told() for edit in self.edits]},
            seed=state.params.seed,
            version=__version__,
            input_sha256=self._start.sha256,
            seconds=0.0,
            results=progress_of(state),
        )
        return state.layout.replace(history=(*state.layout.history, entry))

    @property
    def params(self) -> CogenerateParams:
        """The parameters that the levels are laid out with."""
        return self._moment.state.params

    @property
    def level(self) -> int:
        """Number of levels so far."""
        return self._moment.state.level

    @property
    def finished(self) -> bool:
        """Whether no level is to come."""
        return self._moment.state.finished

    @property
    def is_complete(self) -> bool:
        """Whether the layout is finished: cleaned up and optimized, with nothing left to cut."""
        return self._moment.state.completed and self.finished

    @property
    def to_cut(self) -> tuple[int, ...]:
        """Numbers of the parcels that levels to come cut, or divide with their blocks."""
        moment = self._moment
        return tuple(moment.number(face) for face in left_to_cut(moment.state).tolist())

    @property
    def parcels(self) -> tuple[int, ...]:
        """Number of each parcel, in the order of the layout's faces."""
        return self._moment.parcels

    def figures(self) -> dict[str, float]:
        """Figures of the layout as it is now, by name: see `urban_processing.session.figures`."""
        return figures(self._moment.state)

    def parcel_at(self, place: Place) -> int | None:
        """Number of the parcel at a place; None where there is none."""
        moment = self._moment
        face = moment.face_at(local(moment, (named("A place", read_place, place),))[0])
        return None if face is None else moment.number(face)

    def candidates(self, parcel: int | Place) -> tuple[Candidate, ...]:
        """Ways of cutting a parcel, the best first; none where it cannot be cut.

        The first one is what the next level does, but for ends that it moves to where a
        neighbour's cut of the same level ends.
        """
        moment = self._moment
        return cuts_of(moment, face_of(moment, named("A parcel", read_parcel, parcel)))

    # edits

    def step(self, progress: Progress = SILENT) -> Change:
        """Lay out the next level."""
        return self.do("step", progress=progress)

    def finish(self, progress: Progress = SILENT) -> Change:
        """Lay out all the levels that are still to come, clean up the streets and optimize."""
        return self.do("finish", progress=progress)

    def choose(self, parcel: int | Place, candidate: int) -> Change:
        """Cut a parcel by one of its candidates, given by its rank.

        The next level leaves the halves alone: this was their cut.
        """
        return self.do("choose", parcel=parcel, candidate=candidate)

    def cut(self, parcel: int | Place, line: npt.ArrayLike, *, snap: float | None = None) -> Change:
        """Cut a parcel along a drawn line, (n, 2), that enters and leaves it once.

        Ends that lie within `snap` metres of a corner are moved there.
        """
        return self.do("cut", parcel=parcel, line=line, snap=snap)

    def undo_cut(self, parcel: int | Place) -> Change:
        """Undo the cut that a parcel came of; the next level cuts what is one again anew."""
        return self.do("undo_cut", parcel=parcel)

    def lock(self, parcel: int | Place, land_use: str | None = None) -> Change:
        """Keep a parcel as it is for a land use, by default as a park."""
        return self.do("lock", parcel=parcel, land_use=land_use)

    def unlock(self, parcel: int | Place) -> Change:
        """Let a locked parcel be one like any other."""
        return self.do("unlock", parcel=parcel)

    def merge(self, parcels: Sequence[int | Place], land_use: str | None = None) -> Change:
        """Make neighbours one parcel, which is locked, for a land use if one is given."""
        return self.do("merge", parcels=parcels, land_use=land_use)

    def add_street(
        self,
        line: npt.ArrayLike,
        *,
        follow: bool = False,
        street_class: str = "",
        width: float | None = None,
        snap: float | None = None,
    ) -> Change:
        """Lay a street that stays where it is.

        Parameters
        ----------
        line
            (n, 2) points that it is drawn through, cutting the parcels that it crosses; with
            `follow`, points that it goes through along the boundaries of parcels.
        street_class, width
            Kept as they are given; the width of its right-of-way is in metres.
        snap
            Metres within which a drawn line runs on a boundary, or a point is on one.
        """
        return self.do(
            "add_street",
            line=line,
            follow=follow,
            street_class=street_class,
            width=width,
            snap=snap,
        )

    def remove_street(self, place: Place, *, reach: float | None = None) -> Change:
        """Take away the street at a place, from junction to junction; none is laid there again.

        Parcels that need another street get one.
        """
        return self.do("remove_street", place=place, reach=reach)

    def adopt(
        self,
        parcels: Iterable[shapely.Geometry],
        streets: Iterable[shapely.Geometry],
        *,
        snap: float | None = None,
    ) -> Change:
        """Take over parcels and streets that were edited by hand, in a GIS.

        Parcels that are the same as before keep their numbers and what is known of them.

        Parameters
        ----------
        parcels
            Polygons that cover the land without overlaps and gaps.
        streets
            Lines along their boundaries, those of the rim included.
        snap
            Metres within which they fit together.
        """
        return self.do("adopt", parcels=parcels, streets=streets, snap=snap)

    def do(self, name: str, progress: Progress = SILENT, **values: Any) -> Change:
        """Do an edit by its name in files; values that are None are left out.

        Raises
        ------
        EditError
            If it cannot be done, or would break the requirements; nothing has changed then.
        """
        given = {key: value for key, value in values.items() if value is not None}
        return self._do(make_edit(name, given), progress)

    # files

    def save(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Save what was done as a small JSON file, which `load` replays.

        Raises
        ------
        OutputError
            If the file is there already, or cannot be written.
        """
        done = [
            (entry.edit, entry.before) for entry in self._timeline.entries if entry.edit is not None
        ]
        timeline = self._timeline
        saved = files.as_json(
            self._start, done, current=timeline.now, redo=timeline.last(), layout=self.layout
        )
        return files.save(path, saved, overwrite=overwrite)

    @classmethod
    def load(
        cls, path: str | PathLike[str], start: Site | Layout, progress: Progress = SILENT
    ) -> Self:
        """Replay a saved session on the land or the layout that it began with.

        Raises
        ------
        EditError
            If the file is no saved session, is of another version, was begun with something
            else, or holds an edit that cannot be done.
        """
        return cls.replayed(files.read(path), start, progress)

    @classmethod
    def replayed(
        cls, saved: files.Saved, start: Site | Layout, progress: Progress = SILENT
    ) -> Self:
        """Replay a session that was read, as `load` does."""
        if isinstance(start, Site):
            session = cls.begin(start, saved.params())
        else:
            session = cls.of_layout(start)
        session.replay(saved, progress)
        return session

    def replay(self, saved: files.Saved, progress: Progress = SILENT) -> None:
        """Do the edits of a file, one after the other, branches included.

        Raises
        ------
        EditError
            If they were made on something else, or where one cannot be done; nothing has changed
            then.
        """
        saved.check_start(self._start)
        other = copy.copy(self)
        other._timeline = self._timeline.copy()
        other._replay(saved, progress)
        saved.check_result(other.layout)
        self._timeline = other._timeline

    def _replay(self, saved: files.Saved, progress: Progress) -> None:
        count = len(saved.edits)
        numbers = [self._timeline.now]
        for i, (edit, after) in enumerate(zip(saved.edits, saved.after, strict=True)):
            self._timeline.now = numbers[after]
            try:
                self._do(edit, progress.slice(i / count, (i + 1) / count))
            except EditError as error:
                where = f"{saved.path}, edit {i + 1} ({edit.name})"
                raise EditError(f"{where}: {problem}" for problem in error.problems) from error
            numbers.append(self._timeline.now)
        self._timeline.go_to(numbers[saved.redo])
        self._timeline.go_to(numbers[saved.current])
