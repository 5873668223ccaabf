"""The parcels of a level that are to be cut, and measures along their boundaries."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urban_processing.fields.rings import ComplexArray, RingBatch, cross, make_batch, pad
from urban_processing.hashing import UintArray
from urban_processing.layout import Layout
from urban_processing.mesh.corners import reported_polygons, ring_neighbours, thin_corners
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.subdivision.attach import BARE, edge_networks

CONTINUES_ANGLE = np.radians(20.0)
"""Largest angle between a cut and the neighbour's cut that it continues (Yang 2013, 5)."""


AT_VERTEX = 1e-9
"""A place within this share of an edge from its end is that end."""


@dataclass(frozen=True, eq=False)
class ParcelRings:
    """Rings of P parcels as ragged arrays of R entries; entry i is a half-edge and its origin.

    Parameters
    ----------
    face
        (P,) faces of the layout.
    lineage
        (P,) path of each face, which seeds its random numbers.
    offsets
        (P + 1,) ring p is entries ``offsets[p]`` to ``offsets[p + 1]``.
    half_edge, xy
        (R,) half-edge, and (R, 2) position of its origin.
    street
        (R,) whether the half-edge is street.
    network
        (R,) connected piece of the graph of edges where streets may run, `BARE` for others.
    corner
        (R,) whether the vertex is a corner of the parcel's approximate polygon.
    node
        (R,) whether the vertex is a parcel corner of the mesh (cuts may be snapped to it).
    inward
        (R,) unit direction into the parcel that continues the cut of a neighbour which ends
        at the vertex from the other side; 0 where there is none.
    """

    face: IntArray
    lineage: UintArray
    offsets: IntArray
    half_edge: IntArray
    xy: FloatArray
    street: BoolArray
    network: IntArray
    corner: BoolArray
    node: BoolArray
    inward: ComplexArray

    def chunks(self, budget: int, among: IntArray) -> list[IntArray]:
        """Some parcels, sorted by ring length and grouped so that a padded group stays small."""
        count = np.diff(self.offsets)
        order = among[np.argsort(count[among], kind="stable")]
        groups: list[IntArray] = []
        start = 0
        while start < len(order):
            size = max(1, budget // int(count[order[start]]))
            stop = min(len(order), start + size)
            # the longest ring of a group sets its padding
            while stop > start + 1 and count[order[stop - 1]] * (stop - start) > 2 * budget:
                stop = start + (stop - start) // 2
            groups.append(order[start:stop])
            start = stop
        return groups


def parcel_rings(layout: Layout, faces: IntArray) -> ParcelRings:
    """Gather the rings of the given faces, each of which has one loop."""
    mesh = layout.mesh
    h, offsets = mesh.face_rings(faces)
    vertex = mesh.origin[h]
    xy = mesh.xy[vertex]
    node = (mesh.valence[vertex] > 2) | layout.vertex_corner[vertex]
    return ParcelRings(
        face=faces,
        lineage=layout.face_lineage[faces],
        offsets=offsets,
        half_edge=h,
        xy=xy,
        street=layout.edge_street[h >> 1],
        network=edge_networks(layout)[h >> 1],
        corner=_ring_corners(layout, xy, offsets, vertex),
        node=node,
        inward=_continuations(layout, h, offsets),
    )


def _ring_corners(layout: Layout, xy: FloatArray, offsets: IntArray, vertex: IntArray) -> BoolArray:
    """Corners of the approximate polygons: found on the shape, or from those given."""
    out = np.zeros(len(xy), dtype=bool)
    corners, _ = reported_polygons(xy, offsets)
    out[corners] = True
    if not layout.corners_given:
        return out
    given = layout.vertex_corner[vertex]
    ends = np.flatnonzero(given | (layout.mesh.valence[vertex] > 2))
    count = np.diff(np.searchsorted(ends, offsets))
    ring = np.repeat(np.arange(len(count)), np.diff(offsets))
    enough = count >= 3
    out[enough[ring]] = False
    ends = ends[enough[ring[ends]]]
    if len(ends):
        kept, _ = thin_corners(xy, ends, np.append(0, np.cumsum(count[enough])), keep=given[ends])
        out[kept] = True
    return out


def _continuations(layout: Layout, h: IntArray, offsets: IntArray) -> ComplexArray:
    """Direction that continues a neighbour's cut which ends on a straight run of the ring."""
    mesh = layout.mesh
    before, _ = ring_neighbours(offsets)
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    vertex = mesh.origin[h]
    # the only other half-edge at a vertex of valence 3 comes next in the rotation
    other = mesh.next[h ^ 1]
    is_tee = (mesh.valence[vertex] == 3) & ~mesh.vertex_is_boundary[vertex]
    arm = z[mesh.target[other]] - z[vertex]
    back = z[mesh.origin[h[before]]] - z[vertex]
    ahead = z[mesh.target[h]] - z[vertex]
    straight = cross(ahead, back) / (np.abs(ahead) * np.abs(back))
    opposite = (ahead * np.conj(back)).real < 0
    usable = is_tee & opposite & (np.abs(straight) < np.sin(2 * CONTINUES_ANGLE))
    length = np.where(usable, np.abs(arm), 1.0)
    return np.asarray(np.where(usable, -arm / length, 0))


@dataclass(frozen=True, eq=False)
class Boundary:
    """Boundaries of a batch of B parcels, measured by the length t along the ring.

    Rings are padded to N entries; t runs from 0 at vertex 0 to the perimeter, in √area.
    """

    rings: RingBatch
    street: BoolArray
    network: IntArray
    corner: BoolArray
    node: BoolArray
    inward: ComplexArray

    @cached_property
    def edge(self) -> ComplexArray:
        """(B, N) vector of each edge; zero in the padding but for its last entry."""
        return self.rings.following() - self.rings.z

    @cached_property
    def t(self) -> FloatArray:
        """(B, N + 1) length along the ring at each vertex, and the perimeter at the end."""
        length = np.abs(self.edge)
        return np.concatenate([np.zeros((len(length), 1)), np.cumsum(length, axis=1)], axis=1)

    @property
    def perimeter(self) -> FloatArray:
        """(B,) length of the ring."""
        return self.t[:, -1]

    @cached_property
    def _stride(self) -> float:
        return float(self.perimeter.max()) * 2.0 + 1.0

    @cached_property
    def _flat_t(self) -> FloatArray:
        rows = np.arange(len(self.t))[:, None] * self._stride
        return np.asarray((self.t[:, :-1] + rows).ravel())

    def locate(self, parcel: IntArray, t: FloatArray) -> tuple[IntArray, FloatArray]:
        """Edge and place on it (0 to 1) at a length along the ring."""
        n = self.t.shape[1] - 1
        k = np.searchsorted(self._flat_t, t + parcel * self._stride, side="right") - 1
        k = np.clip(k - parcel * n, 0, n - 1)
        start, stop = self.t[parcel, k], self.t[parcel, k + 1]
        along = (t - start) / np.where(stop > start, stop - start, 1.0)
        return k, np.clip(along, 0.0, 1.0)

    def position(self, parcel: IntArray, t: FloatArray) -> ComplexArray:
        """Point at a length along the ring."""
        k, along = self.locate(parcel, t)
        return np.asarray(self.rings.z[parcel, k] + along * self.edge[parcel, k])

    @cached_property
    def _cross_sum(self) -> FloatArray:
        z = self.rings.z
        c = cross(z, self.rings.following())
        return np.concatenate([np.zeros((len(c), 1)), np.cumsum(c, axis=1)], axis=1)

    @cached_property
    def _street_sum(self) -> FloatArray:
        return self._sum_where(self.street)

    @cached_property
    def usable(self) -> BoolArray:
        """(B, N) edges that are or could be street."""
        return np.asarray((self.network != BARE) & self.rings.valid)

    @cached_property
    def _usable_sum(self) -> FloatArray:
        return self._sum_where(self.usable)

    def _sum_where(self, chosen: BoolArray) -> FloatArray:
        """(B, N + 1) length of the chosen edges up to each vertex."""
        s = np.where(chosen, np.abs(self.edge), 0.0)
        return np.concatenate([np.zeros((len(s), 1)), np.cumsum(s, axis=1)], axis=1)

    def _twice_area_to(self, parcel: IntArray, t: FloatArray) -> FloatArray:
        k, along = self.locate(parcel, t)
        z = self.rings.z[parcel, k]
        return self._cross_sum[parcel, k] + cross(z, z + along * self.edge[parcel, k])

    def _length_to(
        self, total: FloatArray, chosen: BoolArray, parcel: IntArray, t: FloatArray
    ) -> FloatArray:
        k, along = self.locate(parcel, t)
        step = np.where(chosen[parcel, k], np.abs(self.edge[parcel, k]), 0.0)
        return np.asarray(total[parcel, k] + along * step)

    def twice_area_between(
        self, parcel: IntArray, start: FloatArray, stop: FloatArray
    ) -> FloatArray:
        """∑ z × z' along the ring from `start` forward to `stop`."""
        part = self._twice_area_to(parcel, stop) - self._twice_area_to(parcel, start)
        return part + np.where(stop < start, self._cross_sum[parcel, -1], 0.0)

    def street_between(self, parcel: IntArray, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Street length along the ring from `start` forward to `stop`."""
        return self._length_between(self._street_sum, self.street, parcel, start, stop)

    def usable_between(self, parcel: IntArray, start: FloatArray, stop: FloatArray) -> FloatArray:
        """Length that is or could be street along the ring from `start` forward to `stop`."""
        return self._length_between(self._usable_sum, self.usable, parcel, start, stop)

    def _length_between(
        self,
        total: FloatArray,
        chosen: BoolArray,
        parcel: IntArray,
        start: FloatArray,
        stop: FloatArray,
    ) -> FloatArray:
        part = self._length_to(total, chosen, parcel, stop)
        part = part - self._length_to(total, chosen, parcel, start)
        return np.asarray(part + np.where(stop < start, total[parcel, -1], 0.0))

    def is_attached(self, parcel: IntArray, t: FloatArray) -> BoolArray:
        """Whether a place of the ring lies on an edge where streets may run, or at its end."""
        k, along = self.locate(parcel, t)
        n = self.rings.count[parcel]
        k = np.minimum(k, n - 1)
        on = self.network != BARE
        before, after = on[parcel, (k - 1) % n], on[parcel, (k + 1) % n]
        at_start, at_end = along <= AT_VERTEX, along >= 1.0 - AT_VERTEX
        return np.asarray(on[parcel, k] | (at_start & before) | (at_end & after))

    @cached_property
    def has_network(self) -> BoolArray:
        """(B,) whether streets may run along some edge of the ring."""
        return np.asarray(((self.network != BARE) & self.rings.valid).any(axis=1))

    @cached_property
    def has_bare(self) -> bool:
        """Whether there is an edge in the batch that no street may run along."""
        return bool(((self.network == BARE) & self.rings.valid).any())

    @cached_property
    def corners(self) -> tuple[FloatArray, ComplexArray, IntArray]:
        """(B, M) lengths and positions of the corners in ring order, and (B,) their number."""
        mask = self.corner & self.rings.valid
        number = mask.sum(axis=1)
        order = np.argsort(~mask, axis=1, kind="stable")[:, : max(int(number.max()), 1)]
        t = np.take_along_axis(self.t[:, :-1], order, axis=1)
        z = np.take_along_axis(self.rings.z, order, axis=1)
        beyond = np.arange(order.shape[1])[None] >= number[:, None]
        return np.where(beyond, np.inf, t), z, number


def boundaries(parcels: ParcelRings, rows: IntArray) -> Boundary:
    """Normalised boundaries of some of the parcels."""
    o = parcels.offsets
    rings = make_batch(parcels.xy, o, rows)
    valid = rings.valid
    return Boundary(
        rings=rings,
        street=np.asarray(pad(parcels.street, o, rows), dtype=bool),
        network=np.asarray(pad(parcels.network, o, rows), dtype=np.int64),
        corner=np.asarray(pad(parcels.corner, o, rows), dtype=bool) & valid,
        node=np.asarray(pad(parcels.node, o, rows), dtype=bool) & valid,
        inward=np.asarray(pad(parcels.inward, o, rows)) * np.conj(rings.axis)[:, None] * valid,
    )
