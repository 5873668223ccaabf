"""Benchmark of measuring layouts and of comparing with OpenStreetMap, as Markdown.

    python -m tests.benchmarks.measuring           layouts of several sizes, and the sample extract
    python -m tests.benchmarks.measuring --osm-file city.osm.pbf --land city.gpkg

One core; seconds are the median of three runs, each from the layout or the files on. What is
imported counts not.
"""

from __future__ import annotations

import argparse
import os
import statistics
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from tests.benchmarks.run import ONE_CORE, ROOT, say, say_row
from urban_processing.layout import Layout

RUNS = 3
SAMPLES = ROOT / "sample_data"


def main() -> None:
    """Print how long measuring and comparing take."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--boundary", default="wandsworth")
    parser.add_argument("--parcels", nargs="*", type=int, default=[1_000, 3_000, 10_000])
    parser.add_argument("--osm-file", default=str(SAMPLES / "osm_liechtenstein.osm.bz2"))
    parser.add_argument("--land", default=str(SAMPLES / "mauren.gpkg"))
    asked = parser.parse_args()
    if any(os.environ.get(name) != value for name, value in ONE_CORE.items()):
        command = [sys.executable, "-m", "tests.benchmarks.measuring", *sys.argv[1:]]
        os.execve(sys.executable, command, {**os.environ, **ONE_CORE})
    say_row(["parcels", "metrics s", "certificate s", "report s", "report MB"])
    say_row(["---"] * 5)
    for parcels in asked.parcels:
        say_row(measured(asked.boundary, parcels))
    say("")
    say_row(["land", "km²", "sides", "compare s"])
    say_row(["---"] * 4)
    say_row(compared(Path(asked.land), Path(asked.osm_file)))


def measured(boundary: str, parcels: int) -> list[str]:
    """One line: from a layout to its metrics, its certificate and its report."""
    import urban_processing as up
    from urban_processing.metrics import certificate

    layout = up.cogenerate(SAMPLES / f"{boundary}.gpkg", parcels=parcels).layout
    made = up.measure(layout)
    metrics = seconds(lambda: up.measure(fresh(layout)).metric("parcel_distance_m"))
    certified = seconds(lambda: certificate(layout))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "report.html"
        page = seconds(lambda: made.report(path, overwrite=True))
        size = path.stat().st_size / 1e6
    return [
        f"{made.metric('parcels'):,.0f}",
        f"{metrics:.2f}",
        f"{certified:.2f}",
        f"{page:.2f}",
        f"{size:.2f}",
    ]


def fresh(layout: Layout) -> Layout:
    """The layout without what was worked out of it: rights-of-way are kept for its mesh."""
    from urban_processing.optimization.safeguard import moved_to

    return moved_to(layout, layout.mesh.xy)


def compared(land: Path, osm_file: Path) -> list[str]:
    """One line: a layout against the streets of an extract, cleaned."""
    import urban_processing as up

    layout = up.cogenerate(land, parcels=600)

    def compare() -> up.GeoComparison:
        return up.compare(layout, osm_file=osm_file)

    found = compare()
    sides = ", ".join(
        f"{name} {side.metric('street_length_m') / 1000:.1f} km"
        for name, side in found.sides.items()
    )
    area = next(iter(found.sides.values())).metric("area_m2") / 1e6
    return [land.stem, f"{area:.2f}", sides, f"{seconds(compare):.1f}"]


def seconds(work: Callable[[], object]) -> float:
    """Median time of some runs."""
    taken = []
    for _ in range(RUNS):
        started = time.perf_counter()
        work()
        taken.append(time.perf_counter() - started)
    return statistics.median(taken)


if __name__ == "__main__":
    main()
