"""The certificate: what every layout promises, checked on its output geometry alone."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from urban_processing.access_rule import reached_frontage
from urban_processing.layout import Layout
from urban_processing.mesh.overlap import (
    Segments,
    covered_share,
    find_overlaps,
    segments_of,
    unmatched_segments,
)
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.touches import joined_at_touches
from urban_processing.metrics.tables import (
    boundary_table,
    net_parcel_table,
    right_of_way_table,
    street_table,
)
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.site import AREA_ROUNDING, GRID
from urban_processing.tables import Table, issue_table

PARTITION_LIMIT = 1e-8
"""Largest symmetric difference of parcels and land, as a share of the land's area."""

SNAP_M = 1e-6
"""Coordinates closer than this, in metres, are the same place."""


@dataclass(frozen=True)
class Check:
    """One promise: `value` is held against `limit`; `offenders` are parcel numbers."""

    name: str
    holds: bool
    value: float
    limit: float
    message: str
    offenders: tuple[int, ...] = ()


@dataclass(frozen=True)
class Certificate:
    """All checks of a layout."""

    checks: tuple[Check, ...]

    @property
    def holds(self) -> bool:
        """Whether every check holds."""
        return all(check.holds for check in self.checks)

    @property
    def failures(self) -> tuple[Check, ...]:
        """The checks that do not hold."""
        return tuple(check for check in self.checks if not check.holds)

    def check(self, name: str) -> Check:
        """Return the check called `name`; `KeyError` if there is none."""
        for check in self.checks:
            if check.name == name:
                return check
        raise KeyError(f"The certificate has no check {name}.")


def certificate(layout: Layout, *, land: Sequence[shapely.Polygon] | None = None) -> Certificate:
    """Certify a layout by its tables.

    Parameters
    ----------
    layout
        The layout.
    land
        Polygon of each part in local coordinates, such as ``site.parts`` after
        simplification; by default the rims of the layout itself.
    """
    # the geometries of `parcel_table`, without its measures, which nobody asks for here
    parcels = Table(
        {
            "parcel_id": np.arange(1, layout.mesh.n_faces + 1),
            "part": layout.face_part,
            "locked": layout.face_locked,
        },
        layout.mesh.face_polygons(layout.frame.origin),
    )
    boundary = boundary_table(layout)
    streets = lay_out_rights_of_way(layout) if layout.street_rules.laid_out else None
    if land is not None:
        origin = np.asarray(layout.frame.origin)
        moved = shapely.transform(np.array(land, dtype=object), lambda xy: xy + origin)
        boundary = Table({"part": np.arange(len(land)), "area_m2": shapely.area(moved)}, moved)
    return certify(
        parcels,
        street_table(layout),
        boundary,
        min_area=layout.min_area,
        issues=issue_table(layout.issues, layout.frame),
        right_of_way=None if streets is None else right_of_way_table(layout, streets),
        net_parcels=None if streets is None else net_parcel_table(layout, streets),
        net_min_area=layout.street_rules.net_min_area,
    )


def certify(
    parcels: Table,
    streets: Table,
    boundary: Table,
    *,
    min_area: float,
    issues: Table | None = None,
    right_of_way: Table | None = None,
    net_parcels: Table | None = None,
    net_min_area: bool = False,
) -> Certificate:
    """Certify a layout by its layers, as they are in a file.

    Nothing but the geometries, `parcel_id` and `part` is relied on, and `locked` and `fixed_id`
    for what the user gave: areas, frontages and connections are worked out anew.

    Parameters
    ----------
    parcels, streets, boundary
        Layers of the schema with geometry, all in one projected, metric CRS.
    min_area
        The smallest parcel allowed, m².
    issues
        The `issues` layer. Where it is given, a parcel smaller than `min_area`, allowed if it
        is a whole part or a block that nothing but given streets, locked land and the land's
        boundary enclose, must be listed there; so must a part of one parcel without a street.
    right_of_way, net_parcels
        These layers, where rights-of-way are laid out.
    net_min_area
        Whether `min_area` is a promise about net parcels.

    Returns
    -------
    Certificate
        Checks `valid_polygons`, `coverage`, `land_covered`, `reached`, `streets_on_boundaries`,
        `streets_connected` and `min_area`, and with rights-of-way `right_of_way`: it and the
        net parcels are the land, without gaps and overlaps.
    """
    ids = np.asarray(parcels["parcel_id"], dtype=np.int64)
    part = np.asarray(parcels["part"], dtype=np.int64)
    polygons, lines, land = _shift_to_origin(_geometry(parcels), streets, boundary)
    usable = _usable(polygons)
    land_part = np.asarray(boundary["part"], dtype=np.int64)
    street_part = np.asarray(streets["part"], dtype=np.int64)
    excused = _alone(part) & ~np.isin(part, street_part) & _listed(ids, issues)
    coverage = _coverage(ids[usable], polygons[usable])
    # uniting a valid coverage is faster, and only right, where its boundaries match
    unite = shapely.coverage_union_all if coverage.holds else shapely.union_all
    area = shapely.area(polygons)
    if net_min_area and net_parcels is not None:
        area = _net_areas(ids, net_parcels)
    bounds = _bounds(parcels, streets, lines, land)
    checks = (
        _valid(ids, usable),
        coverage,
        _land_covered(polygons[usable], part[usable], land, land_part, unite),
        *_street_checks(ids, polygons, lines, usable, excused),
        _connected(lines, street_part, np.setdiff1d(land_part, part[excused]), ids, part),
        _large_enough(ids, part, polygons, area, min_area, issues, bounds),
    )
    if right_of_way is None or net_parcels is None:
        return Certificate(checks)
    return Certificate((*checks, _right_of_way(right_of_way, net_parcels, boundary)))


def _geometry(table: Table) -> npt.NDArray[np.object_]:
    if table.geometry is None:
        raise ValueError("A layer without geometry cannot be certified.")
    return table.geometry


def _shift_to_origin(
    polygons: npt.NDArray[np.object_], streets: Table, boundary: Table
) -> tuple[npt.NDArray[np.object_], npt.NDArray[np.object_], npt.NDArray[np.object_]]:
    """Move everything near the origin by whole metres: far-off coordinates lose digits."""
    land = _geometry(boundary)
    low = np.floor(np.nan_to_num(shapely.total_bounds(land))[:2])
    moved = [
        np.asarray(shapely.transform(g, lambda xy: xy - low))
        for g in (polygons, _geometry(streets), land)
    ]
    return moved[0], moved[1], moved[2]


def _usable(polygons: npt.NDArray[np.object_]) -> BoolArray:
    is_polygon = shapely.get_type_id(polygons) == shapely.GeometryType.POLYGON
    return np.asarray(is_polygon & shapely.is_valid(polygons) & ~shapely.is_empty(polygons))


def _valid(ids: IntArray, usable: BoolArray) -> Check:
    bad = ids[~usable]
    return _check("valid_polygons", len(bad), 0, "parcels that are no valid polygon", bad)


def _coverage(ids: IntArray, polygons: npt.NDArray[np.object_]) -> Check:
    """Neighbours share their boundaries vertex by vertex; overlaps break this."""
    edges = shapely.coverage_invalid_edges(joined_at_touches(polygons))
    bad = ids[~shapely.is_empty(edges)]
    return _check(
        "coverage", len(bad), 0, "parcels that overlap others or do not match their boundaries", bad
    )


def _land_covered(
    polygons: npt.NDArray[np.object_],
    part: IntArray,
    land: npt.NDArray[np.object_],
    land_part: IntArray,
    unite: Callable[[npt.NDArray[np.object_]], shapely.Geometry],
) -> Check:
    """Gaps and overhangs, and overlaps, which the union alone would hide."""
    difference = 0.0
    for p in np.union1d(part, land_part).tolist():
        own = polygons[part == p]
        union = unite(own)
        whole = shapely.union_all(land[land_part == p])
        difference += shapely.area(shapely.symmetric_difference(union, whole))
        difference += abs(float(shapely.area(own).sum()) - shapely.area(union))
    share = difference / max(float(shapely.area(land).sum()), np.finfo(float).tiny)
    return _check(
        "land_covered",
        share,
        PARTITION_LIMIT,
        "of the land's area in gaps, overlaps and overhangs of the parcels",
        np.empty(0, dtype=np.int64),
    )


def _net_areas(ids: IntArray, net_parcels: Table) -> FloatArray:
    """(F,) net area of each parcel, 0 where it has no net parcel."""
    of = {int(i): k for k, i in enumerate(ids.tolist())}
    out = np.zeros(len(ids))
    area = shapely.area(_geometry(net_parcels)).tolist()
    for parcel, value in zip(net_parcels["parcel_id"].tolist(), area, strict=True):
        out[of[parcel]] += value
    return out


def _right_of_way(right_of_way: Table, net_parcels: Table, boundary: Table) -> Check:
    """Right-of-way and net parcels are the land: valid, fitting together, without gaps.

    What is left of their outlines where those that run in opposite directions cancel each
    other has to be the outline of the land: then they cover each place of it once.
    """
    streets, net, land = _shift_to_origin(_geometry(right_of_way), net_parcels, boundary)
    polygons = np.concatenate([streets, net])
    usable = _usable(polygons)
    left, rim = unmatched_segments(polygons[usable]), segments_of(land)
    on_rim = covered_share(find_overlaps(left, rim, SNAP_M), len(left.line))
    off = (1.0 - on_rim) * left.length > 2.0 * SNAP_M
    bad = np.unique(np.append(np.flatnonzero(~usable), np.flatnonzero(usable)[left.line[off]]))
    whole = float(shapely.area(land).sum())
    missing = abs(float(shapely.area(polygons[usable]).sum()) - whole) / whole
    # where it meets a rim that is no street, right-of-way has a corner on the grid, not on it
    limit = PARTITION_LIMIT + GRID * float(rim.length.sum()) / whole
    numbers = np.append(np.zeros(len(streets), dtype=np.int64), net_parcels["parcel_id"])
    return Check(
        "right_of_way",
        not len(bad) and missing <= limit,
        missing,
        limit,
        f"{len(bad)} surfaces of right-of-way and net parcels are invalid or do not fit together; "
        f"their area differs from the land's by {missing:g} of it.",
        tuple(numbers[bad[bad >= len(streets)]].tolist()),
    )


def _street_checks(
    ids: IntArray,
    polygons: npt.NDArray[np.object_],
    lines: npt.NDArray[np.object_],
    usable: BoolArray,
    excused: BoolArray,
) -> tuple[Check, Check]:
    """Frontage of each parcel, and street length that lies on no parcel's boundary."""
    outlines = polygons.copy()
    outlines[~usable] = None
    street, outline = segments_of(lines), segments_of(outlines)
    overlaps = find_overlaps(street, outline, SNAP_M)
    length = (overlaps.high - overlaps.low) * street.length[overlaps.first]
    owner = outline.line[overlaps.second]
    frontage = np.bincount(owner, weights=length, minlength=len(ids))
    area = np.where(usable, shapely.area(polygons), 0.0)
    # overlaps are measured to the micrometre, as coordinates are kept
    bad = ids[~usable | ((frontage < reached_frontage(area) - SNAP_M) & ~excused)]
    off = float(((1.0 - covered_share(overlaps, len(street.line))) * street.length).sum())
    rounding = SNAP_M * (1 + len(street.line))
    return (
        _check("reached", len(bad), 0, "parcels that no street reaches", bad),
        _check(
            "streets_on_boundaries",
            off,
            rounding,
            "metres of street that run along no parcel's boundary",
            np.empty(0, dtype=np.int64),
        ),
    )


def _connected(
    lines: npt.NDArray[np.object_],
    street_part: IntArray,
    land_part: IntArray,
    ids: IntArray,
    part: IntArray,
) -> Check:
    """Exactly one component of streets in each part; lines connect at shared vertices."""
    segments = segments_of(lines)
    ends = np.round(np.concatenate([segments.start, segments.end]) / SNAP_M)
    _, node = np.unique(ends, axis=0, return_inverse=True)
    node = node.reshape(2, -1)
    n = int(node.max(initial=-1)) + 1
    graph = coo_array((np.ones(node.shape[1], dtype=np.int8), (node[0], node[1])), shape=(n, n))
    label = connected_components(graph, directed=False)[1] if n else np.empty(0, dtype=np.int64)
    wrong = []
    most = 1
    for p in np.union1d(land_part, street_part).tolist():
        found = len(np.unique(label[node[0][street_part[segments.line] == p]]))
        if found != 1:
            wrong.append(p)
            most = max(most, found) if found else 0
    return Check(
        "streets_connected",
        not wrong,
        float(most),
        1.0,
        "Each part has one connected street network."
        if not wrong
        else f"Parts {wrong} have no street network, or one in several pieces (at most {most}).",
        tuple(ids[np.isin(part, wrong)].tolist()),
    )


def _alone(part: IntArray) -> BoolArray:
    """Which parcels are a whole part of the land each."""
    _, inverse, count = np.unique(part, return_inverse=True, return_counts=True)
    return np.asarray(count[inverse] == 1)


def _listed(ids: IntArray, issues: Table | None) -> BoolArray:
    """Which parcels the issues speak of; all where the issues are not known."""
    if issues is None:
        return np.ones(len(ids), dtype=bool)
    return np.isin(ids, issues["parcel_id"])


@dataclass(frozen=True, eq=False)
class _Bounds:
    """What no cut may move: (F,) locked parcels, given streets, and the land."""

    locked: BoolArray
    streets: npt.NDArray[np.object_]
    land: npt.NDArray[np.object_]


def _bounds(
    parcels: Table,
    streets: Table,
    lines: npt.NDArray[np.object_],
    land: npt.NDArray[np.object_],
) -> _Bounds:
    locked = np.asarray(parcels.columns.get("locked", np.zeros(len(parcels))), dtype=bool)
    given = np.asarray(streets.columns.get("fixed_id", np.full(len(streets), np.nan)))
    return _Bounds(locked, lines[~np.isnan(given)], land)


def _large_enough(
    ids: IntArray,
    part: IntArray,
    polygons: npt.NDArray[np.object_],
    area: FloatArray,
    min_area: float,
    issues: Table | None,
    bounds: _Bounds,
) -> Check:
    """No parcel under `min_area` but locked ones and those that nothing can make larger."""
    area = np.nan_to_num(area)
    small = area < min_area * (1.0 - AREA_ROUNDING)
    excused = _alone(part) | _enclosed(polygons, small & ~bounds.locked, bounds)
    excused = (excused & _listed(ids, issues)) | bounds.locked
    bad = small & ~excused
    return Check(
        "min_area",
        not bad.any(),
        float(area.min(initial=np.inf, where=~(small & excused))),
        min_area,
        f"{int(bad.sum())} parcels are smaller than {min_area:g} m².",
        tuple(ids[bad].tolist()),
    )


def _enclosed(polygons: npt.NDArray[np.object_], chosen: BoolArray, bounds: _Bounds) -> BoolArray:
    """Which chosen parcels have all of their outline on bounds, some of it on what was given."""
    out = np.zeros(len(polygons), dtype=bool)
    rows = np.flatnonzero(chosen)
    if not len(rows):
        return out
    outline = segments_of(polygons[rows])
    given = np.concatenate([bounds.streets, polygons[bounds.locked]])
    on_given = _length_on(outline, given, len(rows))
    on_any = _length_on(outline, np.concatenate([given, bounds.land]), len(rows))
    whole = np.bincount(outline.line, weights=outline.length, minlength=len(rows))
    rounding = SNAP_M * (1 + np.bincount(outline.line, minlength=len(rows)))
    out[rows] = (on_any >= whole - rounding) & (on_given > rounding)
    return out


def _length_on(outline: Segments, lines: npt.NDArray[np.object_], n: int) -> FloatArray:
    """(n,) length of each outline that lies on some lines."""
    share = covered_share(find_overlaps(outline, segments_of(lines), SNAP_M), len(outline.line))
    length = share * outline.length
    return np.asarray(np.bincount(outline.line, weights=length, minlength=n), dtype=np.float64)


def _check(name: str, value: float, limit: float, what: str, bad: IntArray) -> Check:
    return Check(
        name, value <= limit, float(value), float(limit), f"{value:g} {what}.", tuple(bad.tolist())
    )
