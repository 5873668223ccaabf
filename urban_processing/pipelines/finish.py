"""What comes after the levels: the clean-up of parcels and streets, and the optimization."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from urban_processing.layout import Layout, Stage
from urban_processing.mesh.planar import FloatArray
from urban_processing.optimization.optimize import optimize_geometry
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.params.optimize import OptimizeParams
from urban_processing.pipelines.dimensions import missed_dimensions
from urban_processing.pipelines.findings import findings
from urban_processing.pipelines.levels import State
from urban_processing.pipelines.stops import progress_of
from urban_processing.progress import SILENT, Progress
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.rights_of_way.net_floor import keep_net_areas, set_remnants_aside
from urban_processing.site import Issue
from urban_processing.streets.entries import choose_entries, join_along_rims
from urban_processing.streets.prune import prune_streets
from urban_processing.streets.shorten import divide_long_blocks
from urban_processing.subdivision.recut import recut_irregular

SMALL_NET_SHARE = 0.25
"""Net parcels under this share of the mean net area are joined where the number was given."""

RECUT_SHARE, PRUNED_SHARE = 0.6, 0.7
"""Shares of cutting again, and of the clean-up of streets, in the time after the levels."""

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
