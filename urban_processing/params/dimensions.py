"""Dimensions of parcels and blocks that do not go together."""

from __future__ import annotations

import math

from urban_processing.params.base import Naming

LARGEST_OVER_MIN = 2.0
"""Parcels are cut until they are smaller than so many smallest areas."""

WIDEST = 4.0
"""Parcels wider than so many depths are no answer to a large frontage."""


def unfit_dimensions(
    called: Naming,
    *,
    min_area: float,
    width_depth: float | None,
    least_frontage: float | None,
    max_block_length: float | None,
) -> list[str]:
    """Return one sentence for each wanted dimension that does not fit the others.

    Parameters
    ----------
    called
        Gives the name of a parameter as the user knows it.
    min_area
        Smallest area of a parcel in m².
    width_depth, least_frontage, max_block_length
        The wanted dimensions in metres; None where they are free.
    """
    problems = []
    frontage, block = called("least_frontage"), called("max_block_length")
    if least_frontage is not None and (width_depth is None or width_depth > 0):
        largest = LARGEST_OVER_MIN * min_area
        ratio = WIDEST if width_depth is None else width_depth
        widest = math.sqrt(largest * ratio)
        shape = (
            f"{called('width_depth')} {ratio:g}" if width_depth else f"{ratio:g} times the depth"
        )
        if least_frontage > widest:
            problems.append(
                f"{frontage} {least_frontage:g} m is too much for parcels of {min_area:.4g} to "
                f"{largest:.4g} m²: with {shape} they are at most {widest:.4g} m wide."
            )
    if max_block_length is not None:
        side = math.sqrt(min_area)
        if max_block_length < side:
            problems.append(
                f"{block} {max_block_length:g} m is less than the side of the smallest parcel "
                f"({side:.4g} m)."
            )
        if least_frontage is not None and max_block_length < least_frontage:
            problems.append(
                f"{block} {max_block_length:g} m is less than {frontage} {least_frontage:g} m: a "
                "block is at least one parcel long."
            )
    return problems
