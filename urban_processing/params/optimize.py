"""Parameters of the global optimization."""

from __future__ import annotations

import enum
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params


class Energy(enum.StrEnum):
    """The energies of Chen 2024, Eq. 3."""

    REGULARITY = "regularity"
    SIDES = "sides"
    STREETS = "streets"
    JUNCTIONS = "junctions"
    CLOSENESS = "closeness"


LARGEST_SNAP = 10.0
"""Largest tolerance in metres within which edited layers are fitted together."""

_WEIGHTS, _EDITED = "Weights", "Edited layers"

Snap = Annotated[
    float,
    Param(
        label="Tolerance of edited layers",
        help="Gaps and overlaps of edited parcels, and distances of streets from parcel "
        "boundaries, are closed up to this width.",
        unit="m",
        above=0,
        maximum=LARGEST_SNAP,
        advanced=True,
        group=_EDITED,
    ),
]
"""The parameter of algorithms that read layouts which people may have edited."""


@dataclass(frozen=True, kw_only=True)
class OptimizeParams(Params):
    """Parameters of `optimize`; lengths in metres, areas in m²."""

    weight_regularity: Annotated[
        float,
        Param(
            label="Weight of regular parcels (ω1)",
            help="ω1: how much the irregularity of parcels counts.",
            minimum=0,
            group=_WEIGHTS,
        ),
    ] = 4.0
    weight_sides: Annotated[
        float,
        Param(
            label="Weight of smooth sides (ω2)",
            help="ω2: how much bends in the sides of parcels count.",
            minimum=0,
            group=_WEIGHTS,
        ),
    ] = 2.0
    weight_streets: Annotated[
        float,
        Param(
            label="Weight of smooth streets (ω3)",
            help="ω3: how much bends in streets count.",
            minimum=0,
            group=_WEIGHTS,
        ),
    ] = 4.0
    weight_junctions: Annotated[
        float,
        Param(
            label="Weight of right-angled junctions (ω4)",
            help="ω4: how much junctions of streets at other angles than 90° count.",
            minimum=0,
            group=_WEIGHTS,
        ),
    ] = 8.0
    weight_closeness: Annotated[
        float,
        Param(
            label="Weight of staying in place (ω5)",
            help="ω5: how much moving away from the layout as it was counts.",
            above=0,
            group=_WEIGHTS,
        ),
    ] = 0.05
    min_area: Annotated[
        float | None,
        Param(
            label="Smallest parcel",
            help="Smallest parcel that may result; by default the one that the layout file "
            "promises, or for layers the area of their smallest parcel. What is smaller "
            "already does not shrink.",
            unit="m²",
            above=0,
        ),
    ] = None
    snap: Snap = 0.05

    def contradictions(self, called: Naming) -> list[str]:
        """Return what contradicts: weights that leave nothing to optimize."""
        improving = [e for e in Energy if e is not Energy.CLOSENESS]
        if any(self.weights[energy] != 0 for energy in improving):
            return []
        names = ", ".join(called(f"weight_{energy.value}") for energy in improving)
        return [f"{names} are all zero: nothing is left to optimize."]

    @property
    def weights(self) -> Mapping[Energy, float]:
        """ω1 to ω5 of Eq. 3."""
        return {energy: getattr(self, f"weight_{energy.value}") for energy in Energy}
