"""Logical streets: the parts of a block's contour that run along one street each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from urban_processing.mesh.touches import cycles
from urban_processing.parcelling.rows.divided import Polygon
from urban_processing.parcelling.rows.sheet import Sheet

NAMED_BEND = 15.0
"""Bend in degrees at which another number of the street makes another logical street."""


@dataclass
class Side:
    """A straight run of the contour, the base of one face of the skeleton.

    Parameters
    ----------
    face
        The face of the skeleton on it.
    run
        Vertices of the run, its end included.
    x, y
        Where it begins.
    dx, dy
        Direction, of length 1.
    length
        Length in metres.
    access
        Whether any of it is a street side.
    width
        Mean width of the street in metres, NaN where it is not known.
    street
        Number of the street, -1 where none is known.
    """

    face: int
    run: list[int]
    x: float
    y: float
    dx: float
    dy: float
    length: float
    access: bool
    width: float
    street: int


@dataclass
class Street:
    """A logical street (Vanegas 2012, section 4.2.1), or a part of the rim without one.

    Parameters
    ----------
    sides
        Its sides in the order of the contour.
    closed
        Whether it comes back to where it begins.
    """

    sides: list[Side]
    closed: bool

    @property
    def rim(self) -> bool:
        """Whether it is no street at all."""
        return not self.sides[0].access

    @property
    def front(self) -> list[int]:
        """Vertices along it, its end included."""
        return [v for side in self.sides for v in side.run[:-1]] + [self.sides[-1].run[-1]]

    @property
    def length(self) -> float:
        """Length in metres."""
        return sum(side.length for side in self.sides)

    @property
    def width(self) -> float:
        """Mean width in metres, NaN where no width is known."""
        known = [side for side in self.sides if side.width == side.width]
        total = sum(side.length for side in known)
        return sum(s.width * s.length for s in known) / total if total else math.nan


def sides_of_rings(sheet: Sheet, polygon: Polygon, edge_face: Sequence[int]) -> list[list[Side]]:
    """Return the sides of each ring of the contour, given the face of the skeleton on each edge."""
    rings = []
    for ring in cycles(sheet.following):
        before = ring[-1:] + ring[:-1]
        starts = [k for u, k in zip(before, ring, strict=True) if edge_face[k] != edge_face[u]]
        stops = starts[1:] + starts[:1]
        rings.append(
            [
                _side(sheet, polygon, (k, stop), face=edge_face[k])
                for k, stop in zip(starts, stops, strict=True)
            ]
        )
    return rings


def _side(sheet: Sheet, polygon: Polygon, ends: tuple[int, int], *, face: int) -> Side:
    start, stop = ends
    run = [start]
    while run[-1] != stop or len(run) == 1:
        run.append(sheet.following[run[-1]])
    x, y = sheet.x, sheet.y
    length = sheet.distance(start, stop)
    known = [
        (sheet.distance(u, v), polygon.width[u], polygon.street[u])
        for u, v in pairwise(run)
        if polygon.access[u]
    ]
    wide = [(part, width) for part, width, _ in known if not math.isnan(width)]
    total = sum(part for part, _ in wide)
    return Side(
        face=face,
        run=run,
        x=x[start],
        y=y[start],
        dx=(x[stop] - x[start]) / length,
        dy=(y[stop] - y[start]) / length,
        length=length,
        access=bool(known),
        width=sum(part * width for part, width in wide) / total if total else math.nan,
        street=max(known)[2] if known else -1,
    )


def logical_streets(
    ring: Sequence[Side],
    center: tuple[float, float],
    *,
    corner: float,
    reach: float,
    depth: float,
) -> list[Street]:
    """Divide a ring of sides into logical streets (Vanegas 2012, section 4.2.1).

    A street begins where the contour bends by more than ``corner``, measured between chords of
    length ``reach``, so that several small bends of a rounded corner count as one and a jag of
    the contour as none; of the places within ``reach`` that bend so, the one that bends most.
    It also begins where the number of the street changes at a bend of more than `NAMED_BEND`,
    where access does, and in the middle of a turn so tight that lines at right angles to it would
    meet within the rows, unless the whole ring is one such turn.

    Parameters
    ----------
    ring
        The sides of a ring in order.
    center
        A point within the block: a ring without a break begins at the vertex furthest from it.
    corner
        Angle in degrees.
    reach, depth
        Lengths in metres; that of the chords, and depth of the rows.
    """
    bends = _bends(ring, reach)
    starts = {k for k in range(len(ring)) if ring[k].access != ring[k - 1].access}
    at = _positions(ring)
    starts |= _corners(bends, at, corner=corner, reach=reach, taken=starts)
    starts |= _renamed(ring, bends, at, reach=reach, taken=starts)
    if len(starts) > 1 and depth > reach:
        starts |= _tight_turns(ring, at, corner=corner, depth=depth, taken=starts)
    if not starts and not ring[0].access:
        starts = set(range(len(ring)))
    if len(starts) > 1:
        order = sorted(starts)
        return [
            Street(_stretch(ring, k, order[(i + 1) % len(order)]), closed=False)
            for i, k in enumerate(order)
        ]
    first = min(starts) if starts else _furthest(ring, center)
    return [Street(_stretch(ring, first, first), closed=True)]


def _stretch(ring: Sequence[Side], start: int, stop: int) -> list[Side]:
    count = (stop - start) % len(ring) or len(ring)
    return [ring[(start + k) % len(ring)] for k in range(count)]


def _positions(ring: Sequence[Side]) -> list[float]:
    """Length of the ring up to the beginning of each side, and in all."""
    at = [0.0]
    for side in ring:
        at.append(at[-1] + side.length)
    return at


def _chord(ring: Sequence[Side], first: int, *, step: int, reach: float) -> tuple[float, float]:
    """Vector from the beginning of side ``first`` to the point ``reach`` on along the ring.

    With a ``step`` of -1 it goes back from the end of ``first``.
    """
    x = y = 0.0
    left, k = reach, first
    for _ in range(len(ring)):
        side = ring[k]
        part = min(side.length, left)
        x += step * side.dx * part
        y += step * side.dy * part
        left -= part
        if left <= 0.0:
            break
        k = (k + step) % len(ring)
    return x, y


def _bends(ring: Sequence[Side], reach: float) -> list[float]:
    """Angle in degrees by which the contour bends at the beginning of each side."""
    reach = min(reach, 0.25 * sum(side.length for side in ring))
    bends = []
    for k in range(len(ring)):
        bx, by = _chord(ring, (k - 1) % len(ring), step=-1, reach=reach)
        fx, fy = _chord(ring, k, step=1, reach=reach)
        angle = math.atan2(fx * by - fy * bx, -(bx * fx + by * fy))
        bends.append(round(math.degrees(angle), 6))
    return bends


def _corners(
    bends: Sequence[float], at: Sequence[float], *, corner: float, reach: float, taken: set[int]
) -> set[int]:
    """Sides that begin at a corner: no place within reach bends more, nor as much before."""
    perimeter = at[-1]
    places = [k for k, bend in enumerate(bends) if abs(bend) > corner]
    found = set()
    for k in places:
        bend = bends[k]
        for other in places:
            if other == k or bends[other] * bend <= 0.0:
                continue
            ahead = (at[other] - at[k]) % perimeter
            behind = perimeter - ahead
            if min(ahead, behind) >= reach:
                continue
            if abs(bends[other]) > abs(bend) or (bends[other] == bend and behind < reach):
                break
        else:
            found.add(k)
    return {k for k in found if not _near(k, taken, at, reach=reach)}


def _tight_turns(
    ring: Sequence[Side], at: Sequence[float], *, corner: float, depth: float, taken: set[int]
) -> set[int]:
    """Sides that begin where a street turns inwards by more than a corner within the depth."""
    bends = _bends(ring, depth)
    clear = [
        bend if bend > 0.0 and not _near(k, taken, at, reach=2.0 * depth) else 0.0
        for k, bend in enumerate(bends)
    ]
    return _corners(clear, at, corner=corner, reach=depth, taken=taken)


def _renamed(
    ring: Sequence[Side],
    bends: Sequence[float],
    at: Sequence[float],
    *,
    reach: float,
    taken: set[int],
) -> set[int]:
    return {
        k
        for k in range(len(ring))
        if min(ring[k].street, ring[k - 1].street) >= 0
        and ring[k].street != ring[k - 1].street
        and abs(bends[k]) > NAMED_BEND
        and not _near(k, taken, at, reach=reach)
    }


def _near(k: int, taken: set[int], at: Sequence[float], *, reach: float) -> bool:
    apart = [(at[other] - at[k]) % at[-1] for other in taken]
    return any(min(a, at[-1] - a) < 0.5 * reach for a in apart)


def _furthest(ring: Sequence[Side], center: tuple[float, float]) -> int:
    """Side that begins furthest from a point; of several the one that begins lowest, leftmost."""
    cx, cy = center
    return min(
        range(len(ring)),
        key=lambda k: (
            -round(math.hypot(ring[k].x - cx, ring[k].y - cy), 6),
            round(ring[k].y, 6),
            round(ring[k].x, 6),
            round(ring[k].dy, 6),  # rings may touch there
            round(ring[k].dx, 6),
        ),
    )
