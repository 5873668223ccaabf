"""Cutting parcels along lines that were drawn."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import Layout, Steering
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import FloatArray, IntArray, linear_rings
from urban_processing.pipelines.levels import State
from urban_processing.quotas import divided
from urban_processing.session.drawn_line import SAME_PLACE, as_line, as_points
from urban_processing.session.moment import Moment
from urban_processing.session.spots import Spot, spot_on, with_vertices
from urban_processing.session.wording import areas_named, beginning, locked_as, parcels_named
from urban_processing.site import AREA_ROUNDING, snap_to_grid
from urban_processing.subdivision.insert import (
    LEAST_CLEARANCE,
    PATH_TOLERANCE,
)


@dataclass(frozen=True, eq=False)
class Joint:
    """A cut of a parcel between two vertices of its boundary.

    Parameters
    ----------
    face
        The parcel, before anything is cut.
    start, stop
        Vertices.
    inner
        (n, 2) the vertices between.
    """

    face: int
    start: int
    stop: int
    inner: FloatArray


def cut_faces(moment: Moment, paths: Mapping[int, FloatArray]) -> State:
    """Cut parcels, each along a path that begins and ends on its boundary.

    The ends move a little to a corner or vertex nearby, so that no edge is too short.
    The cuts are kept: parcels are not joined across them later. The halves go on to be cut like
    their parcel, and share the number of parcels that it was to become.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    paths
        A path (n, 2) in local coordinates for each face to be cut, such as `path_across` gives.

    Raises
    ------
    EditError
        With a sentence for each parcel that may not be cut, or not like this.
    """
    check_can_be_cut(moment, list(paths))
    check_large_enough(moment, list(paths))
    layout = moment.state.layout
    ends = [(face, path[end]) for face, path in paths.items() for end in (0, -1)]
    # paths of neighbours that meet must have one vertex there
    spots = [
        _shared_spot(
            layout, [f for f, other in ends if math.dist(other, place) <= SAME_PLACE], face, place
        )
        for face, place in ends
    ]
    cut, vertices = with_vertices(layout, spots)
    scale = np.sqrt(layout.mesh.face_area)
    joints = [
        Joint(face, start, stop, thinned(path, PATH_TOLERANCE * scale[face]))
        for (face, path), start, stop in zip(
            paths.items(), vertices[0::2], vertices[1::2], strict=True
        )
    ]
    after, _ = cut_between(moment, cut, joints)
    return after


def path_across(moment: Moment, face: int, line: object, *, snap: float) -> FloatArray:
    """(n, 2) the piece of a drawn line that cuts a parcel in two.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    face
        The parcel's face.
    line
        (n, 2) points in local coordinates.
    snap
        Ends that fail to reach the boundary by this many metres are prolonged to it.

    Raises
    ------
    EditError
        If the line misses the parcel, ends within it, or enters it more than once.
    """
    check_can_be_cut(moment, [face])
    drawn = as_line(line)
    number = moment.number(face)
    mesh = moment.state.layout.mesh
    h = mesh.face_half_edges(face)
    ring = np.stack([mesh.xy[mesh.origin[h]], mesh.xy[mesh.target[h]]], axis=1)
    parcel = shapely.Polygon(ring[:, 0])
    at, _ = drawn.crossings(ring, beyond=snap)
    at = at[np.diff(at, prepend=-np.inf) > SAME_PLACE]
    stops = at[(at >= -SAME_PLACE) & (at <= drawn.length + SAME_PLACE)]
    # an end inside the parcel goes on to its boundary, if that is near
    if _is_within(parcel, drawn.xy[0]):
        ahead = at[at < -SAME_PLACE]
        stops = np.append(ahead[-1:] if len(ahead) else 0.0, stops)
    if _is_within(parcel, drawn.xy[-1]):
        ahead = at[at > drawn.length + SAME_PLACE]
        stops = np.append(stops, ahead[:1] if len(ahead) else drawn.length)
    runs = np.column_stack([stops[:-1], stops[1:]])
    runs = runs[[_is_within(parcel, drawn.at(s)) for s in runs.mean(axis=1).tolist()]]
    ends_on = np.isin(runs, at).all(axis=1)
    whole = runs[ends_on]
    if not len(runs):
        raise EditError(f"The line does not cross parcel {number}.")
    if len(whole) > 1:
        raise EditError(
            f"The line crosses parcel {number} {len(whole)} times: draw one that enters and leaves "
            "it once."
        )
    if not len(whole):
        raise EditError(
            f"The line ends inside parcel {number}: draw it on to the parcel's boundary."
        )
    start, stop = whole[0].tolist()
    return np.vstack([drawn.at(start), drawn.between(start, stop), drawn.at(stop)])


def _is_within(parcel: shapely.Polygon, place: FloatArray) -> bool:
    """Whether a place lies in a parcel, and not on its boundary."""
    point = shapely.Point(place)
    inside = shapely.contains_properly(parcel, point)
    return bool(inside and not shapely.dwithin(parcel.exterior, point, SAME_PLACE))


def check_can_be_cut(moment: Moment, faces: Sequence[int]) -> None:
    """Raise `EditError` with a sentence for each face that is locked, or has a hole."""
    layout = moment.state.layout
    problems = [
        f"Parcel {moment.number(face)} is {locked_as(layout.land_uses[layout.face_use[face]])}: no "
        "cut and no street may cross it until it is unlocked."
        for face in faces
        if layout.face_locked[face]
    ]
    problems += [
        f"Parcel {moment.number(face)} lies around a hole or an obstacle: it cannot be cut."
        for face in faces
        if layout.mesh.face_n_loops[face] != 1
    ]
    if problems:
        raise EditError(problems)


def check_large_enough(moment: Moment, faces: Sequence[int]) -> None:
    """Raise `EditError` where parcels are too small to be cut in two."""
    area, least = moment.state.layout.mesh.face_area, moment.state.min_area
    small = [f for f in dict.fromkeys(faces) if area[f] < 2.0 * least * (1.0 - AREA_ROUNDING)]
    if not small:
        return
    named = parcels_named(moment.number(face) for face in small)
    too = "is too small" if len(small) == 1 else "are too small"
    size = f" ({area[small[0]]:,.0f} m²)" if len(small) == 1 else ""
    raise EditError(
        f"{beginning(named)}{size} {too} to be cut in two: the smallest parcel "
        f"allowed is {least:,.0f} m²."
    )


def _shared_spot(layout: Layout, faces: Sequence[int], face: int, place: FloatArray) -> Spot:
    """The spot at a place on a face's boundary, at a vertex of all of some faces if at one."""
    mesh = layout.mesh
    ring = mesh.face_half_edges(face)
    vertices = mesh.origin[ring]
    for other in faces:
        vertices = np.intersect1d(vertices, mesh.origin[mesh.face_half_edges(other)])
    return spot_on(layout, ring, place, reach=0.0, among=vertices)


def cut_between(moment: Moment, layout: Layout, joints: Sequence[Joint]) -> tuple[State, IntArray]:
    """Cut parcels between vertices of their boundaries, some of them perhaps several times.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    layout
        The moment's layout, perhaps with further vertices.
    joints
        The cuts; no two may cross each other.

    Returns
    -------
    state, edges
        The state after them, and the edges that are new.

    Raises
    ------
    EditError
        Where a parcel would be cut into too small or improper ones.
    """
    before = moment.state
    n_old = layout.mesh.n_edges
    owner = np.arange(layout.mesh.n_faces)
    left = list(joints)
    while left:
        layout, owner, left = _one_each(moment, layout, owner, left)
    quota = layout.face_quota.copy()
    halves = np.flatnonzero(np.bincount(owner)[owner] > 1)
    quota[halves] = divided(before.layout.face_quota, owner[halves], layout.mesh.face_area[halves])
    new = np.arange(n_old, layout.mesh.n_edges)
    steering = layout.edge_steering.copy()
    steering[new] |= np.uint8(Steering.KEPT)
    layout = layout.replace(face_quota=quota, edge_steering=steering)
    return dataclasses.replace(before, layout=layout), new


def _one_each(
    moment: Moment, layout: Layout, owner: IntArray, joints: list[Joint]
) -> tuple[Layout, IntArray, list[Joint]]:
    """Make one cut of every parcel, and give back those that are left for later."""
    editor = MeshEditor(layout.mesh)
    taken: dict[int, int] = {}
    later = []
    for joint in joints:
        face = _face_between(moment, layout, owner, joint)
        if face in taken:
            later.append(joint)
            continue
        # the halves' numbers must not depend on which way the line was drawn
        start, stop, inner = joint.start, joint.stop, joint.inner
        if tuple(layout.mesh.xy[stop]) < tuple(layout.mesh.xy[start]):
            start, stop, inner = stop, start, inner[::-1]
        ends = [
            next(h for h in editor.outgoing(vertex) if editor.face[h] == face)
            for vertex in (start, stop)
        ]
        points = [(x, y) for x, y in snap_to_grid(inner).tolist()]
        taken[face] = editor.connect(ends[0], ends[1], points)
    mesh, remap = editor.commit()
    after = layout.with_mesh(mesh, remap)
    _check_halves(moment, after, owner, taken)
    return after, owner[remap.face], later


def _face_between(moment: Moment, layout: Layout, owner: IntArray, joint: Joint) -> int:
    """The piece of a parcel that a cut goes through, as the parcel is cut by now."""
    mesh = layout.mesh
    at = [{int(mesh.face[h]) for h in mesh.outgoing(v)} for v in (joint.start, joint.stop)]
    faces = sorted(f for f in at[0] & at[1] if f >= 0 and owner[f] == joint.face)
    if joint.start != joint.stop and len(faces) == 1:
        return faces[0]
    if joint.start != joint.stop and len(faces) > 1:
        path = np.vstack([mesh.xy[joint.start], joint.inner, mesh.xy[joint.stop]])
        middle = shapely.line_interpolate_point(shapely.LineString(path), 0.5, normalized=True)
        polygons = mesh.face_polygons()[faces]
        held = np.flatnonzero(shapely.contains(polygons, middle))
        if len(held):
            return faces[int(held[0])]
    raise EditError(_improper(moment.number(joint.face)))


def _improper(number: int) -> str:
    return (
        f"The line does not cut parcel {number} into two proper pieces: on its way it touches the "
        "parcel's boundary, or comes back to where it began."
    )


def _check_halves(
    moment: Moment, layout: Layout, owner: IntArray, halves: Mapping[int, int]
) -> None:
    """Raise `EditError` with a sentence for each parcel whose halves are not both legal."""
    mesh = layout.mesh
    pairs = np.array(list(halves.items()), dtype=np.int64)
    h, offsets = mesh.face_rings(pairs.ravel())
    rings = linear_rings(mesh.xy[mesh.origin[h]], offsets)
    polygons = shapely.polygons(rings)
    area = shapely.area(polygons).reshape(-1, 2)
    proper = shapely.is_valid(polygons) & shapely.is_ccw(rings)
    proper &= shapely.minimum_clearance(polygons) > LEAST_CLEARANCE
    proper = proper.reshape(-1, 2).all(axis=1)
    least = moment.state.min_area
    enough = (area >= least * (1.0 - AREA_ROUNDING)).all(axis=1)
    problems = []
    for k in np.flatnonzero(~(proper & enough)).tolist():
        number = moment.number(int(owner[pairs[k, 0]]))
        problems.append(
            f"Parcel {number} would be cut into {areas_named(area[k].tolist())}; the smallest "
            f"parcel allowed is {least:,.0f} m²."
            if proper[k]
            else _improper(number)
        )
    if problems:
        raise EditError(problems)


def thinned(path: FloatArray, tolerance: float) -> FloatArray:
    """(n, 2) the inner vertices of a path, those left out that stray less than a tolerance."""
    xy = as_points(path)
    line = shapely.simplify(shapely.LineString(xy), tolerance)
    return np.asarray(shapely.get_coordinates(line)[1:-1])
