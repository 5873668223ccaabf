"""Progress of a long run, and the way to stop it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol


class Progress(Protocol):
    """What an algorithm tells its caller while it works."""

    def update(self, fraction: float, message: str = "") -> None:
        """Report that `fraction` (0 to 1) is done; raises `Cancelled` to stop the run."""
        ...

    def warn(self, message: str) -> None:
        """Say something the user should know; the run goes on."""
        ...

    def slice(self, start: float, stop: float) -> Progress:
        """Return a view whose 0 to 1 covers `start` to `stop` of this one."""
        ...


@dataclass(frozen=True)
class CallbackProgress:
    """Progress that calls functions; silent where none is given.

    Parameters
    ----------
    on_update
        Called with (fraction, message); may raise `Cancelled`.
    on_warning
        Called with one sentence.
    start, stop
        The range of the whole that this view covers.
    """

    on_update: Callable[[float, str], None] | None = None
    on_warning: Callable[[str], None] | None = None
    start: float = 0.0
    stop: float = 1.0

    def update(self, fraction: float, message: str = "") -> None:
        """Report that `fraction` (0 to 1) of this view is done."""
        if self.on_update is not None:
            fraction = min(1.0, max(0.0, fraction))
            self.on_update(self.start + fraction * (self.stop - self.start), message)

    def warn(self, message: str) -> None:
        """Say something the user should know; the run goes on."""
        if self.on_warning is not None:
            self.on_warning(message)

    def slice(self, start: float, stop: float) -> CallbackProgress:
        """Return a view whose 0 to 1 covers `start` to `stop` of this one."""
        width = self.stop - self.start
        return CallbackProgress(
            self.on_update,
            self.on_warning,
            self.start + start * width,
            self.start + stop * width,
        )


MANY_PARCELS = 20_000
"""The user is warned before a run that makes more parcels than this."""

SILENT = CallbackProgress()
"""A progress that says nothing."""
