"""Streamlines of cross fields: all seeds of all parcels of a batch traced together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from urban_processing.fields.cross import FieldGrid
from urban_processing.fields.rings import ComplexArray, RingBatch, cross
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

STEP = 0.06
"""Step of the integration relative to √area."""

LONGEST = 8.0
"""A streamline longer than this many √area is given up."""

TURN_LIMIT = np.radians(126.0)
"""A streamline whose one arm turns by more than this is given up; both arms together may turn
by less than 180° (Yang 2013, section 5, rejects lines that intersect themselves)."""


@dataclass(frozen=True, eq=False)
class Traces:
    """K arms, each from its start to the parcel's boundary.

    Parameters
    ----------
    parcel
        (K,) row of the batch.
    start
        (K,) normalised position where an arm begins.
    edge, along
        (K,) edge of the ring that is hit (-1 where the arm was given up) and the place on it,
        0 at the edge's first vertex and 1 at its second.
    end, direction
        (K,) normalised position of the hit and unit direction of arrival.
    twice_area
        (K,) ∑ zᵢ × zᵢ₊₁ along the arm.
    clearance
        (K,) least distance to the boundary away from the arm's end, in √area.
    turned
        (K,) angle in radians by which an arm turns, counter-clockwise positive.
    steps
        Points after the start, one entry for each step: (arms still going, their positions).
    """

    parcel: IntArray
    start: ComplexArray
    edge: IntArray
    along: FloatArray
    end: ComplexArray
    direction: ComplexArray
    twice_area: FloatArray
    clearance: FloatArray
    turned: FloatArray
    steps: tuple[tuple[IntArray, ComplexArray], ...]

    def paths(self, arms: IntArray) -> list[ComplexArray]:
        """Points of the given (distinct) arms from start to end."""
        if len(arms) == 0:
            return []
        row = np.full(len(self.parcel), -1)
        row[arms] = np.arange(len(arms))
        rows, points = [np.arange(len(arms))], [self.start[arms]]
        for going, z in self.steps:
            wanted = row[going]
            mask = wanted >= 0
            rows.append(wanted[mask])
            points.append(z[mask])
        all_rows, all_points = np.concatenate(rows), np.concatenate(points)
        order = np.argsort(all_rows, kind="stable")
        cuts = np.cumsum(np.bincount(all_rows, minlength=len(arms)))[:-1]
        return list(np.split(all_points[order], cuts))


def trace(
    rings: RingBatch,
    field: FieldGrid,
    parcel: IntArray,
    start: ComplexArray,
    direction: ComplexArray,
    clearance_span: float,
    rooted: BoolArray,
) -> Traces:
    """Follow the field from `start` until the boundary is crossed (Runge–Kutta of order 2).

    `rooted` arms begin on the boundary itself: the first part of them is not looked at for the
    clearance, nor is the last part of any arm, each over `clearance_span` √area.
    """
    tracer = _Tracer(rings, field, parcel, start, direction)
    limit = int(LONGEST / STEP)
    for _ in range(limit):
        if len(tracer.going) == 0:
            break
        tracer.advance()
    return tracer.result(clearance_span, rooted)


class _Tracer:
    """State of the arms that are still on their way."""

    def __init__(
        self,
        rings: RingBatch,
        field: FieldGrid,
        parcel: IntArray,
        start: ComplexArray,
        direction: ComplexArray,
    ) -> None:
        n = len(parcel)
        self.rings, self.field = rings, field
        self.following = rings.following()
        self.parcel, self.start = parcel, start
        self.z, self.d = start.copy(), direction.copy()
        self.going = np.arange(n)
        self.edge = np.full(n, -1)
        self.along = np.zeros(n)
        self.turned = np.zeros(n)
        self.twice_area = np.zeros(n)
        self.n_steps = np.zeros(n, dtype=np.int64)
        self.steps: list[tuple[IntArray, ComplexArray]] = []
        self.distances: list[FloatArray] = []
        self.cell = 0.5 * np.maximum(field.step.real, field.step.imag)

    def advance(self) -> None:
        """Move every arm by one step; those that cross the boundary end on it."""
        going = self.going
        p, z0, d0 = self.parcel[going], self.z[going], self.d[going]
        d1 = self.field.directions(p, z0, d0)
        d2 = self.field.directions(p, z0 + 0.5 * STEP * d1, d1)
        z1 = z0 + STEP * d2
        self.turned[going] += np.angle(d2 * np.conj(d0))
        distance = self.field.distances(p, z1)
        done = np.abs(self.turned[going]) > TURN_LIMIT
        close = np.flatnonzero(distance < 0.75 * STEP + self.cell[p])
        if len(close):
            hit, edge, along, at = self._crossing(p[close], z0[close], z1[close])
            arms = close[hit]
            z1[arms] = at[hit]
            self.edge[going[arms]] = edge[hit]
            self.along[going[arms]] = along[hit]
            done[arms] = True
        self.twice_area[going] += cross(z0, z1)
        self.steps.append((going, z1))
        self.distances.append(distance)
        self.z[going], self.d[going] = z1, d2
        self.n_steps[going] += 1
        self.going = going[~done]

    def _crossing(
        self, p: IntArray, z0: ComplexArray, z1: ComplexArray
    ) -> tuple[BoolArray, IntArray, FloatArray, ComplexArray]:
        """First edge that each step crosses from inside to outside."""
        a = self.rings.z[p]
        e = self.following[p] - a
        move = (z1 - z0)[:, None]
        to_a = a - z0[:, None]
        denominator = cross(move, e)
        with np.errstate(divide="ignore", invalid="ignore"):
            t = cross(to_a, e) / denominator
            s = cross(to_a, move) / denominator
        on_edge = (denominator > 0) & (t >= 0) & (t <= 1) & (s >= 0) & (s <= 1)
        t = np.where(on_edge, t, np.inf)
        edge = t.argmin(axis=1)
        rows = np.arange(len(p))
        hit = np.isfinite(t[rows, edge])
        along = s[rows, edge]
        at = a[rows, edge] + np.where(hit, along, 0.0) * e[rows, edge]
        return hit, edge, along, at

    def result(self, clearance_span: float, rooted: BoolArray) -> Traces:
        """Gather what is known of the arms."""
        self.edge[self.going] = -1
        return Traces(
            parcel=self.parcel,
            start=self.start,
            edge=self.edge,
            along=self.along,
            end=self.z,
            direction=self.d,
            twice_area=self.twice_area,
            clearance=self._clearance(clearance_span, rooted),
            turned=self.turned,
            steps=tuple(self.steps),
        )

    def _clearance(self, span: float, rooted: BoolArray) -> FloatArray:
        skip = int(np.ceil(span / STEP)) + 1
        out = np.full(len(self.parcel), np.inf)
        last = self.n_steps - skip
        first = np.where(rooted, skip, 0)
        for i, ((going, _), distance) in enumerate(zip(self.steps, self.distances, strict=True)):
            inner = (i < last[going]) & (i >= first[going])
            arms = going[inner]
            out[arms] = np.minimum(out[arms], distance[inner])
        return out
