"""Parameters of doing edits that stand in a file."""

from __future__ import annotations

from dataclasses import dataclass

from urban_processing.params.base import Params
from urban_processing.params.optimize import Snap


@dataclass(frozen=True, kw_only=True)
class EditParams(Params):
    """Parameters of `edit`; what a session began with stands in its file."""

    snap: Snap = 0.05
