"""Obstacles taken off the land."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

import numpy as np
import shapely

from urban_processing.constraints.narrows import HAIR, NARROW_AREA, there_and_back
from urban_processing.errors import BoundaryError
from urban_processing.mesh.build import canonical_rings
from urban_processing.site import GRID, Issue, Site, snap_to_grid

LISTED_M2 = 1.0
"""Obstacles that lie outside the land, or grow, by less than this many m² are not told of."""


def take_off_obstacles(site: Site, *, narrow: float, min_area: float) -> Site:
    """Return the site without its obstacles: its land may have holes and more parts then.

    The rims of obstacles stay exactly as they were given. Land at an obstacle that is narrower
    than `narrow`, such as between a lake and the rim, cannot be laid out and goes with the
    obstacle; so do pieces that are cut off, narrower than that and smaller than a parcel. The
    obstacles of the new site are what is missing of the land before: they and the new parts
    tile it.

    Raises
    ------
    BoundaryError
        If the obstacles cover the land.
    """
    if not site.obstacles:
        return site
    obstacles = shapely.union_all(list(site.obstacles), grid_size=GRID)
    land = shapely.union_all(list(site.parts), grid_size=GRID)
    left = shapely.difference(land, obstacles, grid_size=GRID)
    parts = [
        piece
        for part in _polygons(left)
        for piece in _without_narrows(part, obstacles, narrow)
        if piece.area >= min_area or not _is_narrow(piece, narrow)
    ]
    if not parts:
        raise BoundaryError(
            "The obstacles cover the whole land: nothing is left to lay out. Leave some of them "
            "out, or check their CRS."
        )
    parts = sorted(_canonical(parts), key=lambda p: (-p.area, p.bounds, p.wkb))
    gone = shapely.difference(land, shapely.union_all(parts, grid_size=GRID), grid_size=GRID)
    inside = shapely.intersection(obstacles, land).area
    issues = _issues(site, outside=obstacles.area - inside, grown=gone.area - inside)
    return dataclasses.replace(
        site,
        parts=tuple(parts),
        input_parts=site.input_parts or site.parts,
        obstacles=tuple(_canonical(_polygons(gone))),
        issues=(*site.issues, *issues),
    )


def _issues(site: Site, *, outside: float, grown: float) -> list[Issue]:
    issues = []
    if outside > LISTED_M2:
        land = shapely.union_all(list(site.parts))
        beyond = int((~shapely.intersects(list(site.obstacles), land)).sum())
        issues.append(
            Issue(
                "obstacles_outside",
                f"{outside:.0f} m² of the obstacles lie outside the land ({beyond} obstacle(s) "
                "as a whole) and do not count.",
                value=float(outside),
            )
        )
    if grown > LISTED_M2:
        issues.append(
            Issue(
                "obstacles_grown",
                f"{grown:.0f} m² of land at obstacles are too narrow to lay out and were added to "
                "them.",
                value=float(grown),
            )
        )
    return issues


def _polygons(geometry: shapely.Geometry) -> list[shapely.Polygon]:
    return [p for p in shapely.get_parts(geometry) if p.geom_type == "Polygon" and p.area > 0]


def _canonical(polygons: Sequence[shapely.Polygon]) -> list[shapely.Polygon]:
    """Rings that start and run the same however a polygon came about."""
    turned = canonical_rings(np.array(polygons, dtype=object))
    return sorted(
        (shapely.transform(p, snap_to_grid) for p in turned), key=lambda p: (p.bounds, p.wkb)
    )


def _is_narrow(polygon: shapely.Polygon, width: float) -> bool:
    return bool(shapely.buffer(polygon, -0.5 * width, join_style="mitre").is_empty)


def _without_narrows(
    part: shapely.Polygon, obstacles: shapely.Geometry, width: float
) -> list[shapely.Polygon]:
    """Take away what is narrower than `width` at obstacles; the part may fall apart."""
    if width <= 0 or not shapely.dwithin(part, obstacles, GRID):
        return [part]
    core = there_and_back(part, -0.5 * width)
    # buffers with mitres may come out invalid
    core = shapely.make_valid(core, method="structure", keep_collapsed=False)
    narrow = [
        piece
        for piece in _polygons(shapely.difference(part, core, grid_size=GRID))
        if piece.area > NARROW_AREA * width * width
        and shapely.dwithin(piece, obstacles, HAIR * width)
    ]
    if not narrow:
        return [part]
    taken = shapely.buffer(shapely.union_all(narrow), HAIR * width, join_style="mitre")
    rest = _polygons(shapely.difference(part, taken, grid_size=GRID))
    return [p for p in rest if p.area > NARROW_AREA * width * width]
