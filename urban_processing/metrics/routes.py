"""Ways along streets: from parcels to the rim, to each other, and between intersections."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from urban_processing.fabric.model import Fabric, Fronts
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.averages import in_part
from urban_processing.streets.classes import NodeKind

MOST_SOURCES = 256
"""Ways begin at no more parcels, or nodes, than these, spread evenly over the land."""

LEAST_SOURCES = 16
"""Or at so many in each piece of the land, where that is more."""

MOST_PAIRS = 8_000_000
"""Pairs of pieces of frontage between which ways are worked out."""

NEAR = 1.0
"""Places that are nearer in a straight line, in metres, have no detour."""


@dataclass(frozen=True, eq=False)
class Routes:
    """Ways along all streets, the rim's too; a parcel begins wherever its frontage is."""

    fabric: Fabric

    @cached_property
    def _links(self) -> csr_array:
        """(N, N) length of the shortest edge between two nodes."""
        net = self.fabric.network
        low, high = np.minimum(net.start, net.end), np.maximum(net.start, net.end)
        order = np.lexsort((net.edge_length, high, low))
        order = order[low[order] != high[order]]
        pair = low[order] * np.int64(net.n_nodes) + high[order]
        first = order[np.flatnonzero(np.diff(pair, prepend=-1))]
        at = np.concatenate([low[first], high[first]]), np.concatenate([high[first], low[first]])
        return csr_array((np.tile(net.edge_length[first], 2), at), shape=(net.n_nodes, net.n_nodes))

    def _ways(self, nodes: IntArray) -> FloatArray:
        """(n, N) ways from some nodes to all."""
        return np.asarray(dijkstra(self._links, directed=False, indices=nodes))

    @cached_property
    def _to_rim(self) -> FloatArray:
        """(N,) ways to the rim; infinite where it cannot be reached."""
        net = self.fabric.network
        gates = net.node_kind == NodeKind.ENTRY
        gates[net.start[net.edge_rim]] = True
        gates[net.end[net.edge_rim]] = True
        if not gates.any():
            return np.full(net.n_nodes, np.inf)
        return np.asarray(
            dijkstra(self._links, directed=False, indices=np.flatnonzero(gates), min_only=True)
        )

    @cached_property
    def _weight(self) -> FloatArray:
        """(A,) share that each piece has of its parcel's frontage."""
        fronts = self._fronts
        total = np.bincount(fronts.parcel, weights=fronts.length, minlength=self._n_parcels)
        return np.asarray(fronts.length / total[fronts.parcel])

    @property
    def _fronts(self) -> Fronts:
        parcels = self.fabric.parcels
        nobody = np.empty(0, dtype=np.int64)
        if parcels is None:
            return Fronts(nobody, nobody, np.empty(0), np.empty(0))
        return parcels.fronts

    @property
    def _n_parcels(self) -> int:
        return 0 if self.fabric.parcels is None else len(self.fabric.parcels)

    def parcel_values(self, chosen: BoolArray) -> dict[str, float]:
        """Mean ways from some of the parcels to the rim and to each other.

        Parameters
        ----------
        chosen
            (F,) which parcels.
        """
        between = self._between_parcels
        rows, columns = chosen[between.source], chosen[self._fronts.parcel]
        return {
            "rim_distance_m": self._mean_to_rim(chosen),
            "parcel_distance_m": between.mean(between.way, rows, columns),
            "parcel_detour": between.mean(between.detour, rows, columns),
        }

    def _mean_to_rim(self, chosen: BoolArray) -> float:
        net, fronts = self.fabric.network, self._fronts
        rest = net.edge_length[fronts.edge] - fronts.at
        way = np.minimum(
            fronts.at + self._to_rim[net.start[fronts.edge]],
            rest + self._to_rim[net.end[fronts.edge]],
        )
        way = np.where(net.edge_rim[fronts.edge], 0.0, way)
        return _weighted(way, self._weight * (chosen[fronts.parcel] & np.isfinite(way)))

    @cached_property
    def _between_parcels(self) -> _Between:
        """Ways from pieces of frontage of some parcels to all pieces."""
        net, fronts = self.fabric.network, self._fronts
        source = self._sources
        edge, at = fronts.edge[source], fronts.at[source]
        ends = np.column_stack([net.start[edge], net.end[edge]])
        offset = np.column_stack([at, net.edge_length[edge] - at])
        nodes, local = np.unique(ends, return_inverse=True)
        ways = self._ways(nodes) if len(nodes) else np.empty((0, net.n_nodes))
        local = local.reshape(-1, 2)
        to_node = np.minimum(ways[local[:, 0]] + offset[:, :1], ways[local[:, 1]] + offset[:, 1:])
        way = np.minimum(
            to_node[:, net.start[fronts.edge]] + fronts.at,
            to_node[:, net.end[fronts.edge]] + net.edge_length[fronts.edge] - fronts.at,
        )
        direct = np.abs(at[:, None] - fronts.at)
        way = np.where(edge[:, None] == fronts.edge, np.minimum(way, direct), way)
        z = self._front_places
        parcel = fronts.parcel
        weight = self._weight[source][:, None] * self._weight
        weight = np.where(parcel[source][:, None] == parcel, 0.0, weight)
        return _Between(way, np.abs(z[source][:, None] - z), weight, parcel[source])

    @property
    def _front_places(self) -> npt.NDArray[np.complex128]:
        """(A,) places on the network opposite each piece."""
        import shapely

        fronts = self._fronts
        lines = self.fabric.street_lines[fronts.edge]
        xy = shapely.get_coordinates(shapely.line_interpolate_point(lines, fronts.at))
        return np.asarray(xy[:, 0] + 1j * xy[:, 1])

    @cached_property
    def _sources(self) -> IntArray:
        """Pieces of frontage that ways begin at: those of parcels spread over the land."""
        parcels, fronts = self.fabric.parcels, self._fronts
        if parcels is None or not len(fronts.parcel):
            return np.empty(0, dtype=np.int64)
        present = np.unique(fronts.parcel)
        pieces = len(fronts.parcel)
        most = int(MOST_PAIRS / pieces / (pieces / len(present)))
        z = self._front_places[np.searchsorted(fronts.parcel, present)]
        chosen = _spread(z, parcels.part[present], max(LEAST_SOURCES, min(most, MOST_SOURCES)))
        return np.flatnonzero(np.isin(fronts.parcel, present[chosen]))

    def network_values(self, part: int | None) -> dict[str, float]:
        """Mean detour between intersections, dead ends and places on the rim."""
        between, sources, nodes = self._between_nodes
        node_part = self.fabric.network.node_part
        rows, columns = in_part(node_part[sources], part), in_part(node_part[nodes], part)
        return {"network_detour": between.mean(between.detour, rows, columns)}

    @cached_property
    def _between_nodes(self) -> tuple[_Between, IntArray, IntArray]:
        net = self.fabric.network
        nodes = np.flatnonzero((net.node_degree != 2) | (net.node_kind == NodeKind.ENTRY))
        xy = self.fabric.lines.xy[net.node_vertex]
        z = xy[:, 0] + 1j * xy[:, 1]
        most = max(LEAST_SOURCES, min(MOST_SOURCES, MOST_PAIRS // max(len(nodes), 1)))
        sources = nodes[_spread(z[nodes], net.node_part[nodes], most)]
        way = self._ways(sources)[:, nodes] if len(sources) else np.empty((0, len(nodes)))
        weight = np.where(sources[:, None] == nodes, 0.0, 1.0)
        return (
            _Between(way, np.abs(z[sources][:, None] - z[nodes]), weight, sources),
            sources,
            nodes,
        )


@dataclass(frozen=True, eq=False)
class _Between:
    """Ways from S sources to T targets, the straight lines, and how much each pair counts."""

    way: FloatArray
    straight: FloatArray
    weight: FloatArray
    source: IntArray

    @cached_property
    def detour(self) -> FloatArray:
        far = self.straight >= NEAR
        return np.where(far, self.way / np.where(far, self.straight, 1.0), np.inf)

    def mean(self, values: FloatArray, rows: BoolArray, columns: BoolArray) -> float:
        """Weighted mean over pairs that have a finite value."""
        some = values[rows][:, columns]
        known = np.isfinite(some)
        return _weighted(np.where(known, some, 0.0), self.weight[rows][:, columns] * known)


def _weighted(values: FloatArray, weight: FloatArray) -> float:
    total = float(weight.sum())
    return float((np.where(weight > 0, values, 0.0) * weight).sum()) / total if total else math.nan


def _spread(z: npt.NDArray[np.complex128], part: IntArray, most: int) -> IntArray:
    """Rows spread evenly over places in order of their coordinates, some in each part."""
    order = np.lexsort((np.round(z.imag, 3), np.round(z.real, 3), part))
    chosen = []
    for rows in np.split(order, np.flatnonzero(np.diff(part[order])) + 1):
        share = max(LEAST_SOURCES, round(most * len(rows) / max(len(z), 1)))
        n = min(len(rows), share)
        chosen.append(rows[np.floor(np.arange(n) * (len(rows) / n) if n else []).astype(int)])
    return np.sort(np.concatenate(chosen))
