"""The energies of Chen 2024, section 5, as sums of squared residuals of vertex positions.

Every term gives R residuals, each of at most K vertices. Positions are in units of the mean
spacing of parcels, √(land / parcels), so that the terms compare: angles count in radians, lengths
in parcel sides.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from urban_processing.mesh.corners import IRREGULARITY_WEIGHTS
from urban_processing.mesh.planar import FloatArray, IntArray


class Term(Protocol):
    """One energy: the sum of its squared residuals."""

    @property
    def vertices(self) -> IntArray:
        """(R, K) vertices that each residual depends on."""
        ...

    def residuals(self, xy: FloatArray) -> FloatArray:
        """(R,) residuals at vertex positions (V, 2)."""
        ...

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """(R, K, 2) derivatives of the residuals by the positions of their vertices."""
        ...


@dataclass(frozen=True, eq=False)
class Regularity:
    """Irregularity of n-sided approximate polygons (Eq. 4): F polygons of N sides.

    Parameters
    ----------
    corners
        (F, N) vertices in counter-clockwise order.
    """

    corners: IntArray

    @property
    def vertices(self) -> IntArray:
        """(2·F·N, N) all corners of the polygon, for its angles and then for its sides."""
        return np.repeat(np.concatenate([self.corners, self.corners]), self.n_sides, axis=0)

    @property
    def n_sides(self) -> int:
        """Number of sides."""
        return int(self.corners.shape[1])

    def residuals(self, xy: FloatArray) -> FloatArray:
        """Angles less their mean, and sides over their mean less one, both weighted by γ."""
        edge, length = self._edges(xy)
        before = np.roll(edge, 1, axis=1)
        cross = before[..., 0] * edge[..., 1] - before[..., 1] * edge[..., 0]
        angle = np.pi - np.arctan2(cross, (before * edge).sum(axis=2))
        by_angle = angle - angle.mean(axis=1, keepdims=True)
        by_side = length / length.mean(axis=1, keepdims=True) - 1.0
        w_angle, w_side = self._weights
        return np.concatenate([(w_angle * by_angle).ravel(), (w_side * by_side).ravel()])

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """The same, differentiated by every corner."""
        edge, length = self._edges(xy)
        f, n = length.shape
        # direction of an edge by its far end; by its near end it is the opposite
        turn = np.stack([-edge[..., 1], edge[..., 0]], axis=-1) / (length**2)[..., None]
        unit = edge / length[..., None]
        by_angle, by_side = np.zeros((2, f, n, n, 2))
        for i in range(n):
            after, before = (i + 1) % n, (i - 1) % n
            by_angle[:, i, after] -= turn[:, i]
            by_angle[:, i, i] += turn[:, i] + turn[:, before]
            by_angle[:, i, before] -= turn[:, before]
            by_side[:, i, after] += unit[:, i]
            by_side[:, i, i] -= unit[:, i]
        mean = length.mean(axis=1)[:, None, None, None]
        by_side = by_side / mean - (
            length[:, :, None, None] / mean**2 * by_side.mean(axis=1, keepdims=True)
        )
        by_angle -= by_angle.mean(axis=1, keepdims=True)
        w_angle, w_side = self._weights
        both = np.concatenate([w_angle * by_angle, w_side * by_side])
        return both.reshape(2 * f * n, n, 2)

    def _edges(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        points = xy[self.corners]
        edge = np.roll(points, -1, axis=1) - points
        return edge, np.maximum(np.hypot(edge[..., 0], edge[..., 1]), 1e-12)

    @property
    def _weights(self) -> FloatArray:
        return np.sqrt(np.array(IRREGULARITY_WEIGHTS) / self.n_sides)


@dataclass(frozen=True, eq=False)
class Smoothness:
    """Second differences along sides or streets (Eqs. 5 and 6): T triples of vertices.

    The differences are taken by arc length, since vertices are not equally spaced: the vector
    from the middle vertex to each neighbour is divided by their distance in the initial layout.

    Parameters
    ----------
    triples
        (T, 3) a vertex and its neighbours on both sides: before, vertex, after.
    spacing
        (T, 2) distance to the one before and to the one after.
    """

    triples: IntArray
    spacing: FloatArray

    @property
    def vertices(self) -> IntArray:
        """(2T, 3) the triples, for x and then for y."""
        return np.concatenate([self.triples, self.triples])

    @property
    def _factors(self) -> FloatArray:
        before, after = (1.0 / self.spacing).T
        return np.column_stack([before, -before - after, after])

    def residuals(self, xy: FloatArray) -> FloatArray:
        """Return x and then y of the second differences."""
        difference = np.einsum("tk,tkd->dt", self._factors, xy[self.triples])
        return np.asarray(difference).ravel()

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """The same at all positions."""
        del xy
        n = len(self.triples)
        out = np.zeros((2 * n, 3, 2))
        out[:n, :, 0] = out[n:, :, 1] = self._factors
        return out


@dataclass(frozen=True, eq=False)
class Junctions:
    """Streets that meet at another angle than 90° (Eq. 7): P pairs of arms.

    The direction of an arm is that of the chord from the junction to a point some metres along
    the street, as the reported deviation takes it; the point lies between two vertices.

    Parameters
    ----------
    node
        (P,) the junction.
    arms
        (P, 2, 2) for each of the two arms the vertices before and after its point.
    share
        (P, 2) where the point lies between them.
    scale
        (P,) product of the chords' lengths in the initial layout.
    """

    node: IntArray
    arms: IntArray
    share: FloatArray
    scale: FloatArray

    @property
    def vertices(self) -> IntArray:
        """(P, 5) the junction and two vertices on each arm."""
        return np.column_stack([self.node, self.arms.reshape(-1, 4)])

    def residuals(self, xy: FloatArray) -> FloatArray:
        """Scalar product of the two chords, over their initial lengths."""
        a, b = self.chords(xy)
        return np.asarray((a * b).sum(axis=1) / self.scale)

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """The same, differentiated."""
        a, b = (chord / self.scale[:, None] for chord in self.chords(xy))
        s, t = self.share[:, 0, None], self.share[:, 1, None]
        return np.stack([-a - b, (1 - s) * b, s * b, (1 - t) * a, t * a], axis=1)

    def chords(self, xy: FloatArray) -> tuple[FloatArray, FloatArray]:
        """(P, 2) chord of each of the two arms."""
        ends = xy[self.arms]  # P, arm, before/after, xy
        share = self.share[:, :, None]
        chord = (1 - share) * ends[:, :, 0] + share * ends[:, :, 1] - xy[self.node][:, None]
        return chord[:, 0], chord[:, 1]


@dataclass(frozen=True, eq=False)
class Closeness:
    """Distance from the initial layout (Eq. 8).

    Parameters
    ----------
    initial
        (V, 2) positions before.
    """

    initial: FloatArray

    @property
    def vertices(self) -> IntArray:
        """(2V, 1) every vertex, for x and then for y."""
        return np.tile(np.arange(len(self.initial)), 2)[:, None]

    def residuals(self, xy: FloatArray) -> FloatArray:
        """Return x and then y of how far the vertices went."""
        return np.asarray((xy - self.initial).T.ravel())

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """One, everywhere."""
        del xy
        n = len(self.initial)
        out = np.zeros((2 * n, 1, 2))
        out[:n, 0, 0] = out[n:, 0, 1] = 1.0
        return out


@dataclass(frozen=True, eq=False)
class AreaLimits:
    """Parcels that would become too small or too large: F rings of N vertices.

    No energy of the paper but the soft form of a promise; the residual is what a parcel lacks or
    has too much, 0 within the limits.

    Parameters
    ----------
    rings
        (F, N) vertices in counter-clockwise order.
    least, most
        (F,) limits of the area.
    """

    rings: IntArray
    least: FloatArray
    most: FloatArray

    @property
    def vertices(self) -> IntArray:
        """(F, N) the rings."""
        return self.rings

    def residuals(self, xy: FloatArray) -> FloatArray:
        """Area beyond the limits, as a share of the smaller one."""
        area = self._areas(xy)
        return np.asarray((area - np.clip(area, self.least, self.most)) / self.least)

    def derivatives(self, xy: FloatArray) -> FloatArray:
        """The same, differentiated; 0 within the limits."""
        points = xy[self.rings]
        chord = np.roll(points, -1, axis=1) - np.roll(points, 1, axis=1)
        by_area = 0.5 * np.stack([chord[..., 1], -chord[..., 0]], axis=-1)
        area = self._areas(xy)
        beyond = (area < self.least) | (area > self.most)
        return np.where(beyond[:, None, None], by_area / self.least[:, None, None], 0.0)

    def _areas(self, xy: FloatArray) -> FloatArray:
        points = xy[self.rings] - xy[self.rings[:, :1]]
        after = np.roll(points, -1, axis=1)
        cross = points[..., 0] * after[..., 1] - points[..., 1] * after[..., 0]
        return np.asarray(0.5 * cross.sum(axis=1))
