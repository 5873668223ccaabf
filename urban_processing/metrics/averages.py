"""Figures of a set of values that are NaN where the set is empty."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import BoolArray, IntArray


def mean(values: npt.NDArray[Any]) -> float:
    """Return the mean."""
    return float(values.mean()) if len(values) else math.nan


def lowest(values: npt.NDArray[Any]) -> float:
    """Return the lowest value."""
    return float(values.min()) if len(values) else math.nan


def highest(values: npt.NDArray[Any]) -> float:
    """Return the highest value."""
    return float(values.max()) if len(values) else math.nan


def percent(true: BoolArray) -> float:
    """Return the share that is true in percent."""
    return 100.0 * float(true.mean()) if len(true) else math.nan


def in_part(of: IntArray, part: int | None) -> BoolArray:
    """(n,) what belongs to a part, or all of it where the part is None."""
    return np.ones(len(of), dtype=bool) if part is None else np.asarray(of == part)
