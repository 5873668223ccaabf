"""The one rule that says when a parcel is reached by a street."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import BoolArray, FloatArray

ACCESS_SHARE = 0.25
"""Frontage that a reached parcel has at least, as a share of the square root of its area."""


def required_frontage(area: npt.ArrayLike) -> FloatArray:
    """Return the frontage in metres from which parcels of `area` (m²) count as reached.

    It is never less than the published definition of a reached parcel,
    ``min(3 m, 0.25 * sqrt(area))``, so that what is reached here is reached there.
    """
    return np.asarray(ACCESS_SHARE * np.sqrt(np.asarray(area, dtype=np.float64)))


def is_reached(frontage: npt.ArrayLike, area: npt.ArrayLike) -> BoolArray:
    """Return whether parcels with `frontage` (m) on streets and `area` (m²) are reached."""
    return np.asarray(np.asarray(frontage, dtype=np.float64) >= required_frontage(area))
