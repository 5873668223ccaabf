"""What QGIS adds to the library: ``python -m tests.benchmarks.qgis`` prints a table.

The same boundary and parameters, by the library from a script (read, lay out, measure, certify,
write a layout file) and by qgis_process from the plugin's zip (the same, and every sink), each in
a process of its own on one core. Seconds and peak memory are those of the whole processes, with
their start. Needs QGIS and, for --packages, the
environment that ``.ci/setup-qgis .[qgis]`` makes.
"""

from __future__ import annotations

import argparse
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.benchmarks.run import ONE_CORE, ROOT, say, say_row

LIBRARY = """
import sys, time
import urban_processing as up
started = time.perf_counter()
layout = up.cogenerate(sys.argv[1], parcels=int(sys.argv[2]))
layout.summary()
layout.save(sys.argv[3], overwrite=True)
print("seconds", time.perf_counter() - started)
"""
START = """
import sys, time
sys.path.insert(0, sys.argv[1])
from qgis.core import QgsApplication
app = QgsApplication([], False)
app.initQgis()
started = time.perf_counter()
import urban_processing_qgis
plugin = urban_processing_qgis.classFactory(None)
plugin.initProcessing()
print("seconds", time.perf_counter() - started)
sys.stdout.flush()
import os
os._exit(0)
"""
SINKS = ("PARCELS", "STREETS", "JUNCTIONS", "ISSUES", "BOUNDARY", "METRICS", "PROVENANCE")


def main() -> None:
    """Run both sides and print what QGIS adds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    packages = next(iter((ROOT / "build/qgis/lib").glob("python3*/site-packages")), Path())
    parser.add_argument("--packages", type=Path, default=packages)
    parser.add_argument("--boundary", default="wandsworth")
    parser.add_argument("--parcels", type=int, default=10_000)
    parser.add_argument("--rounds", type=int, default=3)
    asked = parser.parse_args()
    boundary = ROOT / "sample_data" / f"{asked.boundary}.gpkg"
    python = asked.packages.parents[2] / "bin" / "python"
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        plugins = Path(home) / "profile" / "python" / "plugins"
        build = [sys.executable, "-m", "qgis_plugin.build", "--unpacked", str(plugins)]
        subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        environment = {
            **os.environ,
            **ONE_CORE,
            "HOME": home,
            "XDG_RUNTIME_DIR": home,
            "QGIS_CUSTOM_CONFIG_PATH": home,
            "QGIS_PLUGINPATH": str(plugins),
            "QT_QPA_PLATFORM": "offscreen",
            "PYTHONPATH": str(asked.packages),
            "PYTHONWARNINGS": "ignore",
        }
        process = "qgis_process.bin"
        _measured([process, "plugins", "enable", "urban_processing_qgis"], environment)
        layout, number = f"{home}/layout.gpkg", str(asked.parcels)
        outside = [str(python), "-c", LIBRARY, str(boundary), number, layout]
        inside = [process, "run", "urban_processing:cogenerate", "--", f"BOUNDARY={boundary}"]
        inside += [f"PARCELS={number}", f"OUTPUT={layout}"]
        inside += [f"OUTPUT_{name}={home}/{name.lower()}.gpkg" for name in SINKS]
        rounds = [
            (_measured(outside, environment), _measured(inside, environment))
            for _ in range(asked.rounds)
        ]
        starts = [
            _measured([str(python), "-c", START, str(plugins)], environment)
            for _ in range(asked.rounds)
        ]
    say(f"## {asked.parcels:,} parcels on {asked.boundary}, median of {asked.rounds} rounds\n")
    say_row(["", "process s", "peak MiB"])
    say_row(["---"] * 3)
    library, plugin = ([pair[side] for pair in rounds] for side in (0, 1))
    for name, runs in (("library", library), ("QGIS", plugin)):
        say_row([name, *(f"{_median(runs, i):.{digits}f}" for i, digits in ((0, 2), (1, 0)))])
    ratios = [_median(plugin, i) / _median(library, i) for i in (0, 1)]
    say_row(["QGIS / library", *(f"{ratio:.2f}" for ratio in ratios)])
    start = statistics.median(run[2] for run in starts)
    say(f"\nStart of the plugin in a QGIS that runs already: {start:.3f} s")


def _measured(command: Sequence[str], environment: dict[str, str]) -> tuple[float, float, float]:
    """Seconds and peak MiB of a process, and the seconds that it says itself."""
    started = time.perf_counter()
    running = subprocess.Popen(
        command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True
    )
    assert running.stdout is not None
    text = running.stdout.read()
    _, status, usage = os.wait4(running.pid, 0)
    seconds = time.perf_counter() - started
    running.returncode = os.waitstatus_to_exitcode(status)
    if running.returncode:
        raise SystemExit(text)
    said = [line.split()[1] for line in text.splitlines() if line.startswith("seconds ")]
    return seconds, usage.ru_maxrss / 1024, float(said[-1]) if said else 0.0


def _median(runs: Sequence[tuple[float, float, float]], column: int) -> float:
    return statistics.median(run[column] for run in runs)


if __name__ == "__main__":
    main()
