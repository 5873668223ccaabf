"""The land of a town whose boundary nobody gave: what its parcels and streets cover."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.noding import Centrelines
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.places import line_segments
from urban_processing.mesh.planar import FloatArray
from urban_processing.site import GRID

Geometries = npt.NDArray[np.object_]

MITRE_LIMIT = 3.0
"""Corners stay corners where gaps are closed, up to so many times the distance."""

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
    widest = float(half.max())
    strips = shapely.union_all(shapely.buffer(lines, half, cap_style="flat"))
    # the coarse outline alone says which streets lie beside parcels
    core = _closed(body, reach + widest)
    beside = shapely.intersection(strips, shapely.buffer(core, reach + widest, quad_segs=4))
    hull = _closed(shapely.union_all([core, beside]), reach)
    rims = [shapely.boundary(hull), shapely.boundary(core)]
    edges = shapely.union_all(np.append(lines, rims), grid_size=GRID)
    cells = shapely.get_parts(shapely.polygonize(shapely.get_parts(edges)))
    kept = _belongs(cells, parcels, core, hull)
    return _sorted(_filled(shapely.union_all(cells[kept]), lines, reach))


def _belongs(
    cells: Geometries, parcels: Geometries, core: shapely.Geometry, hull: shapely.Geometry
) -> npt.NDArray[np.bool_]:
    """(C,) which pieces have parcels, or lie between what has: not at the open."""
    inside = shapely.point_on_surface(cells)
    settled = np.zeros(len(cells), dtype=bool)
    _, cell = shapely.STRtree(cells).query(
        shapely.point_on_surface(parcels), predicate="intersects"
    )
    settled[cell] = True
    in_core = shapely.intersects(_prepared(core), inside)
    in_hull = shapely.intersects(_prepared(hull), inside)
    at_open = _shared(cells, shapely.boundary(hull))
    at_core = _shared(cells, shapely.boundary(core))
    enclosed = at_open < TOUCHES * shapely.length(cells)
    return np.asarray(settled | (in_hull & np.where(in_core, enclosed, at_core > at_open)))


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
    """Polygons on the grid, the largest first, with canonical rings."""
    snapped = shapely.set_precision(land, GRID)
    parts = shapely.get_parts(snapped)
    polygons = canonical_rings(parts[shapely.get_dimensions(parts) == 2])
    return tuple(sorted(polygons.tolist(), key=lambda p: (-round(p.area, 3), p.bounds, p.wkb)))
