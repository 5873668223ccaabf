"""How something came about: the steps that made it."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Step:
    """One entry of provenance; `results` are figures that the step has to tell."""

    algorithm: str
    parameters: Mapping[str, Any]
    seed: int
    version: str
    input_sha256: str
    seconds: float
    results: Mapping[str, float] = dataclasses.field(default_factory=dict)


def timeless(history: Iterable[Step]) -> tuple[Step, ...]:
    """Return steps without how long they took, which no two runs share."""
    return tuple(dataclasses.replace(step, seconds=math.nan) for step in history)
