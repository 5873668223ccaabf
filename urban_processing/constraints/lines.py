"""Lines of given streets made ready: cut at the land, joined to each other and to the rim."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.ops import substring

from urban_processing.site import GRID, FixedStreet, FloatArray, Issue, snap_to_grid

ALONG = 8.0
"""A line that stays within the tolerance of another for so many tolerances runs along it;
lines that cross do so for less, unless they meet at less than 15°."""


SAME = 1e-3
"""A line that comes this near in metres to a vertex of the rim meets it."""


@dataclass(frozen=True)
class Piece:
    """A piece of a given street; `street` is its number."""

    line: shapely.LineString
    street: int


def ready_streets(
    streets: Sequence[FixedStreet], ground: shapely.Geometry, *, snap: float
) -> tuple[list[Piece], list[Issue]]:
    """Cut streets at the ground where streets may be, and join what nearly meets.

    Lines are cut where they cross themselves. What lies outside the ground is cut off; what
    runs along its rim, within `snap` metres, becomes a piece of the rim; what runs along an
    earlier street is left out. Ends within `snap` of the rim, of another end or of another
    line move there. Pieces shorter than `snap` are dropped.

    Returns
    -------
    pieces, issues
        Pieces by street, and what was changed.
    """
    rim = shapely.union_all(_rings(ground))
    count = _Count()
    pieces: list[Piece] = []
    for number, street in enumerate(streets):
        for simple in _simple_lines(street.line):
            for line, along in _split_along(simple, rim, snap):
                run = _run_of(rim, line, snap) if along else None
                if run is not None:
                    pieces.append(Piece(run, number))
                    continue
                inside = [g for g in _lines(shapely.intersection(line, ground)) if g.length > snap]
                count.outside += line.length - sum(g.length for g in inside)
                pieces += [Piece(g, number) for g in inside]
    pieces = _without_doubles(pieces, snap, count)
    pieces = [Piece(_on_vertices(p.line, rim), p.street) for p in _joined(pieces, rim, snap)]
    return pieces, count.issues(streets, pieces, snap)


def _on_vertices(line: shapely.LineString, rim: shapely.Geometry) -> shapely.LineString:
    """The line by way of the vertices of the rim that it all but meets."""
    met = shapely.snap(line, rim, SAME)
    return met if met.geom_type == "LineString" and not met.is_empty else line


@dataclass
class _Count:
    """Lengths in metres of what was left out."""

    outside: float = 0.0
    doubled: float = 0.0

    def issues(
        self, streets: Sequence[FixedStreet], pieces: Sequence[Piece], snap: float
    ) -> list[Issue]:
        out = []
        if self.outside > snap:
            gone = len(streets) - len({p.street for p in pieces})
            out.append(
                Issue(
                    "fixed_street_outside",
                    f"{self.outside:.0f} m of the given streets lie outside the land, on obstacles "
                    f"or on locked land and were cut off; {gone} of {len(streets)} streets "
                    "have nothing left.",
                    value=self.outside,
                )
            )
        if self.doubled > snap:
            out.append(
                Issue(
                    "fixed_street_doubled",
                    f"{self.doubled:.0f} m of the given streets lie on others, or within "
                    f"{snap:.3g} m beside them, and count once.",
                    value=self.doubled,
                    limit=snap,
                )
            )
        return out


def _rings(geometry: shapely.Geometry) -> list[shapely.LinearRing]:
    return list(shapely.get_rings(shapely.get_parts(geometry)))


def _lines(geometry: shapely.Geometry) -> list[shapely.LineString]:
    """Connected lines of a geometry, as long as they go; points are left out."""
    parts = [g for g in shapely.get_parts(geometry) if g.geom_type == "LineString"]
    if len(parts) < 2:
        return parts
    return list(shapely.get_parts(shapely.line_merge(shapely.MultiLineString(parts))))


def _simple_lines(line: shapely.LineString) -> list[shapely.LineString]:
    """The line cut where it crosses itself; what it runs along twice comes once."""
    if line.is_simple and not line.is_closed:
        return [line]
    return _lines(shapely.union_all([line], grid_size=GRID))


def _split_along(
    line: shapely.LineString, base: shapely.Geometry, snap: float
) -> Iterator[tuple[shapely.LineString, bool]]:
    """Pieces of a line in order, and whether each runs along `base`."""
    if not shapely.dwithin(line, base, snap):
        yield line, False
        return
    length = line.length
    near = _lines(shapely.intersection(line, shapely.buffer(base, snap)))
    spans = []
    for piece in near:
        if piece.length > min(ALONG * snap, length * (1 - 1e-9)):
            a, b = sorted(line.project(shapely.Point(piece.coords[k])) for k in (0, -1))
            closed = line.is_closed and piece.length > length * (1 - 1e-9)
            spans.append((0.0, length) if closed else (a, b))
    at = 0.0
    for a, b in sorted(spans):
        if a - at > GRID:
            yield substring(line, at, a), False
        if b - max(a, at) > GRID:
            yield substring(line, max(a, at), b), True
        at = max(at, b)
    if length - at > GRID:
        yield substring(line, at, length), False


def _run_of(
    rim: shapely.Geometry, line: shapely.LineString, snap: float
) -> shapely.LineString | None:
    """The run of a ring beside a line: of its two ways from end to end the nearer one.

    None where the line turns back at the rim, so that neither way is about as long as it.
    """
    middle = line.interpolate(0.5, normalized=True)
    rings = [shapely.LineString(g) for g in _closed(rim)]
    ring = min(rings, key=lambda g: (round(g.distance(middle), 6), g.wkb))
    if line.is_closed and line.length > 0.5 * ring.length:
        return ring
    a, b = (ring.project(shapely.Point(line.coords[k])) for k in (0, -1))
    low, high = min(a, b), max(a, b)
    inner = substring(ring, low, high)
    xy = [
        *shapely.get_coordinates(substring(ring, high, ring.length)),
        *shapely.get_coordinates(substring(ring, 0.0, low))[1:],
    ]
    outer = shapely.LineString(xy)
    alike = [
        run
        for run in (inner, outer)
        if run.length > 0
        and abs(run.length - line.length) <= 0.5 * line.length
        and run.distance(middle) <= 2 * snap
    ]
    return min(alike, key=lambda run: run.distance(middle), default=None)


def _closed(rim: shapely.Geometry) -> list[shapely.Geometry]:
    """Rings of a union of rings, which are cut where others touch them."""
    merged = shapely.line_merge(rim) if rim.geom_type == "MultiLineString" else rim
    return list(shapely.get_parts(merged))


def _without_doubles(pieces: Sequence[Piece], snap: float, count: _Count) -> list[Piece]:
    """Leave out what runs along an earlier piece, and pieces that are too short."""
    kept: list[Piece] = []
    for piece in pieces:
        beside = [p.line for p in kept if shapely.dwithin(p.line, piece.line, snap)]
        if not beside:
            kept.append(piece)
            continue
        for line, along in _split_along(piece.line, shapely.union_all(beside), snap):
            if along:
                count.doubled += line.length
            else:
                kept.append(Piece(line, piece.street))
    return [p for p in kept if p.line.length > snap]


def _joined(pieces: Sequence[Piece], rim: shapely.Geometry, snap: float) -> list[Piece]:
    """Move ends to the rim, to each other, or onto another line, within the tolerance."""
    lines = [snap_to_grid(shapely.get_coordinates(p.line)) for p in pieces]
    ends = [(i, k) for i, xy in enumerate(lines) for k in (0, -1)]
    settled: list[FloatArray] = []
    free: list[tuple[int, int]] = []
    vertices = shapely.points(shapely.get_coordinates(rim))
    corners = shapely.STRtree(vertices)
    for i, k in ends:
        place = _on_rim(lines[i][k], rim, corners, snap)
        if place is None:
            free.append((i, k))
        else:
            # two feet on one edge of the rim may differ by a rounding error
            same = [p for p in settled if np.hypot(*(p - place)) <= SAME]
            lines[i][k] = same[0] if same else place
            settled.append(lines[i][k].copy())
    alone = []
    for i, k in free:
        near = [p for p in settled if np.hypot(*(p - lines[i][k])) <= snap]
        if near:
            lines[i][k] = near[0]
        else:
            settled.append(lines[i][k].copy())
            alone.append((i, k))
    shapes = [_line(xy) for xy in lines]
    for i, k in alone:
        here = shapely.Point(lines[i][k])
        others = [g for j, g in enumerate(shapes) if j != i and g is not None]
        near_lines = [g for g in others if shapely.dwithin(g, here, snap)]
        if near_lines:
            target = min(near_lines, key=lambda g: (round(g.distance(here), 6), g.wkb))
            lines[i][k] = _nearest_on(target, here, snap)
            shapes[i] = _line(lines[i])
    return [
        Piece(line, piece.street)
        for line, piece in zip(shapes, pieces, strict=True)
        if line is not None
    ]


def _line(xy: FloatArray) -> shapely.LineString | None:
    keep = np.append(True, (np.diff(xy, axis=0) != 0).any(axis=1))
    return shapely.LineString(xy[keep]) if keep.sum() > 1 else None


def _on_rim(
    place: FloatArray, rim: shapely.Geometry, corners: shapely.STRtree, snap: float
) -> FloatArray | None:
    """The vertex of the rim near a place, else the point of the rim near it."""
    here = shapely.Point(place)
    found = corners.query_nearest(here, max_distance=snap)
    if len(found):
        return np.asarray(shapely.get_coordinates(corners.geometries[int(found.min())])[0])
    if rim.distance(here) > snap:
        return None
    return _nearest_on(rim, here, 0.0)


def _nearest_on(line: shapely.Geometry, here: shapely.Point, snap: float) -> FloatArray:
    """The vertex of a line within `snap` of a point, else the nearest point, on the grid."""
    xy = shapely.get_coordinates(line)
    away = np.hypot(*(xy - shapely.get_coordinates(here)[0]).T)
    if away.min() <= snap:
        return np.asarray(xy[int(away.argmin())])
    return snap_to_grid(shapely.get_coordinates(shapely.shortest_line(line, here))[0])
