"""Where a street that was drawn follows boundaries, and where it cuts parcels.

The line is near boundaries, or far from them, run by run. A far run lies in one parcel and cuts
it. A short near run is a place where the line crosses or meets a boundary: the street goes
through one spot there, a parcel corner if one is near. Along a longer one it follows the
boundary from a spot where it comes to one where it leaves.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray, linear_rings
from urban_processing.session.cutting import check_can_be_cut
from urban_processing.session.drawn_line import SAME_PLACE, DrawnLine
from urban_processing.session.moment import Moment
from urban_processing.session.spots import Spot, spot_on

CROSSING = 4.0
"""A run near boundaries is a crossing if it is shorter than so many times the snap distance."""

APPROACH = 2.0
"""A street comes to the boundary that it follows over so many times the snap distance."""

AT_LAKE = (
    "The line crosses a lake or another hole of the land, or follows its shore: no street can run "
    "there."
)
"""Why a street is refused at a hole of the land."""


@dataclass(frozen=True, eq=False)
class Link:
    """What joins two spots of a street that follow each other.

    Parameters
    ----------
    face
        Parcel that it cuts; -1 where it follows boundaries.
    start, stop
        Lengths along the drawn line between which it runs.
    inner
        (n, 2) vertices of the cut between the spots.
    """

    face: int
    start: float
    stop: float
    inner: FloatArray


@dataclass(frozen=True, eq=False)
class Plan:
    """A street as spots on boundaries, and what joins each with the next."""

    spots: tuple[Spot, ...]
    links: tuple[Link, ...]


def plan_street(moment: Moment, line: DrawnLine, *, snap: float, end_snap: float) -> Plan:
    """Find where a drawn street follows boundaries, and where it cuts parcels.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    line
        The line.
    snap
        Distance in metres within which the line follows boundaries.
    end_snap
        The same for its ends.

    Raises
    ------
    EditError
        If the line leaves the land, ends inside a parcel, or crosses one that is not to be cut.
    """
    layout = moment.state.layout
    mesh = layout.mesh
    segments = mesh.xy[mesh.origin.reshape(-1, 2)]
    near = line.near(segments, snap)
    if end_snap > snap:
        wide = line.near(segments, end_snap)
        ends = wide[(wide[:, 0] <= 0.0) | (wide[:, 1] >= line.length)]
        near = _joined_runs(near, ends, end_snap)
    far = _gaps(near, line.length)
    faces = [moment.face_at(line.at(0.5 * (a + b))) for a, b in far.tolist()]
    inside = _checked(moment, line, far, faces)
    planner = _Planner(layout, line, segments, snap, end_snap)
    spots: list[Spot] = []
    links: list[Link] = []
    bounds = [0.0, *far.ravel().tolist(), line.length]
    for k, (start, stop) in enumerate(zip(bounds[0::2], bounds[1::2], strict=True)):
        before = inside[k - 1] if k else None
        after = inside[k] if k < len(inside) else None
        met = planner.meet(before, after, start, stop)
        if len(met) > 1:
            links.append(Link(-1, start, stop, np.empty((0, 2))))
        spots += met
        if after is not None:
            a, b = far[k].tolist()
            links.append(Link(after, a, b, line.between(a, b)))
    return Plan(tuple(spots), tuple(links))


def _joined_runs(near: FloatArray, ends: FloatArray, end_snap: float) -> FloatArray:
    """The near runs, with those at the ends of the line as long as the wider distance makes them.

    Only as much of them as a crossing is long: beyond, the narrower distance counts.
    """
    first, last = ends[ends[:, 0] <= 0.0], ends[ends[:, 0] > 0.0]
    first = np.minimum(first, CROSSING * end_snap)
    last = np.maximum(last, last.max(initial=0.0) - CROSSING * end_snap)
    runs = np.vstack([near, first, last])
    runs = runs[np.argsort(runs[:, 0], kind="stable")]
    reach = np.maximum.accumulate(runs[:, 1])
    at = np.flatnonzero(np.append(True, runs[1:, 0] > reach[:-1]))
    return np.column_stack([runs[at, 0], reach[np.append(at[1:], len(runs)) - 1]])


def _gaps(near: FloatArray, length: float) -> FloatArray:
    """(k, 2) the runs of a line between the near ones, those at its ends included."""
    gaps = np.column_stack([np.append(0.0, near[:, 1]), np.append(near[:, 0], length)])
    return np.asarray(gaps[gaps[:, 1] - gaps[:, 0] > SAME_PLACE])


def _checked(
    moment: Moment, line: DrawnLine, far: FloatArray, faces: list[int | None]
) -> list[int]:
    """The parcels of the far runs; `EditError` where one is none, or the line ends in one."""
    outside = [far[k] for k, face in enumerate(faces) if face is None]
    if outside:
        raise EditError(_outside(moment, line, outside, len(faces) == len(outside)))
    inside = [face for face in faces if face is not None]
    check_can_be_cut(moment, list(dict.fromkeys(inside)))
    problems = [
        f"The line {verb} inside parcel {moment.number(inside[k])}: draw it on to the parcel's "
        "boundary or to a street."
        for k, verb, free in (
            (0, "begins", len(far) > 0 and far[0, 0] <= 0.0),
            (-1, "ends", len(far) > 0 and far[-1, 1] >= line.length),
        )
        if free
    ]
    if problems:
        raise EditError(problems)
    return inside


def _outside(moment: Moment, line: DrawnLine, runs: list[FloatArray], all_of_it: bool) -> str:
    """What is wrong with a line that is not all on land."""
    layout = moment.state.layout
    loops = layout.mesh.loops
    rims = loops.face == -1
    rims &= layout.mesh.loop_area > 0  # seen from outside, holes run counter-clockwise
    holes = [
        shapely.Polygon(layout.mesh.xy[layout.mesh.origin[loops.ring(int(k))]])
        for k in np.flatnonzero(rims)
    ]
    middle = [shapely.Point(line.at(float(run.mean()))) for run in runs]
    if holes and all(shapely.intersects(holes, place).any() for place in middle):
        return AT_LAKE
    if all_of_it and not len(line.near(layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)], 0.0)):
        return "The line does not touch the land."
    return "The line leaves the land: end it at the land's rim."


def ending_at_rims(layout: Layout, line: DrawnLine) -> DrawnLine:
    """The line without what is drawn beyond the land's outer rim at either end."""
    mesh, loops = layout.mesh, layout.mesh.loops
    rims = np.flatnonzero((loops.face == OUTSIDE) & (mesh.loop_area < 0)).tolist()
    half_edges = np.concatenate([loops.ring(rim) for rim in rims])
    xy = mesh.xy[mesh.origin[half_edges]]
    land = shapely.polygons(linear_rings(xy, np.cumsum([0, *(len(loops.ring(r)) for r in rims)])))
    ends = shapely.points(line.xy[[0, -1]])[:, None]
    beyond = ~shapely.dwithin(land, ends, SAME_PLACE).any(axis=1)
    segments = np.stack([xy, mesh.xy[mesh.target[half_edges]]], axis=1)
    at, _ = line.crossings(segments, beyond=0.0)
    if not len(at) or not beyond.any():
        return line
    start = float(at[0]) if beyond[0] else 0.0
    stop = float(at[-1]) if beyond[1] else line.length
    if stop - start <= SAME_PLACE:
        return line
    return DrawnLine(np.vstack([line.at(start), line.between(start, stop), line.at(stop)]))


class _Planner:
    """The layout, the line, and the distances within which it is snapped."""

    def __init__(
        self,
        layout: Layout,
        line: DrawnLine,
        segments: FloatArray,
        snap: float,
        end_snap: float,
    ) -> None:
        self.layout, self.line, self.segments = layout, line, segments
        self.snap, self.end_snap = snap, end_snap
        self.crossed, edge = line.crossings(segments, beyond=end_snap)
        self.sides = layout.mesh.face.reshape(-1, 2)[edge]

    def meet(self, before: int | None, after: int | None, start: float, stop: float) -> list[Spot]:
        """The spots of a near run: one where it is a crossing, else where it comes and leaves.

        `before` and `after` are the parcels of the far runs beside it, None at the line's ends.
        """
        snap = self.end_snap if before is None or after is None else self.snap
        short = stop - start <= CROSSING * snap
        if before is None:
            if after is None:
                return [self._end(0.0), self._end(self.line.length)]
            return self._at_beginning(after, start, stop, short=short)
        if after is None:
            return self._at_end(before, start, stop, short=short)
        if short:
            spot = self._shared(before, after, start, stop)
            if spot is not None:
                return [spot]
        come = self._on_ring(before, self._touch(before, start, stop))
        leave = self._on_ring(after, self._touch(after, stop, start))
        return [come, leave]

    def _at_beginning(self, after: int, start: float, stop: float, *, short: bool) -> list[Spot]:
        """The spots of the first near run of the line."""
        leave = self._on_ring(after, self._touch(after, stop, start))
        return [leave] if short else [self._end(0.0), leave]

    def _at_end(self, before: int, start: float, stop: float, *, short: bool) -> list[Spot]:
        """The spots of the last near run of the line."""
        come = self._on_ring(before, self._touch(before, start, stop))
        return [come] if short else [come, self._end(self.line.length)]

    def _shared(self, before: int, after: int, start: float, stop: float) -> Spot | None:
        """The spot on the boundaries of both parcels where a line crosses from one to the other.

        None where they have none in common: there is another parcel between.
        """
        mesh = self.layout.mesh
        rings = mesh.face_half_edges(before), mesh.face_half_edges(after)
        both = np.intersect1d(mesh.origin[rings[0]], mesh.origin[rings[1]])
        middle = 0.5 * (self._touch(before, start, stop) + self._touch(after, stop, start))
        place = self.line.at(middle)
        if before == after:
            return spot_on(self.layout, rings[0], place, reach=self.snap, among=both)
        edges = rings[0][mesh.face[rings[0] ^ 1] == after]
        if len(edges):
            return spot_on(self.layout, edges, place, reach=self.snap, among=both)
        off = np.hypot(*(mesh.xy[both] - place).T)
        if not len(both) or off.min() > APPROACH * self.snap:
            return None
        vertex = int(both[int(np.argmin(np.round(off, 9)))])
        edge = int(mesh.vertex_half_edge[vertex]) >> 1
        return Spot(vertex, edge, mesh.xy[vertex], 0.0)

    def _touch(self, face: int, start: float, stop: float) -> float:
        """Length along the line where it comes from inside a parcel, at `start`, to its boundary.

        That is where it crosses the boundary; where it runs along it without, or long before,
        it is a little on the way to `stop`.
        """
        sign = 1.0 if stop >= start else -1.0
        snap = max(self.snap, self.end_snap if stop in (0.0, self.line.length) else 0.0)
        at = self.crossed[(self.sides == face).any(axis=1)]
        ahead = sign * (at - start)
        ahead = ahead[(ahead >= -SAME_PLACE)]
        room = abs(stop - start)
        if len(ahead) and ahead.min() <= min(CROSSING * snap, room + snap):
            return start + sign * float(ahead.min())
        return start + sign * min(APPROACH * snap, 0.5 * room)

    def _on_ring(self, face: int, s: float) -> Spot:
        mesh = self.layout.mesh
        ring = mesh.face_half_edges(face)
        place = self.line.at(s)
        return spot_on(self.layout, ring, place, reach=self.snap, among=mesh.origin[ring])

    def _end(self, s: float) -> Spot:
        """The spot of an end of the line, which is near boundaries."""
        mesh = self.layout.mesh
        place = self.line.at(s)
        low, high = self.segments.min(axis=1), self.segments.max(axis=1)
        reach = self.end_snap + SAME_PLACE
        near = ((low <= place + reach) & (high >= place - reach)).all(axis=1)
        half_edges = 2 * np.flatnonzero(near)
        ends: IntArray = np.unique(
            np.concatenate([mesh.origin[half_edges], mesh.target[half_edges]])
        )
        return spot_on(self.layout, half_edges, place, reach=self.end_snap, among=ends)


def barred_edges(layout: Layout) -> IntArray:
    """Edges that no new street may follow: shores of lakes that have no street."""
    shore = (layout.edge_kind == EdgeKind.HOLE) | (layout.edge_kind == EdgeKind.OBSTACLE)
    return np.flatnonzero(shore & ~layout.edge_street)
