"""All that is wrong with a call, told together."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from urban_processing.errors import BoundaryError, ParameterError, UrbanError


def gathered(*steps: Callable[[], Any]) -> list[Any]:
    """Take all steps and return what they give; raise all that is wrong with any together."""
    errors: list[UrbanError] = []
    found = []
    for step in steps:
        try:
            found.append(step())
        except (ParameterError, BoundaryError) as error:
            errors.append(error)
    if errors:
        raise errors[0] if len(errors) == 1 else UrbanError(p for e in errors for p in e.problems)
    return found
