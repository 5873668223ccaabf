"""Layouts from parcels and streets that need not fit exactly, such as hand edits leave them."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.land import land_corners, rim_corners
from urban_processing.layer_rows import (
    VALUES_IGNORED,
    ParcelRows,
    StreetRows,
    parcel_rows,
    street_rows,
    values_of_faces,
)
from urban_processing.layout import (
    NOT_FIXED,
    PARCEL_USE,
    EdgeKind,
    GivenStreet,
    Layout,
    Steering,
    layout_from_mesh,
)
from urban_processing.mesh.build import canonical_rings, mesh_from_polygons
from urban_processing.mesh.components import components
from urban_processing.mesh.coverage import Coverage, fit_together
from urban_processing.mesh.places import are_near, line_segments
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.provenance import Step
from urban_processing.site import AREA_ROUNDING, Frame, Issue
from urban_processing.street_rules import StreetRules

ObjectArray = npt.NDArray[np.object_]

SMALL_CHANGE = 1e-6
"""Overlaps and gaps below this share of the mean parcel are left over from rounding."""

LOOKED_AT_M, LOOKED_AT = 1.0, 200_000
"""Streets are checked every metre, at no more places than these."""

DRAWN_LEVEL = 1
"""Level of streets that somebody drew."""

EDITED, EDITED_SINCE = "layers_edited", "edited_since"
"""Codes of the issues that say that parcels or streets were edited, and what became of them."""

OF_AN_EDIT = frozenset({EDITED, EDITED_SINCE, VALUES_IGNORED})
"""Codes of issues that tell of one edit and do not hold after the next."""


@dataclass(frozen=True, kw_only=True, eq=False)
class Kept:
    """What a layout keeps while its parcels and streets are edited; all coordinates are local.

    Parameters
    ----------
    min_area
        The smallest parcel allowed, m²; None for that of the smallest there is.
    corners
        (C, 2) corners of the land; where they were given, no others are looked for.
    entries
        (N, 2) places where the network meets the outside.
    steered
        (T, 2, 2) ends of the mesh edges that a planner decided something of.
    steering
        (T,) what that is, as in `Layout`.
    corners_given, street_rules, obstacles, fixed_streets, land_uses, history, input_parts, issues
        As in `Layout`.
    """

    min_area: float | None = None
    corners: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    entries: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    steered: FloatArray = field(default_factory=lambda: np.empty((0, 2, 2)))
    steering: npt.NDArray[np.uint8] = field(default_factory=lambda: np.empty(0, dtype=np.uint8))
    corners_given: bool = False
    street_rules: StreetRules = field(default_factory=StreetRules)
    obstacles: tuple[shapely.Polygon, ...] = ()
    fixed_streets: tuple[GivenStreet, ...] = ()
    land_uses: tuple[str, ...] = (PARCEL_USE,)
    history: tuple[Step, ...] = ()
    input_parts: tuple[shapely.Polygon, ...] = ()
    issues: tuple[Issue, ...] = ()


def kept_of(layout: Layout) -> Kept:
    """What there is to keep of a layout."""
    mesh, steered = layout.mesh, np.flatnonzero(layout.edge_steering)
    return Kept(
        min_area=layout.min_area,
        corners=mesh.xy[layout.vertex_corner],
        entries=mesh.xy[layout.vertex_entry],
        steered=mesh.xy[mesh.origin.reshape(-1, 2)[steered]],
        steering=layout.edge_steering[steered],
        corners_given=layout.corners_given,
        street_rules=layout.street_rules,
        obstacles=layout.obstacles,
        fixed_streets=layout.fixed_streets,
        land_uses=layout.land_uses,
        history=layout.history,
        input_parts=layout.input_parts,
        issues=layout.issues,
    )


def assemble_layout(
    parcels: ObjectArray,
    streets: ObjectArray,
    *,
    frame: Frame,
    snap: float,
    kept: Kept | None = None,
    min_area: float | None = None,
    rows: tuple[ParcelRows, StreetRows] | None = None,
) -> Layout:
    """Make a layout from parcels and street lines in local metres.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along. What that changed, and what does not fit, is said in the issues.
    What the rows of the layers say of parcels and streets holds for what comes of them.

    Parameters
    ----------
    parcels
        (n,) valid polygons.
    streets
        (m,) lines; the rim is street where one runs along it.
    frame
        Where the local coordinates lie.
    snap
        Metres within which things fit.
    kept
        What the layout has besides; nothing where the layers come from elsewhere.
    min_area
        The smallest parcel allowed, m²; by default the one that is kept, or else the smallest
        there is.
    rows
        What (n,) rows say of the parcels and (m,) rows of the streets.

    Raises
    ------
    BoundaryError
        If nothing is left of the parcels.
    """
    known = Kept() if kept is None else kept
    if min_area is not None:
        known = dataclasses.replace(known, min_area=min_area)
    of_parcels, of_streets = rows or (parcel_rows({}, len(parcels)), street_rows({}, len(streets)))
    ends = [shapely.get_coordinates(line)[[0, -1]] for line in streets]
    places = np.concatenate(ends) if ends else None
    coverage = fit_together(parcels, snap, places=places)
    if len(coverage.polygons) == 0:
        raise BoundaryError("No parcel is left after snapping: check their size and CRS.")
    mesh = mesh_from_polygons(list(canonical_rings(coverage.polygons)))
    smallest = float(mesh.face_area.min()) if known.min_area is None else known.min_area
    layout = layout_from_mesh(
        mesh,
        frame=frame,
        face_part=_parts(mesh),
        min_area=smallest,
        vertex_corner=_corners(mesh, known, snap),
        rim_is_street=False,
        obstacles=known.obstacles,
    )
    said = values_of_faces(
        of_parcels.taken(coverage.source),
        mesh.face_polygons(),
        min_area=smallest,
        origin=frame.origin,
        land_uses=known.land_uses,
    )
    layout = _with_streets(layout, streets, of_streets, snap).replace(
        **said.fields(),
        edge_steering=_steering(mesh, known, snap),
        vertex_entry=_near(mesh, known.entries, snap),
        corners_given=known.corners_given,
        street_rules=known.street_rules,
        history=known.history,
        input_parts=known.input_parts,
        fixed_streets=known.fixed_streets,
    )
    issues = [
        *(issue for issue in known.issues if _still_holds(issue)),
        *of_parcels.issues,
        *of_streets.issues,
        *_fit_issues(coverage, parcels),
        *_stray_streets(layout, streets, snap),
    ]
    return layout.replace(issues=tuple(issues))


def _with_streets(layout: Layout, streets: ObjectArray, rows: StreetRows, snap: float) -> Layout:
    """The layout with the streets that run along its edges, and what their rows say of them."""
    mesh = layout.mesh
    street = _on_lines(mesh, streets, snap)
    level = np.where(layout.edge_kind == EdgeKind.INTERIOR, DRAWN_LEVEL, 0)
    # what lies on two streets is of the one that was there first
    for said in np.unique(rows.level[rows.level >= 0])[::-1].tolist():
        level[_on_lines(mesh, streets[rows.level == said], snap)] = said
    fixed = np.full(mesh.n_edges, NOT_FIXED)
    for entry in np.unique(rows.fixed[rows.fixed != NOT_FIXED]).tolist():
        fixed[_on_lines(mesh, streets[rows.fixed == entry], snap)] = entry
    return layout.replace(
        edge_street=street,
        edge_level=np.where(street, level, -1).astype(np.int16),
        edge_fixed=np.where(street, fixed, NOT_FIXED),
    )


def _corners(mesh: PlanarMesh, kept: Kept, snap: float) -> BoolArray:
    """(V,) corners of the land that are kept, and unless these were given all that are found.

    A bend in the side between two parcels, such as people draw, is one as well.
    """
    out = _near(mesh, kept.corners, snap)
    if kept.corners_given and out.any():
        return out
    bends = land_corners(mesh) & (mesh.valence == 2)
    return np.asarray(out | rim_corners(mesh) | bends)


def _near(mesh: PlanarMesh, places: FloatArray, snap: float) -> BoolArray:
    """(V,) vertices within the tolerance of one of some places."""
    if len(places) == 0:
        return np.zeros(mesh.n_vertices, dtype=bool)
    return are_near(mesh.xy, list(shapely.points(places)), snap)


def _steering(mesh: PlanarMesh, kept: Kept, snap: float) -> npt.NDArray[np.uint8]:
    """(E,) what a planner decided of the edges, where they still are."""
    out = np.full(mesh.n_edges, Steering.NONE, dtype=np.uint8)
    for what in Steering:
        chosen = (kept.steering & what) != 0
        if chosen.any():
            out[_on_lines(mesh, shapely.linestrings(kept.steered[chosen]), snap)] |= np.uint8(what)
    return out


def _still_holds(issue: Issue) -> bool:
    """Whether an issue of the layout before is one of the land as a whole, however it is edited."""
    return issue.parcel_id is issue.part is issue.geometry is None and issue.code not in OF_AN_EDIT


def land_changes(before: shapely.Geometry, layout: Layout, snap: float) -> tuple[float, float]:
    """Area in m² of land that no parcel covers any more, and of parcels beside the land.

    Zero where it is no more than what snapping may move along the land's rims.

    Parameters
    ----------
    before
        The land as it was, in local coordinates.
    layout
        The layout after an edit.
    snap
        Metres within which its parcels were fitted together.
    """
    now = shapely.coverage_union_all(layout.mesh.face_polygons())
    slack = snap * before.length + AREA_ROUNDING * before.area
    missing, more = (
        float(shapely.difference(one, other).area) for one, other in ((before, now), (now, before))
    )
    return missing if missing > slack else 0.0, more if more > slack else 0.0


def _parts(mesh: PlanarMesh) -> IntArray:
    """(F,) part of a face: faces that share edges, the largest part first."""
    sides = mesh.face.reshape(-1, 2)
    a, b = sides[(sides != OUTSIDE).all(axis=1)].T
    label = components(mesh.n_faces, np.column_stack([a, b]))
    area = np.bincount(label, weights=mesh.face_area)
    rank = np.empty(len(area), dtype=np.int64)
    rank[np.lexsort((np.arange(len(area)), -area))] = np.arange(len(area))
    return rank[label]


def _on_lines(mesh: PlanarMesh, lines: ObjectArray, snap: float) -> BoolArray:
    """(E,) edges that run along a line: both ends and three places between lie near it."""
    if len(lines) == 0:
        return np.zeros(mesh.n_edges, dtype=bool)
    a, b = (mesh.xy[mesh.origin[side::2]] for side in (0, 1))
    segments = shapely.linestrings(line_segments(lines)[0])
    near = [
        are_near(a + share * (b - a), segments, 2 * snap) for share in (0.0, 0.25, 0.5, 0.75, 1.0)
    ]
    return np.asarray(np.all(near, axis=0))


def _fit_issues(coverage: Coverage, parcels: ObjectArray) -> list[Issue]:
    """What snapping could not close: overlaps, gaps, parcels in pieces or gone."""
    small = SMALL_CHANGE * float(np.mean(shapely.area(parcels)))
    issues = [
        Issue(
            code=code,
            message=message.format(area=piece.area),
            value=float(piece.area),
            geometry=piece,
        )
        for code, message, pieces in (
            (
                "parcels_overlap",
                "Two parcels overlap by {area:.3g} m²: the first has it.",
                coverage.overlaps,
            ),
            (
                "hole_between_parcels",
                "{area:.3g} m² between parcels belong to none and are left out of the land.",
                coverage.gaps,
            ),
        )
        for piece in pieces
        if piece.area > small
    ]
    found, times = np.unique(coverage.source, return_counts=True)
    for given in np.setdiff1d(np.arange(len(parcels)), found).tolist():
        message = f"Nothing is left of the parcel in row {given + 1} after snapping."
        issues.append(Issue("parcel_lost", message, geometry=parcels[given]))
    for given in found[times > 1].tolist():
        message = f"The parcel in row {given + 1} is in several pieces, each now a parcel."
        issues.append(Issue("parcel_in_pieces", message, geometry=parcels[given]))
    return issues


def _stray_streets(layout: Layout, streets: ObjectArray, snap: float) -> list[Issue]:
    """Pieces of street that run along no parcel boundary."""
    if len(streets) == 0:
        return []
    mesh = layout.mesh
    edges = shapely.linestrings(mesh.xy[mesh.origin.reshape(-1, 2)[layout.edge_street]])
    total = float(shapely.length(streets).sum())
    step = max(LOOKED_AT_M, total / LOOKED_AT)
    xy = shapely.get_coordinates(shapely.segmentize(streets, step))
    stray = ~are_near(xy, edges, 4 * snap) if len(edges) else np.ones(len(xy), dtype=bool)
    length = total * float(stray.mean())
    if length <= step:
        return []
    return [
        Issue(
            code="street_off_boundaries",
            message=f"About {length:.0f} m of streets run along no parcel boundary and were left "
            "out: split the parcels that they cross.",
            value=length,
            geometry=shapely.Point(xy[stray][0]),
        )
    ]
