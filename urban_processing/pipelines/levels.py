"""The levels of co-generation, each a pure function from one state to the next (Chen 2024, 4)."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.errors import BoundaryError
from urban_processing.land import default_tolerance
from urban_processing.layout import Layout, Stage
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.optimization.optimize import optimize_geometry
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.params.optimize import OptimizeParams
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.pipelines.dimensions import check_dimensions, missed_dimensions
from urban_processing.pipelines.findings import findings
from urban_processing.pipelines.ground import land_area, lay_ground, settle_islands
from urban_processing.pipelines.last_levels import divide_street_blocks
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.quotas import divided, shared_out
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.rights_of_way.net_floor import gross_floor, keep_net_areas, set_remnants_aside
from urban_processing.site import AREA_ROUNDING, Issue, Site
from urban_processing.streets.entries import choose_entries, join_along_rims
from urban_processing.streets.generate import extend_streets
from urban_processing.streets.prune import prune_streets
from urban_processing.streets.shorten import divide_long_blocks
from urban_processing.subdivision.first_cuts import tie_together
from urban_processing.subdivision.holes import cut_through_holes
from urban_processing.subdivision.level import cut_level
from urban_processing.subdivision.recut import recut_irregular

MEAN_OVER_MIN = 1.37
"""Mean parcel area over the smallest allowed one, as measured over many lands."""

FLOOR_SHARE = 0.6
"""Smallest area allowed where the number of parcels is given, over their mean area."""

SMALL_NET_SHARE = 0.25
"""Net parcels under this share of the mean net area are joined where the number was given."""

RECUT_SHARE, PRUNED_SHARE = 0.6, 0.7
"""Shares of cutting again, and of the clean-up of streets, in the time after the levels."""

ALGORITHM = "cogenerate"
"""Name of the algorithm in provenance."""

LEVEL, BLOCKS_DIVIDED, FINISHED = "level", "blocks_divided", "finished"
"""Results in provenance that tell how far the levels have come."""

FOUND_AT_THE_END = frozenset(
    {
        *("block_below_min_area", "block_length_missed", "block_too_long", "count_missed"),
        *("dead_end", "entry_chosen", "fixed_dead_end", "frontage_missed", "no_entry"),
        *("parcel_cut_off", "parcel_not_cut", "parcel_not_reached", "parcel_swallowed"),
        *("part_below_min_area", "part_not_reached", "remnant", "street_on_rim"),
        "width_depth_missed",
    }
)
"""Codes of the issues that `finish` finds; those of an earlier end are found anew."""

STOPPED = "stopped"
"""Code of the issue that says at which level a layout stopped."""

TOO_LARGE = 4.0
"""Parcels above so many smallest ones are cut along streamlines after another strategy."""


@dataclass(frozen=True, eq=False)
class State:
    """Everything a level needs of the one before.

    Parameters
    ----------
    layout
        Parcels and streets so far; each parcel knows whether it goes on to be cut (`Stage`), and
        how many parcels it is still to become where their total was given.
    params
        The run's parameters.
    min_area
        Smallest gross area in m² of parcels.
    level
        Number of levels so far.
    blocks_divided
        Whether another strategy than streamlines has done its last levels.
    completed
        Whether the layout has been through `finish`.
    """

    layout: Layout
    params: CogenerateParams
    min_area: float
    level: int = 0
    blocks_divided: bool = False
    completed: bool = False

    @property
    def floor(self) -> float:
        """Smallest gross area in m² that a cut along streamlines may leave."""
        return self.min_area if self.blocks_divided else self.min_area * _coarser(self.params)

    @property
    def has_quota(self) -> bool:
        """Whether each parcel is to become a given number of parcels."""
        return self.params.parcels is not None

    def to_cut(self) -> IntArray:
        """Parcels that the next level cuts."""
        return self._large_enough(Stage.OPEN, Stage.BEHIND)

    def _large_enough(self, *stages: Stage) -> IntArray:
        layout, mesh = self.layout, self.layout.mesh
        can = np.isin(layout.face_stage, stages) & ~layout.face_locked & (mesh.face_n_loops == 1)
        if self.has_quota:
            return np.flatnonzero(can & (layout.face_quota >= 2))
        return np.flatnonzero(can & (mesh.face_area >= 2.0 * self.floor * (1.0 - AREA_ROUNDING)))

    @property
    def finished(self) -> bool:
        """Whether no level is to come any more."""
        return not self.divides_blocks and not len(self._left())

    def _left(self) -> IntArray:
        """Parcels that this or a later level cuts."""
        return self._large_enough(Stage.OPEN, Stage.BEHIND, Stage.AHEAD)

    @property
    def divides_blocks(self) -> bool:
        """Whether the next level divides the blocks by another strategy than streamlines."""
        if self.blocks_divided or self.params.strategy is Strategy.STREAMLINE:
            return False
        return not len(self._left())


def smallest_area(site: Site, params: CogenerateParams) -> float:
    """Smallest gross area in m² that a cut may leave."""
    if params.min_area is not None:
        rules = params.street_rules
        return gross_floor(params.min_area, rules) if rules.net_min_area else params.min_area
    return FLOOR_SHARE * land_area(site) / (params.parcels or 1)


def begin(site: Site, params: CogenerateParams) -> State:
    """The state before the first level: one parcel a part, cut through its holes."""
    min_area = smallest_area(site, params)
    check_dimensions(params, min_area=min_area)
    tolerance = params.simplify
    if tolerance is None:
        mean = land_area(site) / params.parcels if params.parcels else MEAN_OVER_MIN * min_area
        tolerance = default_tolerance(mean / MEAN_OVER_MIN)
    layout = lay_ground(site, params, min_area=min_area, tolerance=tolerance)
    layout = layout.replace(street_rules=params.street_rules)
    quota = np.zeros(layout.mesh.n_faces, dtype=np.int64)
    if params.parcels is not None:
        quota = shared_out(np.where(layout.face_locked, 0.0, layout.mesh.face_area), params.parcels)
    layout, parent = cut_through_holes(layout, min_area=min_area)
    quota = divided(quota, parent, layout.mesh.face_area)
    layout = settle_islands(layout, min_area=min_area)
    layout, parent = tie_together(layout, min_area=min_area, params=params)
    layout = layout.replace(
        face_quota=divided(quota, parent, layout.mesh.face_area),
        face_stage=np.full(layout.mesh.n_faces, Stage.OPEN, dtype=np.int8),
    )
    return with_streets(State(layout, params, min_area))


def step(state: State) -> State:
    """One level: cut all parcels that are large enough, then reach every parcel by street.

    Where no parcel is left to cut and another strategy makes the last levels, it divides the
    blocks.
    """
    if state.divides_blocks:
        return divide_blocks(state)
    faces = state.to_cut()
    # numbered by the parcels alone: a state that was written and read again goes on the same way
    before = canonical(state.layout)
    layout, cut, parent = cut_level(
        before,
        faces,
        min_area=state.floor,
        params=state.params,
        quota=before.face_quota[faces] if state.has_quota else None,
    )
    quota = layout.face_quota
    if state.has_quota:
        kept = before.face_quota.copy()
        kept[faces[~cut]] = 1
        quota = divided(kept, parent, layout.mesh.face_area)
    layout = layout.replace(face_stage=_next_stage(before, faces[cut])[parent], face_quota=quota)
    return with_streets(dataclasses.replace(state, layout=layout, level=state.level + 1))


def _next_stage(layout: Layout, cut: IntArray) -> npt.NDArray[np.int8]:
    """(F,) stages after a level; what could not be cut is done, unless it is locked."""
    stage = layout.face_stage
    after = np.where(stage == Stage.AHEAD, Stage.OPEN, Stage.DONE)
    after[layout.face_locked] = stage[layout.face_locked]
    after[cut] = Stage.OPEN
    return after.astype(np.int8)


def with_streets(state: State) -> State:
    """The state with the streets that its parcels need (Chen 2024, section 4.2)."""
    layout = extend_streets(
        state.layout, state.params, level=state.level, keep_ends=_keeps_ends(state)
    )
    return dataclasses.replace(state, layout=layout)


def _keeps_ends(state: State) -> bool:
    """Whether dead ends of this level stay (Chen 2024, section 6: street patterns)."""
    pattern = state.params.pattern
    if pattern is StreetPattern.CUL_DE_SAC:
        return _levels_left(state) < state.params.cul_de_sac_levels
    return pattern is StreetPattern.TREE


def _levels_left(state: State) -> int:
    """Number of levels that are still to come, as the largest parcel suggests."""
    faces = state.to_cut()
    if len(faces) == 0:
        return 0
    if state.has_quota:
        return math.ceil(math.log2(int(state.layout.face_quota[faces].max())))
    largest = float(state.layout.mesh.face_area[faces].max())
    return max(1, math.ceil(math.log2(largest / (MEAN_OVER_MIN * state.floor))))


def divide_blocks(state: State) -> State:
    """The last levels by another strategy: divide the blocks, then reach every parcel again.

    What it leaves too large goes on being cut along streamlines.
    """
    params, min_area = state.params, state.min_area
    bounds = SubdivideParams(
        strategy=params.strategy,
        min_area=min_area,
        max_area=2.0 * min_area,
        seed=params.seed,
    )
    layout = divide_street_blocks(state.layout, bounds)
    large = layout.mesh.face_area > TOO_LARGE * min_area
    layout = layout.replace(face_stage=np.where(large, Stage.OPEN, Stage.DONE).astype(np.int8))
    after = dataclasses.replace(
        state, layout=layout, level=state.level + params.last_levels, blocks_divided=True
    )
    return with_streets(after)


def _coarser(params: CogenerateParams) -> float:
    """How many smallest parcels the smallest one is that streamlines leave to another strategy."""
    return 1.0 if params.strategy is Strategy.STREAMLINE else 2.0**params.last_levels


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


def finish(state: State, progress: Progress = SILENT) -> tuple[Layout, dict[str, float]]:
    """Cut irregular parcels again, clean up the streets, optimize, list what is to be known.

    Returns
    -------
    layout, results
        The layout, and what the optimization gained.
    """
    params = state.params
    layout = state.layout.replace(issues=_not_found_at_the_end(state.layout.issues))
    if params.rules.recut:
        layout = recut_irregular(
            layout,
            min_area=state.floor,
            params=params,
            progress=progress.slice(0.0, RECUT_SHARE),
        )
    progress.update(RECUT_SHARE, "Cleaning up the streets")
    layout = prune_streets(layout, params, keep_ends=params.pattern is not StreetPattern.LOOP)
    layout = join_along_rims(layout, params)
    layout = layout.replace(min_area=_promised_area(state, layout))
    results = progress_of(dataclasses.replace(state, completed=True))
    if params.optimize:
        optimized = optimize_geometry(
            layout,
            OptimizeParams().weights,
            least_frontage=params.least_frontage or 0.0,
            progress=progress.slice(PRUNED_SHARE, 1.0),
        )
        layout, results = optimized.layout, {**optimized.results(), **results}
        # what has moved may have become a little longer than wanted
        layout = divide_long_blocks(layout, params)
    # entries first: a street that ends at one is no cul-de-sac, and has another width
    layout = _with_net_floor(choose_entries(canonical(layout), params), params)
    missed = (*findings(layout, params), *missed_dimensions(layout, params))
    return _settled(layout).replace(issues=(*layout.issues, *missed)), results


def _not_found_at_the_end(issues: tuple[Issue, ...]) -> tuple[Issue, ...]:
    return tuple(issue for issue in issues if issue.code not in FOUND_AT_THE_END)


def _settled(layout: Layout) -> Layout:
    """The layout with no parcel that is to be cut any more."""
    n = layout.mesh.n_faces
    return layout.replace(
        face_stage=np.full(n, Stage.DONE, dtype=np.int8), face_quota=np.zeros(n, dtype=np.int64)
    )


def _promised_area(state: State, layout: Layout) -> float:
    """Smallest gross area in m² that the layout promises: given, or that of its smallest parcel."""
    if not state.has_quota:
        return state.min_area
    whole = (layout.mesh.face_area >= state.min_area) & ~layout.face_locked
    return float(layout.mesh.face_area[whole].min()) if whole.any() else state.min_area


def _with_net_floor(layout: Layout, params: CogenerateParams) -> Layout:
    """The layout with a promise about net areas that it keeps, if the smallest area is one.

    Where the number of parcels was given, the promise is the smallest net area found.
    """
    if not layout.street_rules.net_min_area:
        return layout
    floor = params.min_area or SMALL_NET_SHARE * float(_net_areas(layout).mean())
    layout = set_remnants_aside(canonical(keep_net_areas(layout, floor)), floor)
    if params.min_area is None:
        net = _net_areas(layout)
        floor = float(net.min(initial=np.inf, where=(net >= floor) & ~layout.face_locked))
    return layout.replace(min_area=floor if math.isfinite(floor) else layout.min_area)


def _net_areas(layout: Layout) -> FloatArray:
    return lay_out_rights_of_way(layout).net_area
