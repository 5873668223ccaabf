"""What the window asks of the session, and what it hears back."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsApplication, QgsCoordinateReferenceSystem
from qgis.PyQt.QtCore import QObject, QTimer, pyqtSignal

from qgis_plugin import dependencies
from qgis_plugin.crs_text import crs_of
from qgis_plugin.feedback import in_qgis
from qgis_plugin.steering.layers import SteeringLayers
from qgis_plugin.steering.loading import load_layers
from qgis_plugin.steering.model import Place, Start, View
from qgis_plugin.steering.worker import Job, Worker
from qgis_plugin.texts import tr
from urban_processing.errors import Cancelled, UrbanError
from urban_processing.progress import Progress

if TYPE_CHECKING:
    from qgis_plugin.steering.bench import Bench

_HOVER = "hover"
_DONE = object()


class Steering(QObject):
    """One session at a time, its layers, and the thread that works on it."""

    began = pyqtSignal()
    """There is a session."""

    ended = pyqtSignal()
    """There is none any more."""

    viewed = pyqtSignal(object)
    """There is something new to see: a `View`."""

    told = pyqtSignal(str)
    """Something was done that leaves the session as it is."""

    refused = pyqtSignal(list)
    """Something could not be done: sentences."""

    state_changed = pyqtSignal()
    """What may be done has changed."""

    progressed = pyqtSignal(float, str)
    hovered = pyqtSignal(object)
    """The parcel under the cursor: a `Hovered`, or None."""

    def __init__(self) -> None:
        super().__init__()
        self.worker = Worker()
        self.layers = SteeringLayers()
        self.layers.hand_edited.connect(self.state_changed)
        self.layers.gone.connect(self.state_changed)
        self.view: View | None = None
        self.name = ""
        self.unsaved = False
        self._bench: Bench | None = None
        self._job: Job | None = None
        self._changes: Iterator[None] | None = None
        self._context: Any = None
        self.doing = ""
        """What is being done, in words."""

    # what may be done

    @property
    def is_busy(self) -> bool:
        """Whether something is being done that nothing else may be done beside."""
        return self._job is not None or self._changes is not None

    @property
    def can_cancel(self) -> bool:
        """Whether what is being done may be stopped."""
        return self._job is not None and self._job.progressed is not None

    @property
    def crs(self) -> QgsCoordinateReferenceSystem:
        """CRS of the session's coordinates."""
        return crs_of(self.view.crs if self.view is not None else "")

    def why_not(self) -> str:
        """Say why nothing may be changed now; empty where it may."""
        if self.is_busy:
            return tr("Wait: {}").format(self.doing)
        if self.layers.are_edited:
            return tr("First take over or discard what was edited by hand.")
        return ""

    # beginning and ending

    def begin(self, start: Start) -> None:
        """Begin a session."""
        self._begin(start, None, tr("Reading the land…"))

    def open(self, path: Path, start: Start) -> None:
        """Replay a saved session."""
        self._begin(start, path, tr("Replaying the session…"))

    def end(self) -> None:
        """Forget the session and its layers."""
        self._bench, self.view, self.unsaved = None, None, False
        self._changes = None
        self.layers.remove()
        self.ended.emit()

    def close(self) -> None:
        """Stop the thread, and take the layers away."""
        self.worker.close()
        self._job = self._changes = None
        self.layers.remove()
        for owned in (self.layers, self.worker):
            owned.deleteLater()

    def cancel(self) -> None:
        """Stop what is being done at its next step."""
        if self._job is not None:
            self._job.cancel()

    # edits

    def step(self) -> None:
        """Go one level on."""
        self._edit(lambda s, p: s.step(progress=p), tr("The next level is laid out…"))

    def finish(self) -> None:
        """Go through all levels, then clean up and smooth."""
        self._edit(lambda s, p: s.finish(progress=p), tr("The layout is finished…"))

    def undo(self) -> None:
        """Take back the last edit."""
        self._edit(lambda s, _: s.undo())

    def redo(self) -> None:
        """Do again what was taken back."""
        self._edit(lambda s, _: s.redo())

    def go_to(self, branch: int) -> None:
        """Go over to another branch."""
        self._edit(lambda s, _: s.go_to(branch))

    def choose(self, parcel: int, rank: int) -> None:
        """Cut a parcel by one of its candidates."""
        self._edit(lambda s, _: s.choose(parcel, rank))

    def cut(self, line: Sequence[Place]) -> None:
        """Cut a parcel along a drawn line."""
        self._change(lambda bench, _: bench.cut(line))

    def undo_cut(self, place: Place) -> None:
        """Join what the last cut of the parcel at a place made."""
        self._edit_parcel(place, lambda s, parcel: s.undo_cut(parcel))

    def lock(self, place: Place, land_use: str) -> None:
        """Keep the parcel at a place as it is."""
        self._edit_parcel(place, lambda s, parcel: s.lock(parcel, land_use))

    def unlock(self, place: Place) -> None:
        """Let the parcel at a place be cut again."""
        self._edit_parcel(place, lambda s, parcel: s.unlock(parcel))

    def merge(self, parcels: Sequence[int]) -> None:
        """Join parcels to one."""
        self._edit(lambda s, _: s.merge(tuple(parcels)))

    def add_street(self, line: Sequence[Place], *, follow: bool, width: float | None) -> None:
        """Lay a street along a drawn line, or along the boundaries of parcels next to it."""
        self._change(
            lambda bench, _: bench.add_street(line, follow=follow, width=width),
        )

    def remove_street(self, place: Place, reach: float) -> None:
        """Take the street at a place away."""
        self._edit(lambda s, _: s.remove_street(place, reach=reach))

    # edits by hand

    def adopt(self) -> None:
        """Take over what was edited by hand in the layers."""
        parcels, streets = self.layers.drawn()
        self._change(
            lambda bench, _: bench.adopt(parcels, streets),
            tr("The hand edits are taken over…"),
            by_hand=True,
        )

    def discard_hand_edits(self) -> None:
        """Show the session again as it is."""
        self._change(lambda bench, _: bench.view(whole=True), by_hand=True, changes=False)

    def show_layers(self) -> None:
        """Put the layers into the project again."""
        if self.view is not None and not self.layers.are_there:
            self._change(lambda bench, _: bench.view(whole=True), changes=False)

    # looking

    def hover(self, place: Place, *, with_options: bool) -> None:
        """Ask for the parcel at a place; the newest question wins."""
        bench = self._bench
        if bench is None or self.is_busy:
            return
        self.worker.ask(
            Job(
                lambda _: bench.hovered(place, with_options=with_options),
                self.hovered.emit,
                self._refuse,
                latest=_HOVER,
            )
        )

    # results

    def save(self, path: Path) -> None:
        """Save the session."""

        def saved(_: Any) -> None:
            self.unsaved = False
            self.told.emit(tr("The session was saved as {}.").format(path))

        self._with_bench(
            lambda bench, _: bench.session.save(path, overwrite=True),
            saved,
            tr("The session is saved…"),
        )

    def write_layout(self, path: Path) -> None:
        """Write the layout, at the level that it is at, as a layout file."""

        def work(bench: Bench, _: Progress) -> Path:
            from qgis_plugin.steering.result import write_file

            return write_file(bench.session.layout, path)

        self._with_bench(
            work,
            lambda _: self.told.emit(tr("The layout was written to {}.").format(path)),
            tr("The layout file is written…"),
        )

    def to_layers(self) -> None:
        """Finish the layout, if it is not, and load it as the toolbox does."""
        algorithm = self._algorithm()
        if algorithm is None:
            return
        name = self.name

        def work(bench: Bench, progress: Progress) -> tuple[View, Any]:
            from qgis_plugin.steering.result import made_layers

            if not bench.session.is_complete:
                bench.session.finish(progress=progress.slice(0.0, 0.8))
            # from here on there is no way back: the session is finished
            return bench.view(), made_layers(bench.session.layout, algorithm, name)

        def done(result: tuple[View, Any]) -> None:
            view, context = result

            def load() -> None:
                load_layers(context)
                self.told.emit(tr("The finished layout was loaded as layers."))

            self._show(view, load)

        self._with_bench(work, done, tr("The layout is finished…"), cancellable=True)

    # inside

    def _begin(self, start: Start, saved: Path | None, doing: str) -> None:
        from processing.tools.dataobjects import createContext

        algorithm, context = self._algorithm(), createContext()
        if algorithm is None:
            return
        self._context = context  # has objects of Qt, which must not die on the thread

        def work(progress: Progress) -> tuple[Bench, View]:
            dependencies.require_engine()
            from qgis_plugin.steering.bench import bench_for

            made = bench_for(start, saved, algorithm, context, progress)
            return made, made.view(whole=True)

        def done(result: tuple[Bench, View]) -> None:
            self._bench, view = result
            self.name, self.unsaved = start.name, False
            self.layers.make(view.crs)
            self.began.emit()
            self._show(view)

        self._start(work, done, doing, cancellable=True)

    def _edit(self, act: Callable[[Any, Progress], Any], doing: str = "", **options: Any) -> None:
        self._change(
            lambda bench, progress: bench.edit(lambda session: act(session, progress)),
            doing,
            **options,
        )

    def _edit_parcel(self, place: Place, act: Callable[[Any, int], Any]) -> None:
        self._change(lambda bench, _: bench.edit_parcel(place, act))

    def _change(
        self,
        work: Callable[[Bench, Progress], View],
        doing: str = "",
        *,
        by_hand: bool = False,
        changes: bool = True,
    ) -> None:
        """Do something that there is something new to see of."""
        if self.layers.are_edited and not by_hand:
            self._refuse(UrbanError(self.why_not()))
            return

        def done(view: View) -> None:
            if by_hand:
                self.layers.undo_hand_edits()
            self.unsaved |= changes
            self._show(view)

        self._with_bench(work, done, doing, cancellable=bool(doing) and not by_hand)

    def _with_bench(
        self,
        work: Callable[[Bench, Progress], Any],
        done: Callable[[Any], None],
        doing: str,
        *,
        cancellable: bool = False,
    ) -> None:
        bench = self._bench
        if bench is not None:
            self._start(partial(work, bench), done, doing, cancellable=cancellable)

    def _start(
        self,
        work: Callable[[Progress], Any],
        done: Callable[[Any], None],
        doing: str,
        *,
        cancellable: bool,
    ) -> None:
        if self.is_busy:
            if self.can_cancel:
                self.refused.emit([self.why_not()])
            return

        def after(call: Callable[[Any], None], result: Any) -> None:
            self._job = None
            try:
                call(result)
            finally:
                self.state_changed.emit()

        self.doing = doing or tr("the last edit is still being done.")
        self._job = Job(
            work,
            partial(after, done),
            partial(after, self._refuse),
            self.progressed.emit if cancellable else None,
        )
        self.worker.ask(self._job)
        self.state_changed.emit()

    def _show(self, view: View, then: Callable[[], None] | None = None) -> None:
        """Have layers and window show what there is to see, then go on with something."""
        self.view = view
        if view.difference.whole and not self.layers.are_there:
            self.layers.make(view.crs)
        changes = self._changes = self.layers.changes(view.difference)

        def go_on() -> None:
            if self._changes is not changes:
                return  # the session was ended meanwhile
            if next(changes, _DONE) is not _DONE:
                QTimer.singleShot(0, go_on)
                return
            self._changes = None
            self.viewed.emit(view)
            self.state_changed.emit()
            if then is not None:
                then()
            self.show_layers()  # if somebody took them out of the project

        go_on()

    def _refuse(self, error: UrbanError) -> None:
        if isinstance(error, Cancelled):
            self.told.emit(tr("Stopped; nothing was changed."))
        else:
            self.refused.emit([in_qgis(problem) for problem in error.problems])

    def _algorithm(self) -> Any:
        registry = QgsApplication.processingRegistry()
        made = registry.createAlgorithmById("urban_processing:cogenerate")
        if made is None:
            self.refused.emit([tr("Switch the plugin Processing on: the dock needs it.")])
        return made
