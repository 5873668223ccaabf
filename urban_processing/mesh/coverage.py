"""Polygons that nearly fit, as hand edits leave them, made to share their boundaries exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from urban_processing.mesh.components import components
from urban_processing.mesh.places import lower_end_first
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import GRID, snap_to_grid

ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class Coverage:
    """Polygons that share their boundaries exactly.

    Parameters
    ----------
    polygons
        (n,) polygons whose neighbours have the same vertices.
    source
        (n,) which of the polygons given each one comes from; a polygon that fell into several
        pieces comes several times, one that nothing is left of not at all.
    overlaps
        Pieces of land that two or more of the polygons given claimed; the first of them has it.
    gaps
        Pieces enclosed by the polygons that none of them claimed.
    """

    polygons: ObjectArray
    source: IntArray
    overlaps: ObjectArray
    gaps: ObjectArray


def fit_together(
    polygons: ObjectArray, tolerance: float, *, places: FloatArray | None = None
) -> Coverage:
    """Snap polygons to each other and node them.

    Vertices within `tolerance` of each other become one, vertices within it of an edge become
    vertices of that edge; what still crosses or overlaps is cut at the crossings.

    Parameters
    ----------
    polygons
        (n,) valid polygons in local metres.
    tolerance
        Metres.
    places
        (k, 2) further places that are to be vertices of boundaries within the tolerance, such
        as the ends of streets.
    """
    extra = np.empty((0, 2)) if places is None else snap_to_grid(places)
    edges = _snapped_edges(polygons, extra, tolerance)
    lines = shapely.linestrings(edges)
    noded = shapely.union_all(lines, grid_size=GRID)
    pieces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    inner = shapely.point_on_surface(pieces)
    tree = shapely.STRtree(polygons)
    piece, owner = tree.query(inner, predicate="intersects")
    order = np.lexsort((owner, piece))
    piece, owner = piece[order], owner[order]
    claimed, first, times = np.unique(piece, return_index=True, return_counts=True)
    unclaimed = np.setdiff1d(np.arange(len(pieces)), claimed)
    fitted, source = _united(pieces[claimed], owner[first])
    return Coverage(fitted, source, pieces[claimed[times > 1]], pieces[unclaimed])


def _snapped_edges(polygons: ObjectArray, extra: FloatArray, tolerance: float) -> FloatArray:
    """(m, 2, 2) edges of the polygons' rings after snapping, each once."""
    xy, ring = shapely.get_coordinates(shapely.get_rings(polygons), return_index=True)
    xy = snap_to_grid(xy)
    merged = _merged(np.concatenate([xy, extra]), tolerance)
    xy, extra = merged[: len(xy)], merged[len(xy) :]
    same = ring[1:] == ring[:-1]
    a, b = xy[:-1][same], xy[1:][same]
    long = (a != b).any(axis=1)
    segments = np.unique(lower_end_first(np.stack([a[long], b[long]], axis=1)), axis=0)
    corners = np.unique(np.concatenate([xy, extra]), axis=0)
    return _through(segments, corners, tolerance)


def _merged(xy: FloatArray, tolerance: float) -> FloatArray:
    """The places, those within `tolerance` of each other in one: where most of them are."""
    places, inverse, count = np.unique(xy, axis=0, return_inverse=True, return_counts=True)
    pairs = cKDTree(places).query_pairs(tolerance, output_type="ndarray")
    group = components(len(places), pairs)
    order = np.lexsort((np.arange(len(places)), -count, group))
    chosen = order[np.flatnonzero(np.diff(group[order], prepend=-1))]
    return np.asarray(places[chosen][group][inverse.ravel()])


def _through(segments: FloatArray, corners: FloatArray, tolerance: float) -> FloatArray:
    """Lead every segment through the corners that lie within `tolerance` of it."""
    points = shapely.points(corners)
    tree = shapely.STRtree(shapely.linestrings(segments))
    corner, segment = tree.query(points, predicate="dwithin", distance=tolerance)
    a, way = segments[segment, 0], segments[segment, 1] - segments[segment, 0]
    share = ((corners[corner] - a) * way).sum(axis=1) / (way**2).sum(axis=1)
    between = (share > 0) & (share < 1)
    between &= (corners[corner] != segments[segment, 0]).any(axis=1)
    between &= (corners[corner] != segments[segment, 1]).any(axis=1)
    corner, segment, share = corner[between], segment[between], share[between]
    n = len(segments)
    of = np.concatenate([np.arange(n), segment, np.arange(n)])
    at = np.concatenate([np.zeros(n), share, np.ones(n)])
    xy = np.concatenate([segments[:, 0], corners[corner], segments[:, 1]])
    order = np.lexsort((at, of))
    xy, of = xy[order], of[order]
    same = (of[1:] == of[:-1]) & (xy[1:] != xy[:-1]).any(axis=1)
    return np.unique(lower_end_first(np.stack([xy[:-1], xy[1:]], axis=1)[same]), axis=0)


def _united(pieces: ObjectArray, owner: IntArray) -> tuple[ObjectArray, IntArray]:
    """Unite the pieces of each owner; what does not hang together stays apart."""
    polygons: list[shapely.Polygon] = []
    source: list[int] = []
    order = np.argsort(owner, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(owner[order])) + 1)
    for own in groups if len(order) else []:
        several = len(own) > 1
        parts = shapely.get_parts(shapely.union_all(pieces[own])) if several else pieces[own]
        polygons += list(parts)
        source += [int(owner[own[0]])] * len(parts)
    out = np.empty(len(polygons), dtype=object)
    out[:] = polygons
    return out, np.array(source, dtype=np.int64)
