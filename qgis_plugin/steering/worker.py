"""One thread that works for the window: what it is asked, one job after another."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any

from qgis.PyQt.QtCore import QObject, Qt, pyqtSignal

from urban_processing.errors import Cancelled, UrbanError
from urban_processing.progress import CallbackProgress, Progress

_BETWEEN_REPORTS = 0.05
"""Seconds between two reports of progress: each wakes the window."""

_CLOSED: list[Worker] = []
"""Workers that were closed: objects of Qt must not die on a thread."""


@dataclass
class Job:
    """Something to do on the thread, and whom to tell in the window.

    Parameters
    ----------
    work
        Called on the thread with a progress.
    done
        Called in the window with what `work` returned.
    failed
        Called in the window with the error of a user's that `work` raised.
    progressed
        Called in the window with the fraction done and a text.
    latest
        Where it is given, the job is left out if a newer one of that name waits.
    """

    work: Callable[[Progress], Any]
    done: Callable[[Any], None]
    failed: Callable[[UrbanError], None]
    progressed: Callable[[float, str], None] | None = None
    latest: str = ""
    cancelled: threading.Event = field(default_factory=threading.Event)

    def cancel(self) -> None:
        """Have the work stop at its next step."""
        self.cancelled.set()


class Worker(QObject):
    """The thread, and the way back from it to the window."""

    _told = pyqtSignal(object)

    def __init__(self) -> None:
        super().__init__()
        self._told.connect(self._in_window, Qt.ConnectionType.QueuedConnection)
        self._jobs: SimpleQueue[Job] = SimpleQueue()
        self._newest: dict[str, Job] = {}
        self._now: Job | None = None
        self._open = True
        self._thread = threading.Thread(target=self._work, name="steering", daemon=True)
        self._thread.start()

    def ask(self, job: Job) -> Job:
        """Put a job at the end of the queue; it may be cancelled."""
        if job.latest:
            self._newest[job.latest] = job
        self._jobs.put(job)
        return job

    def close(self, seconds: float = 3.0) -> None:
        """Stop at the next step; nothing more is told. Waits no longer than some seconds.

        The thread itself stays, asleep: where a thread ends, QGIS drops what PROJ worked out on
        it, and a CRS that was first met there is then invalid for all (seen in QGIS 3.22).
        """
        self._open = False
        _CLOSED.append(self)
        if self._now is not None:
            self._now.cancel()
        until = time.monotonic() + seconds
        while not self.is_idle and time.monotonic() < until:
            time.sleep(0.01)
        self._newest.clear()

    @property
    def is_idle(self) -> bool:
        """Whether nothing is being done and nothing waits."""
        return self._now is None and self._jobs.empty()

    def _work(self) -> None:
        while True:
            self._now = self._jobs.get()
            if self._open and self._is_newest(self._now):
                self._do(self._now)
            self._now = None

    def _do(self, job: Job) -> None:
        try:
            result = job.work(self._progress(job))
        except UrbanError as error:
            self._tell(job.failed, error)
        except Exception as error:  # a mistake of the program: QGIS shows what the window raises
            self._tell(_break, job, error)
        else:
            self._tell(self._give, job, result)

    def _give(self, job: Job, result: Any) -> None:
        if self._is_newest(job):
            job.done(result)

    def _is_newest(self, job: Job) -> bool:
        return not job.latest or self._newest.get(job.latest) is job

    def _progress(self, job: Job) -> Progress:
        last = 0.0

        def update(fraction: float, message: str) -> None:
            nonlocal last
            if job.cancelled.is_set():
                raise Cancelled
            now = time.monotonic()
            if job.progressed is not None and now - last > _BETWEEN_REPORTS:
                last = now
                self._tell(job.progressed, fraction, message)

        return CallbackProgress(update)

    def _tell(self, call: Callable[..., None], *args: Any) -> None:
        if self._open:
            self._told.emit((call, args))

    def _in_window(self, told: tuple[Callable[..., None], tuple[Any, ...]]) -> None:
        call, args = told
        if self._open:
            call(*args)


def _break(job: Job, error: Exception) -> None:
    job.failed(UrbanError(f"A mistake of the program, nothing was changed: {error!r}"))
    raise error
