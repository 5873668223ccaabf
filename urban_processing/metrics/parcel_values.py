"""Metrics of sets of parcels."""

from __future__ import annotations

import math

import numpy as np

from urban_processing.fabric.model import Fabric
from urban_processing.mesh.corners import IRREGULAR
from urban_processing.mesh.planar import BoolArray, FloatArray
from urban_processing.metrics.averages import highest, lowest, mean, percent
from urban_processing.metrics.parcels import ParcelMeasures


def parcel_values(
    fabric: Fabric, measures: ParcelMeasures, chosen: BoolArray, *, counted_area: FloatArray
) -> dict[str, float]:
    """Metrics of some of the parcels.

    Parameters
    ----------
    fabric, measures
        The fabric and the measures of its parcels.
    chosen
        (F,) which parcels.
    counted_area
        (F,) area that the smallest area allowed is held against.
    """
    p, smallest = measures, fabric.min_area
    if fabric.parcels is None:
        return {}
    n = int(chosen.sum())
    area, irregularity, sides = p.area[chosen], p.irregularity[chosen], p.sides[chosen]
    frontage, thinness = p.frontage[chosen], p.thinness[chosen]
    net, counted = fabric.parcels.net_area[chosen], counted_area[chosen]
    corner_chosen = np.repeat(chosen, p.sides)
    mean_area = mean(area)
    return {
        "parcels": n,
        "triangles": int((sides == 3).sum()),
        "quads": int((sides == 4).sum()),
        "pentagons": int((sides == 5).sum()),
        "hexagons": int((sides == 6).sum()),
        "more_sides": int((sides > 6).sum()),
        "quads_pct": percent(sides == 4),
        "irregularity_min": lowest(irregularity),
        "irregularity_mean": mean(irregularity),
        "irregularity_max": highest(irregularity),
        "irregular_pct": percent(irregularity > IRREGULAR),
        "frontage_mean_m": mean(frontage),
        "frontage_min_m": lowest(frontage),
        **(_on_streets(p, chosen) if fabric.parcels.frontage_known else {}),
        **_proportions(p, chosen),
        "thinness_mean": mean(thinness),
        "thinness_min": lowest(thinness),
        "p_angle_deg": mean(np.abs(p.corner_angle[corner_chosen] - 90.0)),
        "p_area": mean(p.area_ratio[chosen]),
        "undesirable": int(p.undesirable[chosen].sum()),
        "neighbours_mean": mean(fabric.parcels.neighbours[chosen]),
        "undesirable_pct": percent(p.undesirable[chosen]),
        "area_mean_m2": mean_area,
        "area_cv": float(area.std() / mean_area) if n else math.nan,
        "area_min_over_mean": lowest(area) / mean_area,
        "area_max_over_min_area": highest(counted) / smallest,
        **_above(counted, smallest),
        "net_area_mean_m2": mean(net),
        "net_area_min_m2": lowest(net),
    }


def _on_streets(p: ParcelMeasures, chosen: BoolArray) -> dict[str, float]:
    """What frontage says of the parcels, where it is known."""
    return {
        "unreached": int((~p.reached[chosen]).sum()),
        "through_lots": int(p.through[chosen].sum()),
        "through_lots_pct": percent(p.through[chosen]),
    }


def _above(counted: FloatArray, smallest: float) -> dict[str, float]:
    """Parcels that are large beside the smallest one allowed; none where none was promised."""
    if math.isnan(smallest):
        return {}
    return {
        "above_2_min_area_pct": percent(counted > 2.0 * smallest),
        "above_3_min_area": int((counted > 3.0 * smallest).sum()),
    }


def _proportions(p: ParcelMeasures, chosen: BoolArray) -> dict[str, float]:
    """Width over depth of the parcels that have frontage."""
    ratio = (p.width / p.depth)[chosen]
    ratio = ratio[np.isfinite(ratio)]
    low, middle, high = np.quantile(ratio, (0.1, 0.5, 0.9)) if len(ratio) else [math.nan] * 3
    return {
        "width_depth_median": float(middle),
        "width_depth_p10": float(low),
        "width_depth_p90": float(high),
    }
