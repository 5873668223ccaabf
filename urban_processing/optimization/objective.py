"""The objective of Chen 2024, Eq. 3: the energies of a layout, weighted and summed."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import scipy.sparse as sp

from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.corners import reported_corners
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.straight import go_on_straight, included_angle, pairs_at_nodes
from urban_processing.optimization.motion import STAYS, Motion
from urban_processing.optimization.terms import (
    AreaLimits,
    Closeness,
    Junctions,
    Regularity,
    Smoothness,
    Term,
)
from urban_processing.params.optimize import Energy
from urban_processing.streets.network_model import StreetNetwork

AREA_WEIGHT = 300.0
"""Weight of the promise that no parcel falls under the smallest area."""

AREA_MARGIN = 1.02
"""Parcels are kept this much within their limits."""

MOST_AREAS = 2.0
"""Parcels that could not be cut in two are kept below this many smallest areas."""

NEAR = 1.3
"""Parcels whose area is farther than this factor from both limits are not in danger."""

LEAST_SPACING = 0.05
"""Shorter distances between vertices count as this many parcel sides in the differences."""


@dataclass(frozen=True, eq=False)
class WeightedTerm:
    """A term of an objective; `energy` is None where it is none of Eq. 3."""

    term: Term
    weight: float
    energy: Energy | None = None

    @property
    def root(self) -> float:
        """Factor of the residuals."""
        return math.sqrt(self.weight)


@dataclass(frozen=True, eq=False)
class Objective:
    """Half the weighted sum of squared residuals as a function of the unknowns of a motion.

    Parameters
    ----------
    initial
        (V, 2) positions before, in parcel sides.
    terms
        The terms and their weights; those of an energy of Eq. 3 say which.
    motion
        Which vertices move.
    """

    initial: FloatArray
    terms: tuple[WeightedTerm, ...]
    motion: Motion

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.motion.size

    def positions(self, x: FloatArray) -> FloatArray:
        """(V, 2) positions for given unknowns."""
        return np.asarray(self.initial + self.motion.displacement(x))

    def residuals(self, x: FloatArray) -> FloatArray:
        """All weighted residuals."""
        xy = self.positions(x)
        return np.concatenate([part.root * part.term.residuals(xy) for part in self.terms])

    def jacobian(self, x: FloatArray) -> sp.csr_array:
        """Their derivatives by the unknowns."""
        xy = self.positions(x)
        data, unknown, count = [], [], []
        for part in self.terms:
            vertices = part.term.vertices
            by_xy = part.root * part.term.derivatives(xy)
            by_unknown = np.einsum("rkd,rkdu->rku", by_xy, self.motion.direction[vertices])
            numbers = self.motion.unknown[vertices]
            moves = numbers != STAYS
            data.append(by_unknown[moves])
            unknown.append(numbers[moves])
            count.append(moves.sum(axis=(1, 2)))
        pointer = np.append(0, np.cumsum(np.concatenate(count)))
        shape = (len(pointer) - 1, self.motion.size)
        return sp.csr_array((np.concatenate(data), np.concatenate(unknown), pointer), shape=shape)

    def energies(self, xy: FloatArray) -> dict[Energy, float]:
        """Each energy, without its weight, at given positions."""
        out = dict.fromkeys(Energy, 0.0)
        for part in self.terms:
            if part.energy is not None:
                residuals = part.term.residuals(xy)
                out[part.energy] += float(residuals @ residuals)
        return out


def build_objective(
    layout: Layout,
    network: StreetNetwork,
    *,
    motion: Motion,
    spacing: float,
    weights: Mapping[Energy, float],
) -> Objective:
    """Set up the energies of a layout; lengths count in units of `spacing` metres."""
    mesh = layout.mesh
    initial = mesh.xy / spacing
    sides, streets = _straight_on(layout)
    energies: list[tuple[Energy, Term]] = [
        *((Energy.REGULARITY, Regularity(corners)) for corners in _polygons_by_sides(layout)),
        (Energy.SIDES, _smoothness(initial, sides)),
        (Energy.STREETS, _smoothness(initial, streets)),
        (Energy.JUNCTIONS, _junctions(initial, network)),
        (Energy.CLOSENESS, Closeness(initial)),
    ]
    terms = [WeightedTerm(term, weights[energy], energy) for energy, term in energies]
    promises = [WeightedTerm(term, AREA_WEIGHT) for term in _area_limits(layout, spacing)]
    return Objective(initial, (*terms, *promises), motion)


def _area_limits(layout: Layout, spacing: float) -> list[AreaLimits]:
    """Limits of the areas of parcels, by number of vertices; no parcel is beyond its own."""
    mesh = layout.mesh
    half_edges, offsets = mesh.face_rings()
    area, count = mesh.face_area, np.diff(offsets)
    least = np.minimum(area, AREA_MARGIN * layout.min_area) / spacing**2
    most = np.maximum(area, MOST_AREAS / AREA_MARGIN * layout.min_area) / spacing**2
    in_danger = (area < NEAR * layout.min_area) | (NEAR * area > MOST_AREAS * layout.min_area)
    in_danger &= mesh.face_n_loops == 1
    out = []
    for n in np.unique(count[in_danger]).tolist():
        faces = np.flatnonzero(in_danger & (count == n))
        rings = mesh.origin[half_edges[offsets[faces, None] + np.arange(n)]]
        out.append(AreaLimits(rings, least[faces], most[faces]))
    return out


def _polygons_by_sides(layout: Layout) -> list[IntArray]:
    """Corners of the approximate polygons, one array (F, N) for each number of sides N."""
    corners, offsets = reported_corners(layout.mesh)
    n_sides = np.diff(offsets)
    return [
        corners[offsets[:-1][n_sides == n, None] + np.arange(n)]
        for n in np.unique(n_sides).tolist()
    ]


def _straight_on(layout: Layout) -> tuple[IntArray, IntArray]:
    """(T, 3) triples of vertices along parcel sides, and along streets.

    At every vertex the straightest pair of street edges goes on as a street, then the
    straightest of the rest as a side, which may lie on streets that meet the vertex.
    """
    mesh = layout.mesh
    inner = np.flatnonzero(np.repeat(layout.edge_kind == EdgeKind.INTERIOR, 2))
    arms = inner[np.argsort(mesh.origin[inner], kind="stable")]
    pairs = pairs_at_nodes(mesh.origin[arms])
    way = mesh.xy[mesh.target[arms]] - mesh.xy[mesh.origin[arms]]
    z = way[:, 0] + 1j * way[:, 1]
    street: BoolArray = layout.edge_street[arms >> 1][pairs].all(axis=1)
    angle = included_angle(z[pairs[:, 0]], z[pairs[:, 1]])
    on = go_on_straight(pairs, angle, n_arms=len(arms), first=street)
    a, b = arms[pairs[:, 0]], arms[pairs[:, 1]]
    triples = np.column_stack([mesh.target[a], mesh.origin[a], mesh.target[b]])
    return triples[on & ~street], triples[on & street]


def _smoothness(initial: FloatArray, triples: IntArray) -> Smoothness:
    legs = initial[triples[:, [0, 2]]] - initial[triples[:, [1]]]
    return Smoothness(triples, np.maximum(np.hypot(legs[..., 0], legs[..., 1]), LEAST_SPACING))


def _junctions(initial: FloatArray, network: StreetNetwork) -> Junctions:
    """Pairs of streets as the reported deviation counts them: not two rim streets."""
    counted = network.pair_rim < 2
    arms, points = network.pair_arms[counted], network.arm_points
    ends = np.stack([points.before[arms], points.after[arms]], axis=2)
    share = points.share[arms]
    node = points.node[arms[:, 0]]
    term = Junctions(node, ends, share, np.ones(len(arms)))
    length = [np.hypot(c[:, 0], c[:, 1]) for c in term.chords(initial)]
    scale = np.maximum(length[0] * length[1], LEAST_SPACING**2)
    return Junctions(node, ends, share, scale)
