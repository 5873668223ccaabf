"""Parameters of `blocks`."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params
from urban_processing.street_rules import CLASS_WIDTHS, FOOTPATHS

_WIDTHS, _LINES, _BLOCKS = "Widths", "Lines", "Blocks"


@dataclass(frozen=True, kw_only=True)
class BlocksParams(Params):
    """Parameters of `blocks`; lengths in metres, areas in m²."""

    default_width: Annotated[
        float,
        Param(
            label="Width of other streets",
            help="Width of the right-of-way of streets of which neither a width nor a class with a "
            "known width is given.",
            unit="m",
            above=0,
            group=_WIDTHS,
        ),
    ] = 12.0
    class_widths: Annotated[
        str | None,
        Param(
            label="Widths by class",
            help="Widths of rights-of-way by class, besides those known: residential=14, "
            "main road=28.",
            group=_WIDTHS,
        ),
    ] = None
    footpaths: Annotated[
        bool,
        Param(
            label="Footpaths are streets",
            help=f"Whether ways without vehicles ({', '.join(sorted(FOOTPATHS))}) bound blocks, "
            "too.",
            group=_LINES,
        ),
    ] = False
    dead_ends: Annotated[
        bool,
        Param(
            label="Dead ends",
            help="Whether streets that end inside a block take land of it; else they are left out.",
            group=_LINES,
        ),
    ] = True
    snap_tolerance: Annotated[
        float,
        Param(
            label="Snapping tolerance",
            help="Ends of lines this near to another line are joined to it; dead ends and loops "
            "shorter than this are left out.",
            unit="m",
            minimum=0,
            group=_LINES,
        ),
    ] = 1.0
    min_area: Annotated[
        float,
        Param(
            label="Smallest block",
            help="What streets leave between them counts as right-of-way if it is smaller.",
            unit="m²",
            minimum=0,
            group=_BLOCKS,
        ),
    ] = 100.0
    min_width: Annotated[
        float,
        Param(
            label="Narrowest block",
            help="What streets leave between them counts as right-of-way if no circle of this "
            "diameter fits into it, such as the strip between two carriageways.",
            unit="m",
            minimum=0,
            group=_BLOCKS,
        ),
    ] = 6.0
    corner_radius: Annotated[
        float,
        Param(
            label="Corner radius",
            help="Radius that rounds the corners of blocks; 0 leaves them as corners, which "
            "subdivision into parcels needs.",
            unit="m",
            minimum=0,
            advanced=True,
        ),
    ] = 0.0
    turning_radius: Annotated[
        float,
        Param(
            label="Turning radius",
            help="Radius of turning heads at dead ends; 0 for none.",
            unit="m",
            minimum=0,
            advanced=True,
        ),
    ] = 0.0

    @property
    def width_m(self) -> Mapping[str, float]:
        """Width by class."""
        return MappingProxyType({**CLASS_WIDTHS, **self.own_width_m})

    @property
    def own_width_m(self) -> Mapping[str, float]:
        """Width by class as far as it was given."""
        own, _ = _table(self.class_widths)
        return MappingProxyType(own)

    def contradictions(self, called: Naming) -> list[str]:
        """Say what in the table of widths is none."""
        _, wrong = _table(self.class_widths)
        return [
            f"{called('class_widths')}: {entry!r} is no class and width in metres, such as "
            "residential=14."
            for entry in wrong
        ]


def _table(text: str | None) -> tuple[dict[str, float], list[str]]:
    """Widths by class, and the entries that say none."""
    out: dict[str, float] = {}
    wrong = []
    pieces = (text or "").replace(";", ",").split(",")
    for entry in filter(None, (piece.strip() for piece in pieces)):
        name, _, number = entry.rpartition("=")
        try:
            width = float(number)
        except ValueError:
            width = math.nan
        if name.strip() and math.isfinite(width) and width > 0:
            out[name.strip()] = width
        else:
            wrong.append(entry)
    return out, wrong
