"""Benchmark of steering: candidates, edits with their checks, undo and replay, as Markdown.

    python -m tests.benchmarks.steering                        1,000 and 5,000 parcels
    python -m tests.benchmarks.steering --parcels 1000 --replay 200

One core. An edit counts with its check and the streets that it lays; milliseconds are of processor
time, the median and the worst of many parcels, spread over the land, each edit made on the same
layout and undone.
"""

from __future__ import annotations

import argparse
import os
import pickle
import statistics
import sys
import tempfile
import time
from collections import Counter, defaultdict
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from tests.benchmarks.run import ONE_CORE, ROOT, say, say_row

EACH = 30
"""Edits of each kind that are timed."""

SIZE_LEFT = 1.6
"""The layout has reached its number of parcels when its levels would go on to so many more."""


def main() -> None:
    """Print how long it takes to steer."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--boundary", default="wandsworth")
    parser.add_argument("--parcels", nargs="*", type=int, default=[1_000, 5_000])
    parser.add_argument("--replay", type=int, default=200, help="edits of a replayed session")
    parser.add_argument("--each", type=int, default=EACH, help="edits of each kind")
    asked = parser.parse_args()
    if any(os.environ.get(name) != value for name, value in ONE_CORE.items()):
        command = [sys.executable, "-m", "tests.benchmarks.steering", *sys.argv[1:]]
        os.execve(sys.executable, command, {**os.environ, **ONE_CORE})
    for parcels in asked.parcels:
        session = steered(asked.boundary, parcels)
        say(f"\n## {len(session.parcels):,} parcels of {asked.boundary}\n")
        say_row(["what", "done", "refused", "median ms", "worst ms"])
        say_row(["---"] * 5)
        for row in timed(session, asked.each):
            say_row(row)
        say("")
        say(f"Replay: {replayed(asked.boundary, parcels, asked.replay)}.")


def steered(boundary: str, parcels: int) -> Any:
    """A session at the level at which there are about so many parcels, with some still to cut."""
    import urban_processing as up

    land = ROOT / "sample_data" / f"{boundary}.gpkg"
    session = up.steer(land, parcels=round(SIZE_LEFT * parcels))
    while len(session.parcels) < 0.9 * parcels and not session.finished:
        session.step()
    return session


def timed(session: Any, each: int) -> Iterator[list[str]]:
    """A row for each thing that a planner does."""
    to_cut = session._moment.state.to_cut()
    spread = to_cut[np.linspace(0, len(to_cut) - 1, min(each, len(to_cut))).astype(int)]
    cuttable = [session.parcels[face] for face in spread.tolist()]
    yield row("candidates", [clock(lambda p=p: session.candidates(p)) for p in cuttable])
    yield row("figures", [clock(session.figures) for _ in range(5)])
    taken, undone = defaultdict(list), []
    refused: Counter[str] = Counter()
    for name, values in edits(session, cuttable, each):
        spent = clock(lambda name=name, values=values: session.do(name, **values))
        if spent is None:
            refused[name] += 1
            continue
        taken[name].append(spent)
        session.candidates(session.parcels[0])
        undone.append(clock(session.undo))
    for name, spent in taken.items():
        yield row(name, spent, refused[name])
    yield row("undo", undone)
    layers = (
        list(session.layout.mesh.face_polygons(session.layout.frame.origin)),
        streets_of(session),
    )
    yield row("adopt", [clock(lambda: session.adopt(*layers))])
    session.undo()
    yield row("step", [clock(session.step)])
    session.undo()
    yield row("finish", [clock(session.finish)])
    session.undo()


def streets_of(session: Any) -> list[shapely.LineString]:
    """Streets on the map."""
    mesh = session.layout.mesh
    ends = mesh.xy[mesh.origin.reshape(-1, 2)[session.layout.edge_street]]
    return list(shapely.linestrings(ends + np.asarray(session.layout.frame.origin)))


def row(name: str, spent: list[float | None], refused: int = 0) -> list[str]:
    """One row of the table: times in seconds as milliseconds."""
    ms = [1000 * each for each in spent if each is not None]
    return [name, str(len(ms)), str(refused), f"{statistics.median(ms):.0f}", f"{max(ms):.0f}"]


def edits(session: Any, cuttable: list[int], each: int) -> Iterator[tuple[str, dict[str, Any]]]:
    """Edits of each kind, spread over the land; each is made on the same layout."""
    layout = session.layout
    mesh, origin = layout.mesh, np.asarray(layout.frame.origin)
    polygons = mesh.face_polygons()
    face_of = {number: face for face, number in enumerate(session.parcels)}
    for k, number in enumerate(cuttable):
        yield "choose", {"parcel": number, "candidate": 1 + k % 2}
    for number in cuttable:
        box = np.array(polygons[face_of[number]].minimum_rotated_rectangle.exterior.coords)
        a, b = box[:2].mean(axis=0), box[2:4].mean(axis=0)
        if np.hypot(*(box[1] - box[0])) < np.hypot(*(box[2] - box[1])):
            a, b = box[1:3].mean(axis=0), box[3:5].mean(axis=0)
        yield (
            "cut",
            {"parcel": number, "line": origin + np.array([a + 0.1 * (a - b), b - 0.1 * (a - b)])},
        )
    some = [session.parcels[f] for f in spread(mesh.n_faces, each)]
    for number in some:
        yield "undo_cut", {"parcel": number}
    for number in some:
        yield "lock", {"parcel": number}
    sides = mesh.face.reshape(-1, 2)
    inner = np.flatnonzero((sides >= 0).all(axis=1) & ~layout.edge_street)
    for edge in inner[spread(len(inner), each)]:
        yield "merge", {"parcels": [session.parcels[f] for f in sides[edge].tolist()]}
    ends = mesh.xy[mesh.origin.reshape(-1, 2)] + origin
    for edge in inner[spread(len(inner), each)]:
        yield "add_street", {"line": ends[edge], "follow": True}
    for number in cuttable:
        polygon = polygons[face_of[number]]
        box = np.array(polygon.minimum_rotated_rectangle.exterior.coords)
        a, b = box[:2].mean(axis=0), box[2:4].mean(axis=0)
        yield "add_street", {"line": origin + np.array([a, b])}
    streets = np.flatnonzero(layout.edge_street & (layout.edge_kind == 0))
    for edge in streets[spread(len(streets), each)]:
        yield "remove_street", {"place": tuple(ends[edge].mean(axis=0))}


def spread(count: int, some: int) -> list[int]:
    """Some numbers below a count, spread evenly."""
    return np.linspace(0, count - 1, min(some, count)).astype(int).tolist()


def replayed(boundary: str, parcels: int, count: int) -> str:
    """Make many mixed edits one after the other, save them, and replay them."""
    import urban_processing as up

    session = steered(boundary, parcels)
    rng = np.random.default_rng(0)
    before = len(session.edits)
    while len(session.edits) < before + count:
        to_cut = session._moment.state.to_cut()
        cuttable = [session.parcels[f] for f in rng.permutation(to_cut)[:10].tolist()]
        mixed = list(edits(session, cuttable, 10))
        for k in rng.permutation(len(mixed))[:10].tolist():
            name, values = mixed[k]
            clock(lambda name=name, values=values: session.do(name, **values))
    with tempfile.TemporaryDirectory() as folder:
        path = session.save(Path(folder) / "edits.json")
        size = path.stat().st_size / 1e3
        started = time.perf_counter()
        again = up.steer(ROOT / "sample_data" / f"{boundary}.gpkg", replay=path)
        spent = time.perf_counter() - started
        same = files_equal(session, again, Path(folder))
    kinds = Counter(edit.name for edit in session.edits)
    made = ", ".join(f"{n} {name}" for name, n in kinds.most_common())
    moment = len(pickle.dumps(session._moment)) / 1e6
    return (
        f"{len(session.edits)} edits ({made}) in {size:.0f} kB took {spent:.1f} s and gave "
        f"{'the same bytes' if same else 'OTHER BYTES'}; a moment takes {moment:.2f} MB at most"
    )


def files_equal(one: Any, other: Any, folder: Path) -> bool:
    """Whether the layout files of two sessions are the same bytes."""
    written = [
        session.view.save(folder / f"{name}.gpkg").read_bytes()
        for name, session in (("one", one), ("other", other))
    ]
    return written[0] == written[1]


def clock(work: Callable[[], object]) -> float | None:
    """Seconds of some work; None if it was refused."""
    from urban_processing.errors import EditError

    started = time.process_time()
    try:
        work()
    except EditError:
        return None
    return time.process_time() - started


if __name__ == "__main__":
    main()
