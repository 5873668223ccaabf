"""Measuring a fabric, and comparing several."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256

from urban_processing.errors import ParameterError
from urban_processing.fabric.model import ComparedFabrics, Fabric
from urban_processing.metrics.common_land import shared_land
from urban_processing.metrics.comparison import Comparison, Side, compare, unique_names
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.metrics.samples import samples
from urban_processing.params.compare import CompareParams
from urban_processing.params.measure import MeasureParams
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.version import __version__

_MEASURE = "measure"


def measure(fabric: Fabric, params: MeasureParams, progress: Progress = SILENT) -> FabricMeasures:
    """Work out every metric of a fabric; its history tells that it was measured.

    Parameters
    ----------
    fabric
        What is measured.
    params
        Parameters that it was read with.
    progress
        Told how far the work is; may stop it.
    """
    started = time.perf_counter()
    # measuring changes nothing: an earlier one has nothing to tell
    earlier = tuple(made for made in fabric.history if made.algorithm != _MEASURE)
    known = FabricMeasures(replace(fabric, history=earlier))
    progress.update(0.1, "Parcels")
    _ = known.parcels, known.block_sides
    progress.update(0.5, "Ways along streets")
    _ = known.metrics
    own = {field.name for field in MeasureParams.fields()}
    step = Step(
        algorithm=_MEASURE,
        parameters={name: value for name, value in params.as_dict().items() if name in own},
        seed=0,
        version=__version__,
        input_sha256=fabric.input_sha256,
        seconds=time.perf_counter() - started,
    )
    progress.update(1.0, "Measured")
    return known.with_history((*earlier, step))


@dataclass(frozen=True, eq=False)
class ComparedMeasures:
    """Fabrics that were measured and compared.

    Parameters
    ----------
    measured
        Their measures, those of what is there last, each under a name of its own.
    comparison
        The table of their metrics, and the distances of their distributions.
    history
        The step that made this.
    """

    measured: tuple[FabricMeasures, ...]
    comparison: Comparison
    history: tuple[Step, ...]


def compare_fabrics(
    compared: ComparedFabrics, params: CompareParams, progress: Progress = SILENT
) -> ComparedMeasures:
    """Measure fabrics and set them side by side.

    Raises
    ------
    ParameterError
        If there are fewer than two, or the reference is none of them.
    """
    started = time.perf_counter()
    fabrics = compared.all
    names = side_names([fabric.name for fabric in fabrics])
    problems = side_problems(names, "", params.reference)
    if problems:
        raise ParameterError(problems)
    fabrics = tuple(replace(f, name=name) for f, name in zip(fabrics, names, strict=True))
    reference = params.reference
    if reference is None:
        reference = names[0] if compared.real is None else names[-1]
    share = 0.8 / len(fabrics)
    measured = [
        measure(fabric, params, progress.slice(k * share, (k + 1) * share))
        for k, fabric in enumerate(fabrics)
    ]
    progress.update(0.8, "Distributions")
    sides = [Side(known.fabric.name, known.values, samples(known)) for known in measured]
    comparison = compare(
        sides,
        reference=reference,
        seed=params.seed,
        resamples=params.resamples,
        confidence=params.confidence,
        shared_land=[shared_land(f, fabrics[names.index(reference)]) for f in fabrics],
    )
    progress.update(1.0, "Compared")
    digest = sha256("".join(known.fabric.input_sha256 for known in measured).encode())
    step = Step(
        algorithm="compare",
        parameters=params.as_dict(),
        seed=params.seed,
        version=__version__,
        input_sha256=digest.hexdigest(),
        seconds=time.perf_counter() - started,
    )
    return ComparedMeasures(tuple(measured), comparison, (step,))


def side_names(names: Sequence[str]) -> tuple[str, ...]:
    """Return what the sides of a comparison are called: all differently.

    >>> side_names(["", "town", ""])
    ('layout', 'town', 'layout (2)')
    """
    return unique_names([name or "layout" for name in names])


def side_problems(made: Sequence[str], real: str, reference: str | None) -> list[str]:
    """Return one sentence for each reason why sides cannot be compared.

    Parameters
    ----------
    made
        Names of the sides in their order, empty for none.
    real
        Name of what is there; empty where that is no side.
    reference
        Name of the side that the others are to be set against, if one was given.
    """
    names = side_names([*made, *([real] if real else [])])
    problems = []
    if len(names) < 2:
        problems.append(
            "A comparison needs two sides: give two files, or one and what is there: "
            "OpenStreetMap, or layers of parcels and streets."
        )
    if reference is not None and reference not in names:
        problems.append(
            f"There is no side called {reference!r} to compare with: the sides are "
            f"{', '.join(names) or '(none)'}."
        )
    return problems
