"""Values of attributes as people and programs write them: lists, units, decimal commas."""

from __future__ import annotations

import ast
import math
import re
from typing import Any

import numpy as np

FOOT = 0.3048

_NUMBER = re.compile(r"[-+]?\d+(?:[.,]\d+)?(?:[eE][-+]?\d+)?")
_IN_FEET = re.compile(r"['′]|\bf(?:ee|oo)?t\b")


def values_of(value: Any) -> list[Any]:
    """Members of a list, of one that is written as text, or of text with semicolons."""
    if isinstance(value, list | tuple | np.ndarray):
        return list(value)
    if isinstance(value, str):
        if value.strip().startswith("["):
            try:
                return list(ast.literal_eval(value.strip()))
            except (ValueError, SyntaxError):
                return [value]
        return [piece.strip() for piece in value.split(";")]
    return [value]


def length_of(value: Any) -> float:
    """A number, also one written with its unit; NaN for none."""
    if isinstance(value, bool):
        return math.nan
    if not isinstance(value, str):
        try:
            return float(value)
        except (TypeError, ValueError):
            return math.nan
    found = _NUMBER.match(value.strip())
    if found is None:
        return math.nan
    number = float(found.group().replace(",", "."))
    return number * FOOT if _IN_FEET.search(value) else number
