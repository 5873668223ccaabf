"""Benchmark of subdivision, as Markdown.

    python -m tests.benchmarks.subdivision
    python -m tests.benchmarks.subdivision --blocks 5000 --processes 2 --strategies obb

Blocks are quadrangles with bent sides, three in ten of them irregular and concave. Seconds are
wall time: of the division alone, of listing what breaks a bound, and of measuring the parcels and
writing the GeoPackage.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from collections.abc import Iterator
from concurrent.futures import Executor
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import shapely

from urban_processing.blocks.model import plain_blocks
from urban_processing.io.files import write_layers
from urban_processing.mesh.build import canonical_rings
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.pipelines.subdivide import subdivide
from urban_processing.processes import process_pool
from urban_processing.site import snap_to_grid

MIN_AREA = {Strategy.OBB: 200.0, Strategy.SKELETON: 110.0}
"""Smallest parcels in m² that make some 94 parcels of a block; 200 for other strategies."""

REPEATS = 15


def main() -> None:
    """Print the table of growth, and the time that a single block takes."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--blocks", type=int, nargs="+", default=[50, 500, 5000])
    parser.add_argument("--strategies", nargs="+", default=["obb", "skeleton"])
    parser.add_argument("--processes", type=int, nargs="+", default=[1, 2])
    asked = parser.parse_args()
    print("| strategy | blocks | processes | parcels | division s | bounds s | export s | error |")
    print("|---|---|---|---|---|---|---|---|")
    for strategy in map(Strategy, asked.strategies):
        for n in asked.blocks:
            for processes in asked.processes:
                with _pool(processes) as executor:
                    print(_row(strategy, n, processes, executor), flush=True)
    print()
    for strategy in map(Strategy, asked.strategies):
        for side in (1.0, 0.5):
            print(_one_block(strategy, side), flush=True)


@contextmanager
def _pool(processes: int) -> Iterator[Executor | None]:
    """Worker processes that have imported what they need."""
    if processes == 1:
        yield None
        return
    with process_pool(processes) as executor:
        list(executor.map(some_blocks, [1] * 4 * processes))
        yield executor


def _params(strategy: Strategy) -> SubdivideParams:
    return SubdivideParams(
        strategy=strategy,
        min_area=MIN_AREA.get(strategy, 200.0),
        irregularity=0.15,
        street_access=0.9,
    )


def _row(strategy: Strategy, n: int, processes: int, executor: Executor | None) -> str:
    land = some_blocks(n)
    begin = time.perf_counter()
    made = subdivide(plain_blocks(land), _params(strategy), executor=executor)
    total = time.perf_counter() - begin
    division = made.history[-1].seconds
    begin = time.perf_counter()
    with tempfile.TemporaryDirectory() as folder:
        write_layers(MeasuredSubdivision(made).layers(), Path(folder) / "parcels.gpkg")
    export = time.perf_counter() - begin
    return (
        f"| {strategy} | {n:,} | {processes} | {made.pieces.n_faces:,} | {division:.2f} | "
        f"{total - division:.2f} | {export:.2f} | {_error(made, land):.0e} |"
    )


def _error(made: Subdivision, land: np.ndarray) -> float:
    area = np.bincount(made.pieces.block, weights=shapely.area(made.polygons))
    return float(np.abs(area / shapely.area(land) - 1).max())


def _one_block(strategy: Strategy, side: float) -> str:
    """Best time that the division of one block takes; `side` scales the block."""
    land = shapely.transform(some_blocks(1), lambda xy: snap_to_grid(side * xy))
    runs = [subdivide(plain_blocks(land), _params(strategy)) for _ in range(REPEATS)]
    best = 1e3 * min(made.history[-1].seconds for made in runs)
    return f"One block of {runs[0].pieces.n_faces} parcels, {strategy}: {best:.1f} ms"


def some_blocks(n: int) -> np.ndarray:
    """(n,) blocks of some 3 ha."""
    rng = np.random.default_rng(0)
    rings = [_blob(rng) if rng.random() < 0.3 else _quadrangle(rng) for _ in range(n)]
    return canonical_rings(np.array([shapely.Polygon(snap_to_grid(ring)) for ring in rings]))


def _quadrangle(rng: np.random.Generator) -> np.ndarray:
    """Four gently bent sides."""
    size = 150.0
    corners = np.array([[0, 0], [1.4, 0], [1.4, 1], [0, 1]]) * size
    corners += rng.normal(0, 0.08 * size, (4, 2))
    share = np.arange(4)[:, None] / 4
    sides = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        across = np.array([a[1] - b[1], b[0] - a[0]])
        sides.append(a + share * (b - a) + 4 * share * (1 - share) * rng.normal(0, 0.05) * across)
    return np.vstack(sides)


def _blob(rng: np.random.Generator) -> np.ndarray:
    """A rough outline around a point."""
    turn = np.arange(24) / 24 * 2 * np.pi
    k = np.arange(2, 40)[:, None]
    waves = 0.3 * rng.normal(size=(38, 1)) / k**1.25
    radius = 1 + (waves * np.cos(k * turn + rng.uniform(0, 2 * np.pi, (38, 1)))).sum(axis=0)
    radius = 110.0 * np.maximum(radius, 0.25)
    return np.column_stack([1.3 * radius * np.cos(turn), radius * np.sin(turn)])


if __name__ == "__main__":
    main()
