"""Decomposition of a layout's street edges into network edges, streets and junctions."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, PlanarMesh, rank_cycles
from urban_processing.mesh.straight import (
    STRAIGHT_DEG,
    go_on_straight,
    included_angle,
    pairs_at_nodes,
)
from urban_processing.streets.classes import (
    NodeKind,
    edge_classes,
    edge_widths,
    given_classes,
)

CHORD_M = 20.0
"""Longest chord over which the direction of a street at a junction is taken."""

ComplexArray = npt.NDArray[np.complex128]


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
        self, mesh: PlanarMesh, offset: tuple[float, float] = (0.0, 0.0)
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


def street_network(layout: Layout) -> StreetNetwork:
    """Decompose the street edges of a layout (Chen 2024, section 3).

    Linear in the number of mesh edges, without a Python loop over them.
    """
    mesh = layout.mesh
    rim = np.asarray(layout.edge_kind == EdgeKind.RIM)
    part = layout.face_part[mesh.face.reshape(-1, 2).max(axis=1)]
    sort = rim + 2 * (layout.edge_fixed + 1)
    half_edges, offsets = _network_edges(
        mesh, layout.edge_street, sort, rim, layout.vertex_entry, part
    )
    first, last = half_edges[offsets[:-1]], half_edges[offsets[1:] - 1]
    ends = np.concatenate([mesh.origin[first], mesh.target[last]])
    node_vertex, ends = _number_nodes(mesh, ends, np.tile(part[first >> 1], 2))
    n_edges = len(first)
    start, end = ends[:n_edges], ends[n_edges:]
    degree = np.bincount(ends, minlength=len(node_vertex))
    edge_rim, edge_fixed = rim[first >> 1], layout.edge_fixed[first >> 1]
    kind = np.where(degree == 1, NodeKind.END, NodeKind.JUNCTION)
    node_part = np.zeros(len(node_vertex), dtype=np.int64)
    node_part[ends] = np.tile(part[first >> 1], 2)
    alone = (start == end) & (degree[start] == 2) & _is_smooth(mesh, first, last, edge_rim)
    kind[start[alone]] = NodeKind.POINT
    kind[layout.vertex_entry[node_vertex]] = NodeKind.ENTRY
    level = np.asarray(layout.edge_level[half_edges >> 1], dtype=np.int64)
    edge_level = np.minimum.reduceat(level, offsets[:-1]) if n_edges else level
    classes = edge_classes(start, end, kind, degree, edge_rim, edge_level, edge_fixed >= 0)
    classes = given_classes(classes, layout.fixed_streets, edge_fixed)
    pair_node, pair_arms, continues = _pair_arms(mesh, first, last, ends, kind)
    arm_points = _arm_points(mesh, half_edges, offsets, start == end)
    chord = _chords(mesh, arm_points)
    pair_edges = pair_arms % max(n_edges, 1)
    meet = ~continues
    same = continues & (edge_rim[pair_edges[:, 0]] == edge_rim[pair_edges[:, 1]])
    angle = included_angle(chord[pair_arms[meet, 0]], chord[pair_arms[meet, 1]])
    return StreetNetwork(
        half_edges=half_edges,
        offsets=offsets,
        start=start,
        end=end,
        edge_rim=edge_rim,
        edge_fixed=edge_fixed,
        edge_part=part[first >> 1],
        edge_level=edge_level,
        edge_length=_lengths(mesh, half_edges, offsets),
        edge_class=classes,
        edge_width=edge_widths(layout, classes, edge_fixed),
        edge_street=components(n_edges, pair_edges[same]),
        node_vertex=node_vertex,
        node_part=node_part,
        node_degree=degree,
        node_kind=kind,
        pair_node=pair_node[meet],
        pair_arms=pair_arms[meet],
        arm_points=arm_points,
        pair_deviation=90.0 - np.minimum(angle, 180.0 - angle),
    )


def _network_edges(
    mesh: PlanarMesh,
    street: BoolArray,
    sort: IntArray,
    rim: BoolArray,
    entry: BoolArray,
    part: IntArray,
) -> tuple[IntArray, IntArray]:
    """Half-edges of each network edge in order, from its lexicographically lower end.

    The mesh edges of a network edge are of one `sort` (E,).
    """
    rank = _coordinate_rank(mesh)
    half = np.flatnonzero(np.repeat(street, 2))
    following = _continuation(mesh, half, sort, rim, entry)
    starts = np.ones(len(mesh.origin), dtype=bool)
    starts[following[following >= 0]] = False
    # half-edges that leave a node come first, so that the leader of a cycle is one of them
    half = half[np.lexsort((rank[mesh.target[half]], rank[mesh.origin[half]], ~starts[half]))]
    local = np.full(len(mesh.origin), -1)
    local[half] = np.arange(len(half))
    # at a node the walk turns round and comes back: an open chain becomes one cycle of both
    # its directions, a ring two cycles
    successor = np.where(following[half] >= 0, following[half], half ^ 1)
    leader, position = rank_cycles(local[successor])
    other = leader[local[half ^ 1]]
    size = np.bincount(leader, minlength=len(half))[leader]
    kept = np.flatnonzero(((leader == other) & (2 * position < size)) | (leader < other))
    order = kept[np.lexsort((position[kept], leader[kept], part[half[kept] >> 1]))]
    new = np.flatnonzero(position[order] == 0)
    return half[order], np.append(new, len(order))


def _continuation(
    mesh: PlanarMesh, half: IntArray, sort: IntArray, rim: BoolArray, entry: BoolArray
) -> IntArray:
    """(2E,) street half-edge that goes on from the head of one; -1 where a node stops it."""
    out = np.full(len(mesh.origin), -1)
    degree = np.bincount(mesh.origin[half], minlength=mesh.n_vertices)
    by_origin = half[np.argsort(mesh.origin[half], kind="stable")]
    twos = np.searchsorted(mesh.origin[by_origin], np.flatnonzero((degree == 2) & ~entry))
    a, b = by_origin[twos], by_origin[twos + 1]
    d = _directions(mesh)
    same = sort[a >> 1] == sort[b >> 1]
    on = same & (rim[a >> 1] | (included_angle(d[a], d[b]) > STRAIGHT_DEG))
    out[a[on] ^ 1] = b[on]
    out[b[on] ^ 1] = a[on]
    return out


def _number_nodes(mesh: PlanarMesh, ends: IntArray, part: IntArray) -> tuple[IntArray, IntArray]:
    """Vertices of the nodes, by part and coordinates, and the nodes of the given vertices."""
    vertex, first = np.unique(ends, return_index=True)
    order = np.lexsort((_coordinate_rank(mesh)[vertex], part[first]))
    node_of = np.full(mesh.n_vertices, -1)
    node_of[vertex[order]] = np.arange(len(vertex))
    return vertex[order], node_of[ends]


def _is_smooth(mesh: PlanarMesh, first: IntArray, last: IntArray, rim: BoolArray) -> BoolArray:
    """Whether each network edge, if it is a ring, closes without a bend."""
    d = _directions(mesh)
    return np.asarray(rim | (included_angle(d[first], d[last ^ 1]) > STRAIGHT_DEG))


def _pair_arms(
    mesh: PlanarMesh,
    first: IntArray,
    last: IntArray,
    arm_node: IntArray,
    node_kind: IntArray,
) -> tuple[IntArray, IntArray, BoolArray]:
    """All pairs of arms at junctions, and which of them continue as one street.

    Arm ``k`` is the start of network edge ``k``, arm ``K + k`` its end.
    arm_points
        Ends of the chords.
    """
    arms = np.flatnonzero(node_kind[arm_node] >= NodeKind.JUNCTION)
    arms = arms[np.lexsort((arms % max(len(first), 1), arm_node[arms]))]
    node = arm_node[arms]
    local = pairs_at_nodes(node)
    pairs = arms[local]
    direction = _directions(mesh)[np.concatenate([first, last ^ 1])]
    angle = included_angle(direction[pairs[:, 0]], direction[pairs[:, 1]])
    continues = go_on_straight(pairs, angle, n_arms=len(arm_node))
    return node[local[:, 0]], pairs, continues


def _arm_points(
    mesh: PlanarMesh, half_edges: IntArray, offsets: IntArray, is_ring: BoolArray
) -> ArmPoints:
    """The point `CHORD_M` along each arm, or the end of an edge that is shorter."""
    step = mesh.edge_length[half_edges >> 1]
    total = np.append(0.0, np.cumsum(step))
    low, high = total[offsets[:-1]], total[offsets[1:]]
    reach = np.minimum(CHORD_M, np.where(is_ring, 0.5, 1.0) * (high - low))
    where = np.concatenate([low + reach, high - reach])
    at = np.searchsorted(total, where, side="right") - 1
    at = np.clip(at, np.tile(offsets[:-1], 2), np.tile(offsets[1:], 2) - 1)
    h = half_edges[at]
    ends = [mesh.origin[half_edges[offsets[:-1]]], mesh.target[half_edges[offsets[1:] - 1]]]
    share = np.clip((where - total[at]) / step[at], 0.0, 1.0)
    return ArmPoints(np.concatenate(ends), mesh.origin[h], mesh.target[h], share)


def _chords(mesh: PlanarMesh, points: ArmPoints) -> ComplexArray:
    """Direction of each arm, from its node to its point."""
    z = mesh.xy[:, 0] + 1j * mesh.xy[:, 1]
    before, after = z[points.before], z[points.after]
    return np.asarray(before + points.share * (after - before) - z[points.node])


def _lengths(mesh: PlanarMesh, half_edges: IntArray, offsets: IntArray) -> FloatArray:
    length = mesh.edge_length[half_edges >> 1]
    return np.add.reduceat(length, offsets[:-1]) if len(length) else length


def _coordinate_rank(mesh: PlanarMesh) -> IntArray:
    """(V,) place of each vertex when sorted by x, then y."""
    rank = np.empty(mesh.n_vertices, dtype=np.int64)
    rank[np.lexsort((mesh.xy[:, 1], mesh.xy[:, 0]))] = np.arange(mesh.n_vertices)
    return rank


def _directions(mesh: PlanarMesh) -> ComplexArray:
    """(2E,) vector of each half-edge."""
    d = mesh.xy[mesh.target] - mesh.xy[mesh.origin]
    return np.asarray(d[:, 0] + 1j * d[:, 1])
