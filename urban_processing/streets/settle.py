"""Dead ends that no street along parcels can lead on: another access, or a street along a hole."""

from __future__ import annotations

from urban_processing.mesh.planar import OUTSIDE
from urban_processing.streets.access import find_accesses
from urban_processing.streets.connect import lay_access
from urban_processing.streets.ends import close_end, dead_ends, retract_end, street_into
from urban_processing.streets.reach import LAST_RESORT
from urban_processing.streets.state import StreetState


def settle_ends(state: StreetState, *, along_holes: bool) -> None:
    """Get rid of the dead ends that are left where the whole outer rim is street.

    A dead end is taken back if its parcels can have another access whose ends are all led on.
    Else it stays, or, if `along_holes`, is led on along the hole where it ends.

    Parameters
    ----------
    state
        The streets so far; it is changed.
    along_holes
        Whether streets may run along holes as the last resort.
    """
    for node in dead_ends(state):
        if state.degree[node] != 1:
            continue
        if not state.part_has_street_rim[state.part_of(street_into(state, node))]:
            continue
        if not _replace_end(state, node) and along_holes:
            _lead_along_hole(state, node)


def _replace_end(state: StreetState, node: int) -> bool:
    """Take back a dead end and reach its parcels otherwise; nothing changes if that fails."""
    mark = len(state.journal)
    removed = retract_end(state, node)
    beside = {f for i in removed for f in (state.face[i], state.face[i ^ 1])} - {OUTSIDE}
    if removed and all(_reach_closed(state, f) for f in sorted(beside)):
        return True
    state.undo(mark)
    return False


def _reach_closed(state: StreetState, face: int) -> bool:
    """Give a parcel the first access that leaves no dead end, if it needs one."""
    if state.is_reached(face):
        return True
    distance = state.network_distance()
    for access in find_accesses(state, [face], distance, keep_ends=False, count=LAST_RESORT):
        # the end that is led on first may block the way of the other
        for chains in (access.chains, tuple(i ^ 1 for i in reversed(access.chains))):
            mark = len(state.journal)
            cost = lay_access(state, chains, keep_ends=False)
            if cost < state.unclosed_cost and state.is_reached(face):
                return True
            state.undo(mark)
    return False


def _lead_along_hole(state: StreetState, node: int) -> None:
    view = state.with_lake_sides()
    way = close_end(view, node)
    if way is not None:
        for i in way[1]:
            state.add(i)
            # from now on a street like any other
            state.usable[i] = state.usable[i ^ 1] = True
