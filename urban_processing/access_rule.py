"""When a parcel is reached by a street, and the stricter goal of street generation."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.layout import Layout
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray

REACHED_M = 3.0
REACHED_SHARE = 0.25
"""A parcel is reached from this frontage on: `REACHED_M`, or this share of √area if less."""

MEASURED_M = 1e-6
"""Precision in metres of a measured frontage: coordinates are kept to the micrometre."""

ACCESS_SHARE = 0.25
"""Frontage that street generation gives every parcel, as a share of the square root of its area."""


def required_frontage(area: npt.ArrayLike, *, least: float = 0.0) -> FloatArray:
    """Return the frontage in metres from which parcels of `area` (m²) count as reached.

    It is never less than the published definition of a reached parcel,
    ``min(3 m, 0.25 * sqrt(area))``, so that what is reached here is reached there, and never
    less than the `least` frontage (m) that was set as a hard limit.
    """
    by_area = ACCESS_SHARE * np.sqrt(np.asarray(area, dtype=np.float64))
    return np.asarray(np.maximum(by_area, least))


def is_reached(frontage: npt.ArrayLike, area: npt.ArrayLike, *, least: float = 0.0) -> BoolArray:
    """Return whether parcels with `frontage` (m) on streets and `area` (m²) are reached."""
    found = np.asarray(frontage, dtype=np.float64)
    return np.asarray(found >= required_frontage(area, least=least))


def reached_frontage(area: npt.ArrayLike) -> FloatArray:
    """Frontage in metres from which parcels of `area` m² are reached: min(3 m, 0.25·√area)."""
    side = np.sqrt(np.asarray(area, dtype=np.float64))
    return np.asarray(np.minimum(REACHED_M, REACHED_SHARE * side))


def unreached_parcels_of(layout: Layout) -> IntArray:
    """Faces of the parcels of a layout that no street reaches, by `reached_frontage`."""
    enough = reached_frontage(layout.mesh.face_area) - MEASURED_M
    return np.flatnonzero(layout.frontage < enough)
