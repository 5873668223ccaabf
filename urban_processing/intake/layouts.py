"""A layout from layers of parcels and streets, such as people have edited by hand."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.assembly import assemble_layout
from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.intake.polygons import clean_each
from urban_processing.intake.projection import Projection
from urban_processing.intake.working import working_crs
from urban_processing.layout import Layout
from urban_processing.site import Frame, Issue, snap_to_grid

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]


def build_layout(
    parcels: Features[C],
    streets: Features[C],
    *,
    library: CrsLibrary[C],
    snap: float,
) -> Layout:
    """Make a layout from layers of parcels and streets that need not fit exactly.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along. What that changed, and what does not fit, is said in the issues.

    Parameters
    ----------
    parcels
        Polygons.
    streets
        Lines, in any CRS; the rim is street where a line runs along it.
    library
        What knows the CRSs.
    snap
        Metres within which things fit.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    polygons, projection, issues = _projected_parcels(parcels, library)
    lines = _projected_lines(streets, projection)
    low = shapely.bounds(shapely.GeometryCollection(list(polygons)))[:2]
    origin = float(np.floor(low[0])), float(np.floor(low[1]))
    crs = "" if projection.target is None else library.text(projection.target)
    layout = assemble_layout(
        shapely.transform(polygons, lambda xy: snap_to_grid(xy - origin)),
        shapely.transform(lines, lambda xy: xy - origin),
        frame=Frame(crs, origin),
        snap=snap,
    )
    return layout.replace(issues=(*issues, *layout.issues))


def _projected_parcels(
    parcels: Features[C], library: CrsLibrary[C]
) -> tuple[ObjectArray, Projection[C], list[Issue]]:
    """Parcels in a metric CRS, the projection there, and what changed."""
    own = parcels.crs
    if own is None and not parcels.bare:
        raise BoundaryError(f"{parcels.name} has no CRS: assign it in the data.")
    cleaned = clean_each(parcels)
    polygons = np.array([p for p in shapely.get_parts(cleaned.valid) if p.area > 0], dtype=object)
    if len(polygons) == 0:
        raise BoundaryError(f"{parcels.name}: its polygons have no area.")
    issues = [Issue(note.code, note.message, value=note.value) for note in cleaned.notes]
    target = working_crs(
        shapely.get_coordinates(polygons), own, None, library, issues, what="The parcels are"
    )
    projection = Projection(own, target, library)
    mapped = np.array([projection.geometry(polygon) for polygon in polygons], dtype=object)
    return mapped, projection, issues


def _projected_lines(streets: Features[C], projection: Projection[C]) -> ObjectArray:
    present = [g for g in streets.geometry if g is not None and not g.is_empty]
    kinds = {g.geom_type for g in present} - {"LineString", "MultiLineString", "LinearRing"}
    if kinds:
        raise BoundaryError(
            f"Streets must be lines; {streets.name} has {', '.join(sorted(kinds))}."
        )
    own = projection.of(streets)
    lines = shapely.get_parts(np.array([own.geometry(g) for g in present], dtype=object))
    if not np.isfinite(shapely.get_coordinates(lines)).all():
        raise BoundaryError(
            f"Some coordinates of {streets.name} have no place in the CRS of the parcels: check "
            "the CRS of both."
        )
    return np.asarray(lines, dtype=object)
