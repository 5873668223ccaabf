"""Benchmark of `cogenerate` on the sample boundaries, as Markdown.

    python -m tests.benchmarks.run                      quality and growth
    python -m tests.benchmarks.run quality --presets recommended,chen2024
    python -m tests.benchmarks.run growth --boundaries wandsworth

Every run has one core and a process of its own; the seconds are those of the layout alone, after
import, reading and before writing, unless a column says otherwise.
"""

from __future__ import annotations

import argparse
import itertools
import json
import os
import subprocess
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
ONE_CORE = dict.fromkeys(("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"), "1")
BOUNDARIES = sorted(
    path.stem
    for path in (ROOT / "sample_data").glob("*.gpkg")
    if not path.stem.startswith("streets_")
)
PATTERNS = ["loop", "cul-de-sac", "tree"]
GROWTH_SIZES = [500, 1300, 3200, 8000, 20000]

QUALITY = {
    "parcels": ("parcels", ".0f"),
    "quads %": ("quads_pct", ".1f"),
    "mean I": ("irregularity_mean", ".4f"),
    "I > 0.1 %": ("irregular_pct", ".1f"),
    "max I": ("irregularity_max", ".2f"),
    "streets": ("streets", ".0f"),
    "junctions": ("junctions", ".0f"),
    "ends": ("street_ends", ".0f"),
    "parcels/street": ("parcels_per_street", ".1f"),
    "deviation °": ("junction_deviation_deg", ".2f"),
    "L*": ("street_length_relative", ".3f"),
    "largest block": ("block_parcels_max", ".0f"),
    "> 2 min %": ("above_2_min_area_pct", ".1f"),
    "thinness min": ("thinness_min", ".2f"),
}
"""Columns of the quality table: metric and format."""


def main() -> None:
    """Run what was asked for and print the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("what", nargs="?", choices=("all", "quality", "growth"), default="all")
    parser.add_argument("--boundaries", type=_names, default=BOUNDARIES)
    parser.add_argument("--patterns", type=_names, default=PATTERNS)
    parser.add_argument("--presets", type=_names, default=["recommended"])
    parser.add_argument("--parcels", type=_numbers, default=[500], help="sizes of 'quality'")
    parser.add_argument("--growth", type=_numbers, default=GROWTH_SIZES, help="sizes of 'growth'")
    parser.add_argument("--seed", type=int, default=0)
    asked = parser.parse_args()
    if asked.what in ("all", "quality"):
        quality(asked)
    if asked.what in ("all", "growth"):
        growth(asked)


def quality(asked: argparse.Namespace) -> None:
    """Print one row for each boundary, size, pattern and preset."""
    say("## Quality\n")
    say_row(["boundary", "asked", "pattern", "preset", "s", *QUALITY, "certificate"])
    say_row(["---"] * (len(QUALITY) + 6))
    cases = itertools.product(asked.boundaries, asked.parcels, asked.patterns, asked.presets)
    for boundary, parcels, pattern, preset in cases:
        told = {"parcels": parcels, "pattern": pattern, "preset": preset, "seed": asked.seed}
        done = measured(boundary, told)
        values = [format(done["metrics"][name], form) for name, form in QUALITY.values()]
        held = "holds" if not done["certificate"] else "fails: " + ", ".join(done["certificate"])
        seconds = f"{done['seconds']['cogenerate']:.2f}"
        say_row([boundary, str(parcels), pattern, preset, seconds, *values, held])


def growth(asked: argparse.Namespace) -> None:
    """Print the time by stage over several sizes, and the exponent of its growth."""
    boundaries = asked.boundaries if asked.boundaries != BOUNDARIES else ["wandsworth"]
    stages = ["holes", "cuts", "streets", "optimize", "cogenerate", "measure", "write"]
    for boundary, preset in itertools.product(boundaries, asked.presets):
        say(f"\n## Growth: {boundary}, pattern {asked.patterns[0]}, preset {preset}\n")
        say_row(["parcels", *(f"{stage} s" for stage in stages), "ms/parcel", "peak MiB"])
        say_row(["---"] * (len(stages) + 3))
        points = []
        for size in asked.growth:
            told = {"parcels": size, "pattern": asked.patterns[0], "preset": preset}
            done = measured(boundary, {**told, "seed": asked.seed})
            parcels, seconds = done["metrics"]["parcels"], done["seconds"]
            points.append((parcels, seconds["cogenerate"]))
            times = [f"{seconds[stage]:.2f}" for stage in stages]
            each = f"{1000 * seconds['cogenerate'] / parcels:.2f}"
            say_row([f"{parcels:.0f}", *times, each, f"{done['memory_mib']:.0f}"])
        say(f"\nGrowth exponent (least squares, {len(points)} sizes): {exponent(points):.2f}")


def exponent(points: Sequence[tuple[float, float]]) -> float:
    """Return b of seconds = a · parcels^b, by least squares on logarithms."""
    parcels, seconds = np.log(np.asarray(points)).T
    return float(np.polyfit(parcels, seconds, 1)[0])


def measured(boundary: str, parameters: dict[str, Any]) -> dict[str, Any]:
    """Run one case in a fresh process."""
    case = json.dumps({"boundary": boundary, "parameters": parameters})
    done = subprocess.run(
        [sys.executable, "-m", "tests.benchmarks.case", case],
        cwd=ROOT,
        env={**os.environ, **ONE_CORE},
        stdout=subprocess.PIPE,
        text=True,
        check=True,
    )
    result: dict[str, Any] = json.loads(done.stdout)
    return result


def say_row(cells: Iterable[str]) -> None:
    """Print a row of a table."""
    say("| " + " | ".join(cells) + " |")


def say(line: str) -> None:
    """Print a line at once: a long benchmark is read while it runs."""
    sys.stdout.write(line + "\n")
    sys.stdout.flush()


def _names(text: str) -> list[str]:
    return text.split(",")


def _numbers(text: str) -> list[int]:
    return [int(part) for part in text.split(",")]


if __name__ == "__main__":
    main()
