"""From what was given on the command line to what an algorithm takes, or all that is wrong."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from urban_processing.algorithms.spec import AlgorithmSpec, Output
from urban_processing.cli import stores
from urban_processing.cli.readers import READERS, named_file, values_given
from urban_processing.errors import UrbanError
from urban_processing.params.base import Params, option_name


class BadCallError(UrbanError):
    """Something is wrong with what was given on the command line."""


@dataclass(frozen=True)
class Call:
    """All that a run needs."""

    inputs: Mapping[str, Any]
    params: Params


def prepare(spec: AlgorithmSpec, given: Mapping[str, Any]) -> Call:
    """Check everything, read the inputs, and report all the mistakes of the call together.

    Raises
    ------
    BadCallError
        With one sentence for each mistake.
    DependencyError
        If a place cannot be looked up.
    """
    values = values_given(spec, given)
    layers = [i.name for i in spec.inputs if not i.required and given[i.name] is not None]
    problems = spec.params.problems_with(values, layers=layers)
    problems += _output_problems(spec, given)
    inputs: dict[str, Any] = {}
    for item in spec.inputs:
        if item.kind in READERS:
            inputs[item.name] = READERS[item.kind](spec, item, given, problems)
    if problems:
        raise BadCallError(problems)
    return Call(inputs, spec.params.from_values(values))


def _output_problems(spec: AlgorithmSpec, given: Mapping[str, Any]) -> list[str]:
    problems: list[str] = []
    taken = {
        Path(path).resolve(): f"the input {path}"
        for item in spec.inputs
        for path in _paths(given[item.name])
    }
    for output in spec.outputs:
        path = given[output.name]
        if path is None:
            if output.required:
                what = "FILE" if output.kind.is_geopackage else "FOLDER"
                problems.append(f"Say where the result goes: {_flags(output)} {what}.")
            continue
        whole = next(o for o in spec.outputs if o.name == (output.of or output.name))
        problems += stores.problems(output, whole, given)
        place = Path(path).resolve()
        if place in taken:
            problems.append(
                f"{_flags(output)} {path} would replace {taken[place]}: choose another."
            )
        taken.setdefault(place, _flags(output))
    return problems


def _paths(given: Any) -> tuple[str, ...]:
    """Files that were given for an input, without names of sides and layers."""
    if given is None:
        return ()
    paths = [named_file(text)[1] for text in given] if isinstance(given, tuple) else [given]
    return tuple(path.partition("|")[0] for path in paths)


def _flags(output: Output) -> str:
    return f"--{option_name(output.name)}" if output.of else "-o"
