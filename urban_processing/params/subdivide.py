"""Parameters of `subdivide`."""

from __future__ import annotations

import enum
from dataclasses import dataclass
from typing import Annotated

from urban_processing.params.base import Naming, Param, Params


class Strategy(enum.StrEnum):
    """How a block becomes parcels."""

    SKELETON = "skeleton"
    """Rows of parcels along the streets, back to back (Vanegas 2012, section 4.2)."""
    OBB = "obb"
    """Halves of oriented bounding boxes, again and again (Vanegas 2012, section 4.3)."""
    HYBRID = "hybrid"
    """Rows of a given depth along the streets, oriented boxes within."""
    STREAMLINE = "streamline"
    """Cuts along a cross field (Chen 2024, section 4), without new streets."""


class Patio(enum.StrEnum):
    """What becomes of the inside of a block whose rows of parcels do not fill it."""

    OPEN = "open"
    """One piece of common land."""
    OBB = "obb"
    SKELETON = "skeleton"
    STREAMLINE = "streamline"


class CornerLots(enum.StrEnum):
    """Which street a parcel at a corner belongs to (Vanegas 2012, section 4.2.2)."""

    STREET_WIDTH = "street-width"
    STREET_LENGTH = "street-length"


STRATEGY_LABELS = {
    "skeleton": "Rows along the streets (skeleton)",
    "obb": "Oriented boxes",
    "hybrid": "Rows along the streets, boxes within",
    "streamline": "Streamlines of a cross field",
}
"""Readable names of strategies."""

MAX_OVER_MIN = 2.5
"""Largest area over the smallest one, where it is not given."""

WIDTH_SHARES = (0.6, 1.2)
"""Smallest and largest width over √(smallest area), where they are not given."""

SNAP_SHARE = 0.1
"""Snapping distance over √(smallest area), where it is not given."""

_SIZE, _SHAPE, _SKELETON = "Size", "Shape", "Rows of parcels"


@dataclass(frozen=True, kw_only=True)
class SubdivideParams(Params):
    """Parameters of `subdivide`; lengths in metres, areas in m²."""

    strategy: Annotated[
        Strategy,
        Param(
            label="Strategy",
            help="How blocks become parcels: rows along the streets (skeleton), oriented boxes "
            "(obb), rows around boxes (hybrid), or cuts along a cross field (streamline).",
            group=_SIZE,
            per_feature=True,
            labels=STRATEGY_LABELS,
        ),
    ] = Strategy.SKELETON
    min_area: Annotated[
        float,
        Param(
            label="Smallest parcel",
            help="No parcel is smaller, but for blocks that are smaller themselves.",
            unit="m²",
            above=0,
            group=_SIZE,
            per_feature=True,
        ),
    ] = 400.0
    max_area: Annotated[
        float | None,
        Param(
            label="Largest parcel",
            help=f"Parcels above this are divided; by default {MAX_OVER_MIN:g} times the smallest.",
            unit="m²",
            above=0,
            group=_SIZE,
            per_feature=True,
        ),
    ] = None
    min_width: Annotated[
        float | None,
        Param(
            label="Smallest width",
            help="Smallest width of parcels along the street; by default "
            f"{WIDTH_SHARES[0]:g}·√(smallest parcel). Oriented boxes go down to half of it rather "
            "than leave a parcel above the largest area.",
            unit="m",
            above=0,
            group=_SIZE,
            per_feature=True,
        ),
    ] = None
    max_width: Annotated[
        float | None,
        Param(
            label="Largest width",
            help="Largest width of parcels along the street; by default "
            f"{WIDTH_SHARES[1]:g}·√(smallest parcel).",
            unit="m",
            above=0,
            group=_SIZE,
            per_feature=True,
        ),
    ] = None
    irregularity: Annotated[
        float,
        Param(
            label="Split irregularity (ω)",
            help="ω: how far cuts are moved at random from their regular place; 0 for not at all.",
            minimum=0,
            maximum=1,
            group=_SHAPE,
            per_feature=True,
        ),
    ] = 0.2
    street_access: Annotated[
        float,
        Param(
            label="Street access (ξ)",
            help="ξ: how often a cut that would leave a parcel without street is turned; with 1 "
            "no such cut is made, with 0 all of them.",
            minimum=0,
            maximum=1,
            group=_SHAPE,
            per_feature=True,
        ),
    ] = 1.0
    offset: Annotated[
        float | None,
        Param(
            label="Depth of the rows",
            help="Depth of the parcels along the streets; what lies within is the patio. By "
            "default rows meet back to back; for hybrid they are as deep as a mean parcel of mean "
            "width.",
            unit="m",
            above=0,
            group=_SKELETON,
            per_feature=True,
        ),
    ] = None
    patio: Annotated[
        Patio,
        Param(
            label="Patio",
            help="What becomes of the inside of a block with a depth of its rows: left open, or "
            "divided in one of the ways.",
            group=_SKELETON,
            per_feature=True,
            labels={
                "open": "Left open",
                "obb": "Oriented boxes",
                "skeleton": "Skeleton",
                "streamline": "Streamlines",
            },
        ),
    ] = Patio.OPEN
    corner_lots: Annotated[
        CornerLots,
        Param(
            label="Corner parcels",
            help="Which street a parcel at a corner belongs to: the wider one, or the one with the "
            "longer side of the block.",
            group=_SKELETON,
            per_feature=True,
            labels={"street-width": "The wider street", "street-length": "The longer street"},
        ),
    ] = CornerLots.STREET_WIDTH
    corner_angle: Annotated[
        float,
        Param(
            label="Angle of a corner",
            help="Where the contour of a block bends by more than this, another street begins.",
            unit="°",
            minimum=5,
            maximum=170,
            advanced=True,
        ),
    ] = 40.0
    snap_distance: Annotated[
        float | None,
        Param(
            label="Snapping distance",
            help="A cut this near to a vertex of the block's contour goes through it; by default "
            f"{SNAP_SHARE:g}·√(smallest parcel).",
            unit="m",
            minimum=0,
            advanced=True,
        ),
    ] = None
    seed: Annotated[int, Param(label="Seed", help="Random seed.", minimum=0)] = 0

    def contradictions(self, called: Naming) -> list[str]:
        """Say which bounds leave nothing between them."""
        problems = []
        for low, high in (("min_area", "max_area"), ("min_width", "max_width")):
            least, most = getattr(self, low), getattr(self, high)
            if least is not None and most is not None and least > most:
                problems.append(
                    f"{called(low)} ({least:g}) must not be above {called(high)} ({most:g})."
                )
        return problems


def per_block_parameters() -> tuple[str, ...]:
    """Return the names of the parameters that a column of the block layer may override."""
    return tuple(f.name for f in SubdivideParams.fields() if f.param.per_feature)
