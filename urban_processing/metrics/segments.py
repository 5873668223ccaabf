"""Segments: streets from one intersection, dead end or place on the rim to the next."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from urban_processing.fabric.model import Fabric
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.averages import in_part
from urban_processing.streets.classes import NodeKind


@dataclass(frozen=True, eq=False)
class Segments:
    """G segments between the nodes of a street network without its rim streets.

    Bends and changes of class divide no segment. N nodes, numbered as in the network; those
    within a segment have degree 0.

    Parameters
    ----------
    start, end
        (G,) nodes; the same one for a ring.
    length, straight
        (G,) metres along the street, and from end to end in a straight line.
    bearing
        (G,) direction from end to end in degrees clockwise from grid north, in [0, 180);
        NaN for a ring.
    part
        (G,) piece of the land.
    degree
        (N,) number of segment ends at each node.
    node_part
        (N,) piece of the land of each node.
    node_inside
        (N,) whether a node is inside the land, not on its rim.
    """

    start: IntArray
    end: IntArray
    length: FloatArray
    straight: FloatArray
    bearing: FloatArray
    part: IntArray
    degree: IntArray
    node_part: IntArray
    node_inside: BoolArray

    def meshedness(self, part: int | None = None) -> float:
        """Independent loops over the most that a planar network can have (Buhl et al. 2006).

        A planar network of N nodes has at most 2 N - 5 loops; NaN for fewer than three nodes.
        """
        here = in_part(self.part, part)
        ends = np.column_stack([self.start, self.end])[here]
        nodes, local = np.unique(ends, return_inverse=True)
        n = len(nodes)
        if n < 3:
            return math.nan
        pieces = int(components(n, local.reshape(-1, 2)).max()) + 1
        return (len(ends) - n + pieces) / (2 * n - 5)


def segments(fabric: Fabric) -> Segments:
    """Join the network edges of a fabric to segments."""
    net = fabric.network
    inner = np.flatnonzero(~net.edge_rim)
    ends = np.column_stack([net.start[inner], net.end[inner]])
    on_rim = np.zeros(net.n_nodes, dtype=bool)
    on_rim[net.start[net.edge_rim]] = True
    on_rim[net.end[net.edge_rim]] = True
    on_rim |= net.node_kind == NodeKind.ENTRY
    degree = np.bincount(ends.ravel(), minlength=net.n_nodes)
    through = (degree == 2) & ~on_rim
    segment = _joined(ends, through)
    n = int(segment.max()) + 1 if len(segment) else 0
    start, end = _ends(ends, segment, through, n)
    z = _places(fabric)
    way = z[end] - z[start]
    bearing = np.degrees(np.arctan2(way.real, way.imag)) % 180.0
    bearing = np.where(bearing >= 180.0, 0.0, bearing)
    of = np.full(n, -1)
    of[segment] = inner
    return Segments(
        start=start,
        end=end,
        length=np.asarray(
            np.bincount(segment, weights=net.edge_length[inner], minlength=n), dtype=np.float64
        ),
        straight=np.abs(way),
        bearing=np.where(start == end, np.nan, bearing),
        part=net.edge_part[of],
        degree=np.bincount(np.concatenate([start, end]), minlength=net.n_nodes),
        node_part=net.node_part,
        node_inside=~on_rim,
    )


def _places(fabric: Fabric) -> np.ndarray[tuple[int], np.dtype[np.complex128]]:
    xy = fabric.lines.xy[fabric.network.node_vertex]
    return np.asarray(xy[:, 0] + 1j * xy[:, 1])


def _joined(ends: IntArray, through: BoolArray) -> IntArray:
    """(k,) segment of each edge: edges are joined where they meet at nodes within a segment."""
    edge = np.repeat(np.arange(len(ends)), 2)
    node = ends.ravel()
    inside = np.flatnonzero(through[node])
    inside = inside[np.argsort(node[inside], kind="stable")]
    return components(len(ends), edge[inside].reshape(-1, 2))


def _ends(
    ends: IntArray, segment: IntArray, through: BoolArray, n: int
) -> tuple[IntArray, IntArray]:
    """Both end nodes of each segment; a ring begins and ends at its lowest node."""
    node = ends.ravel()
    of = np.repeat(segment, 2)
    lowest = np.full(n, len(through))
    np.minimum.at(lowest, of, node)
    start, end = lowest.copy(), lowest.copy()
    last = np.flatnonzero(~through[node])
    last = last[np.lexsort((node[last], of[last]))]
    # a segment has two ends, or none if it is a ring
    start[of[last[::2]]], end[of[last[1::2]]] = node[last[::2]], node[last[1::2]]
    return start, end
