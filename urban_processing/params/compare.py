"""Parameters of the comparison of fabrics."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Param
from urban_processing.params.measure import MeasureParams

_STATISTICS = "Statistics"


@dataclass(frozen=True, kw_only=True)
class CompareParams(MeasureParams):
    """Parameters of `compare`: those of `measure`, and those of statistics."""

    reference: Annotated[
        str | None,
        Param(
            label="Reference",
            help="Name of the side that the others are set against; by default what is there, or "
            "else the first.",
        ),
    ] = None
    service: Annotated[
        bool,
        Param(
            label="Service ways",
            help="Whether service ways of OpenStreetMap count as streets.",
        ),
    ] = False
    clean: Annotated[
        bool,
        Param(
            label="Clean OpenStreetMap",
            help="Whether dual carriageways, roundabouts and slip roads of OpenStreetMap become "
            "single lines and junctions.",
        ),
    ] = True
    resamples: Annotated[
        int,
        Param(
            label="Resamples",
            help="How often samples are drawn anew for the intervals of distances.",
            minimum=100,
            maximum=100_000,
            advanced=True,
            group=_STATISTICS,
        ),
    ] = 1000
    confidence: Annotated[
        float,
        Param(
            label="Confidence",
            help="Confidence of these intervals.",
            above=0.5,
            maximum=0.999,
            advanced=True,
            group=_STATISTICS,
        ),
    ] = 0.95
    seed: Annotated[
        int,
        Param(
            label="Seed",
            help="Random seed of these samples.",
            minimum=0,
            advanced=True,
            group=_STATISTICS,
        ),
    ] = 0
