"""One run of an algorithm from the command line."""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.spec import (
    AlgorithmSpec,
    Estimate,
    OutputKind,
)
from urban_processing.algorithms.words import duration_in_words, estimate_in_words
from urban_processing.cli import stores
from urban_processing.cli.call import Call, prepare
from urban_processing.cli.terminal import Terminal
from urban_processing.errors import InfeasibleError
from urban_processing.progress import MANY_PARCELS, Progress

_FILE_NAMES = {
    OutputKind.LAYOUT: "layout",
    OutputKind.LAYERS: "layers",
    OutputKind.MAP: "picture",
    OutputKind.EXPORT: "export",
    OutputKind.REPORT: "report",
    OutputKind.JSON: "JSON",
    OutputKind.CSV: "CSV",
}


def run_algorithm(spec: AlgorithmSpec, given: Mapping[str, Any], terminal: Terminal) -> None:
    """Read, say what is to come, run, write, sum up.

    Raises
    ------
    UrbanError
        With everything that is wrong with the call, why the run failed, or what of the
        certificate does not hold.
    """
    from urban_processing.metrics import MeasuredLayout

    call = prepare(spec, given)
    _say_what_inputs_say(spec, call, terminal)
    if spec.estimate is not None:
        _announce(spec.estimate(call.inputs, call.params), terminal)
    started = time.perf_counter()
    with terminal.progress(spec.title) as progress:
        made = _run(spec, call, progress, given)
    rows = [("time", duration_in_words(time.perf_counter() - started))]
    files = []
    for output in spec.outputs:
        if given[output.name] is not None:
            stored = made[output.of or output.name]
            files.append((_FILE_NAMES[output.kind], str(stores.write(output, stored, given))))
    broken = []
    for output in spec.outputs:
        if output.kind is OutputKind.LAYOUT:
            measured = MeasuredLayout(made[output.name])
            rows = [*measured.summary(), *rows]
            broken += [check.message for check in measured.certificate.failures]
        elif output.kind is OutputKind.LAYERS:
            rows = [*made[output.name].summary, *rows]
    terminal.table([*rows, *files])
    if broken:
        raise InfeasibleError(
            ["The layout was written, but not all that it promises holds:", *broken]
        )


def _run(
    spec: AlgorithmSpec, call: Call, progress: Progress, given: Mapping[str, Any]
) -> Mapping[str, Any]:
    if not spec.parallel or given["processes"] == 1:
        return spec.run(call.inputs, call.params, progress)
    from urban_processing.processes import process_pool

    with process_pool(given["processes"]) as executor:
        return spec.run(call.inputs, call.params, progress, executor=executor)


def _say_what_inputs_say(spec: AlgorithmSpec, call: Call, terminal: Terminal) -> None:
    """Repeat on stderr what was repaired or changed in reading the inputs."""
    for item in spec.inputs:
        if item.kind.is_ground:
            for issue in call.inputs[item.name].issues:
                terminal.note(issue.message)


def _announce(estimate: Estimate, terminal: Terminal) -> None:
    what = estimate_in_words(estimate)
    if estimate.parcels > MANY_PARCELS:
        terminal.warn(
            f"This run is large: {what}. A larger smallest area, or fewer parcels, is quicker; "
            "Ctrl-C stops it."
        )
    else:
        terminal.note(f"Expected: {what}.")
