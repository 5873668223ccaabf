"""From a site to the layout that a run begins with: one parcel for each part of the land."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Sequence

import numpy as np
import shapely

from urban_processing.constraints.ground import Ground
from urban_processing.constraints.narrows import (
    HAIR,
    MITRE_LIMIT,
    NARROW_AREA,
    there_and_back,
)
from urban_processing.constraints.rim import edges_along
from urban_processing.errors import BoundaryError, TopologyError
from urban_processing.layout import EdgeKind, GivenStreet, Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.mesh.corners import (
    STRAIGHT_ANGLE,
    interior_angles,
    reported_polygons,
    sharpest_vertex,
)
from urban_processing.mesh.places import edges_at, nearest_on_ring, vertices_at
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import GRID, Issue, Site, snap_to_grid

SIMPLIFY_SHARE = 0.3
"""Default tolerance of the simplification, in sides of the smallest parcel: notches that are
smaller than a parcel make parcels that nobody wants."""

MOVED_SHARE = 0.05
"""Simplification may move this share of a part's area; strips and small parts need less."""

FINE_SHARE = 0.1
"""What is finer than this share of the tolerance is left out before narrows are sought, and a
given corner takes a vertex that lies so near."""

SAME_PLACE = 1e-4
"""A given corner takes a vertex within this share of √area at any tolerance."""

CORNER_MOVED = 0.01
"""A given corner that lay farther than this share of √area off the rim makes an issue."""

TOUCH = 64 * GRID
"""Parts may share points: boundary lines up to this length in metres are taken for one."""


def default_tolerance(min_area: float) -> float:
    """Tolerance in metres of the simplification of a boundary for parcels of `min_area` m²."""
    return float(SIMPLIFY_SHARE * np.sqrt(min_area))


def simplify_site(site: Site, tolerance: float, *, keep: FloatArray | None = None) -> Site:
    """Simplify the land's rings and say how much land changed sides.

    Inlets and spurs narrower than the tolerance go first; then Douglas–Peucker from the
    sharpest corner of each ring, or between the corners that the user gave, topology kept.
    Parts that would meet others along a line afterwards stay as they are. Vertices of outer
    rings at the places `keep` (k, 2) stay like corners.
    """
    if tolerance <= 0:
        return site
    site = place_corners(site, near=FINE_SHARE * tolerance)
    given = list(site.parts)
    fixed = site.corners if keep is None else np.concatenate([site.corners, keep])
    parts = [_simplified(part, tolerance, _own_corners(part, fixed)) for part in given]
    parts = _kept_apart(given, parts)
    if all(_same_rings(a, b) for a, b in zip(given, parts, strict=True)):
        return site
    moved = sum(shapely.symmetric_difference(a, b).area for a, b in zip(given, parts, strict=True))
    before = sum(shapely.get_num_coordinates(p) for p in given)
    after = sum(shapely.get_num_coordinates(p) for p in parts)
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


def _same_rings(a: shapely.Polygon, b: shapely.Polygon) -> bool:
    """Whether two polygons have the same vertices, wherever their rings begin."""
    return bool(shapely.equals_exact(shapely.normalize(a), shapely.normalize(b)))


def place_corners(site: Site, *, near: float = 0.0) -> Site:
    """Put the corners that the user gave on the outer rings, as vertices.

    Each goes to the nearest point of an outer ring: to the nearest vertex there if one lies
    within `near` metres, otherwise to a vertex of its own. Corners that are vertices already
    stay, so that placing twice changes nothing.
    """
    parts, corners, issues = list(site.parts), site.corners.copy(), list(site.issues)
    for k, corner in enumerate(site.corners):
        rims = [part.exterior for part in parts]
        i = int(np.argmin(shapely.distance(rims, shapely.Point(corner))))
        size = float(np.sqrt(parts[i].area))
        parts[i], corners[k], distance = _with_vertex(
            parts[i], corner, near=max(near, SAME_PLACE * size)
        )
        if distance > CORNER_MOVED * size:
            issues.append(
                Issue(
                    code="corner_moved",
                    message=(
                        f"Given corner {k + 1} lay {distance:.3g} m off the rim of the land and "
                        "was moved to the nearest point of it."
                    ),
                    part=i,
                    value=distance,
                    limit=CORNER_MOVED * size,
                    geometry=shapely.Point(corners[k]),
                )
            )
    return dataclasses.replace(site, parts=tuple(parts), corners=corners, issues=tuple(issues))


def _with_vertex(
    part: shapely.Polygon, point: FloatArray, *, near: float
) -> tuple[shapely.Polygon, FloatArray, float]:
    """The part with a vertex where its rim is nearest to a point; that vertex; how far it was."""
    ring = shapely.get_coordinates(part.exterior)
    k, foot, off = nearest_on_ring(ring, point)
    to_vertex = np.hypot(*(ring[:-1] - foot).T)
    vertex = int(np.argmin(to_vertex))
    if to_vertex[vertex] <= near:
        return part, ring[vertex], off
    place = snap_to_grid(foot)
    shell = np.insert(ring, k + 1, place, axis=0)
    return shapely.Polygon(shell, part.interiors), place, off


def _at_corners(xy: FloatArray, corners: FloatArray) -> BoolArray:
    """(n,) which points are corners, to the last digit."""
    z, wanted = xy[:, 0] + 1j * xy[:, 1], corners[:, 0] + 1j * corners[:, 1]
    return np.asarray(np.isin(z, wanted), dtype=bool)


def _own_corners(part: shapely.Polygon, corners: FloatArray) -> FloatArray:
    """(k, 2) vertices of the part's outer ring that are corners."""
    ring = shapely.get_coordinates(part.exterior)[:-1]
    return np.asarray(ring[_at_corners(ring, corners)])


def _simplified(part: shapely.Polygon, tolerance: float, corners: FloatArray) -> shapely.Polygon:
    """Simplify a part; where too much land would change sides, by a smaller tolerance.

    Narrows are sought once, on a ring without what is finer than they are: buffers of rough
    rings take long.
    """
    start = _thinned(part, FINE_SHARE * tolerance, corners)
    if start is not None:
        start = _without_narrows(start, tolerance, corners)
    if start is None or not _is_near(part, start):
        start = part
    while tolerance > 1e-3 * np.sqrt(part.area):
        simple = _thinned(start, tolerance, corners)
        if simple is not None and _is_near(part, simple):
            return simple
        tolerance /= 2
    return part


def _is_near(part: shapely.Polygon, simple: shapely.Polygon) -> bool:
    """Whether so little land changed sides as simplification may move."""
    limit = MOVED_SHARE * part.area
    # the areas alone often tell, and cost nothing
    if abs(simple.area - part.area) > limit:
        return False
    return bool(shapely.symmetric_difference(part, simple).area <= limit)


def _thinned(
    part: shapely.Polygon, tolerance: float, corners: FloatArray
) -> shapely.Polygon | None:
    """Douglas–Peucker that keeps topology and corners; None where no valid polygon is left."""
    holes = [_from_sharpest(ring) for ring in part.interiors]
    if len(corners) == 0:
        start = shapely.Polygon(_from_sharpest(part.exterior), holes)
        simple = shapely.simplify(start, tolerance, preserve_topology=True)
    else:
        runs = _runs_between(part.exterior, corners)
        lines = shapely.MultiLineString([*runs, *(shapely.LineString(hole) for hole in holes)])
        # lines of one collection keep their ends and do not come to cross each other
        thin = shapely.get_parts(shapely.simplify(lines, tolerance, preserve_topology=True))
        shell = np.concatenate([shapely.get_coordinates(run)[:-1] for run in thin[: len(runs)]])
        if len(shell) < 3:
            return None
        simple = shapely.Polygon(shell, [line.coords for line in thin[len(runs) :]])
    simple = shapely.transform(simple, snap_to_grid)
    if simple.is_empty or not simple.is_valid:
        return None
    if len(_own_corners(simple, corners)) < len(corners):
        return None
    return shapely.orient_polygons(simple)


def _runs_between(ring: shapely.LinearRing, corners: FloatArray) -> list[shapely.LineString]:
    """The runs of a ring from corner to corner, in ring order."""
    xy = shapely.get_coordinates(ring)[:-1]
    first, *others = np.flatnonzero(_at_corners(xy, corners)).tolist()
    turned = np.roll(xy, -first, axis=0)
    ends = [0, *(k - first for k in others), len(xy)]
    closed = np.vstack([turned, turned[:1]])
    return [shapely.LineString(closed[a : b + 1]) for a, b in itertools.pairwise(ends)]


def _without_narrows(part: shapely.Polygon, width: float, corners: FloatArray) -> shapely.Polygon:
    """Fill inlets and cut off spurs that are narrower than `width`; the rest stays as it is.

    Inlets and spurs with a given corner stay too.
    """
    fixed = shapely.MultiPoint(corners)
    for sign in (1.0, -1.0):
        back = there_and_back(part, 0.5 * width * sign)
        changes = back.difference(part) if sign > 0 else part.difference(back)
        narrow = [
            piece
            for piece in shapely.get_parts(changes)
            if piece.geom_type == "Polygon"
            and piece.area > NARROW_AREA * width * width
            and not shapely.dwithin(piece, fixed, 2 * MITRE_LIMIT * HAIR * width)
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


def _kept_apart(
    given: list[shapely.Polygon], simple: list[shapely.Polygon]
) -> list[shapely.Polygon]:
    """Take back the simplification of parts that now meet a neighbour along a line.

    A part taken back may meet another simplified one: this ends when none does any more.
    """
    parts = list(simple)
    taken_back: set[int] = set()
    while True:
        meeting = {i for pair in _meeting_parts(parts) for i in pair} - taken_back
        if not meeting:
            return parts
        taken_back |= meeting
        parts = [given[i] if i in meeting else part for i, part in enumerate(parts)]


def _meeting_parts(parts: Sequence[shapely.Polygon]) -> list[tuple[int, int]]:
    """Pairs of parts that overlap or share a boundary line, each once and in order."""
    polygons = np.asarray(parts, dtype=object)
    pairs = shapely.STRtree(polygons).query(polygons, predicate="intersects").T
    pairs = pairs[pairs[:, 0] < pairs[:, 1]]
    shared = shapely.intersection(polygons[pairs[:, 0]], polygons[pairs[:, 1]])
    meeting = pairs[shapely.length(shared) > TOUCH]
    return sorted((int(i), int(j)) for i, j in meeting)


def check_parts(parts: Sequence[shapely.Polygon]) -> None:
    """Make sure that the parts of the land meet at points alone.

    Raises
    ------
    BoundaryError
        If two parts overlap or share a boundary line.
    """
    pairs = _meeting_parts(parts)
    if pairs:
        raise BoundaryError(
            f"Parts {i + 1} and {j + 1} of the land overlap or share a boundary line; unite them "
            "into one polygon, as read_boundary does."
            for i, j in pairs
        )


def first_layout(
    site: Site,
    *,
    min_area: float,
    ground: Ground | None = None,
    rim_lines: Sequence[shapely.LineString] = (),
    obstacle_rim_is_street: bool = False,
) -> Layout:
    """One parcel for each part of the land, or the polygons that its streets divide it into.

    Parameters
    ----------
    site
        The land; where its rim is street, that on `rim_lines` is not, and the other way round.
    min_area
        Smallest parcel allowed, m².
    ground
        The land divided by given streets and locked land; by default it is not.
    rim_lines
        Lines along the outer rings.
    obstacle_rim_is_street
        Whether the rims of obstacles are streets.

    Raises
    ------
    BoundaryError
        If two parts overlap or share a boundary line.
    """
    check_parts(site.parts)
    input_parts = site.input_parts or site.parts
    site = place_corners(site)
    corner, few = _corners_of(site)
    given = len(site.corners) > 0 and len(few) < len(site.parts)
    n_parts = len(site.parts)
    mesh = mesh_from_polygons(site.parts if ground is None else ground.polygons)
    layout = layout_from_mesh(
        mesh,
        frame=site.frame,
        face_part=np.arange(n_parts) if ground is None else ground.part,
        min_area=min_area,
        vertex_corner=vertices_at(mesh.xy, corner),
        rim_is_street=False,
        obstacles=site.obstacles,
    )
    kind = layout.edge_kind
    street = (kind == EdgeKind.RIM) & (
        edges_along(mesh, kind, list(rim_lines)) ^ site.rim_is_street
    )
    street |= (kind == EdgeKind.OBSTACLE) & obstacle_rim_is_street
    issues = _corner_issues(site, few) if len(site.corners) else []
    layout = layout.replace(
        edge_street=street,
        edge_level=np.where(street, 0, -1).astype(np.int16),
        vertex_entry=vertices_at(mesh.xy, site.entries),
        corners_given=given,
        issues=(*site.issues, *issues),
        input_parts=input_parts,
    )
    return layout if ground is None else _with_ground(layout, ground, site)


def _with_ground(layout: Layout, ground: Ground, site: Site) -> Layout:
    """The layout with its given streets and locked parcels."""
    edge = edges_at(layout.mesh, ground.segments)
    if (edge < 0).any():
        raise TopologyError(
            f"{int((edge < 0).sum())} pieces of given streets bound no parcel; this is a mistake "
            "of the software: leave out the streets that end inside the land, and report it."
        )
    fixed, street, level = (
        layout.edge_fixed.copy(),
        layout.edge_street.copy(),
        layout.edge_level.copy(),
    )
    fixed[edge] = ground.segment_street
    street[edge], level[edge] = True, 0
    names = [*layout.land_uses, *dict.fromkeys(each.land_use for each in site.locked)]
    uses = tuple(dict.fromkeys(names))
    use = np.array([0, *(uses.index(each.land_use) for each in site.locked)])[ground.locked + 1]
    return layout.replace(
        edge_fixed=fixed,
        edge_street=street,
        edge_level=level,
        face_locked=ground.locked >= 0,
        face_use=use,
        land_uses=uses,
        fixed_streets=tuple(GivenStreet(s.street_class, s.width) for s in site.fixed_streets),
        issues=(*layout.issues, *ground.issues),
    )


def _corners_of(site: Site) -> tuple[FloatArray, dict[int, int]]:
    """(k, 2) corners of the land, found or given, and parts with too few given ones."""
    mesh = mesh_from_polygons(site.parts)
    corner, few = _given_corners(mesh, site.corners)
    given = len(site.corners) > 0 and len(few) < mesh.n_faces
    return mesh.xy[corner if given else land_corners(mesh)], few


def land_corners(mesh: PlanarMesh) -> BoolArray:
    """(V,) vertices of the rim where it bends by more than 45° (Chen 2024, section 3).

    The land is not cut yet: its parts are the faces.
    """
    return _bends(mesh, mesh.loops.face != OUTSIDE)


def rim_corners(mesh: PlanarMesh) -> BoolArray:
    """(V,) the same for land that is cut into parcels."""
    return _bends(mesh, mesh.loops.face == OUTSIDE)


def _bends(mesh: PlanarMesh, chosen: BoolArray) -> BoolArray:
    """(V,) vertices where one of some loops bends by more than 45°."""
    loops = mesh.loops
    out = np.zeros(mesh.n_vertices, dtype=bool)
    angles = interior_angles(mesh.xy[mesh.origin[loops.half_edges]], loops.offsets)
    included = np.pi - np.abs(angles - np.pi)
    bends = (included < STRAIGHT_ANGLE) & np.repeat(chosen, np.diff(loops.offsets))
    out[mesh.origin[loops.half_edges[bends]]] = True
    return out


def _given_corners(mesh: PlanarMesh, corners: FloatArray) -> tuple[BoolArray, dict[int, int]]:
    """Vertices of the outer rings that the user gave as corners, and parts with too few.

    Returns
    -------
    corner
        (V,) given corners; in parts with fewer than three, corners found by angle.
    few
        Number of given corners of the parts that have fewer than three.
    """
    out = np.zeros(mesh.n_vertices, dtype=bool)
    few: dict[int, int] = {}
    loops = mesh.loops
    for loop in np.flatnonzero((loops.face != OUTSIDE) & (mesh.loop_area > 0)).tolist():
        half_edges = loops.half_edges[loops.offsets[loop] : loops.offsets[loop + 1]]
        vertex: IntArray = mesh.origin[half_edges]
        xy = mesh.xy[vertex]
        is_corner = _at_corners(xy, corners)
        if is_corner.sum() >= 3:
            out[vertex[is_corner]] = True
            continue
        few[int(loops.face[loop])] = int(is_corner.sum())
        found, _ = reported_polygons(xy, np.array([0, len(xy)]))
        out[vertex[found]] = True
    return out, few


def _corner_issues(site: Site, few: dict[int, int]) -> list[Issue]:
    """Say which parts have too few given corners."""
    return [
        Issue(
            code="too_few_corners",
            message=(
                f"Part {part + 1} of the land has {count} given corner(s), fewer than 3: its "
                "corners are found by angle instead."
            ),
            part=part,
            value=float(count),
            limit=3.0,
            geometry=site.parts[part],
        )
        for part, count in sorted(few.items())
    ]
