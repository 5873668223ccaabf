"""One run of `cogenerate`, measured: ``python -m tests.benchmarks.case '{...}'`` prints JSON.

A run has a process of its own, so that its peak memory is its own and nothing is warm.
"""

from __future__ import annotations

import json
import resource
import sys
import time
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any

from urban_processing.io.boundaries import read_boundary
from urban_processing.io.files import write_layout
from urban_processing.metrics import LayoutMeasures, certificate, measure
from urban_processing.params import CogenerateParams
from urban_processing.pipelines import cogenerate as pipeline

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
STAGES = {
    "holes": ("cut_through_holes",),
    "cuts": ("cut_level",),
    "streets": ("extend_streets", "prune_streets"),
    "optimize": ("optimize_geometry",),
}
"""Functions of the pipeline whose time is taken together."""


def run(case: dict[str, Any]) -> dict[str, Any]:
    """Lay out a sample boundary; return seconds by stage, MiB, all metrics, the certificate."""
    seconds: dict[str, float] = {}
    for stage, functions in STAGES.items():
        seconds[stage] = 0.0
        for name in functions:
            setattr(pipeline, name, _timed(getattr(pipeline, name), stage, seconds))
    params = CogenerateParams.from_values(case["parameters"])
    started = time.perf_counter()
    site = read_boundary(SAMPLES / f"{case['boundary']}.gpkg")
    seconds["read"] = time.perf_counter() - started
    started = time.perf_counter()
    layout = pipeline.cogenerate(site, params)
    seconds["cogenerate"] = time.perf_counter() - started
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    started = time.perf_counter()
    metrics = measure(layout, measures=LayoutMeasures(layout))
    held = certificate(layout)
    seconds["measure"] = time.perf_counter() - started
    started = time.perf_counter()
    with TemporaryDirectory() as folder:
        write_layout(layout, Path(folder) / "layout.gpkg")
    seconds["write"] = time.perf_counter() - started
    return {
        "seconds": seconds,
        "memory_mib": memory,
        "metrics": {m.metric: m.value for m in metrics if m.part is None},
        "certificate": [check.name for check in held.failures],
    }


def _timed(
    function: Callable[..., Any], stage: str, seconds: dict[str, float]
) -> Callable[..., Any]:
    def timed(*arguments: Any, **options: Any) -> Any:
        started = time.perf_counter()
        try:
            return function(*arguments, **options)
        finally:
            seconds[stage] += time.perf_counter() - started

    return timed


if __name__ == "__main__":
    sys.stdout.write(json.dumps(run(json.loads(sys.argv[1]))))
