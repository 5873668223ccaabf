"""From a site to the layout that a run begins with: one parcel for each part of the land."""

from __future__ import annotations

import dataclasses

import numpy as np
import shapely

from urban_processing.layout import Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.corners import STRAIGHT_ANGLE, interior_angles, sharpest_vertex
from urban_processing.mesh.planar import OUTSIDE, BoolArray, PlanarMesh
from urban_processing.site import GRID, Issue, Site

SIMPLIFY_SHARE = 0.3
"""Default tolerance of the simplification, in sides of the smallest parcel: notches that are
smaller than a parcel make parcels that nobody wants."""

MOVED_SHARE = 0.05
"""Simplification may move this share of a part's area; strips and small parts need less."""

MITRE_LIMIT = 5.0
NARROW_AREA = 0.2
"""Inlets and spurs smaller than this many squared tolerances are left to the simplification."""

HAIR = 1e-3
"""Widening of what is filled or cut off, in tolerances."""


def default_tolerance(min_area: float) -> float:
    """Tolerance in metres of the simplification of a boundary for parcels of `min_area` m²."""
    return float(SIMPLIFY_SHARE * np.sqrt(min_area))


def simplify_site(site: Site, tolerance: float) -> Site:
    """Simplify the land's rings and say how much land changed sides.

    Inlets and spurs narrower than the tolerance go first; then Douglas–Peucker from the
    sharpest corner of each ring, topology kept. Parts that would overlap others afterwards
    stay as they are.
    """
    if tolerance <= 0:
        return site
    parts = [_simplified(part, tolerance) for part in site.parts]
    parts = _without_overlaps(list(site.parts), parts)
    moved = sum(
        shapely.symmetric_difference(a, b).area for a, b in zip(site.parts, parts, strict=True)
    )
    before = sum(shapely.get_num_coordinates(p) for p in site.parts)
    after = sum(shapely.get_num_coordinates(p) for p in parts)
    if after == before:
        return site
    issue = Issue(
        code="boundary_simplified",
        message=(
            f"The boundary was simplified by up to {tolerance:.3g} m, from {before} to {after} "
            f"vertices; {moved:.0f} m² ({100 * moved / site.area:.2g} %) of land changed sides. "
            "simplify=0 keeps every vertex."
        ),
        value=float(moved),
        limit=float(tolerance),
    )
    return dataclasses.replace(site, parts=tuple(parts), issues=(*site.issues, issue))


def _simplified(part: shapely.Polygon, tolerance: float) -> shapely.Polygon:
    """Simplify a part; where too much land would change sides, by a smaller tolerance."""
    while tolerance > 1e-3 * np.sqrt(part.area):
        simple = _simplified_once(part, tolerance)
        if shapely.symmetric_difference(part, simple).area <= MOVED_SHARE * part.area:
            return simple
        tolerance /= 2
    return part


def _simplified_once(part: shapely.Polygon, tolerance: float) -> shapely.Polygon:
    even = _without_narrows(part, tolerance)
    rings = [_from_sharpest(ring) for ring in (even.exterior, *even.interiors)]
    start = shapely.Polygon(rings[0], rings[1:])
    simple = shapely.simplify(start, tolerance, preserve_topology=True)
    simple = shapely.set_precision(simple, GRID)
    if not isinstance(simple, shapely.Polygon) or simple.is_empty or not simple.is_valid:
        return part
    return shapely.orient_polygons(simple)


def _without_narrows(part: shapely.Polygon, width: float) -> shapely.Polygon:
    """Fill inlets and cut off spurs that are narrower than `width`; the rest stays as it is."""
    for sign in (1.0, -1.0):
        reach = 0.5 * width * sign
        there = part.buffer(reach, join_style="mitre", mitre_limit=MITRE_LIMIT)
        back = there.buffer(-reach, join_style="mitre", mitre_limit=MITRE_LIMIT)
        changes = back.difference(part) if sign > 0 else part.difference(back)
        narrow = [
            piece
            for piece in shapely.get_parts(changes)
            if piece.geom_type == "Polygon" and piece.area > NARROW_AREA * width * width
        ]
        if not narrow:
            continue
        # a hair wider, so that the pieces leave no slits
        pieces = shapely.union_all(narrow).buffer(HAIR * width, join_style="mitre")
        changed = part.union(pieces) if sign > 0 else part.difference(pieces)
        # a spur may hold an island of land on to the rest: then it stays
        whole = isinstance(changed, shapely.Polygon) and not changed.is_empty
        if whole and len(changed.interiors) == len(part.interiors):
            part = changed
    return part


def _from_sharpest(ring: shapely.LinearRing) -> shapely.LinearRing:
    """The same ring, beginning at its sharpest vertex: simplification keeps the first one."""
    xy = shapely.get_coordinates(ring)[:-1]
    start = int(sharpest_vertex(xy, np.array([0, len(xy)]))[0])
    turned = np.roll(xy, -start, axis=0)
    return shapely.LinearRing(turned)


def _without_overlaps(
    given: list[shapely.Polygon], simple: list[shapely.Polygon]
) -> list[shapely.Polygon]:
    """Take back the simplification of parts that now overlap a neighbour."""
    tree = shapely.STRtree(simple)
    for i, j in tree.query(simple, predicate="intersects").T.tolist():
        if i < j and shapely.intersection(simple[i], simple[j]).area > 0:
            simple[i], simple[j] = given[i], given[j]
    return simple


def first_layout(site: Site, *, min_area: float) -> Layout:
    """One parcel for each part of the land; the rim is street if the site says so."""
    mesh = mesh_from_polygons(site.parts)
    given = len(site.corners) > 0
    corner = _nearest_vertices(mesh, site) if given else land_corners(mesh)
    layout = layout_from_mesh(
        mesh,
        frame=site.frame,
        face_part=np.arange(len(site.parts)),
        min_area=min_area,
        vertex_corner=corner,
        rim_is_street=site.rim_is_street,
    )
    return layout.replace(
        corners_given=given, issues=site.issues, input_parts=site.input_parts or site.parts
    )


def land_corners(mesh: PlanarMesh) -> BoolArray:
    """(V,) vertices of the rim where it bends by more than 45° (Chen 2024, section 3)."""
    loops = mesh.loops
    out = np.zeros(mesh.n_vertices, dtype=bool)
    angles = interior_angles(mesh.xy[mesh.origin[loops.half_edges]], loops.offsets)
    included = np.pi - np.abs(angles - np.pi)
    face = np.repeat(loops.face, np.diff(loops.offsets))
    bends = (included < STRAIGHT_ANGLE) & (face != OUTSIDE)
    out[mesh.origin[loops.half_edges[bends]]] = True
    return out


def _nearest_vertices(mesh: PlanarMesh, site: Site) -> BoolArray:
    """(V,) rim vertices nearest to the corners that the user gave."""
    out = np.zeros(mesh.n_vertices, dtype=bool)
    for corner in site.corners:
        out[int(np.argmin(np.hypot(*(mesh.xy - corner).T)))] = True
    return out
