"""The rights-of-way of any set of centrelines, without a layout."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import ParameterError
from urban_processing.mesh.places import line_segments
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.rights_of_way.partition import RightsOfWay, partition
from urban_processing.rights_of_way.surfaces import (
    Circles,
    Geometries,
    StreetSides,
    street_surfaces,
)
from urban_processing.site import GRID

BESIDE = 1e-3
"""Distance in metres within which a centreline runs along the rim of a block."""


def rights_of_way_of_lines(
    land: Sequence[shapely.Polygon],
    centrelines: Sequence[shapely.LineString],
    *,
    width: npt.ArrayLike,
    rank: npt.ArrayLike | None = None,
    corner_radius: float = 0.0,
    turning_radius: float = 0.0,
) -> tuple[Geometries, RightsOfWay]:
    """Divide land by streets into blocks, and these into right-of-way and net blocks.

    Parameters
    ----------
    land
        Polygons in local metres that meet at points at most; part ``i`` is ``land[i]``.
    centrelines
        Street centrelines. They may cross each other and the rim; what lies outside the land
        does not count. A line on the rim takes the inner half of its width.
    width
        Width of the right-of-way in metres, one for all or one for each line.
    rank
        Class of each line as a number, the highest 0, which takes junctions; by default all
        are of one class.
    corner_radius, turning_radius
        Radii in metres of the corners of blocks and of turning heads at dead ends; 0 for none.

    Returns
    -------
    blocks
        (B,) polygons of the blocks, to the centreline.
    rights_of_way
        `RightsOfWay` whose "parcels" are these blocks.

    Raises
    ------
    ParameterError
        If a width is not above 0.

    Examples
    --------
    >>> land = [shapely.box(0, 0, 100, 100)]
    >>> street = [shapely.LineString([(50, 0), (50, 100)])]
    >>> blocks, streets = rights_of_way_of_lines(land, street, width=10)
    >>> streets.net_area.tolist()
    [4500.0, 4500.0]
    """
    n = len(centrelines)
    widths = np.broadcast_to(np.asarray(width, dtype=np.float64), (n,))
    if not (widths > 0).all() or not np.isfinite(widths).all():
        raise ParameterError("Each width must be a number of metres above 0.")
    ranks = np.zeros(n, dtype=np.int64) if rank is None else np.asarray(rank, dtype=np.int64)
    rims = shapely.boundary(np.asarray(land, dtype=object))
    edges = shapely.get_parts(shapely.union_all([*rims, *centrelines], grid_size=GRID))
    cells = shapely.get_parts(shapely.polygonize(edges))
    cell, part = shapely.STRtree(np.asarray(land, dtype=object)).query(
        shapely.point_on_surface(cells), predicate="intersects"
    )
    blocks = cells[cell]
    segments, line = segments_on(edges, centrelines, widths)
    near, block = shapely.STRtree(blocks).query(
        shapely.points(segments.mean(axis=1)), predicate="dwithin", distance=BESIDE
    )
    of = line[near]
    surfaces = street_surfaces(
        blocks,
        StreetSides(block, segments[near], widths[of], ranks[of]),
        turning_heads(blocks, rims, segments, ranks[line], turning_radius),
        corner_radius=corner_radius,
    )
    return blocks, partition(blocks, edges, surfaces, block=np.arange(len(blocks)), part=part)


def segments_on(
    edges: Geometries, centrelines: Sequence[shapely.LineString], width: FloatArray
) -> tuple[FloatArray, IntArray]:
    """(S, 2, 2) pieces of edges on centrelines, and (S,) which line: the widest of several."""
    pieces, _ = line_segments(edges)
    piece, line = shapely.STRtree(np.asarray(centrelines, dtype=object)).query(
        shapely.points(pieces.mean(axis=1)), predicate="dwithin", distance=BESIDE
    )
    order = np.lexsort((line, -width[line], piece))
    _, first = np.unique(piece[order], return_index=True)
    chosen = order[first]
    return pieces[piece[chosen]], line[chosen]


def turning_heads(
    blocks: Geometries, rims: Geometries, segments: FloatArray, rank: IntArray, radius: float
) -> Circles:
    """Circles where a single one of (S, 2, 2) segments ends inside the land, not at its rims."""
    ends = segments.reshape(-1, 2)
    places, first, count = np.unique(ends, axis=0, return_index=True, return_counts=True)
    at = shapely.points(places)
    dead = (count == 1) & (radius > 0) & ~shapely.dwithin(at, shapely.union_all(rims), BESIDE)
    end, block = shapely.STRtree(blocks).query(at[dead], predicate="intersects")
    chosen = first[dead][end]
    return Circles(block, ends[chosen], np.full(len(chosen), radius), rank[chosen // 2])
