"""What a finished layout does not keep of the dimensions that were wanted."""

from __future__ import annotations

import numpy as np

from urban_processing.access_rule import MEASURED_M
from urban_processing.errors import InfeasibleError
from urban_processing.layout import Layout
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.metrics.parcels import width_and_depth
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.params.dimensions import unfit_dimensions
from urban_processing.pipelines.findings import parcel_issues
from urban_processing.site import Issue

OFF_RATIO = 1.5
"""Parcels whose width : depth is off by more than this factor are counted."""

_IN_WORDS = {
    "width_depth": "a width : depth of",
    "least_frontage": "a least frontage of",
    "max_block_length": "a longest block of",
}


def check_dimensions(params: CogenerateParams, *, min_area: float) -> None:
    """Raise `InfeasibleError` if wanted dimensions do not fit parcels of `min_area` m².

    The parameters check this themselves where the smallest area is given.
    """
    problems = unfit_dimensions(
        _IN_WORDS.__getitem__,
        min_area=min_area,
        width_depth=params.width_depth,
        least_frontage=params.least_frontage,
        max_block_length=params.max_block_length,
    )
    if problems:
        raise InfeasibleError(p[:1].upper() + p[1:] for p in problems)


def missed_dimensions(layout: Layout, params: CogenerateParams) -> list[Issue]:
    """List what goes against hard limits one by one, and what misses a goal as one issue each."""
    return [
        *(_short_frontages(layout, params) if params.least_frontage is not None else []),
        *(_off_proportions(layout, params.width_depth) if params.width_depth is not None else []),
        *(_long_blocks(layout, params) if params.max_block_length is not None else []),
    ]


def _short_frontages(layout: Layout, params: CogenerateParams) -> list[Issue]:
    frontage, least = layout.frontage, params.least_frontage or 0.0
    short = frontage < least - MEASURED_M
    if params.hard_frontage:
        return parcel_issues(
            layout,
            "frontage_below_limit",
            "The frontage of this parcel is {value:.1f} m, less than the limit of {limit:.1f} m; "
            "no street could be added for it.",
            short,
            frontage,
            np.full(len(frontage), least),
        )
    if not short.any():
        return []
    worst = float(frontage.min())
    message = (
        f"{int(short.sum())} of {len(short)} parcels have less than the {least:g} m of frontage "
        f"wanted, the least {worst:.1f} m. As a hard limit it would add streets for them."
    )
    return [Issue(code="frontage_missed", message=message, value=worst, limit=least)]


def _off_proportions(layout: Layout, wanted: float) -> list[Issue]:
    width, depth = width_and_depth(layout)
    ratio = (width / depth)[np.isfinite(width)]
    off = np.abs(np.log(ratio / wanted)) > np.log(OFF_RATIO)
    if not off.any():
        return []
    middle = float(np.median(ratio))
    message = (
        f"The width : depth of {int(off.sum())} of {len(ratio)} parcels is off {wanted:g} by more "
        f"than a factor of {OFF_RATIO:g}, from {ratio.min():.2f} to {ratio.max():.2f}; the median "
        f"of all is {middle:.2f}. Parcels at street corners are rarely narrow by this measure."
    )
    return [Issue(code="width_depth_missed", message=message, value=middle, limit=wanted)]


def _long_blocks(layout: Layout, params: CogenerateParams) -> list[Issue]:
    most = params.max_block_length or 0.0
    measures = LayoutMeasures(layout)
    length = measures.block_sides.length
    long = np.flatnonzero(length > most + MEASURED_M)
    if params.hard_block_length:
        return [_long_block(layout, measures, block, most) for block in long.tolist()]
    if not len(long):
        return []
    worst = float(length.max())
    message = (
        f"{len(long)} of {len(length)} blocks are longer than the {most:g} m wanted, the longest "
        f"{worst:.0f} m: no street along parcels divides them into blocks that are large enough."
    )
    return [Issue(code="block_length_missed", message=message, value=worst, limit=most)]


def _long_block(layout: Layout, measures: LayoutMeasures, block: int, most: float) -> Issue:
    length = float(measures.block_sides.length[block])
    first = int(np.flatnonzero(layout.face_block == block)[0])
    return Issue(
        code="block_too_long",
        message=f"This block is {length:.0f} m long, more than the limit of {most:.0f} m; no "
        "street along parcels divides it.",
        part=int(layout.face_part[first]),
        value=length,
        limit=most,
        geometry=measures.block_sides.outline[block],
    )
