"""Blocks that observed parcels make, and the block of each parcel."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import rings_of
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.components import components
from urban_processing.mesh.places import lower_end_first
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.mesh.polygons import by_place
from urban_processing.site import GRID

ObjectArray = npt.NDArray[np.object_]

OUTSIDE = -1
"""Block of a parcel that lies in none."""

INSIDE = 0.5
"""Least share of a parcel that lies in blocks."""

TOUCH = 0.01
"""What comes this near, in metres, touches whatever the widest gap is."""

SHARED_SIDE = 0.5
"""Least length in metres of the side that neighbours share; at a corner alone they do not meet."""

_SAME_AREA = 1e-6


def blocks_of(parcels: ObjectArray, *, gap: float) -> tuple[ObjectArray, IntArray]:
    """Return the blocks that parcels make which share sides, one by one or through others.

    The blocks are the union of the parcels where these fit together. Gaps between sides are
    closed, and so are holes that are no larger than a mean parcel, such as alleys within.

    Parameters
    ----------
    parcels
        (n,) valid polygons.
    gap
        Widest gap, in metres, between sides that count as shared.

    Returns
    -------
    blocks
        (B,) polygons in the order of place.
    block
        (n,) block of each parcel, 0 to B - 1; each has one.
    """
    group = components(len(parcels), _neighbours(parcels, gap + TOUCH))
    order = np.argsort(group, kind="stable")
    block = np.empty(len(parcels), dtype=np.int64)
    pieces: list[ObjectArray] = []
    made = 0
    for rows in np.split(order, np.flatnonzero(np.diff(group[order])) + 1):
        own = _dissolved(parcels[rows], gap)
        of = np.zeros(len(rows), dtype=np.int64)
        if len(own) > 1:
            known, of = np.unique(_most_in_common(parcels[rows], own)[0], return_inverse=True)
            own = own[known]
        block[rows] = made + of
        made += len(own)
        pieces.append(own)
    blocks = canonical_rings(_apart(shapely.set_precision(np.concatenate(pieces), GRID)))
    order = by_place(blocks)
    return blocks[order], np.argsort(order)[block]


def _neighbours(parcels: ObjectArray, reach: float) -> IntArray:
    """(k, 2) pairs of parcels that share a side: more of it is near than at a corner."""
    least = SHARED_SIDE + 4.0 * reach
    a, b = shapely.STRtree(parcels).query(parcels, predicate="dwithin", distance=reach)
    a, b = a[a < b], b[a < b]
    shared = np.isin(a * len(parcels) + b, _of_one_edge(parcels, least))
    sides, around = shapely.boundary(parcels), shapely.buffer(parcels, reach, join_style="mitre")
    for some, others in ((a, b), (b, a)):
        left = np.flatnonzero(~shared)
        near = shapely.intersection(sides[some[left]], around[others[left]])
        shared[left] = shapely.length(near) > least
    return np.column_stack([a[shared], b[shared]])


def _of_one_edge(parcels: ObjectArray, least: float) -> IntArray:
    """Pairs that have the very same edge, longer than `least`: lower row times n, plus the other.

    Most neighbours have; what takes time is told of the others alone.
    """
    rings = rings_of(parcels)
    ends = np.stack([rings.xy, rings.xy[rings.following]], axis=1)
    long = np.hypot(*(ends[:, 1] - ends[:, 0]).T) > least
    owner, ends = rings.edge_block[long], lower_end_first(ends[long])
    order = np.lexsort((owner, *ends.reshape(-1, 4).T))
    same = (ends[order[1:]] == ends[order[:-1]]).all(axis=(1, 2))
    low, high = owner[order[:-1]][same], owner[order[1:]][same]
    return np.asarray(low * len(parcels) + high)


def _dissolved(parcels: ObjectArray, gap: float) -> ObjectArray:
    """Outline of parcels that share sides, exact where they fit together."""
    joined = None
    if shapely.coverage_is_valid(parcels):
        joined = shapely.coverage_union_all(parcels)
    if joined is None or joined.geom_type != "Polygon":
        reach = 0.5 * gap + TOUCH
        wider = shapely.union_all(shapely.buffer(parcels, reach, join_style="mitre"))
        joined = shapely.buffer(wider, -reach, join_style="mitre")
    mean = float(shapely.area(parcels).mean())
    return np.array([_without_holes(part, mean) for part in shapely.get_parts(joined)])


def _without_holes(polygon: shapely.Polygon, most: float) -> shapely.Polygon:
    """Fill the holes that are no larger than `most`, an area."""
    holes = [hole for hole in polygon.interiors if shapely.Polygon(hole).area > most]
    return shapely.Polygon(polygon.exterior, holes)


def _apart(blocks: ObjectArray) -> ObjectArray:
    """Blocks less the smaller ones that lie in them: in a hole that was filled, or by a hair."""
    a, b = shapely.STRtree(blocks).query(blocks, predicate="intersects")
    smaller = np.lexsort((by_place(blocks), np.round(shapely.area(blocks), 6)))
    rank = np.argsort(smaller)
    a, b = a[rank[a] > rank[b]], b[rank[a] > rank[b]]
    common = shapely.area(shapely.intersection(blocks[a], blocks[b])) > 0
    out = blocks.copy()
    for large, small in sorted(zip(a[common].tolist(), b[common].tolist(), strict=True)):
        rest = shapely.get_parts(shapely.difference(out[large], blocks[small], grid_size=GRID))
        out[large] = rest[np.argmax(shapely.area(rest))]
    return out


def block_of_each(parcels: ObjectArray, blocks: ObjectArray) -> IntArray:
    """(n,) the block that each parcel overlaps most; `OUTSIDE` if it lies in none.

    A parcel lies outside if less than `INSIDE` of its area is in blocks, all of them together.
    """
    out, inside = _most_in_common(parcels, blocks)
    out[inside < INSIDE * shapely.area(parcels)] = OUTSIDE
    return out


def _most_in_common(parcels: ObjectArray, blocks: ObjectArray) -> tuple[IntArray, FloatArray]:
    """(n,) the block that each parcel overlaps most, and its area in all blocks together."""
    block, parcel = shapely.STRtree(parcels).query(blocks, predicate="intersects")
    common = shapely.area(shapely.intersection(parcels[parcel], blocks[block]))
    inside = np.bincount(parcel, weights=common, minlength=len(parcels)).astype(np.float64)
    order = np.lexsort((block, -np.round(common / _SAME_AREA), parcel))
    most = np.full(len(parcels), OUTSIDE, dtype=np.int64)
    rows, first = np.unique(parcel[order], return_index=True)
    most[rows] = block[order][first]
    return most, inside


def same_as_others(parcels: ObjectArray, *, share: float) -> tuple[IntArray, IntArray]:
    """Return parcels that lie on another, and those that overlap another.

    Parameters
    ----------
    parcels
        (n,) valid polygons, in the order in which they are preferred.
    share
        Two parcels are the same if they have this share of the larger one in common.

    Returns
    -------
    same
        Rows that are another one's again: without them none is there twice.
    overlapping
        Rows of which more than 1 - `share` is another's, which is not the same.
    """
    suspect = ~shapely.is_empty(shapely.coverage_invalid_edges(parcels))
    a, b = shapely.STRtree(parcels).query(parcels[suspect], predicate="intersects")
    pairs = np.sort(np.column_stack([np.flatnonzero(suspect)[a], b]), axis=1)
    a, b = np.unique(pairs[pairs[:, 0] < pairs[:, 1]], axis=0).T
    common = shapely.area(shapely.intersection(parcels[a], parcels[b]))
    area: FloatArray = shapely.area(parcels)
    alike = common >= share * np.maximum(area[a], area[b])
    gone = np.zeros(len(parcels), dtype=bool)
    for i, j in sorted(zip(a[alike].tolist(), b[alike].tolist(), strict=True)):
        gone[j] |= not gone[i]
    smaller = np.minimum(area[a], area[b])
    crossing = (common > (1.0 - share) * smaller) & ~gone[a] & ~gone[b]
    return np.flatnonzero(gone), np.unique(np.concatenate([a[crossing], b[crossing]]))
