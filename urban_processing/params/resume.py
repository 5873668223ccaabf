"""Parameters of going on with a layout that stopped at a level."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params
from urban_processing.params.cogenerate import StopAtLevel
from urban_processing.params.optimize import Snap

PARCEL_LAYER = "parcel_layer"
"""Name of the input that brings parcels without what they were begun with."""


@dataclass(frozen=True, kw_only=True)
class ResumeParams(Params):
    """Parameters of `resume`; what the layout was begun with stands in its provenance."""

    min_area: Annotated[
        float | None,
        Param(
            label="Smallest parcel",
            help="Smallest parcel allowed, in place of the size or the number of parcels that the "
            "layout was begun with; needed for layers, which do not say it. Parcels that are done "
            "stay as they are.",
            unit="m²",
            above=0,
        ),
    ] = None
    stop_at_level: StopAtLevel = None
    snap: Snap = 0.05

    def contradictions_with(self, layers: Collection[str], called: Naming) -> list[str]:
        """Return what contradicts: layers without a size."""
        if PARCEL_LAYER in layers and self.min_area is None:
            return [
                f"Give {called('min_area')} (m²), the smallest parcel allowed: layers do not say "
                "what they were begun with."
            ]
        return []
