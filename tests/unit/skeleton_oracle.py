"""Straight skeletons by CGAL, in a process of their own: it may crash, and is GPL.

``python skeleton_oracle.py`` reads the rings of a polygon as JSON from each line and prints its
skeleton arcs as WKT, or `none` where CGAL has no answer. It needs the package pysfcgal, which
nothing else here does.
"""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections.abc import Iterable, Iterator
from pathlib import Path

import shapely

SECONDS = 5
"""Time after which there is no answer."""
MARK = "skeleton: "
"""CGAL prints messages of its own before answers, at times on the same line."""


def skeletons_by_cgal(
    polygons: Iterable[shapely.Polygon], python: str = sys.executable
) -> Iterator[shapely.MultiLineString | None]:
    """The arcs of the straight skeleton of each polygon; None where CGAL crashed or gave up."""
    child = _start(python)
    try:
        for polygon in polygons:
            answer = _ask(child, polygon)
            if answer is None:
                child.kill()
                child.wait()
                child = _start(python)
            yield answer
    finally:
        child.kill()
        child.wait()


def _start(python: str) -> subprocess.Popen[str]:
    return subprocess.Popen(
        [python, str(Path(__file__))],
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        text=True,
    )


def _ask(child: subprocess.Popen[str], polygon: shapely.Polygon) -> shapely.MultiLineString | None:
    assert child.stdin is not None
    assert child.stdout is not None
    rings = [list(ring.coords) for ring in [polygon.exterior, *polygon.interiors]]
    try:
        child.stdin.write(json.dumps(rings) + "\n")
        child.stdin.flush()
    except BrokenPipeError:
        return None
    for line in child.stdout:  # the child ends itself when time is up
        _, mark, answer = line.partition(MARK)
        if mark:
            return shapely.from_wkt(answer) if answer.startswith("MULTILINESTRING (") else None
    return None


def _serve() -> None:
    from pysfcgal.geometry import Polygon

    for line in sys.stdin:
        signal.alarm(SECONDS)  # ends the process, even inside C++
        shell, *holes = json.loads(line)
        try:
            arcs = Polygon(shell, holes).straight_skeleton().to_wkt(17)
        except Exception:
            arcs = "none"
        signal.alarm(0)
        print(MARK + arcs, flush=True)


if __name__ == "__main__":
    _serve()
