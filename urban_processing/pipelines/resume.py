"""Going on with a layout that stopped at a level, edited or not (Chen 2024, section 6)."""

from __future__ import annotations

import time

from urban_processing.layout import Layout
from urban_processing.params.resume import ResumeParams
from urban_processing.pipelines.cogenerate import go_on
from urban_processing.pipelines.stops import state_of
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.version import __version__


def resume(layout: Layout, params: ResumeParams, progress: Progress = SILENT) -> Layout:
    """Go through the levels that are still to come, with the parameters of the beginning.

    Parameters
    ----------
    layout
        A layout that `cogenerate` made and stopped at a level; it may have been edited since. Or
        any other, if the smallest area is given.
    params
        The smallest area where it is another than before, and where to stop again.
    progress
        Told of every level and of what comes after them; may cancel between these steps.

    Raises
    ------
    BoundaryError
        If co-generation did not make the layout, and no smallest area is given.
    """
    started = time.perf_counter()
    state = state_of(layout, min_area=params.min_area)
    made, results = go_on(state, stop_at=params.stop_at_level, progress=progress)
    entry = Step(
        algorithm="resume",
        parameters=params.as_dict(),
        seed=state.params.seed,
        version=__version__,
        input_sha256=layout.digest,
        seconds=time.perf_counter() - started,
        results=results,
    )
    return made.replace(history=(*made.history, entry))
