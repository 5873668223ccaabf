"""Progress of the engine to the feedback of QGIS, and sentences in its words."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager

from qgis.core import QgsProcessingException, QgsProcessingFeedback

from urban_processing.errors import Cancelled, UrbanError
from urban_processing.progress import CallbackProgress

_OPTION = re.compile(r"\s*\(--[^)]*\)")
_EMPTY = re.compile(r"empty cell \(None[^)]*\)")


def progress_to(feedback: QgsProcessingFeedback) -> CallbackProgress:
    """Return a progress that moves the bar, says warnings in the log, and stops on cancel."""

    def update(fraction: float, message: str) -> None:
        stop_if_cancelled(feedback)
        feedback.setProgress(100.0 * fraction)
        if message:
            feedback.setProgressText(message)

    return CallbackProgress(update, lambda message: feedback.pushWarning(in_qgis(message)))


def stop_if_cancelled(feedback: QgsProcessingFeedback) -> None:
    """Raise `Cancelled` if the user has pressed Cancel."""
    if feedback.isCanceled():
        raise Cancelled


def in_qgis(sentence: str) -> str:
    """Return a sentence without the options of the command line, and with the words of QGIS.

    >>> in_qgis("Give it with crs (--crs EPSG:code), or assign it.")
    'Give it with crs, or assign it.'
    >>> in_qgis("It must be a number, or an empty cell (None in a column of objects).")
    'It must be a number, or an empty cell (NULL).'
    """
    return _EMPTY.sub("empty cell (NULL)", _OPTION.sub("", sentence))


@contextmanager
def errors_as_sentences() -> Iterator[None]:
    """Turn the errors that a user may meet into the one that QGIS shows without a traceback."""
    try:
        yield
    except UrbanError as error:
        raise QgsProcessingException("\n".join(map(in_qgis, error.problems))) from error
