"""Lines noded: cut at all crossings, those that lie on each other once."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.places import line_segments, lower_end_first
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

NODE_GRID = 2.0**-10
"""Spacing in metres of the grid that centrelines are noded on. It is coarser than that of other
coordinates, so that an end which meets another line but for rounding makes no second node."""

ALIGNED_DEG = 30.0
"""A piece lies on a line only if it makes no larger angle with it, where it may be told."""


@dataclass(frozen=True, eq=False)
class Centrelines:
    """S noded segments; they meet at their ends alone.

    Parameters
    ----------
    segments
        (S, 2, 2) ends, the lower first, sorted.
    line
        (S,) line that each comes from; of several the widest.
    """

    segments: FloatArray
    line: IntArray

    @property
    def node_xy(self) -> FloatArray:
        """(N, 2) places where segments end, sorted."""
        return np.unique(self.segments.reshape(-1, 2), axis=0)

    @property
    def ends(self) -> IntArray:
        """(S, 2) nodes at both ends."""
        _, node = np.unique(self.segments.reshape(-1, 2), axis=0, return_inverse=True)
        return np.asarray(node.reshape(-1, 2))

    @property
    def length(self) -> FloatArray:
        """(S,) lengths in metres."""
        d = self.segments[:, 1] - self.segments[:, 0]
        return np.hypot(d[:, 0], d[:, 1])

    def cut_at(self, edges: npt.NDArray[np.object_]) -> Centrelines:
        """Return the pieces of noded lines that lie on the segments."""
        lines = np.asarray(shapely.linestrings(self.segments), dtype=object)
        segments, of = pieces_on(edges, lines, np.zeros(len(lines)))
        return _sorted(segments, self.line[of])

    def take(self, kept: BoolArray) -> Centrelines:
        """Return some of the segments."""
        return Centrelines(self.segments[kept], self.line[kept])


def node_lines(lines: npt.NDArray[np.object_], width: FloatArray) -> Centrelines:
    """Segments between all crossings and vertices, each once, and their lines."""
    if not len(lines):
        return Centrelines(np.empty((0, 2, 2)), np.empty(0, dtype=np.int64))
    edges = shapely.get_parts(shapely.union_all(lines, grid_size=NODE_GRID))
    return _sorted(*pieces_on(edges, lines, width))


def pieces_on(
    edges: npt.NDArray[np.object_], lines: npt.NDArray[np.object_], width: FloatArray
) -> tuple[FloatArray, IntArray]:
    """Pieces of noded lines that lie on some lines, and which: of several the widest.

    Next to a node a piece may be shorter than rounding: it is on the line that it runs along.
    """
    pieces, _ = line_segments(edges)
    sources, line = line_segments(lines)
    piece, source = shapely.STRtree(shapely.linestrings(sources)).query(
        shapely.points(pieces.mean(axis=1)), predicate="dwithin", distance=2 * NODE_GRID
    )
    across = angles_between(pieces[piece], sources[source]) > ALIGNED_DEG
    order = np.lexsort((line[source], -width[line[source]], across, piece))
    found, first = np.unique(piece[order], return_index=True)
    return pieces[found], line[source[order[first]]]


def angles_between(a: FloatArray, b: FloatArray) -> FloatArray:
    """(n,) angles in degrees, 0 to 90, between the lines along (n, 2, 2) segments."""
    u, v = a[:, 1] - a[:, 0], b[:, 1] - b[:, 0]
    cross = np.abs(u[:, 0] * v[:, 1] - u[:, 1] * v[:, 0])
    return np.asarray(np.degrees(np.arctan2(cross, np.abs((u * v).sum(axis=1)))))


def _sorted(segments: FloatArray, line: IntArray) -> Centrelines:
    segments = lower_end_first(segments)
    order = np.lexsort(segments.reshape(-1, 4).T[::-1])
    return Centrelines(segments[order], line[order])
