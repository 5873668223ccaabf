"""How much of their land two fabrics have in common."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.fabric.model import Fabric


def shared_land(a: Fabric, b: Fabric) -> float:
    """Return the area that two lands share over that of both together: 0 apart, 1 the same.

    NaN where it is not known: their coordinates are of different systems, or there is no area.
    """
    if a.frame.crs != b.frame.crs:
        return math.nan
    first, second = (_on_the_map(fabric) for fabric in (a, b))
    common = float(shapely.area(shapely.intersection(first, second)))
    whole = float(shapely.area(first)) + float(shapely.area(second)) - common
    return common / whole if whole > 0.0 else math.nan


def _on_the_map(fabric: Fabric) -> shapely.Geometry:
    origin = np.asarray(fabric.frame.origin)
    return shapely.transform(shapely.union_all(fabric.land), lambda xy: xy + origin)
