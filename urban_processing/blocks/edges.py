"""Which street lies along each edge of a block."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.blocks.model import BlockRings
from urban_processing.blocks.net import Faces, Sides
from urban_processing.blocks.noding import Centrelines, angles_between
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.rights_of_way.centrelines import BESIDE

ROUNDED_DIGITS = 3
"""Edges that are as near to two kerbs, to this many digits of a metre, lie on the wider street."""

SLACK = 0.05
"""Kerbs lie half a width beside the centreline up to this share, since buffers are simplified."""

ALIGNED_DEG = 30.0
"""A street along the rim of the land makes at most this angle with it."""


@dataclass(frozen=True, eq=False)
class EdgeStreets:
    """(K,) segment along each edge, -1 where there is no street, of K edges of blocks."""

    segment: IntArray

    @property
    def access(self) -> BoolArray:
        """(K,) whether an edge lies on a street."""
        return np.asarray(self.segment >= 0)


def streets_along(
    rings: BlockRings,
    face: IntArray,
    work: Centrelines,
    faces: Faces,
    sides: Sides,
    *,
    width: FloatArray,
    margin: float,
    snap: float,
) -> EdgeStreets:
    """Find the street along each edge of the blocks.

    It is the street of the block's own face whose kerb, half its width beside the centreline,
    the middle of the edge is nearest to. An edge on the rim of the land is street where one runs
    along it, no further away than half its width and `snap` metres.

    Parameters
    ----------
    rings, face
        Rings of the blocks, and the face of each block.
    work, faces, sides
        Streets and what they enclose.
    width
        (S,) width of each segment.
    margin
        Metres that a rounded corner, a turning head or the cut across a neck may lie beyond the
        kerb.
    """
    a, b = rings.xy, rings.xy[rings.following]
    middle = (a + b) / 2
    points = shapely.points(middle)
    n = len(points)
    segment = np.full(n, -1)
    if not len(sides.face):
        return EdgeStreets(segment)
    lines = shapely.linestrings(work.segments[sides.segment])
    half = width[sides.segment] / 2
    side, edge = shapely.STRtree(points).query(
        lines, predicate="dwithin", distance=(1 + SLACK) * half + max(margin, snap) + BESIDE
    )
    own = sides.face[side] == face[rings.edge_block][edge]
    side, edge = side[own], edge[own]
    beyond = shapely.distance(points[edge], lines[side]) - half[side]
    if len(faces.rims):
        rim = shapely.dwithin(shapely.union_all(faces.rims), points, BESIDE)
        angle = angles_between(work.segments[sides.segment[side]], np.stack([a, b], axis=1)[edge])
        along = (beyond <= snap) & (angle <= ALIGNED_DEG)
        kept = along | ~rim[edge]
        side, edge, beyond = side[kept], edge[kept], beyond[kept]
    wide = -width[sides.segment[side]]
    order = np.lexsort((sides.segment[side], wide, np.round(beyond, ROUNDED_DIGITS), edge))
    first, at = np.unique(edge[order], return_index=True)
    segment[first] = sides.segment[side[order[at]]]
    return EdgeStreets(segment)


def streets_beside(rings: BlockRings, segments: FloatArray, reach: FloatArray) -> IntArray:
    """(K,) the nearest segment along each edge of blocks, -1 for none.

    Parameters
    ----------
    rings
        Rings of the blocks.
    segments
        (S, 2, 2) ends of segments, sorted.
    reach
        (S,) distance in metres from the middle of an edge within which a segment counts; the angle
        between them is at most `ALIGNED_DEG`.
    """
    a, b = rings.xy, rings.xy[rings.following]
    points = shapely.points((a + b) / 2)
    lines = shapely.linestrings(segments)
    segment, edge = shapely.STRtree(points).query(lines, predicate="dwithin", distance=reach)
    angle = angles_between(segments[segment], np.stack([a, b], axis=1)[edge])
    along = angle <= ALIGNED_DEG
    segment, edge = segment[along], edge[along]
    away = np.round(shapely.distance(points[edge], lines[segment]), ROUNDED_DIGITS)
    order = np.lexsort((segment, away, edge))
    first, at = np.unique(edge[order], return_index=True)
    out = np.full(len(points), -1)
    out[first] = segment[order[at]]
    return out
