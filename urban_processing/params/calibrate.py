"""Parameters of `calibrate`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Param, Params


@dataclass(frozen=True, kw_only=True)
class CalibrateParams(Params):
    """Parameters of `calibrate`; lengths in metres."""

    spread: Annotated[
        float,
        Param(
            label="Standard deviations (k)",
            help="k: how many standard deviations the bounds lie below and above the mean of a "
            "block.",
            minimum=0,
            maximum=10,
        ),
    ] = 2.0
    gap: Annotated[
        float,
        Param(
            label="Widest gap",
            help="Parcels with no wider gap between their sides are of one block, where no blocks "
            "are given.",
            unit="m",
            minimum=0,
            maximum=20,
        ),
    ] = 0.1
    least_compactness: Annotated[
        float,
        Param(
            label="Least compactness",
            help="Parcels below this are left out, such as those of roads: 4π·area/perimeter², 1 "
            "for a circle, 0.79 for a square, 0.1 for a strip 29 times as long as wide; 0 leaves "
            "none out.",
            minimum=0,
            maximum=0.9,
            advanced=True,
        ),
    ] = 0.1
