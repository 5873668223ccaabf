"""What is to be known before sides are compared: other lands, another density."""

from __future__ import annotations

import math

import numpy as np

from urban_processing.metrics.comparison import Comparison, Side
from urban_processing.metrics.distributions import EMPTY

SAME_LAND = 0.95
"""Lands that share this part of their area, or more, are taken for the same."""

ANOTHER_DENSITY = 1.5
"""Blocks or parcels that are so many times as large are of another density."""

LANDS, DENSITY = "lands", "density"


def notes(comparison: Comparison, names: tuple[str, ...] = ()) -> list[tuple[str, str]]:
    """Return what each note is about, `LANDS` or `DENSITY`, and a sentence.

    Parameters
    ----------
    comparison
        The comparison.
    names
        What the sides are called in the sentences; by default as in the comparison.
    """
    shown = names or comparison.names
    other = [k for k in range(len(shown)) if k != comparison.reference_number]
    found = [(LANDS, _lands(comparison, k, shown)) for k in other]
    found += [(DENSITY, _density(comparison, k, shown)) for k in other]
    return [(about, text) for about, text in found if text]


def _lands(comparison: Comparison, k: int, names: tuple[str, ...]) -> str:
    """Say that side k has another land than the reference; nothing if it has the same."""
    reference = comparison.reference_number
    share = comparison.shared_land[k] if comparison.shared_land else math.nan
    systems = bool(comparison.shared_land) and math.isnan(share)
    areas = [comparison.sides[j].values.get("area_m2", math.nan) for j in (k, reference)]
    proportion = min(areas) / max(areas) if min(areas) > 0.0 else math.nan
    known = proportion if math.isnan(share) else share
    if math.isnan(known) or round(known, 6) >= SAME_LAND:
        unknown = "It is not known whether the lands are the same: coordinate systems differ."
        return unknown if systems else ""
    size = ""
    if not math.isnan(proportion):
        size = f" ({_size(areas[0])} in {names[k]}, {_size(areas[1])} in {names[reference]})"
    if math.isnan(share):
        how = "how much they share is not known"
        how += ", for their coordinate systems differ" if systems else ""
    elif round(share, 6) == 0.0:
        how = "they lie apart"
    else:
        how = f"they share {_percent(share)} of their area"
    return f"The lands are not the same{size}: {how}."


def _percent(share: float) -> str:
    return "under 1 %" if share < 0.01 else f"{100.0 * share:.0f} %"


def _size(area: float) -> str:
    return f"{area / 1e6:,.1f} km²" if area >= 1e6 else f"{area / 1e4:,.3g} ha"


def _density(comparison: Comparison, k: int, names: tuple[str, ...]) -> str:
    """Say that blocks or parcels of side k are of another size; nothing if they are not."""
    reference = comparison.reference_number
    pair, called = [comparison.sides[j] for j in (k, reference)], (names[k], names[reference])
    clauses = []
    for things, mean, size in (("blocks", "median", _block), ("parcels", "mean", _parcel)):
        sizes = [size(side) for side in pair]
        # undefined sizes compare as False
        if min(sizes) > 0.0 and round(max(sizes) / min(sizes), 6) > ANOTHER_DENSITY:
            larger = int(np.argmax(sizes))
            times = f"{max(sizes) / min(sizes):,.{0 if max(sizes) >= 10 * min(sizes) else 1}f}"
            clauses.append(
                f"{things} are {times} times as large ({mean}) in {called[larger]} as in "
                f"{called[1 - larger]}"
            )
    if not clauses:
        return ""
    said = "; ".join(clauses)
    return f"{said[0].upper()}{said[1:]}: another density; figures of size differ by that already."


def _block(side: Side) -> float:
    return side.samples.get("block_area_m2", EMPTY).median


def _parcel(side: Side) -> float:
    return side.values.get("area_mean_m2", math.nan)
