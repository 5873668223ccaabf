"""The polygons that a layout begins with: the land, divided by given streets and locked land."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.constraints.leads import lead_on
from urban_processing.constraints.lines import ready_streets
from urban_processing.constraints.linework import node_lines
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import GRID, Issue, Site, snap_to_grid


@dataclass(frozen=True, eq=False)
class Ground:
    """Polygons that tile the land, and the pieces of given streets on their boundaries.

    Parameters
    ----------
    polygons
        Valid polygons that share their vertices exactly, by part.
    part
        (F,) part of the land that each is in.
    locked
        (F,) entry of the site's locked land that each is, -1 for others.
    segments, segment_street
        (S, 2, 2) ends of edges on given streets, and (S,) the street.
    issues
        What was changed.
    """

    polygons: tuple[shapely.Polygon, ...]
    part: IntArray
    locked: IntArray
    segments: FloatArray
    segment_street: IntArray
    issues: tuple[Issue, ...] = ()


def divide_land(site: Site, *, min_area: float, snap: float) -> Ground:
    """Divide the land by its given streets and locked land; obstacles are off it already.

    Streets are cut at the land and at locked land, noded, joined to each other and to the rim
    within `snap` metres, and prolonged by lines that are no streets where they end inside a
    face, if no piece falls below `min_area`.
    """
    locked, locked_issues = _locked_on(site, snap)
    n = len(site.parts)
    if not site.fixed_streets and not locked:
        none = np.full(n, -1)
        empty = np.empty((0, 2, 2)), np.empty(0, dtype=np.int64)
        return Ground(site.parts, np.arange(n), none, *empty, tuple(locked_issues))
    land = shapely.union_all(list(site.parts))
    closed_polygons = [q for p in locked.values() for q in p]
    closed = shapely.union_all(closed_polygons)
    ground = shapely.difference(land, closed, grid_size=GRID)
    pieces, issues = ready_streets(site.fixed_streets, ground, snap=snap)
    outer = [part.exterior for part in site.parts]
    inner = [ring for part in site.parts for ring in part.interiors]
    inner += list(shapely.get_rings(closed_polygons))
    work = node_lines(outer, inner, pieces)
    work.clip(ground)
    holes = sum(shapely.Polygon(ring).area for ring in inner)
    lead_on(work, min_area=min_area, snap=snap, holes=holes)
    polygons, part, which = _faces(list(work.polygons()), site.parts, locked)
    segments, street = work.segments()
    on = street >= 0
    return Ground(
        tuple(polygons),
        part,
        which,
        segments[on],
        street[on],
        (*locked_issues, *issues, *work.issues),
    )


def _locked_on(site: Site, snap: float) -> tuple[dict[int, list[shapely.Polygon]], list[Issue]]:
    """Locked land within the land, by its number; what lies outside is cut off."""
    if not site.locked:
        return {}, []
    land = shapely.union_all(list(site.parts))
    rim = land.boundary
    out: dict[int, list[shapely.Polygon]] = {}
    lost = 0.0
    for k, given in enumerate(site.locked):
        near = shapely.make_valid(
            shapely.snap(given.polygon, rim, snap), method="structure", keep_collapsed=False
        )
        inside = shapely.intersection(near, land, grid_size=GRID)
        kept = [
            p
            for p in shapely.get_parts(inside)
            if p.geom_type == "Polygon" and not shapely.buffer(p, -0.5 * snap).is_empty
        ]
        lost += max(given.polygon.area - sum(p.area for p in kept), 0.0)
        if kept:
            out[k] = kept
    if lost <= snap * snap:
        return out, []
    gone = len(site.locked) - len(out)
    issue = Issue(
        "locked_outside",
        f"{lost:.0f} m² of the locked land lie outside the land or on obstacles and do not count; "
        f"{gone} of {len(site.locked)} areas have nothing left.",
        value=float(lost),
    )
    return out, [issue]


def _faces(
    polygons: Sequence[shapely.Polygon],
    parts: Sequence[shapely.Polygon],
    locked: dict[int, list[shapely.Polygon]],
) -> tuple[list[shapely.Polygon], IntArray, IntArray]:
    """Faces in the land, by part and size; the part and the locked land of each."""
    turned = canonical_rings(np.array(polygons, dtype=object))
    faces = np.array([shapely.transform(p, snap_to_grid) for p in turned], dtype=object)
    place = shapely.point_on_surface(faces)
    face, part = shapely.STRtree(list(parts)).query(place, predicate="within")
    which = np.full(len(faces), -1)
    owner = [k for k, each in locked.items() for _ in each]
    inside, number = shapely.STRtree([q for each in locked.values() for q in each]).query(
        place, predicate="within"
    )
    which[inside] = np.array(owner, dtype=np.int64)[number]
    rows = sorted(
        zip(part.tolist(), face.tolist(), strict=True),
        key=lambda row: (row[0], -faces[row[1]].area, faces[row[1]].bounds, faces[row[1]].wkb),
    )
    chosen = np.array([f for _, f in rows], dtype=np.int64)
    return list(faces[chosen]), np.array([p for p, _ in rows], dtype=np.int64), which[chosen]
