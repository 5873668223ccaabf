"""How QGIS answers while a layout is steered: ``python -m tests.benchmarks.dock``.

Steers a sample boundary through all its levels in the dock, in a window that is drawn offscreen,
with an edit after the last level, and prints for each thing that a planner does how long it
takes until the map's layers show it, and the longest time that the window was blocked meanwhile.
Needs the environment that ``.ci/setup-qgis ".[test,qgis]"`` makes.
"""

from __future__ import annotations

import argparse
import importlib
import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from typing import Any

from tests.benchmarks.run import ROOT, say, say_row

BEAT_MS = 2
PLUGIN = "urban_processing_qgis"


def main() -> None:
    """Steer, and print what it took."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--boundary", default="wandsworth")
    parser.add_argument("--parcels", type=int, default=5_000)
    asked = parser.parse_args()
    os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        build = [sys.executable, "-m", "qgis_plugin.build", "--unpacked", home]
        subprocess.run(build, cwd=ROOT, check=True, stdout=subprocess.DEVNULL)
        sys.path[:0] = [home, "/usr/share/qgis/python/plugins"]
        importlib.import_module("processing.tools.dataobjects")  # as QGIS has it
        window = Window()
        window.load(f"{ROOT / 'sample_data' / asked.boundary}.gpkg|layername=boundary")
        _steer(window, asked.parcels)
        sys.stdout.flush()
        os._exit(0)  # QGIS does not end well in a script


class Window:
    """A window with a map, and the clock of its event loop."""

    def __init__(self) -> None:
        from qgis.core import QgsApplication, QgsProject
        from qgis.gui import QgsLayerTreeMapCanvasBridge, QgsMapCanvas, QgsMessageBar
        from qgis.PyQt.QtCore import QTimer
        from qgis.PyQt.QtWidgets import QMainWindow

        self.app = QgsApplication([], True)
        self.app.initQgis()
        self.main = QMainWindow()
        self.map = QgsMapCanvas()
        self.messages = QgsMessageBar(self.main)
        self.main.setCentralWidget(self.map)
        self.main.resize(1400, 900)
        root = QgsProject.instance().layerTreeRoot()
        self.bridge = QgsLayerTreeMapCanvasBridge(root, self.map)
        self.main.show()
        self.last = time.perf_counter()
        self.longest = 0.0
        self.beat = QTimer()
        self.beat.timeout.connect(self._beat)
        self.beat.start(BEAT_MS)
        self.plugin = importlib.import_module(PLUGIN).classFactory(self)
        self.plugin.initGui()
        self.plugin.show_dock(True)
        self.dock = self.plugin.dock

    def __getattr__(self, name: str) -> Any:
        answers = {
            "mapCanvas": self.map,
            "mainWindow": self.main,
            "messageBar": self.messages,
        }
        if name == "addDockWidget":
            return self.main.addDockWidget
        return lambda *_: answers.get(name)

    def load(self, source: str) -> None:
        """Load the land."""
        from qgis.core import QgsProject, QgsVectorLayer

        self.land = QgsVectorLayer(source, "land")
        QgsProject.instance().addMapLayer(self.land)

    def look_at_all(self) -> None:
        """Have the map show all of the session, in its CRS."""
        layer = self.dock.steering.layers.parcels.layer
        self.map.setDestinationCrs(layer.crs())
        self.map.setExtent(layer.extent())

    def _beat(self) -> None:
        now = time.perf_counter()
        self.longest = max(self.longest, now - self.last)
        self.last = now

    def timed(self, act: Callable[[], Any]) -> tuple[float, float]:
        """Seconds until the layers show it, and the longest block while it was done and drawn."""
        steering = self.dock.steering
        self.wait(0.3)
        self.longest, self.last = 0.0, time.perf_counter()
        started = self.last
        act()
        while steering.is_busy or not steering.worker.is_idle:
            self.app.processEvents()
            time.sleep(0.0005)
        seconds = time.perf_counter() - started
        self.wait(0.3)
        while self.map.isDrawing():
            self.app.processEvents()
            time.sleep(0.0005)
        return seconds, self.longest

    def wait(self, seconds: float) -> None:
        """Let the window live."""
        until = time.perf_counter() + seconds
        while time.perf_counter() < until:
            self.app.processEvents()
            time.sleep(0.0005)


def _steer(window: Window, parcels: int) -> None:
    steering, panel = window.dock.steering, window.dock.panel
    start = window.dock.start_panel
    start.size_kind.setCurrentIndex(1)
    start.size.setValue(parcels)
    say_row(["", "parcels", "seconds", "longest block ms"])
    say_row(["---"] * 4)

    def report(name: str, act: Callable[[], Any]) -> None:
        seconds, block = window.timed(act)
        count = steering.view.parcels if steering.view else 0
        say_row([name, f"{count:,}", f"{seconds:.3f}", f"{1000 * block:.0f}"])

    report("begin, with the first import of the engine", start.begin.click)
    window.look_at_all()
    while not steering.view.finished:
        report(f"step to level {steering.view.level + 1}", panel.step.click)
    for name, act in _edits(window).items():
        report(name, act)
    report("undo", steering.undo)
    report("redo", steering.redo)
    report("finish into layers", panel.to_layers.click)
    say(f"\n{panel.note.text()}")


def _edits(window: Window) -> dict[str, Callable[[], Any]]:
    steering = window.dock.steering
    features = list(steering.layers.parcels.layer.getFeatures())
    inner = sorted(features, key=lambda feature: -feature["area_m2"])[:40]
    places = [feature.geometry().pointOnSurface().asPoint() for feature in inner]
    at = [(place.x(), place.y()) for place in places]
    return {
        "candidates of a parcel": lambda: steering.hover(at[0], with_options=True),
        "candidates of another": lambda: steering.hover(at[1], with_options=True),
        "park": lambda: steering.lock(at[2], "park"),
        "unlock": lambda: steering.unlock(at[2]),
        "undo a cut": lambda: steering.undo_cut(at[3]),
        "choose a cut": lambda: steering._change(
            lambda bench, _: bench.edit_parcel(at[3], lambda s, parcel: s.choose(parcel, 1))
        ),
    }


if __name__ == "__main__":
    main()
