"""Parcels and areas in the sentences of a session."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from urban_processing.layout import PARCEL_USE

NAMED = 6
"""So many parcels are named at most; of more, so many and how many there are."""


def parcels_named(numbers: Iterable[int]) -> str:
    """Return "parcel 4", "parcels 4 and 7", or "12 parcels, such as 1, 2 and 3"."""
    names = [str(number) for number in sorted(set(numbers))]
    if len(names) == 1:
        return f"parcel {names[0]}"
    if len(names) <= NAMED:
        return f"parcels {_listed(names)}"
    return f"{len(names):,} parcels, such as {_listed(names[:NAMED])}"


def beginning(words: str) -> str:
    """Return words as a sentence begins with them."""
    return words[:1].upper() + words[1:]


def locked_as(land_use: str) -> str:
    """Return "locked as park", or "locked" where there is no such use."""
    return "locked" if land_use == PARCEL_USE else f"locked as {land_use}"


def areas_named(areas: Sequence[float]) -> str:
    """Return "120 m² and 3,400 m²", the smallest first."""
    return _listed([f"{area:,.0f} m²" for area in sorted(areas)])


def _listed(names: Sequence[str]) -> str:
    return " and ".join([", ".join(names[:-1]), names[-1]] if len(names) > 1 else names)
