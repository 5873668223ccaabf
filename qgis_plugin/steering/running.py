"""One job at a time for the session, and what there is to see after it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial
from typing import TYPE_CHECKING, Any

from qgis.core import QgsCoordinateReferenceSystem
from qgis.PyQt.QtCore import QObject, QTimer, pyqtSignal

from qgis_plugin.crs_text import crs_of
from qgis_plugin.feedback import in_qgis
from qgis_plugin.steering.layers import SteeringLayers
from qgis_plugin.steering.model import View
from qgis_plugin.steering.worker import Job, Worker
from qgis_plugin.texts import tr
from urban_processing.errors import Cancelled, UrbanError
from urban_processing.progress import Progress

if TYPE_CHECKING:
    from qgis_plugin.steering.bench import Bench

_DONE = object()


class Runner(QObject):
    """The thread, the layers, and the one job that is being done."""

    viewed = pyqtSignal(object)
    """There is something new to see: a `View`."""

    told = pyqtSignal(str)
    """Something was done that leaves the session as it is."""

    refused = pyqtSignal(list)
    """Something could not be done: sentences."""

    state_changed = pyqtSignal()
    """What may be done has changed."""

    progressed = pyqtSignal(float, str)

    def __init__(self) -> None:
        super().__init__()
        self.worker = Worker()
        self.layers = SteeringLayers()
        self.layers.hand_edited.connect(self.state_changed)
        self.layers.gone.connect(self.state_changed)
        self.view: View | None = None
        self.unsaved = False
        self.doing = ""
        """What is being done, in words."""
        self._bench: Bench | None = None
        self._job: Job | None = None
        self._changes: Iterator[None] | None = None

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

    def cancel(self) -> None:
        """Stop what is being done at its next step."""
        if self._job is not None:
            self._job.cancel()

    def show_layers(self) -> None:
        """Put the layers into the project again, if somebody took them out."""
        if self.view is not None and not self.layers.are_there:
            self._change(lambda bench, _: bench.view(whole=True), changes=False)

    def _change(
        self,
        work: Callable[[Bench, Progress], View],
        doing: str = "",
        *,
        by_hand: bool = False,
        changes: bool = True,
        then: Callable[[], None] | None = None,
    ) -> None:
        """Do something that there is something new to see of, then go on with something.

        Parameters
        ----------
        work
            Returns what there is to see.
        doing
            What is being done, in words, where it takes long and can be stopped.
        by_hand
            Whether it deals with what was edited by hand; nothing else may be done then.
        changes
            Whether the session is another one afterwards.
        then
            Called once the layers show it.
        """
        if self.layers.are_edited and not by_hand:
            self._refuse(UrbanError(self.why_not()))
            return

        def done(view: View) -> None:
            if by_hand:
                self.layers.undo_hand_edits()
            self.unsaved |= changes
            self._show(view, then)

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
            self.layers.set_read_only(False)
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
        self.layers.set_read_only(cancellable)
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
            try:
                if next(changes, _DONE) is not _DONE:
                    QTimer.singleShot(0, go_on)
                    return
            except OSError as error:
                self._refuse(UrbanError(str(error)))
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
