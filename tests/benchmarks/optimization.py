"""Benchmark of the global optimization on the sample boundaries, as Markdown.

    python -m tests.benchmarks.optimization              what it gains, and how long it takes

One core; the seconds are those of the optimization alone, the median of three runs.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import time
from collections.abc import Sequence

from tests.benchmarks.run import BOUNDARIES, ONE_CORE, ROOT, say, say_row

SHOWN = {
    "mean I": ("irregularity_mean", ".4f"),
    "I > 0.1 %": ("irregular_pct", ".1f"),
    "deviation °": ("junction_deviation_deg", ".2f"),
    "quads %": ("quads_pct", ".1f"),
    "area spread": ("area_cv", ".3f"),
}
RUNS = 3


def main() -> None:
    """Optimize layouts of every boundary, and large ones of one, and print before and after."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--boundaries", nargs="+", default=BOUNDARIES)
    parser.add_argument("--parcels", type=int, default=500)
    parser.add_argument("--large", nargs="*", type=int, default=[1273, 10_000])
    parser.add_argument("--large-on", default="wandsworth")
    asked = parser.parse_args()
    if any(os.environ.get(name) != value for name, value in ONE_CORE.items()):
        os.execve(sys.executable, [*_command(), *sys.argv[1:]], {**os.environ, **ONE_CORE})
    say_row(["boundary", "parcels", *SHOWN, "s"])
    say_row(["---"] * (len(SHOWN) + 3))
    for boundary in asked.boundaries:
        say_row(row(boundary, asked.parcels))
    for parcels in asked.large:
        say_row(row(asked.large_on, parcels))
    say("")


def row(boundary: str, parcels: int) -> Sequence[str]:
    """One line of the table: each figure before and after."""
    from urban_processing.io.boundaries import read_boundary
    from urban_processing.metrics import measure
    from urban_processing.optimization.optimize import optimize_geometry
    from urban_processing.optimization.safeguard import moved_to
    from urban_processing.params import CogenerateParams, OptimizeParams
    from urban_processing.pipelines.cogenerate import cogenerate

    params = CogenerateParams(parcels=parcels, optimize=False)
    before = cogenerate(read_boundary(ROOT / "sample_data" / f"{boundary}.gpkg"), params)
    seconds = []
    for _ in range(RUNS):
        fresh = moved_to(before, before.mesh.xy)  # without what was worked out of it
        started = time.perf_counter()
        after = optimize_geometry(fresh, OptimizeParams().weights).layout
        seconds.append(time.perf_counter() - started)
    was, now = (
        {m.metric: m.value for m in measure(layout) if m.part is None} for layout in (before, after)
    )
    figures = [f"{was[name]:{form}} → {now[name]:{form}}" for name, form in SHOWN.values()]
    return [boundary, f"{before.mesh.n_faces:,}", *figures, f"{statistics.median(seconds):.2f}"]


def _command() -> list[str]:
    return [sys.executable, "-m", "tests.benchmarks.optimization"]


if __name__ == "__main__":
    main()
