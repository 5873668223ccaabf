"""Polygons as people draw them, made valid: what can be repaired is, and said so."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.features import Features

REPAIR_TOLERANCE = 0.05
"""An invalid polygon is repaired while that changes its area by no more than this share;
beyond, as with a bow-tie, which side is land is not clear."""

LAND_NEEDED = (
    "A boundary must be a polygon; closed lines can be turned into polygons first (in QGIS: "
    "Lines to Polygons)."
)
"""What is needed where land is asked for."""

_MAX_NAMED = 5

ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True)
class Note:
    """What was changed, and where (in the source's coordinates)."""

    code: str
    message: str
    value: float | None = None
    place: shapely.Geometry | None = None


@dataclass(frozen=True)
class Cleaned:
    """The land: all polygons united.

    Parameters
    ----------
    land
        Valid polygon or multipolygon.
    input_parts
        (n,) polygons as given, without heights.
    notes
        What was changed.
    """

    land: shapely.Geometry
    input_parts: ObjectArray
    notes: tuple[Note, ...]


@dataclass
class _Report:
    problems: list[str] = field(default_factory=list)
    notes: list[Note] = field(default_factory=list)


def clean_polygons(features: Features[Any]) -> Cleaned:
    """Return the united, valid land of some features.

    Raises
    ------
    BoundaryError
        If there is no feature, no polygon, a coordinate that is not finite, no area, or a
        polygon whose repair would change its area by more than 5 %.
    """
    each = clean_each(features)
    land = _polygonal(shapely.union_all(each.valid))
    if land.is_empty or land.area <= 0:
        raise BoundaryError(f"{features.name}: its polygons have no area.")
    return Cleaned(land, each.given, each.notes)


@dataclass(frozen=True)
class CleanedEach:
    """Polygons one by one.

    Parameters
    ----------
    given, valid
        (n,) polygons as given, and valid polygons or multipolygons; these may be empty.
    row
        (n,) row of the feature that each comes from.
    notes
        What was changed.
    """

    given: ObjectArray
    valid: ObjectArray
    row: npt.NDArray[np.int64]
    notes: tuple[Note, ...]


def clean_each(features: Features[Any], *, need: str = LAND_NEEDED) -> CleanedEach:
    """Return the polygons of some features, each of them made valid.

    Parameters
    ----------
    features
        The features.
    need
        What is said where none is a polygon: what is needed, and how to come by it.

    Raises
    ------
    BoundaryError
        As `clean_polygons`, but for an area that is missing.
    """
    report = _Report()
    polygons, feature = _polygons_of(features, need, report)
    if not report.problems:
        _check_finite(polygons, feature, report)
    if report.problems:
        raise BoundaryError(report.problems)
    valid = _repaired(polygons, feature, report)
    if report.problems:
        raise BoundaryError(report.problems)
    return CleanedEach(polygons, valid, feature, tuple(report.notes))


def _polygons_of(
    features: Features[Any], need: str, report: _Report
) -> tuple[ObjectArray, npt.NDArray[np.int64]]:
    """Single polygons without heights, and the row of the feature each comes from."""
    geometry = features.geometry
    name = features.name
    no_polygons = np.empty(0, dtype=object), np.empty(0, dtype=np.int64)
    if len(geometry) == 0:
        report.problems.append(f"{name} has no features: check the layer and the filter (where).")
        return no_polygons
    blank = shapely.is_missing(geometry) | shapely.is_empty(geometry)
    if blank.all():
        report.problems.append(f"{name} has {len(geometry)} feature(s), but all without geometry.")
        return no_polygons
    rows = np.flatnonzero(~blank)
    pieces, index = _flat_parts(geometry[rows])
    is_polygon = shapely.get_type_id(pieces) == shapely.GeometryType.POLYGON
    if not is_polygon.any():
        report.problems.append(f"{name} holds {_counted(pieces)}, but no polygon. {need}")
        return no_polygons
    if blank.any():
        message = f"{int(blank.sum())} feature(s) without geometry were left out."
        report.notes.append(Note("empty_geometry", message, float(blank.sum())))
    if not is_polygon.all():
        message = f"{_counted(pieces[~is_polygon])} beside the polygons were left out."
        report.notes.append(Note("not_polygons", message, float((~is_polygon).sum())))
    return shapely.force_2d(pieces[is_polygon]), rows[index[is_polygon]]


def _flat_parts(geometry: ObjectArray) -> tuple[ObjectArray, npt.NDArray[np.int64]]:
    """Split collections down to single geometries."""
    index = np.arange(len(geometry))
    while True:
        parts, parent = shapely.get_parts(geometry, return_index=True)
        index = index[parent]
        if (shapely.get_type_id(parts) <= shapely.GeometryType.POLYGON).all():
            filled = ~shapely.is_empty(parts)
            return parts[filled], index[filled]
        geometry = parts


def _counted(geometries: ObjectArray) -> str:
    counts = Counter(g.geom_type for g in geometries)
    words = {"Point": "point", "LineString": "line", "LinearRing": "line"}
    return " and ".join(
        f"{n} {words.get(kind, kind.lower())}{'s' if n > 1 else ''}"
        for kind, n in sorted(counts.items())
    )


def _check_finite(polygons: ObjectArray, feature: npt.NDArray[np.int64], report: _Report) -> None:
    xy, owner = shapely.get_coordinates(polygons, return_index=True)
    bad = np.unique(feature[owner[~np.isfinite(xy).all(axis=1)]])
    if len(bad):
        named = ", ".join(str(i + 1) for i in bad[:_MAX_NAMED])
        more = f" and {len(bad) - _MAX_NAMED} more" if len(bad) > _MAX_NAMED else ""
        report.problems.append(
            f"Coordinates of feature {named}{more} are not finite (NaN or infinite): correct "
            "the data."
        )


def _repaired(
    polygons: ObjectArray, feature: npt.NDArray[np.int64], report: _Report
) -> ObjectArray:
    """Make polygons valid; overlapping rings count once, holes outside are dropped."""
    out = polygons.copy()
    for i in np.flatnonzero(~shapely.is_valid(polygons)):
        before = polygons[i].area  # by the shoelace formula, whatever the rings do
        out[i] = _valid(polygons[i])
        change = out[i].area - before
        reason = shapely.is_valid_reason(polygons[i])
        number = int(feature[i]) + 1
        if out[i].is_empty:
            continue  # an outline without area is no land; the union says if that was all
        if abs(change) > REPAIR_TOLERANCE * max(before, out[i].area):
            report.problems.append(
                f"The outline of feature {number} is invalid ({reason}), as in a bow-tie, and "
                f"repair would change its area from {before:.6g} to {out[i].area:.6g}: which "
                "side is land is not clear. Correct the outline there."
            )
            continue
        report.notes.append(
            Note(
                "ring_repaired",
                f"The outline of feature {number} was invalid ({reason}) and was repaired; its "
                f"area changed by {100 * change / max(before, out[i].area):+.2g} %.",
                float(change),
                out[i].point_on_surface(),
            )
        )
    return out


def _valid(polygon: shapely.Polygon) -> shapely.Geometry:
    """Repair the shell and the holes apart: a hole outside the shell must not become land."""
    rings = shapely.polygons(np.array([polygon.exterior, *polygon.interiors], dtype=object))
    valid = shapely.make_valid(rings, method="structure", keep_collapsed=False)
    return _polygonal(shapely.difference(valid[0], shapely.union_all(valid[1:])))


def _polygonal(geometry: shapely.Geometry) -> shapely.Geometry:
    """Keep the polygons of a geometry, as one polygon or multipolygon."""
    if geometry.geom_type in ("Polygon", "MultiPolygon"):
        return geometry
    parts = [p for p in shapely.get_parts(geometry) if p.geom_type.endswith("Polygon")]
    return shapely.union_all(parts)
