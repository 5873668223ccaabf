"""Groups of unreachable parcels (Chen 2024, section 4.2, step 1)."""

from __future__ import annotations

from urban_processing.mesh.planar import OUTSIDE
from urban_processing.streets.state import StreetState


def unreached_parcels(state: StreetState) -> list[int]:
    """Parcels without the frontage they need."""
    return [f for f in range(len(state.need)) if not state.is_reached(f)]


def group_parcels(state: StreetState, parcels: list[int]) -> list[list[int]]:
    """Split parcels into groups connected across shared chains, the largest group first."""
    left = set(parcels)
    groups = []
    for first in parcels:
        if first not in left:
            continue
        left.discard(first)
        group = [first]
        for f in group:
            for i in state.around[f]:
                g = state.face[i ^ 1]
                if g != OUTSIDE and g in left:
                    left.discard(g)
                    group.append(g)
        groups.append(sorted(group))
    return sorted(groups, key=lambda group: (-len(group), group[0]))
