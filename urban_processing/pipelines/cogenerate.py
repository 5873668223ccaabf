"""Hierarchical co-generation of parcels and streets (Chen 2024, sections 3 and 4)."""

from __future__ import annotations

import dataclasses
import math
import time
from dataclasses import dataclass

import numpy as np

from urban_processing.errors import InfeasibleError
from urban_processing.land import default_tolerance
from urban_processing.layout import Layout
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.optimization.optimize import optimize_geometry
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.params.optimize import OptimizeParams
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.pipelines.dimensions import check_dimensions, missed_dimensions
from urban_processing.pipelines.findings import findings
from urban_processing.pipelines.ground import land_area, lay_ground, settle_islands
from urban_processing.pipelines.last_levels import divide_street_blocks
from urban_processing.pipelines.quotas import divided, shared_out
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.rights_of_way.net_floor import gross_floor, keep_net_areas, set_remnants_aside
from urban_processing.site import AREA_ROUNDING, Site
from urban_processing.streets.entries import choose_entries, join_along_rims
from urban_processing.streets.generate import extend_streets
from urban_processing.streets.prune import prune_streets
from urban_processing.streets.shorten import divide_long_blocks
from urban_processing.subdivision.first_cuts import tie_together
from urban_processing.subdivision.holes import cut_through_holes
from urban_processing.subdivision.level import cut_level
from urban_processing.subdivision.recut import recut_irregular
from urban_processing.version import __version__

MEAN_OVER_MIN = 1.37
"""Mean parcel area over the smallest allowed one, as measured over many lands."""

FLOOR_SHARE = 0.6
"""Smallest area allowed where the number of parcels is given, over their mean area."""

SMALL_NET_SHARE = 0.25
"""Net parcels under this share of the mean net area are joined where the number was given."""

MOST_PARCELS = 2_000_000
"""More parcels than this are refused: the run would take hours and all the memory."""

LEVELS_SHARE, RECUT_SHARE, PRUNED_SHARE = 0.6, 0.6, 0.7
"""Share of the levels in the time of a run; of cutting again, and of the clean-up of streets, in
the time after them."""

TOO_LARGE = 4.0
"""Parcels above so many smallest ones are cut along streamlines after another strategy."""

SECONDS_PER_PARCEL = 2.6e-3
"""For the estimate that is given before a long run; one core of a common machine."""


@dataclass(frozen=True)
class Estimate:
    """What a run is expected to give."""

    parcels: int
    seconds: float


@dataclass(frozen=True, eq=False)
class State:
    """Everything a level needs of the one before.

    Parameters
    ----------
    layout
        Parcels and streets so far.
    params
        The run's parameters.
    min_area
        Smallest area in m² that a cut may leave.
    active
        (F,) parcels that may be cut further.
    quota
        (F,) number of parcels that each is to become, where the total was given.
    level
        Number of levels so far.
    """

    layout: Layout
    params: CogenerateParams
    min_area: float
    active: BoolArray
    quota: IntArray | None
    level: int = 0

    def to_cut(self) -> IntArray:
        """Parcels that the next level cuts."""
        mesh = self.layout.mesh
        can = self.active & ~self.layout.face_locked & (mesh.face_n_loops == 1)
        if self.quota is not None:
            return np.flatnonzero(can & (self.quota >= 2))
        return np.flatnonzero(can & (mesh.face_area >= 2.0 * self.min_area * (1.0 - AREA_ROUNDING)))

    @property
    def finished(self) -> bool:
        """Whether no parcel can be cut any more."""
        return len(self.to_cut()) == 0


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
    levels = progress.slice(0.0, LEVELS_SHARE)
    while not state.finished:
        done = math.log2(state.layout.mesh.n_faces + 1) / math.log2(goal + 2)
        levels.update(min(done, 1.0) ** 3, _message(state))
        state = step(state)
    if params.strategy is not Strategy.STREAMLINE:
        levels.update(1.0, "Dividing the blocks")
        state = divide_blocks(state)
    levels.update(1.0, _message(state))
    layout, results = finish(state, progress.slice(LEVELS_SHARE, 1.0))
    progress.update(1.0)
    entry = Step(
        algorithm="cogenerate",
        parameters=params.as_dict(),
        seed=params.seed,
        version=__version__,
        input_sha256=site.input_sha256,
        seconds=time.perf_counter() - started,
        results=results,
    )
    return layout.replace(history=(*layout.history, entry))


def _message(state: State) -> str:
    return f"Level {state.level}, {state.layout.mesh.n_faces} parcels"


def estimate(site: Site, params: CogenerateParams) -> Estimate:
    """Guess the number of parcels and the seconds that a run takes."""
    if params.parcels is not None:
        parcels = max(params.parcels, len(site.parts))
    else:
        mean = MEAN_OVER_MIN * smallest_area(site, params)
        parcels = sum(max(1, round(part.area / mean)) for part in site.parts)
    return Estimate(parcels, parcels * SECONDS_PER_PARCEL)


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
    quota = None
    if params.parcels is not None:
        quota = shared_out(np.where(layout.face_locked, 0.0, layout.mesh.face_area), params.parcels)
    layout, parent = cut_through_holes(layout, min_area=min_area)
    if quota is not None:
        quota = divided(quota, parent, layout.mesh.face_area)
    layout = settle_islands(layout, min_area=min_area)
    layout, parent = tie_together(layout, min_area=min_area, params=params)
    if quota is not None:
        quota = divided(quota, parent, layout.mesh.face_area)
    state = State(
        layout=layout,
        params=params,
        min_area=min_area * _coarser(params),
        active=np.ones(layout.mesh.n_faces, dtype=bool),
        quota=quota,
    )
    return dataclasses.replace(state, layout=_with_streets(state, layout))


def step(state: State) -> State:
    """One level: cut all parcels that are large enough, then reach every parcel by street."""
    faces = state.to_cut()
    before = state.layout
    layout, cut, parent = cut_level(
        before,
        faces,
        min_area=state.min_area,
        params=state.params,
        quota=None if state.quota is None else state.quota[faces],
    )
    was_cut = np.zeros(before.mesh.n_faces, dtype=bool)
    was_cut[faces[cut]] = True
    active = was_cut[parent]
    quota = None
    if state.quota is not None:
        kept = state.quota.copy()
        kept[faces[~cut]] = 1
        quota = divided(kept, parent, layout.mesh.face_area)
    after = dataclasses.replace(
        state, layout=layout, active=active, quota=quota, level=state.level + 1
    )
    return dataclasses.replace(after, layout=_with_streets(after, layout))


def _with_streets(state: State, layout: Layout) -> Layout:
    return extend_streets(layout, state.params, level=state.level, keep_ends=_keeps_ends(state))


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
    if state.quota is not None:
        return math.ceil(math.log2(int(state.quota[faces].max())))
    largest = float(state.layout.mesh.face_area[faces].max())
    return max(1, math.ceil(math.log2(largest / (MEAN_OVER_MIN * state.min_area))))


def divide_blocks(state: State) -> State:
    """The last levels by another strategy: divide the blocks, then reach every parcel again.

    What it leaves too large goes on being cut along streamlines.
    """
    params = state.params
    min_area = state.min_area / _coarser(params)
    layout = state.layout.replace(min_area=min_area)
    bounds = SubdivideParams(
        strategy=params.strategy,
        min_area=min_area,
        max_area=2.0 * min_area,
        seed=params.seed,
    )
    layout = divide_street_blocks(layout, bounds)
    after = dataclasses.replace(
        state,
        layout=layout,
        min_area=min_area,
        active=layout.mesh.face_area > TOO_LARGE * min_area,
        level=state.level + params.last_levels,
    )
    after = dataclasses.replace(after, layout=_with_streets(after, layout))
    while not after.finished:
        after = step(after)
    return after


def _coarser(params: CogenerateParams) -> float:
    """How many smallest parcels the smallest one is that streamlines leave to another strategy."""
    return 1.0 if params.strategy is Strategy.STREAMLINE else 2.0**params.last_levels


def finish(state: State, progress: Progress = SILENT) -> tuple[Layout, dict[str, float]]:
    """Cut irregular parcels again, clean up the streets, optimize, list what is to be known.

    Returns
    -------
    layout, results
        The layout, and what the optimization gained.
    """
    params = state.params
    layout = state.layout
    if params.rules.recut:
        layout = recut_irregular(
            layout,
            min_area=state.min_area,
            params=params,
            progress=progress.slice(0.0, RECUT_SHARE),
        )
    progress.update(RECUT_SHARE, "Cleaning up the streets")
    layout = prune_streets(layout, params, keep_ends=params.pattern is not StreetPattern.LOOP)
    layout = join_along_rims(layout, params)
    layout = layout.replace(min_area=_promised_area(state, layout))
    results: dict[str, float] = {}
    if params.optimize:
        optimized = optimize_geometry(
            layout,
            OptimizeParams().weights,
            least_frontage=params.least_frontage or 0.0,
            progress=progress.slice(PRUNED_SHARE, 1.0),
        )
        layout, results = optimized.layout, optimized.results()
        # what has moved may have become a little longer than wanted
        layout = divide_long_blocks(layout, params)
    # entries first: a street that ends at one is no cul-de-sac, and has another width
    layout = _with_net_floor(choose_entries(canonical(layout), params), params)
    missed = (*findings(layout, params), *missed_dimensions(layout, params))
    return layout.replace(issues=(*layout.issues, *missed)), results


def _promised_area(state: State, layout: Layout) -> float:
    """Smallest gross area in m² that the layout promises: given, or that of its smallest parcel."""
    if state.quota is None:
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
