"""The surfaces that streets take of the blocks beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.rights_of_way.corners import Fillets, round_corners

SEGMENTS = 8
"""Segments of a quarter circle."""

SAME_PLACE = 1e-6
"""Distance in metres below which a corner lies on a surface."""

Geometries = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class StreetSides:
    """Streets as the blocks see them: S segments, each at the block on one of its sides.

    Parameters
    ----------
    block
        (S,) block beside the segment. A segment between two blocks stands here twice, one
        that ends within a block once.
    segments
        (S, 2, 2) ends of the centreline.
    width
        (S,) width of the whole right-of-way in metres.
    rank
        (S,) class of the street as a number, the highest class 0.
    """

    block: IntArray
    segments: FloatArray
    width: FloatArray
    rank: IntArray


@dataclass(frozen=True, eq=False)
class TurningHeads:
    """Circles at dead ends: block, centre, radius in metres and rank of the street of each."""

    block: IntArray
    centre: FloatArray
    radius: FloatArray
    rank: IntArray


@dataclass(frozen=True, eq=False)
class Surfaces:
    """What streets take, before it is cut out of the land.

    Parameters
    ----------
    regions
        (R,) polygons; they overlap each other and reach beyond their block.
    block, rank
        (R,) block that a region takes land from, and rank of its class.
    outlines
        Lines within the blocks along which these are to be cut.
    """

    regions: Geometries
    block: IntArray
    rank: IntArray
    outlines: Geometries


def street_surfaces(
    blocks: Geometries, sides: StreetSides, heads: TurningHeads, *, corner_radius: float
) -> Surfaces:
    """Widen streets within each block by half their width, with round corners and ends.

    A block knows the streets on its own boundary alone, so that a wide street which ends at
    a narrow one leaves no dent on the far side.

    Parameters
    ----------
    blocks
        (B,) polygons.
    sides, heads
        Streets and dead ends, by block.
    corner_radius
        Radius in metres of the corners of blocks.
    """
    strips, block, rank = _strips(sides)
    circles = shapely.buffer(shapely.points(heads.centre), heads.radius, quad_segs=2 * SEGMENTS)
    regions = np.concatenate([strips, np.atleast_1d(circles)]).astype(object)
    block, rank = np.concatenate([block, heads.block]), np.concatenate([rank, heads.rank])
    whole = _united(len(blocks), regions, block)
    shapely.prepare(blocks)
    fillets = _within(blocks, round_corners(whole, corner_radius))
    lines = np.append(shapely.boundary(regions), fillets.arcs)
    owner = np.append(block, fillets.owner)
    outlines = shapely.get_parts(shapely.intersection(blocks[owner], lines))
    return Surfaces(
        regions=np.append(regions, fillets.wedges),
        block=np.append(block, fillets.owner),
        rank=np.append(rank, _highest_at(fillets, regions, block, rank)),
        outlines=outlines[shapely.get_dimensions(outlines) == 1],
    )


def _strips(sides: StreetSides) -> tuple[Geometries, IntArray, IntArray]:
    """Streets of one block, class and width as one surface each; its block and rank."""
    if not len(sides.block):
        none = np.empty(0, dtype=np.int64)
        return np.empty(0, dtype=object), none, none
    order = np.lexsort((sides.width, sides.rank, sides.block))
    key = np.column_stack([sides.block, sides.rank, sides.width])[order]
    first = np.r_[True, (np.diff(key, axis=0) != 0).any(axis=1)]
    group = np.cumsum(first) - 1
    pieces = shapely.multilinestrings(shapely.linestrings(sides.segments[order]), indices=group)
    at = order[first]
    strips = shapely.buffer(shapely.line_merge(pieces), sides.width[at] / 2, quad_segs=SEGMENTS)
    return np.asarray(strips, dtype=object), sides.block[at], sides.rank[at]


def _united(n: int, regions: Geometries, block: IntArray) -> Geometries:
    """(n,) union of the regions of each block, None where there is none."""
    out = np.full(n, None, dtype=object)
    order = np.argsort(block, kind="stable")
    for group in np.split(order, np.flatnonzero(np.diff(block[order])) + 1):
        if len(group):
            out[block[group[0]]] = (
                regions[group[0]] if len(group) == 1 else shapely.union_all(regions[group])
            )
    return out


def _within(blocks: Geometries, fillets: Fillets) -> Fillets:
    """Those whose corner lies inside the block, not on the far side of the street."""
    inside = shapely.contains_xy(blocks[fillets.owner], *fillets.corner.T)
    return Fillets(
        fillets.owner[inside],
        fillets.corner[inside],
        fillets.arcs[inside],
        fillets.wedges[inside],
    )


def _highest_at(fillets: Fillets, regions: Geometries, block: IntArray, rank: IntArray) -> IntArray:
    """(K,) rank of each fillet: that of the highest class which meets at its corner."""
    corners = shapely.points(fillets.corner)
    corner, region = shapely.STRtree(regions).query(
        corners, predicate="dwithin", distance=SAME_PLACE
    )
    own = block[region] == fillets.owner[corner]
    out = np.full(len(corners), np.iinfo(np.int64).max)
    np.minimum.at(out, corner[own], rank[region[own]])
    return out
