"""Parcels with what streets, blocks and neighbours make of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import BlockRings, rings_of
from urban_processing.blocks.noding import NODE_GRID
from urban_processing.fabric.frontage import StreetPieces, StreetSegments, pieces_on_streets
from urban_processing.fabric.model import (
    NO_BLOCK,
    UNKNOWN_LEVEL,
    FabricParcels,
    Fronts,
    ParcelRings,
)
from urban_processing.fabric.observed import ObservedParcels
from urban_processing.fabric.streets_in_land import INNER, StreetsInLand
from urban_processing.fabric.touching import (
    Stretches,
    boundary_segments,
    count_neighbours,
    touching_parcels,
)
from urban_processing.mesh.overlap import Segments, find_overlaps, segments_of
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params.measure import MeasureParams
from urban_processing.streets.classes import NodeKind

Geometries = npt.NDArray[np.object_]

LEAST_FRONT = 0.1
"""A parcel that has no more than so many metres on a street touches it at a corner."""

RIM_LENGTH = 0.5
"""Parcels lie on the rim if more than so many metres of their boundary do."""


def describe_parcels(
    parcels: ObservedParcels, ground: StreetsInLand, params: MeasureParams, *, streets_known: bool
) -> tuple[FabricParcels, bool]:
    """Find frontage, blocks and neighbours of parcels.

    Parameters
    ----------
    parcels, ground
        Parcels, and the streets in their land.
    params
        Tolerance and reach.
    streets_known
        Whether there is a layer of streets; else frontage is NaN.

    Returns
    -------
    parcels
        Their net areas are their areas.
    gross
        Whether they run to the centreline of streets: most of their frontage lies on it.
    """
    polygons, rings = parcels.polygons, rings_of(parcels.polygons)
    n = len(polygons)
    boundary = boundary_segments(rings)
    touching = touching_parcels(boundary)
    pieces = pieces_on_streets(
        boundary,
        polygons,
        _street_segments(ground),
        touching,
        snap=max(params.snap_tolerance, NODE_GRID),
        reach=params.street_reach,
    )
    pieces = _without_touches(pieces, boundary, ground)
    length = (pieces.high - pieces.low) * boundary.length[pieces.edge]
    shapes = _parcel_rings(polygons, rings, pieces, ground, boundary)
    if not streets_known:
        shapes = replace(shapes, frontage=np.full(n, np.nan))
    known = FabricParcels(
        rings=shapes,
        parcel_id=parcels.parcel_id,
        part=_most_overlapped(polygons, ground.land, 0),
        block=_blocks_of(polygons, ground),
        level=np.full(n, UNKNOWN_LEVEL),
        land_use=parcels.land_use,
        net_area=shapes.area,
        neighbours=count_neighbours(touching, boundary, _on_centrelines(pieces), n_parcels=n),
        fronts=_fronts(pieces, boundary, ground),
    )
    return known, bool(length[pieces.on_centreline].sum() > length.sum() / 2)


def _street_segments(ground: StreetsInLand) -> StreetSegments:
    net = ground.network
    ends = np.flatnonzero(net.node_kind == NodeKind.END)
    first, last = net.half_edges[net.offsets[:-1]] >> 1, net.half_edges[net.offsets[1:] - 1] >> 1
    node = np.concatenate([net.start, net.end])
    at = np.flatnonzero(np.isin(node, ends))
    return StreetSegments(
        ground.lines.segments,
        ground.width,
        ground.lines.xy[net.node_vertex[node[at]]],
        np.concatenate([first, last])[at],
    )


def _on_centrelines(pieces: StreetPieces) -> Stretches:
    on = pieces.on_centreline
    return Stretches(pieces.edge[on], pieces.low[on], pieces.high[on])


def _without_touches(
    pieces: StreetPieces, boundary: Segments, ground: StreetsInLand
) -> StreetPieces:
    """Pieces of parcels that have more than `LEAST_FRONT` metres on a network edge.

    Of these, pieces below a tenth of that are what rounding leaves at corners.
    """
    length = (pieces.high - pieces.low) * boundary.length[pieces.edge]
    key = boundary.line[pieces.edge] * np.int64(max(ground.network.n_edges, 1))
    _, index = np.unique(key + ground.edge_of[pieces.segment], return_inverse=True)
    total = np.bincount(index.ravel(), weights=length)
    return pieces.take((total[index.ravel()] > LEAST_FRONT) & (length > LEAST_FRONT / 10))


def _blocks_of(polygons: Geometries, ground: StreetsInLand) -> IntArray:
    if not ground.network.n_edges:
        return np.full(len(polygons), NO_BLOCK)
    return _most_overlapped(polygons, ground.faces.polygons, NO_BLOCK)


def _most_overlapped(polygons: Geometries, areas: Geometries, none: int) -> IntArray:
    """(n,) the area that has most of each polygon, `none` where none has any."""
    out = np.full(len(polygons), none)
    area, polygon = shapely.STRtree(polygons).query(areas, predicate="contains")
    out[polygon] = area
    rows = np.setdiff1d(np.arange(len(polygons)), polygon)
    row, area = shapely.STRtree(areas).query(polygons[rows], predicate="intersects")
    shared = np.round(shapely.area(shapely.intersection(polygons[rows[row]], areas[area])), 3)
    order = np.lexsort((area, -shared, row))
    order = order[shared[order] > 0]
    found, first = np.unique(row[order], return_index=True)
    out[rows[found]] = area[order[first]]
    return out


def _parcel_rings(
    polygons: Geometries,
    rings: BlockRings,
    pieces: StreetPieces,
    ground: StreetsInLand,
    boundary: Segments,
) -> ParcelRings:
    """The shapes of parcels, and what of them is on streets."""
    n = len(polygons)
    length = (pieces.high - pieces.low) * boundary.length[pieces.edge]
    on_street = np.bincount(pieces.edge, weights=length, minlength=len(boundary.line))
    frontage = np.bincount(boundary.line, weights=on_street, minlength=n)
    shell = rings.is_shell[rings.edge_ring]
    size = np.diff(rings.offsets)[rings.is_shell]
    rim = np.zeros(n, dtype=bool)
    rim[boundary.line[pieces.edge[ground.lines.rim[pieces.segment] != INNER]]] = True
    return ParcelRings(
        xy=rings.xy[shell],
        offsets=np.append(0, np.cumsum(size)),
        on_street=np.asarray(on_street[shell], dtype=np.float64),
        frontage=np.asarray(frontage, dtype=np.float64),
        polygons=polygons,
        area=shapely.area(polygons),
        rim=rim | _on_rim(boundary, ground.land, n),
    )


def _on_rim(boundary: Segments, land: Geometries, n: int) -> BoolArray:
    """(n,) parcels with an edge on the rim of the land or on a hole of it."""
    found = find_overlaps(boundary, segments_of(land), RIM_LENGTH, clipped=True, least=0.0)
    length = (found.high - found.low) * boundary.length[found.first]
    along = np.bincount(boundary.line[found.first], weights=length, minlength=n)
    return np.asarray(along > RIM_LENGTH)


def _fronts(pieces: StreetPieces, boundary: Segments, ground: StreetsInLand) -> Fronts:
    """One piece for each edge of a parcel and each network edge that it lies along."""
    edge = ground.edge_of[pieces.segment]
    length = (pieces.high - pieces.low) * boundary.length[pieces.edge]
    at = ground.along(pieces.segment, pieces.share)
    key = pieces.edge * np.int64(max(ground.network.n_edges, 1)) + edge
    _, first, index = np.unique(key, return_index=True, return_inverse=True)
    index = index.ravel()
    total: FloatArray = np.zeros(len(first))
    np.add.at(total, index, length)
    middle = np.bincount(index, weights=length * at, minlength=len(first)) / total
    parcel, edge = boundary.line[pieces.edge[first]], edge[first]
    # rounding may lead beyond the end of an edge
    middle = np.clip(middle, 0.0, ground.network.edge_length[edge])
    order = np.lexsort((np.round(middle, 6), edge, parcel))
    return Fronts(parcel[order], edge[order], middle[order], total[order])
