"""Streets that a planner adds and removes (Chen 2024, section 6 and Fig. 15)."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.errors import EditError
from urban_processing.layout import NOT_FIXED, EdgeKind, GivenStreet, Layout, Steering
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.pipelines.levels import State
from urban_processing.session.cutting import (
    Joint,
    check_large_enough,
    cut_between,
    thinned,
)
from urban_processing.session.drawn_line import SAME_PLACE, DrawnLine, as_line, as_points
from urban_processing.session.moment import Moment
from urban_processing.session.spots import with_vertices
from urban_processing.session.street_lines import (
    AT_LAKE,
    Link,
    Plan,
    barred_edges,
    ending_at_rims,
    plan_street,
)
from urban_processing.session.ways import costs_near, way_along_corners, way_between
from urban_processing.session.wording import parcels_named
from urban_processing.streets.network import street_network
from urban_processing.subdivision.insert import PATH_TOLERANCE

SHRINKING = (1.0, 0.3, 0.1)
"""Shares of the snap distance that are tried one after the other until a drawn street fits."""

THINNED = 0.1
"""A drawn line is thinned by this share of the snap distance."""

CLOSEST_SNAP = 0.01
"""Smallest snap distance in metres."""

BESIDE = 2.0
"""A street follows edges within so many snap distances of the line."""


def add_street(
    moment: Moment, line: FloatArray, *, snap: float, follow: bool, given: GivenStreet
) -> tuple[State, str]:
    """Add a street that stays, along a line.

    The street and the boundaries that it makes are kept by what follows: no clean-up removes
    them and nothing moves them.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    line
        (n, 2) points in local coordinates. A line that is drawn follows boundaries where it
        runs along them, and cuts the parcels that it crosses.
    snap
        Distance in metres within which it does; its ends are moved to boundaries within it.
        With `follow`, the distance within which each point has a parcel corner.
    follow
        Whether the street runs along boundaries alone, by the shortest way from one point of
        the line to the next.
    given
        Class and width of the street.

    Returns
    -------
    state, sentence
        The state with the street, and what was done, without a full stop. Parcels are not reached
        anew yet.

    Raises
    ------
    EditError
        If the line is none, or no street can run along it.
    """
    snap = max(snap, CLOSEST_SNAP)
    state = moment.state
    if follow:
        cut: list[int] = []
        edges = way_along_corners(state.layout, as_points(line), reach=snap)
    else:
        drawn = ending_at_rims(state.layout, as_line(line, tolerance=THINNED * snap))
        state, edges, cut = _drawn_street(moment, drawn, snap)
    layout = state.layout
    new = edges[~layout.edge_street[edges]]
    if not len(new):
        raise EditError("There is a street already along all of this line.")
    length = float(layout.mesh.edge_length[new].sum())
    sentence = f"A street of {length:,.0f} m was added"
    sentence += f"; it cut {parcels_named(moment.number(f) for f in cut)}" if cut else ""
    layout = _as_street(layout, edges, state.level, given)
    return dataclasses.replace(state, layout=layout), sentence


def remove_street(moment: Moment, place: FloatArray, *, reach: float) -> tuple[State, str]:
    """Remove the street at a place, from junction to junction.

    The system lays none there again, unless a parcel cannot be reached otherwise.

    Parameters
    ----------
    moment
        State and numbers of the parcels.
    place
        (2,) local coordinates.
    reach
        Distance in metres within which there must be a street.

    Returns
    -------
    state, sentence
        The state without the street, and what was done, without a full stop. Parcels are not
        reached anew yet.

    Raises
    ------
    EditError
        If no street is near.
    """
    layout = moment.state.layout
    network = street_network(layout)
    edges = network.half_edges >> 1
    ends = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[edges]]
    off = np.round(shapely.distance(shapely.linestrings(ends), shapely.Point(place)), 9)
    if not len(off) or off.min() > reach:
        raise EditError(f"There is no street within {reach:,.1f} m of this place.")
    k = int(np.searchsorted(network.offsets, int(np.argmin(off)), side="right")) - 1
    run = edges[network.offsets[k] : network.offsets[k + 1]]
    street, level = layout.edge_street.copy(), layout.edge_level.copy()
    fixed, steering = layout.edge_fixed.copy(), layout.edge_steering.copy()
    street[run], level[run], fixed[run] = False, -1, NOT_FIXED
    steering[run] |= np.uint8(Steering.NO_STREET)
    layout = layout.replace(
        edge_street=street, edge_level=level, edge_fixed=fixed, edge_steering=steering
    )
    length = float(layout.mesh.edge_length[run].sum())
    state = dataclasses.replace(moment.state, layout=layout)
    return state, f"A street of {length:,.0f} m was removed"


def _as_street(layout: Layout, edges: IntArray, level: int, given: GivenStreet) -> Layout:
    """The layout with edges that are a street of the user's from now on.

    Streets that were given before, and those on the rim, remain what they were.
    """
    street, levels = layout.edge_street.copy(), layout.edge_level.copy()
    fixed, steering = layout.edge_fixed.copy(), layout.edge_steering.copy()
    on_rim = layout.edge_kind[edges] == EdgeKind.RIM
    own = edges[(fixed[edges] == NOT_FIXED) & ~(on_rim & street[edges])]
    levels[edges[~street[edges]]] = level
    street[edges] = True
    fixed[own] = len(layout.fixed_streets)
    steering[edges] &= np.uint8(~np.uint8(Steering.NO_STREET))
    steering[edges] |= np.uint8(Steering.KEPT)
    return layout.replace(
        edge_street=street,
        edge_level=levels,
        edge_fixed=fixed,
        edge_steering=steering,
        fixed_streets=(*layout.fixed_streets, given),
    )


def _drawn_street(
    moment: Moment, line: DrawnLine, snap: float
) -> tuple[State, IntArray, list[int]]:
    """The state with a drawn street's cuts, its edges, and the parcels that it cut.

    Where following boundaries leads to no legal street, the line is followed more closely.
    """
    problems: list[EditError] = []
    for share in SHRINKING:
        street = _resolved(moment, plan_street(moment, line, snap=share * snap, end_snap=snap))
        if not problems:
            check_large_enough(moment, [joint.face for joint in street.joints])
        try:
            return _laid(moment, line, street, share * snap)
        except EditError as error:
            problems.append(error)
    # a parcel that is cut too small says more than a way that is not found
    raise next((error for error in problems if not isinstance(error, _NoWay)), problems[0])


class _NoWay(EditError):
    """A street cannot follow boundaries where the line is close to them."""


@dataclass(frozen=True, eq=False)
class _Street:
    """A layout with the vertices of a street, its cuts, and where it follows boundaries."""

    layout: Layout
    joints: list[Joint]
    walks: list[tuple[Link, int, int]]


def _resolved(moment: Moment, plan: Plan) -> _Street:
    """Put the vertices of a plan on the boundaries."""
    layout, vertices = with_vertices(moment.state.layout, plan.spots)
    scale = np.sqrt(moment.state.layout.mesh.face_area)
    street = _Street(layout, [], [])
    for link, a, b in zip(plan.links, vertices[:-1], vertices[1:], strict=True):
        if a == b:
            continue
        if link.face >= 0:
            path = np.vstack([layout.mesh.xy[a], link.inner, layout.mesh.xy[b]])
            inner = thinned(path, PATH_TOLERANCE * scale[link.face])
            if len(inner) or not _is_side(layout, a, b):
                street.joints.append(Joint(link.face, a, b, inner))
                continue
        street.walks.append((link, a, b))
    return street


def _laid(
    moment: Moment, line: DrawnLine, street: _Street, snap: float
) -> tuple[State, IntArray, list[int]]:
    """Cut the parcels, and find the ways along boundaries between the cuts."""
    state, new = cut_between(moment, street.layout, street.joints)
    edges = [new, *(_walk(state.layout, line, walk, snap) for walk in street.walks)]
    return state, np.unique(np.concatenate(edges)), [joint.face for joint in street.joints]


def _is_side(layout: Layout, a: int, b: int) -> bool:
    """Whether an edge joins two vertices."""
    return any(int(layout.mesh.target[h]) == b for h in layout.mesh.outgoing(a))


def _walk(layout: Layout, line: DrawnLine, walk: tuple[Link, int, int], snap: float) -> IntArray:
    """Edges along which a street follows boundaries between two vertices."""
    link, a, b = walk
    start, stop = max(link.start, 0.0), min(link.stop, line.length)
    run = np.vstack([line.at(start), line.between(start, stop), line.at(stop)])
    # where it is to begin and end may be farther off than what lies between
    ends = layout.mesh.xy[[a, b]]
    off = shapely.distance(shapely.points(ends), shapely.LineString(run)).max()
    reach = max(BESIDE * snap, float(off)) + SAME_PLACE
    barred = barred_edges(layout)
    way = way_between(layout, a, b, costs_near(layout, run, reach, barred))
    if way is not None:
        return np.array(way, dtype=np.int64)
    if way_between(layout, a, b, costs_near(layout, run, reach, barred[:0])) is not None:
        raise EditError(AT_LAKE)
    raise _NoWay(
        "The line runs so close to a boundary that it can neither follow it nor keep clear of it: "
        "draw it along the boundary, or farther off."
    )
