"""Optimizing the geometry of a layout: the topology stays, vertices move."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.corners import polygon_irregularity, reported_corners
from urban_processing.mesh.planar import FloatArray
from urban_processing.optimization.motion import free_motion
from urban_processing.optimization.objective import Objective, build_objective
from urban_processing.optimization.safeguard import moved_to, safe_positions
from urban_processing.optimization.solver import minimize
from urban_processing.params.optimize import Energy
from urban_processing.progress import SILENT, Progress
from urban_processing.site import Issue
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork

SOLVING = 0.7
"""Share of the time that solving takes; the rest is making sure of the result."""

SHORTENINGS = (1.0, 0.5, 0.25)
"""Shares of the movement that are tried until the layout as a whole is better."""


@dataclass(frozen=True, eq=False)
class Optimized:
    """An optimized layout and what was gained.

    Parameters
    ----------
    layout
        The layout; the mesh has the same topology.
    before, after
        Each energy of Eq. 3 without its weight, lengths in units of √(land / parcels).
    moved
        (V,) how far each vertex went, in metres.
    """

    layout: Layout
    before: Mapping[Energy, float]
    after: Mapping[Energy, float]
    moved: FloatArray

    def results(self) -> dict[str, float]:
        """What was gained, as named figures for the provenance of the layout."""
        out: dict[str, float] = {}
        for energy in Energy:
            if energy is not Energy.CLOSENESS:  # it is zero before
                out[f"energy_{energy.value}_before"] = self.before[energy]
            out[f"energy_{energy.value}_after"] = self.after[energy]
        out["moved_mean_m"] = float(self.moved.mean())
        out["moved_max_m"] = float(self.moved.max())
        return {name: float(f"{value:.6g}") for name, value in out.items()}


def optimize_geometry(
    layout: Layout,
    weights: Mapping[Energy, float],
    *,
    least_frontage: float = 0.0,
    progress: Progress = SILENT,
) -> Optimized:
    """Make parcels more regular, sides and streets smoother, junctions more right-angled.

    The minimum of Eq. 3 is found first; then the vertices of a parcel go only so far as it
    stays simple, large enough, reached and regular. Rim vertices slide along exactly straight
    runs of the rim (Eq. 9) or stay (Eq. 10), locked parcels stay. If all that makes the mean
    irregularity of the parcels or the mean deviation of junctions from 90° worse, the layout
    stays as it is, and its issues say so.

    Parameters
    ----------
    layout
        The layout.
    weights
        ω1 to ω5.
    least_frontage
        Frontage in metres below which no parcel falls that has it before.
    progress
        Told how far the work is; may cancel it.
    """
    mesh = layout.mesh
    spacing = math.sqrt(float(mesh.face_area.sum()) / mesh.n_faces)
    network = street_network(layout)
    objective = build_objective(
        layout, network, motion=free_motion(layout), spacing=spacing, weights=weights
    )
    x = minimize(objective, progress=progress.slice(0.0, SOLVING))
    wanted = objective.positions(x) * spacing - mesh.xy
    best, before = layout, _figures(layout, network)
    for i, share in enumerate(SHORTENINGS):
        progress.update(SOLVING + (1.0 - SOLVING) * i / len(SHORTENINGS), "Checking every parcel")
        moved = moved_to(
            layout, safe_positions(layout, mesh.xy + share * wanted, least_frontage=least_frontage)
        )
        if (_figures(moved, street_network(moved)) <= before).all():
            best = moved
            break
    else:
        best = _told(layout)
    progress.update(1.0)
    return _summary(layout, best, objective, spacing)


def _told(layout: Layout) -> Layout:
    """The layout with an issue that says that it stays as it is."""
    issue = Issue(
        "optimization_taken_back",
        "The optimization would have made the parcels more irregular or the junctions less "
        "right-angled, since too many parcels cannot move: the layout stays as it was cut.",
    )
    before = tuple(known for known in layout.issues if known.code != issue.code)
    return layout.replace(issues=(*before, issue))


def _summary(before: Layout, after: Layout, objective: Objective, spacing: float) -> Optimized:
    shift = after.mesh.xy - before.mesh.xy
    return Optimized(
        layout=after,
        before=objective.energies(before.mesh.xy / spacing),
        after=objective.energies(after.mesh.xy / spacing),
        moved=np.hypot(shift[:, 0], shift[:, 1]),
    )


def _figures(layout: Layout, network: StreetNetwork) -> FloatArray:
    """Mean irregularity of the parcels, and mean deviation of the junctions from 90°."""
    corners, offsets = reported_corners(layout.mesh)
    irregularity = polygon_irregularity(layout.mesh.xy[corners], offsets)
    deviation = network.pair_deviation[network.pair_rim < 2]
    return np.array([irregularity.mean(), deviation.mean() if len(deviation) else 0.0])
