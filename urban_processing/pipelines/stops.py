"""Layouts that stopped at a level, and the states to go on with from them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from urban_processing.errors import BoundaryError
from urban_processing.layout import Layout
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.levels import State
from urban_processing.provenance import Step
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way.net_floor import gross_floor
from urban_processing.site import Issue

ALGORITHM = "cogenerate"
"""Name of the algorithm in provenance."""

LEVEL, BLOCKS_DIVIDED, FINISHED = "level", "blocks_divided", "finished"
"""Results in provenance that tell how far the levels have come."""

STOPPED = "stopped"
"""Code of the issue that says at which level a layout stopped."""


def pause(state: State) -> tuple[Layout, dict[str, float]]:
    """The layout at the end of a level, which can be gone on with, and what is to be known.

    Returns
    -------
    layout, results
        The layout, and which level it is at.
    """
    open_ = len(state.to_cut())
    message = (
        f"Co-generation stopped at level {state.level}: {open_:,} of "
        f"{state.layout.mesh.n_faces:,} parcels are large enough to be cut; resume goes on."
    )
    layout = canonical(state.layout)
    issue = Issue(STOPPED, message, value=float(state.level))
    return layout.replace(issues=(*layout.issues, issue)), progress_of(state)


def progress_of(state: State) -> dict[str, float]:
    """What provenance tells of how far a state has come, for `state_of`."""
    return {
        LEVEL: float(state.level),
        BLOCKS_DIVIDED: float(state.blocks_divided),
        FINISHED: float(state.completed),
    }


def state_of(layout: Layout, *, min_area: float | None = None) -> State:
    """The state of a layout, to go on from there.

    Parameters
    ----------
    layout
        Made by co-generation; or by anything else, if the smallest area is given.
    min_area
        Smallest parcel allowed from now on, m², in place of what the layout was begun with.

    Raises
    ------
    BoundaryError
        If no smallest area is given, now or before, and co-generation did not make the layout.
    """
    begun = _begun_with(layout.history, min_area)
    if begun is None:
        raise BoundaryError(
            "The layout does not say what it was begun with: it was not made by cogenerate, or by "
            "an older version of it. Give min_area (--min-area), the smallest parcel allowed in "
            "m², to go on with it."
        )
    params = CogenerateParams.from_values(begun)
    rules = params.street_rules
    told = [step.results for step in layout.history if LEVEL in step.results]
    results = told[-1] if told else {LEVEL: 0.0, BLOCKS_DIVIDED: 0.0}
    completed = bool(results.get(FINISHED))
    floor = layout.min_area
    if min_area is not None:
        floor = gross_floor(min_area, rules) if rules.net_min_area else min_area
    elif rules.net_min_area and completed:
        floor = gross_floor(layout.min_area, rules)
    issues = tuple(issue for issue in layout.issues if issue.code != STOPPED)
    return State(
        layout=layout.replace(issues=issues, min_area=floor),
        params=params,
        min_area=floor,
        level=int(results[LEVEL]),
        blocks_divided=bool(results[BLOCKS_DIVIDED]),
        completed=completed,
    )


def _begun_with(history: Sequence[Step], min_area: float | None) -> dict[str, Any] | None:
    """Values of the parameters that a layout goes on with; None where nothing says them.

    They are those of its last co-generation. A smallest area that was given since, in going on,
    takes the place of the size they had.
    """
    values: dict[str, Any] | None = None
    sizes: list[float | None] = []
    for step in history:
        if step.algorithm == ALGORITHM:
            values, sizes = {**step.parameters, "stop_at_level": None}, []
        elif LEVEL in step.results:
            sizes.append(step.parameters.get("min_area"))
    if values is not None and not any(LEVEL in step.results for step in history):
        values = None  # an older version made it, whose levels are not known
    given = [size for size in (*sizes, min_area) if size is not None]
    if not given:
        return values
    # streets of layers have no rights-of-way unless somebody laid them out
    begun = {"right_of_way": False} if values is None else values
    return {**begun, "min_area": given[-1], "parcels": None}
