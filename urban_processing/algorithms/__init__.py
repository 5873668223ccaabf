"""The algorithms as shells see them: one declaration each, and the list of all."""

from urban_processing.algorithms.registry import get, specs
from urban_processing.algorithms.spec import (
    AlgorithmSpec,
    Estimate,
    Input,
    InputKind,
    Output,
    OutputKind,
)

__all__ = [
    "AlgorithmSpec",
    "Estimate",
    "Input",
    "InputKind",
    "Output",
    "OutputKind",
    "get",
    "specs",
]
