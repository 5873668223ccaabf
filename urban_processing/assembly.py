"""Layouts from parcels and streets that need not fit exactly, such as hand edits leave them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.land import land_corners
from urban_processing.layout import NOT_FIXED, EdgeKind, Layout, layout_from_mesh
from urban_processing.mesh.build import canonical_rings, mesh_from_polygons
from urban_processing.mesh.components import components
from urban_processing.mesh.coverage import Coverage, fit_together
from urban_processing.mesh.places import are_near, line_segments
from urban_processing.mesh.planar import OUTSIDE, BoolArray, IntArray, PlanarMesh
from urban_processing.site import Frame, Issue

ObjectArray = npt.NDArray[np.object_]

SMALL_CHANGE = 1e-6
"""Overlaps and gaps below this share of the mean parcel are left over from rounding."""

LOOKED_AT_M, LOOKED_AT = 1.0, 200_000
"""Streets are checked every metre, at no more places than these."""

DRAWN_LEVEL = 1
"""Level of streets that somebody drew."""


def assemble_layout(
    parcels: ObjectArray,
    streets: ObjectArray,
    *,
    frame: Frame,
    snap: float,
    min_area: float | None = None,
    locked: BoolArray | None = None,
    fixed: IntArray | None = None,
    obstacles: Sequence[shapely.Polygon] = (),
) -> Layout:
    """Make a layout from parcels and street lines in local metres.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along. What that changed, and what does not fit, is said in the issues.

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
    min_area
        The smallest parcel allowed, m²; by default the smallest there is.
    locked
        (n,) parcels that stay as they are.
    fixed
        (m,) entry of `Layout.fixed_streets` that a line is, -1 for others.
    obstacles
        What is no land; edges on them are their rims.

    Raises
    ------
    BoundaryError
        If nothing is left of the parcels.
    """
    ends = [shapely.get_coordinates(line)[[0, -1]] for line in streets]
    places = np.concatenate(ends) if ends else None
    coverage = fit_together(parcels, snap, places=places)
    if len(coverage.polygons) == 0:
        raise BoundaryError("No parcel is left after snapping: check their size and CRS.")
    mesh = mesh_from_polygons(list(canonical_rings(coverage.polygons)))
    layout = layout_from_mesh(
        mesh,
        frame=frame,
        face_part=_parts(mesh),
        min_area=float(mesh.face_area.min()) if min_area is None else min_area,
        vertex_corner=land_corners(mesh),
        rim_is_street=False,
        obstacles=obstacles,
    )
    street = _on_lines(mesh, streets, snap)
    drawn = np.where(layout.edge_kind == EdgeKind.INTERIOR, DRAWN_LEVEL, 0)
    layout = layout.replace(
        edge_street=street,
        edge_level=np.where(street, drawn, -1).astype(np.int16),
        edge_fixed=np.where(street, _fixed(mesh, streets, fixed, snap), NOT_FIXED),
    )
    if locked is not None:
        layout = layout.replace(face_locked=locked[coverage.source])
    issues = [*_fit_issues(coverage, parcels), *_stray_streets(layout, streets, snap)]
    return layout.replace(issues=tuple(issues))


def _fixed(mesh: PlanarMesh, streets: ObjectArray, fixed: IntArray | None, snap: float) -> IntArray:
    """(E,) entry of the given street that an edge runs along, `NOT_FIXED` for none."""
    out = np.full(mesh.n_edges, NOT_FIXED)
    given = np.empty(0, dtype=np.int64) if fixed is None else fixed
    for entry in np.unique(given[given != NOT_FIXED]).tolist():
        out[_on_lines(mesh, streets[given == entry], snap)] = entry
    return out


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
