"""A layout from layers of parcels and streets, such as people have edited by hand."""

from __future__ import annotations

from typing import TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.assembly import assemble_layout, kept_of
from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.intake.polygons import clean_each
from urban_processing.intake.projection import Projection
from urban_processing.intake.working import working_crs
from urban_processing.layer_rows import parcel_rows, street_rows
from urban_processing.layout import Layout
from urban_processing.site import Frame, Issue, snap_to_grid

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]
IntArray = npt.NDArray[np.int64]


def build_layout(
    parcels: Features[C],
    streets: Features[C],
    *,
    library: CrsLibrary[C],
    snap: float,
    min_area: float | None = None,
    before: Layout | None = None,
) -> Layout:
    """Make a layout from layers of parcels and streets that need not fit exactly.

    Parcels are snapped to each other and noded, streets are laid on the parcel boundaries
    that they run along. What that changed, and what does not fit, is said in the issues.
    Columns of the layers that a layout file has, too, count where no geometry tells the same:
    `PARCEL_COLUMNS` and `STREET_COLUMNS` of `urban_processing.layer_rows`.

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
    min_area
        The smallest parcel allowed, m²; by default the smallest there is.
    before
        The layout that the layers are edited from: they are brought into its CRS, and what they
        do not say is as it was.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the layers.
    """
    asked = None if before is None or not before.frame.crs else before.frame.crs
    polygons, of_parcel, projection, issues = _projected_parcels(parcels, library, asked)
    lines, of_street = _projected_lines(streets, projection)
    frame = _frame(polygons, projection) if before is None else before.frame
    kept = None if before is None else kept_of(before)
    said = parcel_rows(parcels.columns, len(parcels.geometry))
    n_given = 0 if kept is None else len(kept.fixed_streets)
    of_streets = street_rows(streets.columns, len(streets.geometry), n_given=n_given)
    layout = assemble_layout(
        shapely.transform(polygons, lambda xy: snap_to_grid(xy - frame.origin)),
        shapely.transform(lines, lambda xy: xy - frame.origin),
        frame=frame,
        snap=snap,
        kept=kept,
        min_area=min_area,
        rows=(said.taken(of_parcel), of_streets.taken(of_street)),
    )
    return layout.replace(issues=(*issues, *layout.issues))


def _frame(polygons: ObjectArray, projection: Projection[C]) -> Frame:
    """A frame whose origin is at the lower left of some polygons."""
    low = shapely.bounds(shapely.GeometryCollection(list(polygons)))[:2]
    crs = "" if projection.target is None else projection.library.text(projection.target)
    return Frame(crs, (float(np.floor(low[0])), float(np.floor(low[1]))))


def _projected_parcels(
    parcels: Features[C], library: CrsLibrary[C], asked: str | None
) -> tuple[ObjectArray, IntArray, Projection[C], list[Issue]]:
    """Parcels in a metric CRS, the row of each, the projection there, and what changed."""
    own = parcels.crs
    if own is None and not parcels.bare:
        raise BoundaryError(f"{parcels.name} has no CRS: assign it in the data.")
    cleaned = clean_each(parcels)
    polygons, piece = shapely.get_parts(cleaned.valid, return_index=True)
    some = shapely.area(polygons) > 0
    polygons, row = polygons[some], cleaned.row[piece[some]]
    if len(polygons) == 0:
        raise BoundaryError(f"{parcels.name}: its polygons have no area.")
    issues = [Issue(note.code, note.message, value=note.value) for note in cleaned.notes]
    if asked is not None:
        target: C | None = library.from_text(asked)
        own = target if own is None else own
    else:
        xy = shapely.get_coordinates(polygons)
        target = working_crs(xy, own, None, library, issues, what="The parcels are")
    projection = Projection(own, target, library)
    mapped = np.array([projection.geometry(polygon) for polygon in polygons], dtype=object)
    return mapped, row, projection, issues


def _projected_lines(
    streets: Features[C], projection: Projection[C]
) -> tuple[ObjectArray, IntArray]:
    """Lines of streets in the CRS of the parcels, and the row of each."""
    rows = np.array(streets.present(), dtype=np.int64)
    present = streets.geometry[rows]
    kinds = {g.geom_type for g in present} - {"LineString", "MultiLineString", "LinearRing"}
    if kinds:
        raise BoundaryError(
            f"Streets must be lines; {streets.name} has {', '.join(sorted(kinds))}."
        )
    own = projection.of(streets)
    mapped = np.array([own.geometry(g) for g in present], dtype=object)
    lines, piece = shapely.get_parts(mapped, return_index=True)
    if not np.isfinite(shapely.get_coordinates(lines)).all():
        raise BoundaryError(
            f"Some coordinates of {streets.name} have no place in the CRS of the parcels: check "
            "the CRS of both."
        )
    return np.asarray(lines, dtype=object), rows[piece]
