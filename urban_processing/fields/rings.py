"""Many parcels side by side: their rings padded to one length, each in a frame of its own."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

ComplexArray = npt.NDArray[np.complex128]
_T = TypeVar("_T", bound=np.generic)


@dataclass(frozen=True, eq=False)
class RingBatch:
    """B parcels as padded counter-clockwise rings of at most N vertices.

    Coordinates are complex and normalised: the origin at the centroid, the unit √area, the
    axes along the directions that the boundary prefers (modulo 90°), so that nothing in the
    kernels depends on scale, place or rotation. Padding repeats the last vertex.

    Parameters
    ----------
    z
        (B, N) normalised vertices.
    count
        (B,) number of vertices.
    centre, scale, axis
        (B,) centroid, √area in metres and unit direction of the local x axis:
        map position = centre + scale * axis * z.
    """

    z: ComplexArray
    count: IntArray
    centre: ComplexArray
    scale: FloatArray
    axis: ComplexArray

    @property
    def valid(self) -> BoolArray:
        """(B, N) which entries are vertices and not padding."""
        return np.asarray(np.arange(self.z.shape[1])[None] < self.count[:, None])

    def following(self) -> ComplexArray:
        """(B, N) vertex after each vertex; a padded entry's is the ring's first."""
        return np.roll(self.z, -1, axis=1)

    def to_map(self, parcel: IntArray, z: ComplexArray) -> FloatArray:
        """(n, 2) map positions of normalised positions of the given parcels."""
        w = self.centre[parcel] + self.scale[parcel] * self.axis[parcel] * z
        return np.column_stack([w.real, w.imag])


def cross(a: ComplexArray, b: ComplexArray) -> FloatArray:
    """Cross product of plane vectors given as complex numbers."""
    return np.asarray(a.real * b.imag - a.imag * b.real)


def pad(values: npt.NDArray[_T], offsets: IntArray, rings: IntArray) -> npt.NDArray[_T]:
    """(B, N) values of the chosen rings of a ragged array, the last one repeated."""
    count = offsets[rings + 1] - offsets[rings]
    index = np.minimum(np.arange(int(count.max()))[None], count[:, None] - 1)
    return np.asarray(values[offsets[rings][:, None] + index])


def make_batch(xy: FloatArray, offsets: IntArray, rings: IntArray) -> RingBatch:
    """Normalise the chosen rings of a ragged array of map coordinates."""
    count = offsets[rings + 1] - offsets[rings]
    w = pad(xy[:, 0] + 1j * xy[:, 1], offsets, rings)
    first = w[:, :1]
    w = w - first
    after = np.roll(w, -1, axis=1)
    c = cross(w, after)
    area = 0.5 * c.sum(axis=1)
    centroid = ((w + after) * c).sum(axis=1) / (6.0 * area)
    scale = np.sqrt(area)
    axis = _preferred_axis(w, after)
    z = (w - centroid[:, None]) * np.conj(axis)[:, None] / scale[:, None]
    return RingBatch(z, count, first[:, 0] + centroid, scale, axis)


def _preferred_axis(w: ComplexArray, after: ComplexArray) -> ComplexArray:
    """Direction modulo 90° of the boundary, of the two the one along which it is longer."""
    edge = after - w
    length = np.abs(edge)
    fourfold = (np.where(length > 0, edge / np.maximum(length, 1e-300), 0) ** 4 * length).sum(
        axis=1
    )
    axis = np.exp(0.25j * np.angle(fourfold))
    turned = w * np.conj(axis)[:, None]
    wide, tall = np.ptp(turned.real, axis=1), np.ptp(turned.imag, axis=1)
    axis = np.where(tall > wide * (1 + 1e-9), axis * 1j, axis)
    return np.asarray(axis)
