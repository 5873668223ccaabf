"""Features of the land to a `Site` in local metres."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from typing import TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.intake.given import GivenLayers
from urban_processing.intake.polygons import Cleaned, clean_polygons
from urban_processing.intake.projection import Projection
from urban_processing.intake.working import source_crs, working_crs
from urban_processing.mesh.build import canonical_rings
from urban_processing.site import GRID, FloatArray, Frame, Issue, Site, snap_to_grid

C = TypeVar("C")

MINIMUM_AREA = 1.0
"""Land below this many m² is a mistake, most often degrees taken for metres."""

SLIVER = 1e-4
"""Holes that a circle of this radius, relative to √area of the land, does not fit into are
gaps between badly matched polygons, not obstacles."""

SPECK = 1e-9
"""Parts below this share of the land are left over from repair, not land."""

CORNER_REACH = 0.1
"""Given corners may lie this far off the land's rim, relative to √area."""


def build_site(
    features: Features[C] | None,
    *,
    library: CrsLibrary[C],
    asked: C | None = None,
    corners: Features[C] | None = None,
    given: GivenLayers[C] | None = None,
    problems: Sequence[str] = (),
) -> Site:
    """Make land boundaries ready for the engine.

    All polygons are united (touching ones become one piece of land), repaired where they are
    invalid, brought into a projected, metric CRS that is true to area, and shifted to a
    whole-metre origin. What was changed is said in the site's issues.

    Parameters
    ----------
    features
        Polygons of the land; None where they could not be read, which is then a problem.
    library
        What knows the CRSs.
    asked
        Projected, metric CRS to work in; the CRS of features that have none.
    corners
        Points at the corners of a freeform land.
    given
        Streets, obstacles and other layers that constrain the layout.
    problems
        What is wrong already: raised with all else that is.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the input.
    """
    found = [*problems]
    if corners is not None:
        found += _corner_problems(corners)
    if given is not None:
        found += given.problems()
    if features is None:
        raise BoundaryError(found)
    issues: list[Issue] = []
    own = source_crs(features, asked, library, found, issues)
    cleaned = _cleaned(features, found)
    if found or cleaned is None:
        raise BoundaryError(found)
    working = working_crs(shapely.get_coordinates(cleaned.land), own, asked, library, issues)
    projection = Projection(own, working, library)
    land, origin = _to_local(cleaned.land, projection)
    parts = _sorted_parts(_without_slivers(land, issues))
    frame = Frame("" if working is None else library.text(working), origin)
    site = Site(
        parts=parts,
        frame=frame,
        corners=_local_corners(corners, projection, origin, parts),
        input_parts=_input_parts(cleaned.input_parts, projection, origin),
        issues=(*issues, *_repair_issues(cleaned, projection, origin)),
        input_sha256=_digest(cleaned.input_parts, "" if own is None else library.text(own)),
    )
    _check_size(site)
    return site if given is None else given.put_into(site, projection)


def _cleaned(features: Features[C], problems: list[str]) -> Cleaned | None:
    try:
        return clean_polygons(features)
    except BoundaryError as error:
        problems += error.problems
        return None


def _to_local(
    land: shapely.Geometry, projection: Projection[C]
) -> tuple[shapely.Geometry, tuple[float, float]]:
    """Project the land, shift it to a whole-metre origin and put it on the grid."""
    mapped = projection.geometry(land)
    if not np.isfinite(shapely.get_coordinates(mapped)).all():
        raise BoundaryError(
            "Some coordinates of the boundary have no place in the CRS asked for: choose one "
            "that covers the land, or leave crs (--crs) out."
        )
    min_x, min_y = shapely.bounds(mapped)[:2]
    origin = float(np.floor(min_x)), float(np.floor(min_y))
    local = shapely.transform(mapped, lambda xy: xy - origin)
    # projecting can make edges cross by a hair, and bring together what lay on both sides
    # of the 180th meridian
    united = shapely.union_all(shapely.get_parts(shapely.make_valid(local)))
    return shapely.set_precision(united, GRID), origin


def _without_slivers(land: shapely.Geometry, issues: list[Issue]) -> list[shapely.Polygon]:
    """Drop specks and fill sliver holes, and say so."""
    polygons = [p for p in shapely.get_parts(land) if p.geom_type == "Polygon" and p.area > 0]
    total = sum(p.area for p in polygons)
    specks = [p for p in polygons if p.area < SPECK * total]
    if specks:
        message = f"{len(specks)} speck(s) left over from repair were dropped."
        issues.append(Issue("specks_dropped", message, value=sum(p.area for p in specks)))
    radius = SLIVER * total**0.5
    kept, filled = [], []
    for polygon in (p for p in polygons if p.area >= SPECK * total):
        holes = [shapely.Polygon(ring) for ring in polygon.interiors]
        slivers = [h for h in holes if shapely.buffer(h, -radius).is_empty]
        filled += slivers
        kept.append(shapely.union_all([polygon, *slivers]) if slivers else polygon)
    if filled:
        area = sum(h.area for h in filled)
        issues.append(
            Issue(
                "gaps_filled",
                f"{len(filled)} gap(s) between polygons, narrower than {2 * radius:.2g} m, were "
                f"filled ({area:.3g} m²).",
                value=area,
                geometry=shapely.MultiPolygon(filled) if len(filled) > 1 else filled[0],
            )
        )
    return kept


def _sorted_parts(polygons: list[shapely.Polygon]) -> tuple[shapely.Polygon, ...]:
    """Largest first, ties by coordinates; canonical start of every ring."""
    canonical = [
        shapely.transform(p, snap_to_grid)
        for p in canonical_rings(np.array(polygons, dtype=object))
    ]
    return tuple(sorted(canonical, key=lambda p: (-p.area, p.bounds, p.wkb)))


def _input_parts(
    polygons: npt.NDArray[np.object_], projection: Projection[C], origin: tuple[float, float]
) -> tuple[shapely.Polygon, ...]:
    if projection.is_identity:
        return tuple(shapely.transform(p, lambda xy: xy - origin) for p in polygons)
    return tuple(
        shapely.transform(projection.geometry(p), lambda xy: snap_to_grid(xy - origin))
        for p in polygons
    )


def _repair_issues(
    cleaned: Cleaned, projection: Projection[C], origin: tuple[float, float]
) -> list[Issue]:
    return [
        Issue(
            code=note.code,
            message=note.message,
            value=note.value,
            geometry=None
            if note.place is None
            else shapely.transform(note.place, lambda xy: projection.points(xy) - origin),
        )
        for note in cleaned.notes
    ]


def _check_size(site: Site) -> None:
    if site.area < MINIMUM_AREA:
        raise BoundaryError(
            f"The land has an area of only {site.area:.3g} m². If its coordinates are degrees, "
            "give their CRS: crs='EPSG:4326' (--crs EPSG:4326)."
        )


def _digest(polygons: npt.NDArray[np.object_], crs: str) -> str:
    """Hash of the polygons as given, whatever their order, and of their CRS."""
    wkb = sorted(shapely.to_wkb(shapely.normalize(polygons), byte_order=1))
    return hashlib.sha256(b"".join([*wkb, crs.encode()])).hexdigest()


def _corner_problems(corners: Features[C]) -> list[str]:
    usable = corners.geometry[corners.present()]
    if not len(usable) or {g.geom_type for g in usable} - {"Point", "MultiPoint"}:
        return ["Corners must be points; give a point layer or an array (k, 2)."]
    if not np.isfinite(shapely.get_coordinates(usable)).all():
        return ["Corners: a coordinate is not finite."]
    return []


def _local_corners(
    features: Features[C] | None,
    projection: Projection[C],
    origin: tuple[float, float],
    parts: tuple[shapely.Polygon, ...],
) -> FloatArray:
    """Corners in local coordinates, checked to lie near the rim."""
    if features is None:
        return np.empty((0, 2))
    xy = shapely.get_coordinates(features.geometry[features.present()])
    local = snap_to_grid(projection.of(features).points(xy) - origin)
    rim = shapely.union_all([p.exterior for p in parts])
    distance = shapely.distance(shapely.points(local), rim)
    reach = CORNER_REACH * sum(p.area for p in parts) ** 0.5
    far = np.flatnonzero(~(distance <= reach))
    if len(far):
        raise BoundaryError(
            f"Corner {i + 1} lies {distance[i]:.3g} m from the rim of the land; corners must lie "
            f"on it, or within {reach:.3g} m. Check their CRS."
            for i in far
        )
    return local
