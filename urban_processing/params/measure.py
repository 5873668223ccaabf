"""Parameters of `measure` and `compare`: how layers of other programs are read."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Param, Params
from urban_processing.params.blocks import BlocksParams

_STREETS, _PARCELS = "Streets", "Parcels"


@dataclass(frozen=True, kw_only=True)
class MeasureParams(Params):
    """How parcels and streets that are no layout of ours become a fabric; lengths in metres."""

    street_reach: Annotated[
        float,
        Param(
            label="Reach of streets",
            help="A parcel has frontage where nothing lies between it and a street, and the "
            "street's centreline runs beside it no further away than half the street's width and "
            "this: real rights-of-way are wider than the nominal ones of their class.",
            unit="m",
            minimum=0,
            maximum=100,
            group=_PARCELS,
        ),
    ] = 10.0
    default_width: Annotated[
        float,
        Param(
            label="Width of other streets",
            help="Width of the right-of-way of streets of which neither a width nor a class with a "
            "known width is given.",
            unit="m",
            above=0,
            group=_STREETS,
        ),
    ] = 12.0
    footpaths: Annotated[
        bool,
        Param(
            label="Footpaths are streets",
            help="Whether ways without vehicles bound blocks and give frontage, too.",
            group=_STREETS,
        ),
    ] = False
    snap_tolerance: Annotated[
        float,
        Param(
            label="Snapping tolerance",
            help="Ends of streets this near to another street are joined to it, dead ends shorter "
            "than this are left out, and a street this near to the rim of the land, or nearer than "
            "a quarter of its width, runs along it.",
            unit="m",
            minimum=0,
            maximum=20,
            group=_STREETS,
        ),
    ] = 1.0

    @property
    def of_streets(self) -> BlocksParams:
        """The same for the search for blocks."""
        return BlocksParams(
            default_width=self.default_width,
            footpaths=self.footpaths,
            snap_tolerance=self.snap_tolerance,
        )
