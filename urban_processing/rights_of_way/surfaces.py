"""The surfaces that streets take of the blocks beside them."""

from __future__ import annotations

import itertools
import math
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
class Circles:
    """Surfaces around points: block, centre, radius in metres and rank of the class of each."""

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
    blocks: Geometries, sides: StreetSides, heads: Circles, *, corner_radius: float
) -> Surfaces:
    """Widen streets within each block by half their width, with round corners and ends.

    A block knows the streets on its own boundary alone, so that a wide street which ends at
    a narrow one leaves no dent on the far side. Where streets meet or end, a circle closes what
    lies between them; it is as wide as the two of them that go on most nearly straight.

    Parameters
    ----------
    blocks
        (B,) polygons.
    sides, heads
        Streets by block, and turning heads.
    corner_radius
        Radius in metres of the corners of blocks.
    """
    strips, block, rank = _strips(sides)
    joints = _joints(sides)
    regions = np.concatenate([strips, _discs(joints, SEGMENTS), _discs(heads, 2 * SEGMENTS)])
    block = np.concatenate([block, joints.block, heads.block])
    rank = np.concatenate([rank, joints.rank, heads.rank])
    regions, (block, rank) = _united(regions, block, rank)
    whole, (owner,) = _united(regions, block)
    shapely.prepare(blocks)
    fillets = _within(blocks, round_corners(whole, corner_radius), owner)
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
    strips = shapely.buffer(
        shapely.line_merge(pieces), sides.width[at] / 2, quad_segs=SEGMENTS, cap_style="flat"
    )
    return np.asarray(strips, dtype=object), sides.block[at], sides.rank[at]


def _discs(circles: Circles, segments: int) -> Geometries:
    centres = shapely.points(circles.centre)
    return np.asarray(shapely.buffer(centres, circles.radius, quad_segs=segments), dtype=object)


def _joints(sides: StreetSides) -> Circles:
    """Circles where the strips of a block end: at its ends, junctions and changes of width."""
    n = len(sides.block)
    place = np.concatenate([sides.segments[:, 0], sides.segments[:, 1]])
    toward = np.concatenate([sides.segments[:, 1], sides.segments[:, 0]]) - place
    of = np.tile(np.arange(n), 2)
    _, vertex = np.unique(place + 0.0, axis=0, return_inverse=True)
    order = np.lexsort((of, vertex.ravel(), sides.block[of]))
    at = np.column_stack([sides.block[of], vertex.ravel()])[order]
    new = np.diff(at, axis=0, prepend=-1) != 0
    start = np.append(np.flatnonzero(new.any(axis=1)), len(at))
    # two of one kind that follow one another are one strip already
    first, second = of[order[start[:-1]]], of[order[start[1:] - 1]]
    joined = (np.diff(start) == 2) & (sides.rank[first] == sides.rank[second])
    joined &= sides.width[first] == sides.width[second]
    angle = np.arctan2(toward[:, 1], toward[:, 0])
    chosen = []
    for k in np.flatnonzero(~joined).tolist():
        ends = order[start[k] : start[k + 1]]
        meeting = of[ends]
        through = meeting[list(_straightest(angle[ends]))]
        widest = max(through.tolist(), key=lambda s: (sides.width[s], -sides.rank[s], -s))
        chosen.append((int(ends[0]), widest))
    end, street = np.array(chosen, dtype=np.int64).reshape(-1, 2).T
    return Circles(sides.block[street], place[end], sides.width[street] / 2, sides.rank[street])


def _straightest(angle: FloatArray) -> tuple[int, ...]:
    """The two of some directions that are most nearly opposite; the only one of one."""
    if len(angle) == 1:
        return (0,)
    bend = {
        (i, j): round(abs(math.remainder(angle[i] - angle[j] - math.pi, math.tau)), 9)
        for i, j in itertools.combinations(range(len(angle)), 2)
    }
    return min(bend, key=lambda pair: (bend[pair], pair))


def _united(regions: Geometries, *keys: IntArray) -> tuple[Geometries, list[IntArray]]:
    """Union of the regions that have the same keys, and these keys, in order."""
    order = np.lexsort(keys[::-1])
    new = np.any([np.diff(key[order], prepend=-1) != 0 for key in keys], axis=0)
    start = np.flatnonzero(new)
    groups = np.split(order, start[1:]) if len(order) else []
    united = np.empty(len(groups), dtype=object)
    united[:] = [regions[g[0]] if len(g) == 1 else shapely.union_all(regions[g]) for g in groups]
    return united, [key[order[start]] for key in keys]


def _within(blocks: Geometries, fillets: Fillets, owner: IntArray) -> Fillets:
    """Those whose corner lies inside the block that owns the surface, not beyond its streets."""
    block = owner[fillets.owner]
    inside = shapely.contains_xy(blocks[block], *fillets.corner.T)
    return Fillets(
        block[inside],
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
