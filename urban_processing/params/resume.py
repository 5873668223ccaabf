"""Parameters of going on with a layout that stopped at a level."""

from __future__ import annotations

from dataclasses import dataclass

from urban_processing.params.base import Params
from urban_processing.params.cogenerate import StopAtLevel
from urban_processing.params.optimize import Snap


@dataclass(frozen=True, kw_only=True)
class ResumeParams(Params):
    """Parameters of `resume`; what the layout was begun with stands in its provenance."""

    stop_at_level: StopAtLevel = None
    snap: Snap = 0.05
