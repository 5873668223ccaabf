"""Decomposition of noded lines into network edges, streets and junctions (Chen 2024, section 3)."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.layout import NOT_FIXED
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray, rank_cycles
from urban_processing.mesh.straight import (
    STRAIGHT_DEG,
    go_on_straight,
    included_angle,
    pairs_at_nodes,
)
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network_model import ArmPoints, Linework, StreetNetwork

CHORD_M = 20.0
"""Longest chord over which the direction of a street at a junction is taken."""

ComplexArray = npt.NDArray[np.complex128]


def decompose_streets(
    lines: Linework,
    *,
    street: BoolArray,
    rim: BoolArray,
    part: IntArray,
    entry: BoolArray,
    sort: IntArray | None = None,
) -> StreetNetwork:
    """Decompose noded lines into network edges, streets and junctions.

    Parameters
    ----------
    lines
        Lines that meet at vertices alone.
    street, rim, part
        (E,) which edges are street and which of them run along the rim of the land; the piece of
        land that each lies in.
    entry
        (V,) places where the network meets the outside.
    sort
        (E,) edges that differ in this number, which is not below -1, are no one network edge.

    Returns
    -------
    StreetNetwork
        Without level, given street, class and width of its edges: they are what the lines say.
    """
    sorts = np.asarray(rim + 2 * (np.zeros(len(rim), np.int64) if sort is None else sort + 1))
    half_edges, offsets = _network_edges(lines, street, sorts, rim, entry, part)
    first, last = half_edges[offsets[:-1]], half_edges[offsets[1:] - 1]
    ends = np.concatenate([lines.origin[first], lines.target[last]])
    node_vertex, ends = _number_nodes(lines, ends, np.tile(part[first >> 1], 2))
    n_edges = len(first)
    start, end = ends[:n_edges], ends[n_edges:]
    degree = np.bincount(ends, minlength=len(node_vertex))
    edge_rim = rim[first >> 1]
    kind = np.where(degree == 1, NodeKind.END, NodeKind.JUNCTION)
    node_part = np.zeros(len(node_vertex), dtype=np.int64)
    node_part[ends] = np.tile(part[first >> 1], 2)
    alone = (start == end) & (degree[start] == 2) & _is_smooth(lines, first, last, edge_rim)
    kind[start[alone]] = NodeKind.POINT
    kind[entry[node_vertex]] = NodeKind.ENTRY
    pair_node, pair_arms, continues = _pair_arms(lines, first, last, ends, kind)
    arm_points = _arm_points(lines, half_edges, offsets, start == end)
    chord = _chords(lines, arm_points)
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
        edge_fixed=np.full(n_edges, NOT_FIXED),
        edge_part=part[first >> 1],
        edge_level=np.zeros(n_edges, dtype=np.int64),
        edge_length=_lengths(lines, half_edges, offsets),
        edge_class=np.full(n_edges, "", dtype=np.str_),
        edge_width=np.full(n_edges, np.nan),
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
    lines: Linework,
    street: BoolArray,
    sort: IntArray,
    rim: BoolArray,
    entry: BoolArray,
    part: IntArray,
) -> tuple[IntArray, IntArray]:
    """Half-edges of each network edge in order, from its lexicographically lower end.

    The mesh edges of a network edge are of one `sort` (E,).
    """
    rank = _coordinate_rank(lines)
    half = np.flatnonzero(np.repeat(street, 2))
    following = _continuation(lines, half, sort, rim, entry)
    starts = np.ones(len(lines.origin), dtype=bool)
    starts[following[following >= 0]] = False
    # half-edges that leave a node come first, so that the leader of a cycle is one of them
    half = half[np.lexsort((rank[lines.target[half]], rank[lines.origin[half]], ~starts[half]))]
    local = np.full(len(lines.origin), -1)
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
    lines: Linework, half: IntArray, sort: IntArray, rim: BoolArray, entry: BoolArray
) -> IntArray:
    """(2E,) street half-edge that goes on from the head of one; -1 where a node stops it."""
    out = np.full(len(lines.origin), -1)
    degree = np.bincount(lines.origin[half], minlength=lines.n_vertices)
    by_origin = half[np.argsort(lines.origin[half], kind="stable")]
    twos = np.searchsorted(lines.origin[by_origin], np.flatnonzero((degree == 2) & ~entry))
    a, b = by_origin[twos], by_origin[twos + 1]
    d = _directions(lines)
    same = sort[a >> 1] == sort[b >> 1]
    on = same & (rim[a >> 1] | (included_angle(d[a], d[b]) > STRAIGHT_DEG))
    out[a[on] ^ 1] = b[on]
    out[b[on] ^ 1] = a[on]
    return out


def _number_nodes(lines: Linework, ends: IntArray, part: IntArray) -> tuple[IntArray, IntArray]:
    """Vertices of the nodes, by part and coordinates, and the nodes of the given vertices."""
    vertex, first = np.unique(ends, return_index=True)
    order = np.lexsort((_coordinate_rank(lines)[vertex], part[first]))
    node_of = np.full(lines.n_vertices, -1)
    node_of[vertex[order]] = np.arange(len(vertex))
    return vertex[order], node_of[ends]


def _is_smooth(lines: Linework, first: IntArray, last: IntArray, rim: BoolArray) -> BoolArray:
    """Whether each network edge, if it is a ring, closes without a bend."""
    d = _directions(lines)
    return np.asarray(rim | (included_angle(d[first], d[last ^ 1]) > STRAIGHT_DEG))


def _pair_arms(
    lines: Linework,
    first: IntArray,
    last: IntArray,
    arm_node: IntArray,
    node_kind: IntArray,
) -> tuple[IntArray, IntArray, BoolArray]:
    """All pairs of arms at junctions, and which of them continue as one street.

    Arm ``k`` is the start of network edge ``k``, arm ``K + k`` its end.
    """
    arms = np.flatnonzero(node_kind[arm_node] >= NodeKind.JUNCTION)
    arms = arms[np.lexsort((arms % max(len(first), 1), arm_node[arms]))]
    node = arm_node[arms]
    local = pairs_at_nodes(node)
    pairs = arms[local]
    direction = _directions(lines)[np.concatenate([first, last ^ 1])]
    angle = included_angle(direction[pairs[:, 0]], direction[pairs[:, 1]])
    continues = go_on_straight(pairs, angle, n_arms=len(arm_node))
    return node[local[:, 0]], pairs, continues


def _arm_points(
    lines: Linework, half_edges: IntArray, offsets: IntArray, is_ring: BoolArray
) -> ArmPoints:
    """The point `CHORD_M` along each arm, or the end of an edge that is shorter."""
    step = lines.edge_length[half_edges >> 1]
    total = np.append(0.0, np.cumsum(step))
    low, high = total[offsets[:-1]], total[offsets[1:]]
    reach = np.minimum(CHORD_M, np.where(is_ring, 0.5, 1.0) * (high - low))
    where = np.concatenate([low + reach, high - reach])
    at = np.searchsorted(total, where, side="right") - 1
    at = np.clip(at, np.tile(offsets[:-1], 2), np.tile(offsets[1:], 2) - 1)
    h = half_edges[at]
    ends = [lines.origin[half_edges[offsets[:-1]]], lines.target[half_edges[offsets[1:] - 1]]]
    share = np.clip((where - total[at]) / step[at], 0.0, 1.0)
    return ArmPoints(np.concatenate(ends), lines.origin[h], lines.target[h], share)


def _chords(lines: Linework, points: ArmPoints) -> ComplexArray:
    """Direction of each arm, from its node to its point."""
    z = lines.xy[:, 0] + 1j * lines.xy[:, 1]
    before, after = z[points.before], z[points.after]
    return np.asarray(before + points.share * (after - before) - z[points.node])


def _lengths(lines: Linework, half_edges: IntArray, offsets: IntArray) -> FloatArray:
    length = lines.edge_length[half_edges >> 1]
    return np.add.reduceat(length, offsets[:-1]) if len(length) else length


def _coordinate_rank(lines: Linework) -> IntArray:
    """(V,) place of each vertex when sorted by x, then y."""
    rank = np.empty(lines.n_vertices, dtype=np.int64)
    rank[np.lexsort((lines.xy[:, 1], lines.xy[:, 0]))] = np.arange(lines.n_vertices)
    return rank


def _directions(lines: Linework) -> ComplexArray:
    """(2E,) vector of each half-edge."""
    d = lines.xy[lines.target] - lines.xy[lines.origin]
    return np.asarray(d[:, 0] + 1j * d[:, 1])
