"""Figures that are worked out after every edit: a few, and fast."""

from __future__ import annotations

import numpy as np

from urban_processing.access_rule import unreached_parcels_of
from urban_processing.layout import EdgeKind
from urban_processing.mesh.corners import polygon_irregularity, reported_corners
from urban_processing.mesh.planar import IntArray
from urban_processing.pipelines.levels import State


def figures(state: State) -> dict[str, float]:
    """Return what a planner looks at while steering.

    ``parcels``, how many of them the next level cuts (``to_cut``) and no street reaches
    (``unreached``); mean and least area; mean irregularity (Chen 2024, Eq. 1) and the share of
    parcels with four sides; length of the streets inside the land in km, their junctions with
    each other and the rim, and their ends.
    """
    layout, mesh = state.layout, state.layout.mesh
    corners, offsets = reported_corners(mesh)
    irregularity = polygon_irregularity(mesh.xy[corners], offsets)
    inner = layout.edge_street & (layout.edge_kind == EdgeKind.INTERIOR)
    degree = _degree(layout.edge_street, mesh.origin, mesh.n_vertices)
    inner_degree = _degree(inner, mesh.origin, mesh.n_vertices)
    has_inner = inner_degree > 0
    return {
        "parcels": float(mesh.n_faces),
        "to_cut": float(len(next_to_cut(state))),
        "unreached": float(len(unreached_parcels_of(layout))),
        "mean_area_m2": float(mesh.face_area.mean()),
        "least_area_m2": float(mesh.face_area.min()),
        "irregularity_mean": float(irregularity.mean()),
        "quads_pct": float(100.0 * np.mean(np.diff(offsets) == 4)),
        "street_km": float(mesh.edge_length[inner].sum()) / 1000.0,
        "junctions": float((has_inner & (degree > 2)).sum()),
        "street_ends": float((has_inner & (degree == 1)).sum()),
    }


def next_to_cut(state: State) -> IntArray:
    """Faces that the next level cuts, or divides together with the rest of their block."""
    return np.flatnonzero(~state.layout.face_locked) if state.divides_blocks else state.to_cut()


def _degree(edges: np.ndarray, origin: np.ndarray, n_vertices: int) -> np.ndarray:
    return np.bincount(origin[np.repeat(edges, 2)], minlength=n_vertices)
