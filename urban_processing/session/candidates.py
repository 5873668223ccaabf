"""Candidate cuts of one parcel, as the next level would choose among them."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.levels import State
from urban_processing.session.model import Candidate
from urban_processing.subdivision.insert import TEE_SNAP, Trial, try_cuts
from urban_processing.subdivision.parcels import parcel_rings
from urban_processing.subdivision.score import TERMS
from urban_processing.subdivision.streamline import Cut, propose_cuts

MOST = 6
"""Most candidates of a parcel."""

ENOUGH = 2
"""With fewer candidates than this, the parcel is looked at thoroughly as well."""

SAME_M = 1e-3
"""Cuts that stay within this many metres of each other once they are drawn are the same."""


def candidates(state: State, face: int) -> tuple[Candidate, ...]:
    """Legal cuts of a parcel, the best first, as the next level ranks them.

    None where no cut leaves two halves of at least the smallest area.
    """
    layout = state.layout
    parcels = parcel_rings(layout, np.array([face]))
    quota = layout.face_quota[[face]] if state.has_quota and layout.face_quota[face] > 1 else None
    found: list[tuple[Cut, Trial, float]] = []
    for thorough in (False, True):
        if len(found) >= ENOUGH:
            break
        tee_snap = TEE_SNAP if state.params.rules.snap > 0 and not thorough else 0.0
        [cuts] = propose_cuts(
            parcels,
            min_area=state.floor,
            params=state.params,
            quota=quota,
            thorough=thorough,
            alternatives=MOST,
        )
        trials = try_cuts(layout, parcels, cuts, min_area=state.floor, tee_snap=tee_snap)
        for cut, trial in zip(cuts, trials, strict=True):
            if trial is not None and not any(_same(trial, other) for _, other, _ in found):
                found.append((cut, trial, tee_snap))
    origin = np.asarray(layout.frame.origin)
    return tuple(
        Candidate(
            rank=rank,
            quality=cut.quality,
            terms=dict(zip(TERMS, cut.terms, strict=True)),
            line=shapely.LineString(trial.path + origin),
            areas=(min(trial.areas), max(trial.areas)),
            reason=_reason(cut, trial, state.params),
            cut=cut,
            tee_snap=tee_snap,
        )
        for rank, (cut, trial, tee_snap) in enumerate(found[:MOST], start=1)
    )


def _same(a: Trial, b: Trial) -> bool:
    one, other = shapely.LineString(a.path), shapely.LineString(b.path)
    return bool(shapely.hausdorff_distance(one, other) < SAME_M)


def _reason(cut: Cut, trial: Trial, params: CogenerateParams) -> str:
    """What speaks for a cut and against it."""
    term = dict(zip(TERMS, cut.terms, strict=True))
    small, large = sorted(trial.areas)
    said = [f"Halves of {small:,.0f} and {large:,.0f} m²"]
    access = params.weights[2]
    if access > 0:
        both = term["access"] > 1.5 * access
        said.append("both have street" if both else "a half needs a new street")
    if term["continuity"] > 0:
        said.append("it continues a neighbour's cut")
    if term["clearance"] < 0:
        said.append("it runs close to the boundary")
    if term["frontage"] < 0:
        said.append("a half has less than the least frontage")
    return "; ".join(said) + "."
