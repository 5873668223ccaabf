"""Centrelines made one clean network: noded, doubles merged, near misses joined."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely
from scipy.spatial import cKDTree

from urban_processing.blocks.noding import NODE_GRID, Centrelines, node_lines
from urban_processing.blocks.streets import StreetLines
from urban_processing.mesh.components import components
from urban_processing.mesh.places import are_near
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.site import Issue

OWN_STRETCH = 4.0
"""An end is not joined to its own line, nor to what meets it, within so many tolerances."""

ROUNDED_DIGITS = 6
"""Distances that agree to this many digits of a metre are equal."""


def clean_centrelines(
    streets: StreetLines,
    *,
    snap: float,
    dead_ends: bool,
    land: Sequence[shapely.Polygon] | None = None,
    short_ends: bool = False,
) -> tuple[Centrelines, list[Issue]]:
    """Node lines, and mend what is not as a network of streets is.

    Lines are cut where they cross, lines that lie on each other count once. Ends that miss
    another line by at most `snap` metres move there; dead ends and loops shorter than that go.

    Parameters
    ----------
    streets
        Lines of known width, in the order of `chosen_streets`.
    snap
        Metres.
    dead_ends
        Whether streets stay that lead to nothing.
    land
        Land that is looked at: ends on its rim and outside are no dead ends.
    short_ends
        Whether dead ends stay that end within the right-of-way of the street that they leave, if
        they are no shorter than `snap`.
    """
    issues: list[Issue] = []
    rows = np.flatnonzero(_worth_keeping(streets.lines, snap, issues))
    lines = shapely.transform(streets.lines[rows], lambda xy: np.round(xy / NODE_GRID) * NODE_GRID)
    work = node_lines(lines, streets.width[rows])
    work = replace(work, line=rows[work.line])
    issues += _crossings(work, lines)
    _tell_doubled(lines, work, snap, issues)
    reach = np.zeros(len(streets)) if short_ends else streets.width / 2
    work = _without_stubs(work, reach, snap, issues)
    work = _joined(work, streets.width, snap, issues)
    return _dead_ends(work, issues, kept=dead_ends, within=_interior(land, snap)), issues


def _interior(land: Sequence[shapely.Polygon] | None, snap: float) -> shapely.Geometry | None:
    """Land without what lies within a tolerance of its rim."""
    return None if land is None else shapely.union_all(shapely.buffer(list(land), -snap))


def _worth_keeping(lines: npt.NDArray[np.object_], snap: float, issues: list[Issue]) -> BoolArray:
    """Lines that have a length and are no loops smaller than the tolerance."""
    west, south, east, north = shapely.bounds(lines).T
    extent = np.maximum(east - west, north - south)
    tiny = (shapely.length(lines) < NODE_GRID) | (shapely.is_closed(lines) & (extent < snap))
    if tiny.any():
        message = (
            f"{int(tiny.sum())} line(s) without length or loops below {snap:g} m were dropped."
        )
        issues.append(Issue("tiny_lines", message, value=float(tiny.sum()), limit=snap))
    return np.asarray(~tiny)


def _crossings(work: Centrelines, lines: npt.NDArray[np.object_]) -> list[Issue]:
    """Say where lines cross and none has a vertex."""
    at = work.node_xy
    degree = np.bincount(work.ends.ravel(), minlength=len(at))
    meet = np.flatnonzero(degree > 2)
    vertices = shapely.points(shapely.get_coordinates(lines))
    at = at[meet]
    found = ~are_near(at, vertices, 2 * NODE_GRID)
    n = int(found.sum())
    if not n:
        return []
    message = f"At {n} place(s) lines cross without a node: they meet there now."
    return [Issue("crossings_noded", message, value=float(n), geometry=_places(at[found]))]


def _tell_doubled(
    lines: npt.NDArray[np.object_], work: Centrelines, snap: float, issues: list[Issue]
) -> None:
    doubled = float(shapely.length(lines).sum() - work.length.sum())
    if doubled > max(snap, NODE_GRID):
        same = len(lines) - len(np.unique(shapely.to_wkb(lines)))
        message = (
            f"{doubled:.0f} m of lines lie on others and count once; {same} line(s) are there "
            "twice. Of several the widest counts."
        )
        issues.append(Issue("streets_doubled", message, value=doubled))


def _without_stubs(
    work: Centrelines, reach: FloatArray, snap: float, issues: list[Issue]
) -> Centrelines:
    """Take away dead ends that go no further than a line (n,) reaches that they leave."""
    reaches = reach[work.line]
    stubs = []
    for end, walk in _walks(work, max(snap, reaches.max(initial=0.0))).items():
        within = max(snap, reaches[walk.onward].max(initial=0.0))
        if walk.stopped and walk.length < within:
            stubs.append((end, walk.segments))
    if not stubs:
        return work
    kept = np.ones(len(work.line), dtype=bool)
    for _, segments in stubs:
        kept[segments] = False
    more = ", or within the right-of-way of the street that they leave," if reach.any() else ""
    message = f"{len(stubs)} dead end(s) shorter than {snap:g} m{more} were left out."
    places = _places(work.node_xy[[end for end, _ in stubs]])
    issues.append(
        Issue("stubs_left_out", message, value=float(len(stubs)), limit=snap, geometry=places)
    )
    return work.take(kept)


@dataclass(frozen=True)
class _Walk:
    """The way from a dead end up to a distance or the first junction, where it stops."""

    segments: list[int]
    node: int
    length: float
    onward: list[int]
    """The other segments at the node."""

    @property
    def stopped(self) -> bool:
        """Whether the way ends at a junction or another dead end."""
        return len(self.onward) != 1


def _walks(work: Centrelines, distance: float) -> dict[int, _Walk]:
    """Ways from all dead ends inward until they are at least a distance long."""
    ends, length = work.ends, work.length
    degree = np.bincount(ends.ravel())
    at: dict[int, list[int]] = {}
    out = {}
    for segment, pair in enumerate(ends.tolist()):
        for node in pair:
            at.setdefault(node, []).append(segment)
    for end in np.flatnonzero(degree == 1).tolist():
        node, walked = end, 0.0
        way: list[int] = []
        while walked < distance:
            onward = [s for s in at[node] if s not in way[-1:]]
            if len(onward) != 1:  # a junction, or the other end
                break
            way += onward
            walked += float(length[onward[0]])
            a, b = ends[onward[0]].tolist()
            node = b if node == a else a
        out[end] = _Walk(way, node, walked, [s for s in at[node] if s not in way[-1:]])
    return out


def _joined(work: Centrelines, width: FloatArray, snap: float, issues: list[Issue]) -> Centrelines:
    """Move ends to each other, or onto the nearest other segment, within the tolerance."""
    xy = work.node_xy
    degree = np.bincount(work.ends.ravel(), minlength=len(xy))
    dead = np.flatnonzero(degree == 1)
    if snap <= 0 or not len(dead):
        return work
    target = _ends_together(xy, dead, snap)
    target |= _onto_segments(work, xy, [d for d in dead.tolist() if d not in target], snap)
    moved = {node: place for node, place in target.items() if (place != xy[node]).any()}
    if not moved:
        return work
    places = xy.copy()
    for node, place in moved.items():
        places[node] = place
    segments = places[work.ends]
    long = (segments[:, 0] != segments[:, 1]).any(axis=1)
    source = work.line[long]
    again = node_lines(np.asarray(shapely.linestrings(segments[long])), width[source])
    at = np.array([xy[node] for node in moved])
    message = f"{len(moved)} end(s) of streets were moved by up to {snap:g} m to meet others."
    issues.append(
        Issue("ends_joined", message, value=float(len(moved)), limit=snap, geometry=_places(at))
    )
    return replace(again, line=source[again.line])


def _ends_together(xy: FloatArray, dead: IntArray, snap: float) -> dict[int, FloatArray]:
    """Ends within the tolerance of each other: the place of the lowest is that of all."""
    pairs = cKDTree(xy[dead]).query_pairs(snap, output_type="ndarray")
    group = components(len(dead), pairs)
    size = np.bincount(group, minlength=1)
    _, lowest = np.unique(group, return_index=True)
    return {
        int(dead[i]): xy[dead[lowest[group[i]]]] for i in np.flatnonzero(size[group] > 1).tolist()
    }


def _onto_segments(
    work: Centrelines, xy: FloatArray, dead: list[int], snap: float
) -> dict[int, FloatArray]:
    """Where each end meets the nearest segment within the tolerance that is not its own."""
    if not dead:
        return {}
    lines = shapely.linestrings(work.segments)
    points = shapely.points(xy[dead])
    k, segment = shapely.STRtree(lines).query(points, predicate="dwithin", distance=snap)
    gap = np.round(shapely.distance(points[k], lines[segment]), ROUNDED_DIGITS)
    order = np.lexsort((segment, gap, k))
    walks = _walks(work, OWN_STRETCH * snap)
    own: dict[int, set[int]] = {}
    out: dict[int, FloatArray] = {}
    for i, s in zip(k[order].tolist(), segment[order].tolist(), strict=True):
        end = dead[i]
        if end in out:
            continue
        if end not in own:
            own[end] = {*walks[end].segments, *walks[end].onward}
        if s not in own[end]:
            out[end] = _foot(work.segments[s], xy[end], snap)
    return out


def _foot(segment: FloatArray, place: FloatArray, snap: float) -> FloatArray:
    """The end of a segment within the tolerance of a place, else the nearest point on it."""
    away = np.hypot(*(segment - place).T)
    if away.min() <= snap:
        return np.asarray(segment[int(np.argmin(np.round(away, ROUNDED_DIGITS)))])
    way = segment[1] - segment[0]
    share = float(np.clip(((place - segment[0]) * way).sum() / (way**2).sum(), 0.0, 1.0))
    return np.asarray(np.round((segment[0] + share * way) / NODE_GRID) * NODE_GRID)


def _dead_ends(
    work: Centrelines, issues: list[Issue], *, kept: bool, within: shapely.Geometry | None
) -> Centrelines:
    """Count the dead ends; take away what leads to nothing else if they are not kept."""
    xy, ends = work.node_xy, work.ends
    inside = np.ones(len(xy), dtype=bool)
    if within is not None:
        shapely.prepare(within)
        inside = shapely.contains_xy(within, *xy.T)
    degree = np.bincount(ends.ravel(), minlength=len(xy))
    dead = np.flatnonzero((degree == 1) & inside)
    if not len(dead):
        return work
    message = f"{len(dead)} street(s) are dead ends" + (
        ": what they take makes notches in blocks." if kept else " and were left out."
    )
    code = "dead_ends" if kept else "dead_ends_left_out"
    issues.append(Issue(code, message, value=float(len(dead)), geometry=_places(xy[dead])))
    if kept:
        return work
    alive = np.ones(len(ends), dtype=bool)
    while True:
        degree = np.bincount(ends[alive].ravel(), minlength=len(xy))
        loose = alive & ((degree == 1) & inside)[ends].any(axis=1)
        if not loose.any():
            return work.take(alive)
        alive &= ~loose


def _places(xy: FloatArray) -> shapely.MultiPoint:
    return shapely.MultiPoint(xy)
