"""Metrics of the land and of its use."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.fabric.model import UNKNOWN_LEVEL, Fabric
from urban_processing.metrics.averages import in_part

PARK_USES = frozenset(
    {
        "allotments", "forest", "garden", "grass", "green", "park", "playground", "recreation",
        "recreation_ground", "village_green", "wood",
    }
)  # fmt: skip
"""Land uses that are parks, as plans and OpenStreetMap name them."""

OTHER_USES = frozenset(
    {
        "brownfield", "cemetery", "civic", "commercial", "construction", "education", "government",
        "greenfield", "hospital", "industrial", "institutional", "landfill", "locked", "military",
        "office", "parking", "patio", "public", "quarry", "railway", "religious", "remnant",
        "retail", "school", "transport", "university", "utility", "vacant", "water",
    }
)  # fmt: skip
"""Land uses that are neither parks nor parcels to live on."""


def land_area(fabric: Fabric, part: int | None) -> float:
    """Area of the land in m², of the whole or of one part."""
    return float(shapely.area(fabric.land[in_part(fabric.land_part, part)]).sum())


def land_values(fabric: Fabric, part: int | None) -> dict[str, float]:
    """Metrics of the land of the whole, or of one part."""
    land = fabric.land[in_part(fabric.land_part, part)]
    parcels = fabric.parcels
    level = np.empty(0) if parcels is None else parcels.level[in_part(parcels.part, part)]
    made = level[level != UNKNOWN_LEVEL]
    return {
        "perimeter_m": float(shapely.length(land).sum()),
        "area_m2": land_area(fabric, part),
        "min_area_m2": fabric.min_area,
        "deepest_level": float(made.max()) if len(made) else math.nan,
        **_land_uses(fabric, part),
    }


def _land_uses(fabric: Fabric, part: int | None) -> dict[str, float]:
    """Right-of-way, and shares of the land in streets, parcels, parks and the rest."""
    streets, street_part, parcels = fabric.right_of_way, fabric.right_of_way_part, fabric.parcels
    if streets is None or street_part is None:
        return {}
    land = land_area(fabric, part)
    taken = float(shapely.area(streets[in_part(street_part, part)]).sum())
    values = {
        "right_of_way_m2": taken,
        "right_of_way_pct": 100.0 * taken / land,
        "land_use_streets_pct": 100.0 * taken / land,
    }
    if parcels is None:
        return values
    inside = in_part(parcels.part, part)
    net, use = parcels.net_area[inside], parcels.land_use[inside]
    named = np.array([str(name).strip().lower() for name in use.tolist()], dtype=np.str_)
    is_park, is_other = (np.isin(named, sorted(uses)) for uses in (PARK_USES, OTHER_USES))
    plain = float(net[~is_park & ~is_other].sum())
    parks = float(net[is_park].sum())
    return {
        **values,
        "land_use_parcels_pct": 100.0 * plain / land,
        "land_use_parks_pct": 100.0 * parks / land,
        "land_use_other_pct": 100.0 * max(land - taken - plain - parks, 0.0) / land,
    }
