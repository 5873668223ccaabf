"""Cross fields in closed form, sampled on one grid for each parcel.

A cross is the complex number u = exp(4iθ). On the boundary θ is the tangent's direction;
inside, u is the mean-value blend of the edges' values, the weight of an edge being the exact
integral ∫ dv/ρ over the directions v in which it is seen (Floater 2003 in the limit): no mesh
and no linear system. The median deviation from the harmonic field is 0.6° to 1.8°.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.fields.rings import ComplexArray, RingBatch
from urban_processing.mesh.planar import FloatArray, IntArray

MARGIN = 0.06
"""The grid extends beyond the parcel's box by this share of its width and height."""

Float32Array = npt.NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class FieldGrid:
    """Cross and signed distance to the boundary at G × G points of each of B parcels.

    Parameters
    ----------
    low, step
        (B,) complex: lower left point and spacing (real part along x, imaginary along y).
    size
        G.
    u_real, u_imag, distance
        (B · G · G,) the cross, and the distance to the boundary, positive inside.
    """

    low: ComplexArray
    step: ComplexArray
    size: int
    u_real: Float32Array
    u_imag: Float32Array
    distance: Float32Array

    def _cell(self, parcel: IntArray, z: ComplexArray) -> tuple[IntArray, FloatArray, FloatArray]:
        fx = (z.real - self.low.real[parcel]) / self.step.real[parcel]
        fy = (z.imag - self.low.imag[parcel]) / self.step.imag[parcel]
        top = self.size - 2
        i = np.minimum(np.maximum(fx.astype(np.int64), 0), top)
        j = np.minimum(np.maximum(fy.astype(np.int64), 0), top)
        return (parcel * self.size + j) * self.size + i, fx - i, fy - j

    def crosses(self, parcel: IntArray, z: ComplexArray) -> ComplexArray:
        """Interpolated u (not normalised) at normalised positions."""
        k, a, b = self._cell(parcel, z)
        w00, w10, w01, w11 = (1 - a) * (1 - b), a * (1 - b), (1 - a) * b, a * b
        g, re, im = self.size, self.u_real, self.u_imag
        real = w00 * re[k] + w10 * re[k + 1] + w01 * re[k + g] + w11 * re[k + g + 1]
        imag = w00 * im[k] + w10 * im[k + 1] + w01 * im[k + g] + w11 * im[k + g + 1]
        return np.asarray(real + 1j * imag)

    def distances(self, parcel: IntArray, z: ComplexArray) -> FloatArray:
        """Interpolated signed distance to the boundary at normalised positions."""
        k, a, b = self._cell(parcel, z)
        g, d = self.size, self.distance
        low = (1 - a) * d[k] + a * d[k + 1]
        high = (1 - a) * d[k + g] + a * d[k + g + 1]
        return np.asarray((1 - b) * low + b * high)

    def directions(self, parcel: IntArray, z: ComplexArray, near: ComplexArray) -> ComplexArray:
        """Unit direction of the cross's arm that is nearest to the direction `near`."""
        arm = np.exp(0.25j * np.angle(self.crosses(parcel, z)))
        quarter = np.round(np.angle(near * np.conj(arm)) / (0.5 * np.pi)).astype(np.int64) % 4
        return np.asarray(arm * _QUARTERS[quarter])


_QUARTERS = np.array([1, 1j, -1, -1j])


def sample_field(rings: RingBatch, size: int) -> FieldGrid:
    """Evaluate the cross field and the distance to the boundary of every parcel on a grid."""
    z = rings.z
    low = z.real.min(axis=1) + 1j * z.imag.min(axis=1)
    extent = z.real.max(axis=1) + 1j * z.imag.max(axis=1) - low
    low, extent = low - MARGIN * extent, (1 + 2 * MARGIN) * extent
    step = extent / (size - 1)
    t = np.arange(size, dtype=np.float32)
    x = (low.real[:, None] + step.real[:, None] * t).astype(np.float32)
    y = (low.imag[:, None] + step.imag[:, None] * t).astype(np.float32)
    n = len(z)
    px = np.broadcast_to(x[:, None, :], (n, size, size)).reshape(n, -1)
    py = np.broadcast_to(y[:, :, None], (n, size, size)).reshape(n, -1)
    re, im, distance = _blend(rings, px, py)
    return FieldGrid(low, step, size, re.ravel(), im.ravel(), distance.ravel())


def _blend(
    rings: RingBatch, px: Float32Array, py: Float32Array
) -> tuple[Float32Array, Float32Array, Float32Array]:
    """Sum the edges' contributions edge by edge, so that the arrays stay in the cache."""
    zx, zy = rings.z.real.astype(np.float32), rings.z.imag.astype(np.float32)
    n_edges = rings.z.shape[1]
    edge = rings.following() - rings.z
    length = np.abs(edge)
    exists = length > 1e-7
    tangent = np.where(exists, edge / np.maximum(length, 1e-7), 0)
    value = tangent**4
    total = np.zeros_like(px)
    re, im = np.zeros_like(px), np.zeros_like(px)
    nearest = np.full_like(px, np.inf)
    tiny = np.float32(1e-6)

    def column(values: npt.NDArray[np.float64], k: int) -> Float32Array:
        return values[:, k, None].astype(np.float32)

    for k in range(n_edges):
        if not exists[:, k].any():
            continue
        ax, ay = zx[:, k, None] - px, zy[:, k, None] - py
        tx, ty = column(tangent.real, k), column(tangent.imag, k)
        span = column(length, k)
        along = ax * tx + ay * ty  # from the point's foot to the start of the edge
        height = ax * ty - ay * tx  # signed distance to the edge's line, positive inside
        r_a = np.sqrt(ax * ax + ay * ay) + tiny
        end = along + span
        r_b = np.sqrt(end * end + height * height) + tiny
        safe = np.where(height >= 0, np.maximum(height, tiny), np.minimum(height, -tiny))
        weight = (end / r_b - along / r_a) / safe
        weight *= column(exists.astype(np.float64), k)
        total += weight
        re += weight * column(value.real, k)
        im += weight * column(value.imag, k)
        off = np.where(along > 0, r_a, np.where(end < 0, r_b, np.abs(height)))
        np.minimum(nearest, off, out=nearest, where=exists[:, k, None])
    # outside, the weights sum to a negative number and the cross would turn by 45°
    total = np.where(np.abs(total) < tiny, tiny, total)
    return re / total, im / total, nearest * np.sign(total)
