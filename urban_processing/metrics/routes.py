"""Ways along streets: from parcels to the rim, to each other, and between intersections."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import shapely
from scipy.sparse import csr_array
from scipy.sparse.csgraph import dijkstra

from urban_processing.fabric.model import Fabric, Fronts
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.averages import in_part
from urban_processing.streets.classes import NodeKind

MOST_PAIRS = 8_000_000
"""Ways are worked out between all pairs of pieces of frontage, if there are no more than these;
else they begin at fewer parcels, spread evenly over the land and standing for the others."""

MOST_NODE_PAIRS = 1_000_000
"""The same of pairs of nodes."""

LEAST_SOURCES = 64
"""But at no fewer parcels or nodes than these."""

LEAST_IN_PART = 16
"""And at no fewer in each part of the land."""

BLOCK = 250_000
"""Pairs that are worked out at a time, so that memory does not grow with their number."""

NEAR = 1.0
"""Places that are nearer in a straight line, in metres, have no detour."""


@dataclass(frozen=True, eq=False)
class Routes:
    """Ways along all streets, the rim's too.

    A parcel meets the streets wherever its frontage is: each piece of it counts by its length,
    from its middle.
    """

    fabric: Fabric

    @cached_property
    def _links(self) -> tuple[IntArray, IntArray, FloatArray]:
        """Nodes that network edges lead from and to, both ways, and the edges' lengths."""
        net = self.fabric.network
        some = net.start != net.end
        start, end, length = net.start[some], net.end[some], net.edge_length[some]
        return np.append(start, end), np.append(end, start), np.tile(length, 2)

    @cached_property
    def _graph(self) -> csr_array:
        """(N, N) length of the shortest edge from node to node."""
        return _shortest(*self._links, self.fabric.network.n_nodes)

    @cached_property
    def _to_rim(self) -> FloatArray:
        """(N,) ways to the rim; infinite where it cannot be reached."""
        net = self.fabric.network
        gate = net.node_kind == NodeKind.ENTRY
        gate[net.start[net.edge_rim]] = True
        gate[net.end[net.edge_rim]] = True
        if not gate.any():
            return np.full(net.n_nodes, np.inf)
        return np.asarray(dijkstra(self._graph, indices=np.flatnonzero(gate), min_only=True))

    @cached_property
    def _weight(self) -> FloatArray:
        """(A,) share that each piece has of its parcel's frontage."""
        fronts = self._fronts
        total = np.bincount(fronts.parcel, weights=fronts.length)
        return np.asarray(fronts.length / total[fronts.parcel])

    @property
    def _fronts(self) -> Fronts:
        parcels = self.fabric.parcels
        nobody = np.empty(0, dtype=np.int64)
        if parcels is None:
            return Fronts(nobody, nobody, np.empty(0), np.empty(0))
        return parcels.fronts

    @cached_property
    def _front_xy(self) -> FloatArray:
        """(A, 2) places on the network opposite each piece."""
        fronts = self._fronts
        lines = self.fabric.street_lines[fronts.edge]
        return np.asarray(shapely.get_coordinates(shapely.line_interpolate_point(lines, fronts.at)))

    def parcel_values(self, part: int | None, *, interior: bool) -> dict[str, float]:
        """Mean ways from parcels to the rim and to each other.

        Parameters
        ----------
        part
            The piece of the land that they lie in; None for all.
        interior
            Whether interior parcels alone are meant.
        """
        parcels, sums = self.fabric.parcels, self._between_parcels
        if parcels is None:
            return {}
        chosen = in_part(parcels.part, part) & ~(interior & parcels.rings.rim)
        return {
            "rim_distance_m": self._mean_to_rim(chosen),
            "parcel_distance_m": sums.mean_way(part, interior=interior),
            "parcel_detour": sums.mean_detour(part, interior=interior),
        }

    def _mean_to_rim(self, chosen: BoolArray) -> float:
        net, fronts = self.fabric.network, self._fronts
        way = np.minimum(
            self._to_rim[net.start[fronts.edge]] + fronts.at,
            self._to_rim[net.end[fronts.edge]] + self._rest,
        )
        way = np.where(net.edge_rim[fronts.edge], 0.0, way)
        counted = chosen[fronts.parcel] & np.isfinite(way)
        return _ratio((way * self._weight)[counted].sum(), self._weight[counted].sum())

    @cached_property
    def _rest(self) -> FloatArray:
        """(A,) metres from the middle of each piece of frontage to the end of its edge.

        A piece at the very end may lie beyond it by rounding, and a way is never negative.
        """
        length = self.fabric.network.edge_length[self._fronts.edge]
        return np.maximum(length - self._fronts.at, 0.0)

    @cached_property
    def _between_parcels(self) -> _Sums:
        """Ways from pieces of frontage of some parcels to all pieces of other parcels."""
        parcels, fronts = self.fabric.parcels, self._fronts
        if parcels is None or not len(fronts.parcel):
            return _Sums.over(np.empty(0, dtype=np.int64), np.empty(0, dtype=bool))
        factor = self._sources
        piece = np.flatnonzero(factor[fronts.parcel] > 0)
        sums = _Sums.over(parcels.part[fronts.parcel], parcels.rings.rim[fronts.parcel])
        step = max(1, BLOCK // len(fronts.parcel))
        for some in np.split(piece, range(step, len(piece), step)):
            own = fronts.parcel[some][:, None] == fronts.parcel
            sums.add(
                some,
                np.where(own, np.inf, self._ways_to_fronts(some)),
                _straight(self._front_xy[some], self._front_xy),
                (self._weight[some] * factor[fronts.parcel[some]], self._weight),
            )
        return sums

    def _ways_to_fronts(self, some: IntArray) -> FloatArray:
        """(s, A) ways from some pieces of frontage to all."""
        net, fronts = self.fabric.network, self._fronts
        edge, at, rest = fronts.edge, fronts.at, self._rest
        source = net.n_nodes + np.arange(len(some))
        tails, heads, length = self._links
        graph = _shortest(
            np.concatenate([tails, source, source]),
            np.concatenate([heads, net.start[edge[some]], net.end[edge[some]]]),
            np.concatenate([length, at[some], rest[some]]),
            net.n_nodes + len(some),
        )
        to_node = np.asarray(dijkstra(graph, indices=source))
        way = np.minimum(to_node[:, net.start[edge]] + at, to_node[:, net.end[edge]] + rest)
        row, column = np.nonzero(edge[some][:, None] == edge)
        direct = np.abs(at[some[row]] - at[column])
        way[row, column] = np.minimum(way[row, column], direct)
        return way

    @cached_property
    def _sources(self) -> FloatArray:
        """(F,) number of parcels that each one stands for as a beginning of ways; 0 for none."""
        parcels, fronts = self.fabric.parcels, self._fronts
        if parcels is None:
            return np.empty(0)
        present = np.unique(fronts.parcel)
        pieces = len(fronts.parcel)
        most = int(MOST_PAIRS / pieces / (pieces / len(present)))
        xy = shapely.get_coordinates(shapely.centroid(parcels.rings.polygons[present]))
        out = np.zeros(len(parcels))
        out[present] = _spread(xy, parcels.part[present], most)
        return out

    def network_values(self, part: int | None) -> dict[str, float]:
        """Mean detour between intersections, dead ends and places on the rim."""
        return {"network_detour": self._between_nodes.mean_detour(part, interior=False)}

    @cached_property
    def _between_nodes(self) -> _Sums:
        """Ways from some nodes that are no bends to all of them."""
        net = self.fabric.network
        nodes = np.flatnonzero((net.node_degree != 2) | (net.node_kind == NodeKind.ENTRY))
        sums = _Sums.over(net.node_part[nodes], np.zeros(len(nodes), dtype=bool))
        if not len(nodes):
            return sums
        xy = self.fabric.lines.xy[net.node_vertex[nodes]]
        factor = _spread(xy, net.node_part[nodes], MOST_NODE_PAIRS // len(nodes))
        source = np.flatnonzero(factor)
        step = max(1, BLOCK // net.n_nodes)
        for some in np.split(source, range(step, len(source), step)):
            way = np.asarray(dijkstra(self._graph, indices=nodes[some]))[:, nodes]
            way[np.arange(len(some)), some] = np.inf
            sums.add(some, way, _straight(xy[some], xy), (factor[some], np.ones(len(nodes))))
        return sums


@dataclass(frozen=True, eq=False)
class _Sums:
    """Weighted sums over pairs of things, kept apart by part of the land and by rim or interior.

    Parameters
    ----------
    part, rim
        (G,) part of the land of each group of things, and whether it is that of the rim.
    group
        (T,) group of each thing.
    way, pairs, detour, far
        (G, G) sums from group to group of ways and of the weights of those; of detours and
        of the weights of those.
    """

    part: IntArray
    rim: BoolArray
    group: IntArray
    way: FloatArray
    pairs: FloatArray
    detour: FloatArray
    far: FloatArray

    @classmethod
    def over(cls, part: IntArray, rim: BoolArray) -> _Sums:
        """Nothing yet, over things in parts of the land, on its rim or not."""
        key, group = np.unique(2 * part + rim, return_inverse=True)
        sums = np.zeros((4, len(key), len(key)))
        return cls(key // 2, key % 2 == 1, group.ravel(), *sums)

    def add(
        self,
        some: IntArray,
        way: FloatArray,
        straight: FloatArray,
        weight: tuple[FloatArray, FloatArray],
    ) -> None:
        """Add ways (s, T), infinite ones left out, from some things to all of them."""
        one, other = weight
        onto = np.zeros((len(other), len(self.part)))
        onto[np.arange(len(other)), self.group] = other
        known = np.isfinite(way)
        far = known & (straight >= NEAR)
        way = np.where(known, way, 0.0)
        detour = way / np.where(far, straight, 1.0)
        for total, values in (
            (self.way, way),
            (self.pairs, known),
            (self.detour, np.where(far, detour, 0.0)),
            (self.far, far),
        ):
            np.add.at(total, self.group[some], one[:, None] * (values @ onto))

    def mean_way(self, part: int | None, *, interior: bool) -> float:
        """Mean way between things of a part, or of interior ones."""
        return self._mean(self.way, self.pairs, part, interior=interior)

    def mean_detour(self, part: int | None, *, interior: bool) -> float:
        """Mean over pairs of the way over the straight line."""
        return self._mean(self.detour, self.far, part, interior=interior)

    def _mean(
        self, total: FloatArray, weight: FloatArray, part: int | None, *, interior: bool
    ) -> float:
        here = in_part(self.part, part) & ~(interior & self.rim)
        chosen = np.ix_(here, here)
        return _ratio(total[chosen].sum(), weight[chosen].sum())


def _ratio(total: float, weight: float) -> float:
    return float(total) / float(weight) if weight > 0 else math.nan


def _straight(some: FloatArray, xy: FloatArray) -> FloatArray:
    """(s, T) distances in a straight line."""
    dx, dy = some[:, :1] - xy[:, 0], some[:, 1:] - xy[:, 1]
    return np.asarray(np.sqrt(dx * dx + dy * dy))


def _shortest(tails: IntArray, heads: IntArray, length: FloatArray, n: int) -> csr_array:
    """(n, n) length of the shortest of the links from each node to each other."""
    order = np.lexsort((length, heads, tails))
    new = np.diff(tails[order], prepend=-1) != 0
    new |= np.diff(heads[order], prepend=-1) != 0
    first = order[new]
    return csr_array((length[first], (tails[first], heads[first])), shape=(n, n))


def _spread(xy: FloatArray, part: IntArray, most: int) -> FloatArray:
    """(n,) how many places each one stands for, if some are chosen, spread evenly; else 0.

    All are chosen if they are no more than `most`, or than `LEAST_SOURCES`. Each part of the land
    has its share, and at least `LEAST_IN_PART`.
    """
    out = np.zeros(len(xy))
    most = max(most, LEAST_SOURCES)
    for p in np.unique(part):
        rows = np.flatnonzero(part == p)
        share = max(LEAST_IN_PART, math.ceil(most * len(rows) / len(xy)))
        n = min(len(rows), share)
        order = rows[_snake(np.round(xy[rows], 3), strips=round(math.sqrt(n)))]
        chosen = order[np.floor((np.arange(n) + 0.5) * (len(rows) / n)).astype(np.int64)]
        out[chosen] = len(rows) / n
    return out


def _snake(xy: FloatArray, *, strips: int) -> IntArray:
    """Order of places up and down strips of equally many, so that followers are neighbours."""
    x, y = xy[:, 0], xy[:, 1]
    strip = np.empty(len(xy), dtype=np.int64)
    strip[np.lexsort((y, x))] = np.arange(len(xy)) * strips // len(xy)
    return np.lexsort((x, np.where(strip % 2, -y, y), strip))
