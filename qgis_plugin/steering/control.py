"""What the window asks of the session, and what it hears back."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from qgis.core import QgsApplication
from qgis.PyQt.QtCore import pyqtSignal

from qgis_plugin import dependencies
from qgis_plugin.steering.loading import load_layers
from qgis_plugin.steering.model import Place, Start, View
from qgis_plugin.steering.running import Runner
from qgis_plugin.steering.worker import Job
from qgis_plugin.texts import tr
from urban_processing.progress import Progress

if TYPE_CHECKING:
    from qgis_plugin.steering.bench import Bench

_HOVER = "hover"


class Steering(Runner):
    """One session at a time: its edits and its results."""

    began = pyqtSignal()
    """There is a session."""

    ended = pyqtSignal()
    """There is none any more."""

    hovered = pyqtSignal(object)
    """The parcel under the cursor: a `Hovered`, or None."""

    def __init__(self) -> None:
        super().__init__()
        self.name = ""
        self._context: Any = None

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
        self.layers.deleteLater()

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
        if self.view is not None and not self.view.complete:
            self._edit(
                lambda s, p: s.finish(progress=p), tr("The layout is finished…"), then=self._load
            )
        else:
            self._load()

    def _load(self) -> None:
        algorithm, name = self._algorithm(), self.name
        if algorithm is None:
            return

        def work(bench: Bench, _: Progress) -> Any:
            from qgis_plugin.steering.result import made_layers

            return made_layers(bench.session.layout, algorithm, name)

        def done(context: Any) -> None:
            load_layers(context)
            self.told.emit(tr("The finished layout was loaded as layers."))

        self._with_bench(work, done, tr("The finished layout is measured and loaded…"))

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

    def _algorithm(self) -> Any:
        registry = QgsApplication.processingRegistry()
        made = registry.createAlgorithmById("urban_processing:cogenerate")
        if made is None:
            self.refused.emit([tr("Switch the plugin Processing on: the dock needs it.")])
        return made
