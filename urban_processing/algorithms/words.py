"""Parameters in words, the same in help texts, toolboxes and reference pages."""

from __future__ import annotations

import enum

from urban_processing.algorithms.spec import Estimate
from urban_processing.params.base import ParamField

_KINDS = {bool: "yes or no", int: "whole number", float: "number", str: "text"}


def kind_in_words(field: ParamField) -> str:
    """Return what values a parameter takes: ``number in m²``, ``loop, cul-de-sac or tree``."""
    if issubclass(field.kind, enum.Enum):
        choices = [str(member.value) for member in field.kind]
        return f"{', '.join(choices[:-1])} or {choices[-1]}" if choices[1:] else choices[0]
    unit = f" in {field.param.unit}" if field.param.unit else ""
    return _KINDS[field.kind] + unit


def limits_in_words(field: ParamField) -> str:
    """Return the limits of a number: ``above 0``, ``4 to 200``; nothing if there are none."""
    param = field.param
    if param.minimum is not None and param.maximum is not None:
        return f"{param.minimum:g} to {param.maximum:g}"
    words = []
    if param.above is not None:
        words.append(f"above {param.above:g}")
    if param.minimum is not None:
        words.append(f"at least {param.minimum:g}")
    if param.maximum is not None:
        words.append(f"at most {param.maximum:g}")
    return ", ".join(words)


def default_in_words(field: ParamField) -> str:
    """Return the default as a user would write it; nothing if it is worked out or missing."""
    default = field.default
    if default is None:
        return ""
    if isinstance(default, enum.Enum):
        return str(default.value)
    if isinstance(default, bool):
        return "yes" if default else "no"
    return f"{default:g}" if isinstance(default, float) else str(default)


def column_in_words(field: ParamField) -> str:
    """Return ``or a column`` for a parameter that a column may set feature by feature."""
    return "or a column" if field.param.per_feature else ""


def estimate_in_words(estimate: Estimate) -> str:
    """Return what a run will make and take: ``about 1,200 parcels, about 2.2 s``."""
    return f"about {estimate.parcels:,} parcels, about {duration_in_words(estimate.seconds)}"


def duration_in_words(seconds: float) -> str:
    """Return a time as one would say it.

    >>> [duration_in_words(s) for s in (0.2, 3.21, 75, 8000)]
    ['0.2 s', '3.2 s', '1 min 15 s', '2 h 13 min']
    """
    if seconds < 10:
        return f"{max(seconds, 0.1):.1f} s"
    if seconds < 60:
        return f"{seconds:.0f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"
