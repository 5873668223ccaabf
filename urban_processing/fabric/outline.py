"""The land of a town whose boundary nobody gave: what its parcels and streets cover."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import rings_of
from urban_processing.blocks.noding import NODE_GRID, Centrelines
from urban_processing.fabric.frontage import StreetSegments, pieces_on_streets
from urban_processing.fabric.touching import Touching, boundary_segments
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.overlap import segments_of
from urban_processing.mesh.places import line_segments
from urban_processing.mesh.planar import FloatArray
from urban_processing.site import GRID

Geometries = npt.NDArray[np.object_]

MITRE_LIMIT = 3.0
"""Corners stay corners where gaps are closed, up to so many times the distance."""

WEDGE = 1.5
"""Corners between streets around parcels are no further away than so many times the reach: the
diagonal of a square, and a little more."""

TOUCHES = 1e-3
"""Share of its outline along which a piece of land without parcels lies at the open."""


def town_outline(
    parcels: Geometries,
    body: shapely.Geometry,
    streets: tuple[Centrelines, FloatArray],
    *,
    reach: float,
) -> tuple[shapely.Polygon, ...]:
    """Return the land that parcels and the streets among them cover.

    Rights-of-way and gaps between parcels are land, also where a street is wider than its nominal
    width by `reach` on both sides. Where a street runs around the parcels its centreline is the
    rim; streets that lead away are cut where the parcels end. What else there is without parcels
    and streets, such as water, is no land.

    Parameters
    ----------
    parcels, body
        (P,) polygons, and their union.
    streets
        Segments of streets, and the (S,) width of each.
    reach
        Metres.

    Returns
    -------
    tuple of shapely.Polygon
        The largest first.
    """
    work, width = streets
    if not len(work.line):
        return _sorted(_closed(body, reach))
    lines = np.asarray(shapely.linestrings(work.segments), dtype=object)
    half = width / 2
    near = shapely.dwithin(_prepared(body), lines, half + reach)
    lines, half = lines[near], half[near]
    if not len(lines):
        return _sorted(_closed(body, reach))
    beside = half + reach
    core = _closed(body, float(beside.max()))
    strips = _strips(core, lines, half, reach)
    rims = shapely.boundary(np.append(strips, core))
    edges = shapely.union_all(np.append(lines, rims), grid_size=GRID)
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(edges)))
    kept = _belongs(cells, parcels, core, strips, float(beside.max()))
    return _sorted(_filled(shapely.union_all(cells[kept]), lines, reach))


def _strips(
    core: shapely.Geometry, lines: Geometries, half: FloatArray, reach: float
) -> Geometries:
    """What lies between the outline of parcels and the streets along it, piece by piece."""
    polygons = canonical_rings(shapely.get_parts(core))
    outline = boundary_segments(rings_of(polygons))
    streets = segments_of(lines)
    nowhere = np.empty(0, dtype=np.int64)
    pieces = pieces_on_streets(
        outline,
        polygons,
        StreetSegments(streets, 2 * half[streets.line], np.empty((0, 2)), nowhere),
        Touching(nowhere, np.empty(0), np.empty(0), nowhere),
        snap=GRID,
        reach=reach,
    )
    a, b = outline.start[pieces.edge], outline.end[pieces.edge]
    c, d = streets.start[pieces.segment], streets.end[pieces.segment]
    ends, feet = [], []
    for share in (pieces.low, pieces.high):
        place = a + share[:, None] * (b - a)
        along = ((place - c) * (d - c)).sum(axis=1) / ((d - c) ** 2).sum(axis=1)
        ends.append(place)
        feet.append(c + np.clip(along, 0.0, 1.0)[:, None] * (d - c))
    corners = np.stack([*ends, *feet], axis=1)
    strips = shapely.convex_hull(shapely.multipoints(corners))
    return np.asarray(strips[shapely.area(strips) > GRID], dtype=object)


def _belongs(
    cells: Geometries,
    parcels: Geometries,
    core: shapely.Geometry,
    strips: Geometries,
    near: float,
) -> npt.NDArray[np.bool_]:
    """(C,) which pieces have parcels, or lie between parcels or between these and streets."""
    inside = shapely.point_on_surface(cells)
    kept = np.zeros(len(cells), dtype=bool)
    _, cell = shapely.STRtree(cells).query(
        shapely.point_on_surface(parcels), predicate="intersects"
    )
    kept[cell] = True
    cell, _ = shapely.STRtree(strips).query(inside, predicate="intersects")
    kept[cell] = True
    in_core = shapely.intersects(_prepared(core), inside)
    enclosed = _shared(cells, shapely.boundary(core)) < TOUCHES * shapely.length(cells)
    # at corners, between two strips and the streets
    wedge = shapely.contains(_prepared(shapely.buffer(core, WEDGE * near, quad_segs=4)), cells)
    return np.asarray(kept | np.where(in_core, enclosed, wedge))


def _filled(land: shapely.Geometry, lines: Geometries, reach: float) -> shapely.Geometry:
    """Land with those holes filled that streets run through, such as those of interchanges."""
    outlines, owner = shapely.get_rings(shapely.get_parts(land), return_index=True)
    holes = shapely.polygons(outlines[np.diff(owner, prepend=-1) == 0])
    inner = shapely.buffer(holes, -reach / 2)
    hole, line = shapely.STRtree(lines).query(inner, predicate="intersects")
    crossed = shapely.length(shapely.intersection(inner[hole], lines[line]))
    total = np.bincount(hole, weights=crossed, minlength=len(holes))
    return shapely.union_all([land, *holes[total > reach]])


def _shared(cells: Geometries, rim: shapely.Geometry) -> FloatArray:
    """(C,) metres of the outline of each cell that lie along a rim."""
    outlines, owner = shapely.get_rings(cells, return_index=True)
    segments, ring = line_segments(outlines)
    pieces, _ = line_segments(shapely.get_parts(rim))
    at, _ = shapely.STRtree(shapely.linestrings(pieces)).query(
        shapely.points(segments.mean(axis=1)), predicate="dwithin", distance=4 * GRID
    )
    at = np.unique(at)
    length = np.hypot(*(segments[at, 1] - segments[at, 0]).T)
    total = np.bincount(owner[ring[at]], weights=length, minlength=len(cells))
    return np.asarray(total, dtype=np.float64)


def _closed(geometry: shapely.Geometry, radius: float) -> shapely.Geometry:
    """A geometry with gaps of twice a radius closed; its corners stay."""
    if radius <= 0:
        return geometry
    out = geometry
    for distance in (radius, -radius):
        out = shapely.buffer(out, distance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    return shapely.union_all([out, geometry])


def _prepared(geometry: shapely.Geometry) -> shapely.Geometry:
    shapely.prepare(geometry)
    return geometry


def _sorted(land: shapely.Geometry) -> tuple[shapely.Polygon, ...]:
    """Polygons on the grid, the largest first, with canonical rings.

    Spikes, clefts and holes as thin as rounding go, and vertices on straight edges.
    """
    smooth = land
    for distance in (2 * NODE_GRID, -4 * NODE_GRID, 2 * NODE_GRID):
        smooth = shapely.buffer(smooth, distance, join_style="mitre", mitre_limit=MITRE_LIMIT)
    snapped = shapely.set_precision(shapely.simplify(smooth, 2 * NODE_GRID), GRID)
    parts = shapely.get_parts(snapped)
    polygons = canonical_rings(parts[shapely.get_dimensions(parts) == 2])
    return tuple(sorted(polygons.tolist(), key=lambda p: (-round(p.area, 3), p.bounds, p.wkb)))
