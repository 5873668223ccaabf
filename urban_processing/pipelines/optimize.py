"""Global optimization of a layout at hand (Chen 2024, section 5)."""

from __future__ import annotations

import dataclasses
import time

import numpy as np

from urban_processing.layout import Layout
from urban_processing.optimization.optimize import Optimized, optimize_geometry
from urban_processing.params.optimize import OptimizeParams
from urban_processing.pipelines.findings import CUT_OFF, SWALLOWED, right_of_way_findings
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.rebuild import canonical
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.site import AREA_ROUNDING, Issue
from urban_processing.version import __version__


def optimize(layout: Layout, params: OptimizeParams, progress: Progress = SILENT) -> Layout:
    """Move the vertices of a layout so that parcels, streets and junctions become more regular.

    Parameters
    ----------
    layout
        The layout; parcels and streets stay what they are, only their geometry changes.
    params
        Weights of the energies; the smallest area allowed.
    progress
        Told how far the work is; may cancel it.

    Returns
    -------
    Layout
        With a `history` entry that tells each energy before and after.
    """
    started = time.perf_counter()
    if params.min_area is not None:
        layout = layout.replace(min_area=params.min_area)
    optimized = _optimized(layout, params, progress)
    after = optimized.layout.replace(issues=_moved(optimized.layout))
    entry = Step(
        algorithm="optimize",
        parameters=params.as_dict(),
        seed=0,
        version=__version__,
        input_sha256=layout.digest,
        seconds=time.perf_counter() - started,
        results=optimized.results(),
    )
    return canonical(after.replace(history=(*after.history, entry)))


def _optimized(layout: Layout, params: OptimizeParams, progress: Progress) -> Optimized:
    """Optimize; parcels whose net area would sink below a promise about it stay as they are."""
    locked = layout.face_locked
    while True:
        optimized = optimize_geometry(
            layout.replace(face_locked=locked), params.weights, progress=progress
        )
        after = optimized.layout.replace(face_locked=layout.face_locked)
        optimized = dataclasses.replace(optimized, layout=after)
        if not layout.street_rules.net_min_area:
            return optimized
        least = np.minimum(layout.min_area, lay_out_rights_of_way(layout).net_area)
        sunk = lay_out_rights_of_way(after).net_area < least * (1.0 - AREA_ROUNDING)
        if not sunk.any():
            return optimized
        # what stays may still lose a little to a junction that moves: then nothing moves
        locked = locked | sunk if (sunk & ~locked).any() else np.ones_like(locked)


def _moved(layout: Layout) -> tuple[Issue, ...]:
    """The issues, those of parcels at their new outlines, those of rights-of-way anew."""
    polygons = layout.mesh.face_polygons()
    kept = tuple(
        issue
        if issue.parcel_id is None or not 1 <= issue.parcel_id <= len(polygons)
        else dataclasses.replace(issue, geometry=polygons[issue.parcel_id - 1])
        for issue in layout.issues
        if issue.code not in (SWALLOWED, CUT_OFF)
    )
    return (*kept, *right_of_way_findings(layout))
