"""Streets as network edges between nodes: what a decomposition of street edges finds."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.streets.classes import NodeKind


class Linework(Protocol):
    """Lines as half-edges: edge ``e`` is the pair of half-edges ``2 e`` and ``2 e + 1``."""

    @property
    def xy(self) -> FloatArray:
        """(V, 2) coordinates of the vertices."""
        ...

    @property
    def origin(self) -> IntArray:
        """(2E,) vertex that a half-edge leaves."""
        ...

    @property
    def target(self) -> IntArray:
        """(2E,) vertex that a half-edge leads to."""
        ...

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        ...

    @property
    def edge_length(self) -> FloatArray:
        """(E,) length of each edge."""
        ...


@dataclass(frozen=True, eq=False)
class ArmPoints:
    """Where the directions of arms are taken: a point along each arm, between two vertices.

    Parameters
    ----------
    node
        (2K,) vertex that an arm leaves.
    before, after
        (2K,) the vertices between which its point lies.
    share
        (2K,) how far it lies from the one to the other, 0 to 1.
    """

    node: IntArray
    before: IntArray
    after: IntArray
    share: FloatArray


@dataclass(frozen=True, eq=False)
class StreetNetwork:
    """The street edges of a layout as K network edges, N nodes and S streets.

    A network edge is a chain of street edges between nodes. Nodes are the vertices where
    other than two street edges meet, where the rim meets an interior street, where a street
    that the user gave begins or ends, at entries, and where an interior street bends by an
    included angle of at most `STRAIGHT_DEG`. Rim streets are those on the outer ring of the
    land; they bend as the land does and are divided only where an interior street meets them.
    All numbering and all directions follow from coordinates alone, so that they do not depend
    on the order of mesh edges.

    Parameters
    ----------
    half_edges, offsets
        Mesh half-edges of network edge ``k``: ``half_edges[offsets[k]:offsets[k + 1]]``.
    start, end
        (K,) nodes; the same node for a ring.
    edge_rim
        (K,) whether a network edge lies on the outer ring of the land.
    edge_fixed
        (K,) the given street that a network edge lies on, -1 for none.
    edge_part, edge_level, edge_length
        (K,) part of the land, lowest level of its mesh edges, length in metres.
    edge_class
        (K,) `StreetClass`, or the class that the user gave a street: a *cul-de-sac* leads to
        nothing but a street end; a *collector* is
        another interior edge of the first half (rounded up) of the levels that have interior
        streets; the other interior edges are *local*. A given street without a class is *fixed*.
    edge_width
        (K,) width of the right-of-way in metres: the user's, else the nominal one of the class.
    edge_street
        (K,) street that a network edge belongs to. At a node the straightest pair of edges
        continues as one street, then the straightest of the rest, while the included angle
        is above `STRAIGHT_DEG`. Where an interior street goes straight on into the rim, as
        at a notch, the two are one continuation but keep separate numbers, since streets are
        counted without the rim.
    node_vertex, node_part, node_degree
        (N,) mesh vertex, part and number of street edges of a node.
    node_kind
        (N,) `NodeKind`.
    pair_node, pair_arms, pair_deviation
        (P,), (P, 2), (P,) every two arms that meet at a junction without one continuing the
        other, and 90° less the acute angle between their chords, of `CHORD_M` or the edge's
        length, in degrees. Arm ``k`` is the start of network edge ``k``, arm ``K + k`` its end.
    arm_points
        Ends of the chords.
    """

    half_edges: IntArray
    offsets: IntArray
    start: IntArray
    end: IntArray
    edge_rim: BoolArray
    edge_fixed: IntArray
    edge_part: IntArray
    edge_level: IntArray
    edge_length: FloatArray
    edge_class: npt.NDArray[np.str_]
    edge_width: FloatArray
    edge_street: IntArray
    node_vertex: IntArray
    node_part: IntArray
    node_degree: IntArray
    node_kind: IntArray
    pair_node: IntArray
    pair_arms: IntArray
    pair_deviation: FloatArray
    arm_points: ArmPoints

    @property
    def n_edges(self) -> int:
        """Number of network edges, those of the rim included."""
        return len(self.start)

    @property
    def n_nodes(self) -> int:
        """Number of nodes, starts of rings included."""
        return len(self.node_vertex)

    @cached_property
    def pair_edges(self) -> IntArray:
        """(P, 2) network edges of the arms of a pair."""
        return self.pair_arms % max(self.n_edges, 1)

    @cached_property
    def street_rim(self) -> BoolArray:
        """(S,) whether a street is a rim street."""
        _, first = np.unique(self.edge_street, return_index=True)
        return np.asarray(self.edge_rim[first])

    @cached_property
    def street_part(self) -> IntArray:
        """(S,) part of the land that a street lies in."""
        _, first = np.unique(self.edge_street, return_index=True)
        return np.asarray(self.edge_part[first])

    @cached_property
    def street_length(self) -> FloatArray:
        """(S,) length of a street in metres."""
        length = np.bincount(self.edge_street, weights=self.edge_length)
        return np.asarray(length, dtype=np.float64)

    @cached_property
    def node_number(self) -> IntArray:
        """(N,) running number, from 1, of the junctions and ends; 0 for the start of a ring."""
        counted = self.node_kind != NodeKind.POINT
        return np.where(counted, np.cumsum(counted), 0)

    @cached_property
    def pair_rim(self) -> IntArray:
        """(P,) how many of the two edges of a pair lie on the rim.

        Two rim streets meet as the land makes them: their angle is not counted.
        """
        return np.asarray(self.edge_rim[self.pair_edges].sum(axis=1))

    @cached_property
    def node_deviation(self) -> FloatArray:
        """(N,) mean deviation in degrees of the pairs that are not both rim; NaN without any."""
        counted = self.pair_rim < 2
        node, deviation = self.pair_node[counted], self.pair_deviation[counted]
        n = np.bincount(node, minlength=self.n_nodes)
        total = np.bincount(node, weights=deviation, minlength=self.n_nodes)
        return np.where(n > 0, total / np.maximum(n, 1), np.nan)

    @cached_property
    def node_interior(self) -> BoolArray:
        """(N,) whether an interior street meets or ends at a node: Chen counts only these."""
        out = np.zeros(self.n_nodes, dtype=bool)
        out[self.start[~self.edge_rim]] = True
        out[self.end[~self.edge_rim]] = True
        return out

    def lines(
        self, mesh: Linework, offset: tuple[float, float] = (0.0, 0.0)
    ) -> npt.NDArray[np.object_]:
        """(K,) shapely lines of the network edges, shifted by `offset`."""
        if not self.n_edges:
            return np.empty(0, dtype=object)
        vertices = np.insert(
            mesh.origin[self.half_edges],
            self.offsets[1:],
            mesh.target[self.half_edges[self.offsets[1:] - 1]],
        )
        of_vertex = np.repeat(np.arange(self.n_edges), np.diff(self.offsets) + 1)
        lines = shapely.linestrings(mesh.xy[vertices] + np.asarray(offset), indices=of_vertex)
        return np.asarray(lines)
