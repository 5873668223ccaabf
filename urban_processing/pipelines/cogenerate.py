"""Hierarchical co-generation of parcels and streets (Chen 2024, sections 3 and 4)."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass

from urban_processing.errors import InfeasibleError
from urban_processing.layout import Layout
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.finish import finish
from urban_processing.pipelines.levels import MEAN_OVER_MIN, State, begin, smallest_area, step
from urban_processing.pipelines.stops import ALGORITHM, pause
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.site import Site
from urban_processing.version import __version__

MOST_PARCELS = 2_000_000
"""More parcels than this are refused: the run would take hours and all the memory."""

LEVELS_SHARE = 0.6
"""Share of the levels in the time of a run."""

SECONDS_PER_PARCEL = 2.6e-3
"""For the estimate that is given before a long run; one core of a common machine."""


@dataclass(frozen=True)
class Estimate:
    """What a run is expected to give."""

    parcels: int
    seconds: float


def cogenerate(site: Site, params: CogenerateParams, progress: Progress = SILENT) -> Layout:
    """Divide land into parcels that are all reached by one street network.

    At each level every parcel that is large enough is cut in two (section 4.1), then streets
    are added along parcel boundaries until every parcel is reached (section 4.2). The parts of
    the land are worked on together, each with a network of its own.

    Parameters
    ----------
    site
        The land.
    params
        Smallest area or number of parcels, street pattern, weights.
    progress
        Told of every level and of what comes after them; may cancel between these steps.

    Returns
    -------
    Layout
        With `issues` for what could not be done and a `history` entry for this run.
    """
    started = time.perf_counter()
    goal = estimate(site, params).parcels
    if goal > MOST_PARCELS:
        raise InfeasibleError(
            f"This would make about {goal:,} parcels; more than {MOST_PARCELS:,} do not fit into "
            "one run. Give a larger smallest area, fewer parcels, or lay out districts apart."
        )
    state = begin(site, params)
    layout, results = go_on(state, stop_at=params.stop_at_level, progress=progress)
    entry = Step(
        algorithm=ALGORITHM,
        parameters=params.as_dict(),
        seed=params.seed,
        version=__version__,
        input_sha256=site.input_sha256,
        seconds=time.perf_counter() - started,
        results=results,
    )
    return layout.replace(history=(*layout.history, entry))


def go_on(
    state: State, *, stop_at: int | None, progress: Progress = SILENT
) -> tuple[Layout, dict[str, float]]:
    """Go through the levels, to the end or until so many are done.

    Returns
    -------
    layout, results
        The layout, and what its entry of provenance has to tell.
    """
    layout, params = state.layout, state.params
    mean = MEAN_OVER_MIN * state.min_area
    goal = params.parcels or max(1, round(float(layout.mesh.face_area.sum()) / mean))
    levels = progress.slice(0.0, LEVELS_SHARE)
    while not state.finished and not _is_over(state, stop_at):
        done = math.log2(state.layout.mesh.n_faces + 1) / math.log2(goal + 2)
        levels.update(min(done, 1.0) ** 3, _message(state))
        state = step(state)
    levels.update(1.0, _message(state))
    if _is_over(state, stop_at):
        made = pause(state)
    else:
        made = finish(state, progress.slice(LEVELS_SHARE, 1.0))
    progress.update(1.0)
    return made


def _is_over(state: State, stop_at: int | None) -> bool:
    at_the_end = state.completed and state.finished
    return stop_at is not None and state.level >= stop_at and not at_the_end


def _message(state: State) -> str:
    if state.divides_blocks:
        return "Dividing the blocks"
    return f"Level {state.level}, {state.layout.mesh.n_faces} parcels"


def estimate(site: Site, params: CogenerateParams) -> Estimate:
    """Guess the number of parcels and the seconds that a run takes."""
    if params.parcels is not None:
        parcels = max(params.parcels, len(site.parts))
    else:
        mean = MEAN_OVER_MIN * smallest_area(site, params)
        parcels = sum(max(1, round(part.area / mean)) for part in site.parts)
    return Estimate(parcels, parcels * SECONDS_PER_PARCEL)
