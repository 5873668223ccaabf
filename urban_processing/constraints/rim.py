"""Which part of the rim is street, and where the network meets the outside."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.constraints.lines import SAME
from urban_processing.errors import BoundaryError
from urban_processing.layout import ON_OBSTACLE, EdgeKind
from urban_processing.mesh.places import nearest_on_ring, segments_on
from urban_processing.mesh.planar import BoolArray, FloatArray, PlanarMesh
from urban_processing.site import Site, snap_to_grid


@dataclass(frozen=True, eq=False)
class RimRun:
    """A run along an outer ring from one vertex to another, counter-clockwise.

    `start` and `stop` are (2,) places; they are the same where the run is the whole ring.
    """

    part: int
    start: FloatArray
    stop: FloatArray


def place_on_rim(site: Site, *, snap: float) -> tuple[Site, tuple[RimRun, ...], FloatArray]:
    """Put entries, the ends of rim lines and street crossings on the outer rings, as vertices.

    Each goes to the nearest point of an outer ring. Of the two runs between the ends of a line,
    the one beside the line is meant. Streets count that cross the rim or end within `snap`
    metres of it.

    Returns
    -------
    site, runs, places
        The site with the vertices, the runs of the rim lines, and (k, 2) all places.
    """
    parts = list(site.parts)
    crossings = [_placed(parts, xy)[1] for xy in _crossings(site, snap)]
    entries = np.array([_placed(parts, xy)[1] for xy in site.entries]).reshape(-1, 2)
    runs = []
    for line in site.rim_lines:
        xy = shapely.get_coordinates(line)
        part, start = _placed(parts, xy[0])
        _, stop = _placed(parts, xy[-1], part)
        runs.append(_run(parts[part], part, start, stop, line))
    ends = [xy for run in runs for xy in (run.start, run.stop)]
    places = np.array([*crossings, *entries, *ends]).reshape(-1, 2)
    site = dataclasses.replace(site, parts=tuple(parts), entries=entries)
    return site, tuple(runs), places


def _crossings(site: Site, snap: float) -> FloatArray:
    """(k, 2) where given streets cross the outer rings, or end near them."""
    if not site.fixed_streets:
        return np.empty((0, 2))
    rim = shapely.union_all([p.exterior for p in site.parts])
    lines = [street.line for street in site.fixed_streets]
    found = shapely.get_parts(shapely.intersection(lines, rim))
    found = found[~shapely.is_empty(found)]
    # where a street runs along the rim, only its ends there
    ends = [g.coords[k] for g in found if g.geom_type == "LineString" for k in (0, -1)]
    points = [g.coords[0] for g in found if g.geom_type == "Point"]
    tips = [line.coords[k] for line in lines for k in (0, -1)]
    near = shapely.dwithin(shapely.points(tips), rim, snap)
    tips = [xy for xy, is_near in zip(tips, near.tolist(), strict=True) if is_near]
    unique = sorted(set(points + ends + tips))
    return np.array([xy[:2] for xy in unique]).reshape(-1, 2)


def _placed(
    parts: list[shapely.Polygon], xy: FloatArray, part: int | None = None
) -> tuple[int, FloatArray]:
    """Return the part and the vertex nearest to a place; it is inserted if there is none there."""
    here = shapely.Point(xy)
    if part is None:
        part = int(np.argmin(shapely.distance([p.exterior for p in parts], here)))
    polygon = parts[part]
    ring = shapely.get_coordinates(polygon.exterior)
    k, foot, _ = nearest_on_ring(ring, xy)
    place = snap_to_grid(foot)
    for vertex in (ring[k], ring[k + 1]):
        if np.hypot(*(vertex - place)) <= SAME:
            return part, np.asarray(vertex)
    parts[part] = shapely.Polygon(np.insert(ring, k + 1, place, axis=0), polygon.interiors)
    return part, place


def _run(
    polygon: shapely.Polygon, part: int, start: FloatArray, stop: FloatArray, line: shapely.Geometry
) -> RimRun:
    """Of the two runs between two vertices the one beside a line."""
    ring = shapely.get_coordinates(polygon.exterior)[:-1]
    there, back = _between(ring, start, stop), _between(ring, stop, start)
    middle = shapely.line_interpolate_point(line, 0.5, normalized=True)
    if (start == stop).all():
        return RimRun(part, start, stop)
    if there.distance(middle) <= back.distance(middle):
        return RimRun(part, start, stop)
    return RimRun(part, stop, start)


def _between(ring: FloatArray, start: FloatArray, stop: FloatArray) -> shapely.LineString:
    """The run of an unclosed ring from a vertex to another, or all around."""
    first = int(np.flatnonzero((ring == start).all(axis=1))[0])
    turned = np.roll(ring, -first, axis=0)
    turned = np.vstack([turned, turned[:1]])
    last = int(np.flatnonzero((turned[1:] == stop).all(axis=1))[0]) + 1
    return shapely.LineString(turned[: last + 1])


def run_lines(site: Site, runs: tuple[RimRun, ...]) -> list[shapely.LineString]:
    """The runs as lines along the outer rings of a site; their ends are vertices of them."""
    rings = [shapely.get_coordinates(p.exterior)[:-1] for p in site.parts]
    return [_between(rings[run.part], run.start, run.stop) for run in runs]


def edges_along(mesh: PlanarMesh, kind: np.ndarray, lines: list[shapely.LineString]) -> BoolArray:
    """(E,) which edges of the rim lie on one of some lines."""
    out = np.zeros(mesh.n_edges, dtype=bool)
    rim = np.flatnonzero(kind == EdgeKind.RIM)
    _, on = segments_on(mesh.xy[mesh.origin.reshape(-1, 2)[rim]], lines, ON_OBSTACLE)
    out[rim[on]] = True
    return out


def check_entries(site: Site) -> None:
    """Make sure that all entries lie on an outer ring of the land.

    Raises
    ------
    BoundaryError
        With one sentence for each that an obstacle covers.
    """
    rim = shapely.union_all([p.exterior for p in site.parts])
    off = shapely.distance(shapely.points(site.entries), rim)
    problems = [
        f"Entry {i + 1} lies in an obstacle, or in land too narrow to lay out: move it, or leave "
        "the obstacle out."
        for i in np.flatnonzero(off > ON_OBSTACLE).tolist()
    ]
    if problems:
        raise BoundaryError(problems)
