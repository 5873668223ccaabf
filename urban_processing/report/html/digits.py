"""Numbers as people read them."""

from __future__ import annotations

import math
from collections.abc import Iterable

DIGITS = 3
"""Digits of a number that is not whole."""

MOST_DECIMALS = 4
"""Decimals that nobody needs more of."""

MINUS = "\u2212"


def decimals_for(values: Iterable[float]) -> int:
    """Return the decimals for numbers of one row: none if all are whole, else three digits.

    >>> decimals_for([1273.0, 4.0]), decimals_for([0.0234, 0.5]), decimals_for([1273.4])
    (0, 3, 0)
    """
    known = [round(abs(v), MOST_DECIMALS + 2) for v in values if math.isfinite(v)]
    if all(v == round(v) for v in known):
        return 0
    largest = max(known)
    return min(max(DIGITS - 1 - math.floor(math.log10(largest)), 0), MOST_DECIMALS)


def number(value: float, decimals: int | None = None) -> str:
    """Return a number with commas and a true minus sign; nothing where there is none.

    >>> number(1273.0), number(0.12345), number(-4.5, 1), number(float("nan"))
    ('1,273', '0.123', '−4.5', '')
    """
    if math.isnan(value):
        return ""
    if math.isinf(value):
        return "∞" if value > 0 else f"{MINUS}∞"
    shown = f"{value:,.{decimals_for([value]) if decimals is None else decimals}f}"
    if not shown.strip("-0.,"):
        shown = shown.lstrip("-")
    return shown.replace("-", MINUS)


def signed(value: float, decimals: int) -> str:
    """Return a difference: with its sign, but nought without."""
    shown = number(value, decimals)
    return shown if value <= 0 or not shown.strip("0.,") or math.isnan(value) else f"+{shown}"


def with_unit(value: float, unit: str, decimals: int | None = None) -> str:
    """Return a number and its unit: ``1,273 m²``, ``12.5°``.

    >>> print(with_unit(1273.0, "m²"), with_unit(12.5, "°"))
    1,273 m² 12.5°
    """
    gap = "" if unit in ("", "°") else "\u00a0"
    return f"{number(value, decimals)}{gap}{unit}"


def counted(n: int, noun: str, several: str = "") -> str:
    """Return how many there are: ``1 parcel``, ``1,273 parcels``.

    >>> counted(1, "parcel"), counted(2, "dead end"), counted(2, "entry", "entries")
    ('1 parcel', '2 dead ends', '2 entries')
    """
    return f"{n:,} {noun if n == 1 else several or noun + 's'}"


def share(part: float, whole: float) -> str:
    r"""Return a share in percent; ``under 1`` and ``over 99`` where rounding would deceive.

    >>> [share(n, 1000).replace("\u00a0", " ") for n in (0, 1, 500, 999, 1000)]
    ['0 %', 'under 1 %', '50 %', 'over 99 %', '100 %']
    """
    percent = 100.0 * part / whole if whole else 0.0
    if 0.0 < percent < 1.0:
        return "under 1\u00a0%"
    if 99.0 < percent < 100.0:
        return "over 99\u00a0%"
    return f"{percent:.0f}\u00a0%"
