"""Places and distances of an edit in the local coordinates of a moment."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from urban_processing.errors import EditError
from urban_processing.mesh.planar import FloatArray
from urban_processing.session.moment import Moment
from urban_processing.session.reading import Place

SNAP_SHARE, LEAST_SNAP = 0.1, 0.05
"""A drawn line lies on a boundary within this share of the side of a parcel of the smallest area,
and within `LEAST_SNAP` metres at least."""

REACH_SHARE = 0.5
"""What somebody points at is meant within this share of the side of a parcel of the smallest
area."""


def local(moment: Moment, places: Sequence[Place]) -> FloatArray:
    """(n, 2) local coordinates of places on the map."""
    origin = np.asarray(moment.state.layout.frame.origin)
    return np.asarray(np.asarray(places, dtype=np.float64) - origin)


def face_of(moment: Moment, parcel: int | Place) -> int:
    """The face of a parcel that is given by its number or by a place in it."""
    if isinstance(parcel, int):
        return moment.face(parcel)
    face = moment.face_at(local(moment, (parcel,))[0])
    if face is None:
        raise EditError(f"There is no parcel at {parcel[0]:.1f}, {parcel[1]:.1f}.")
    return face


def snap_of(moment: Moment, given: float | None) -> float:
    """Tolerance in metres of drawn lines."""
    return max(LEAST_SNAP, SNAP_SHARE * _side(moment)) if given is None else given


def reach_of(moment: Moment, given: float | None) -> float:
    """Distance in metres within which something is pointed at."""
    return REACH_SHARE * _side(moment) if given is None else given


def _side(moment: Moment) -> float:
    return math.sqrt(moment.state.min_area)
