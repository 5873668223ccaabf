"""Benchmark of subdivision by oriented boxes, as Markdown.

    python -m tests.benchmarks.subdivision
    python -m tests.benchmarks.subdivision --blocks 100 1000 --access 1

Blocks are quadrangles with bent sides, three in ten of them irregular and concave; the seconds
are those of the division alone, on one core, without making polygons of the parcels.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
import shapely

from urban_processing.blocks.model import plain_blocks
from urban_processing.hashing import splitmix64
from urban_processing.mesh.build import canonical_rings
from urban_processing.parcelling.ground import Ground, Pieces, Rules
from urban_processing.parcelling.obb import divide_by_boxes
from urban_processing.site import snap_to_grid

MIN_AREA = 200.0
REPEATS = 15


def main() -> None:
    """Print the table of growth, and the time that a single block takes."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--blocks", type=int, nargs="+", default=[50, 500, 5000])
    parser.add_argument("--access", type=float, default=0.9, help="street access")
    asked = parser.parse_args()
    print("| blocks | parcels | s | parcels/s | above largest % | area error |")
    print("|---|---|---|---|---|---|")
    for n in asked.blocks:
        land = some_blocks(n)
        pieces, seconds = divided(land, asked.access)
        print(
            f"| {n:,} | {pieces.n_faces:,} | {seconds:.2f} | {pieces.n_faces / seconds:,.0f} | ",
            end="",
        )
        area = shapely.area(pieces.polygons())
        whole = shapely.area(land)
        error = np.abs(np.bincount(pieces.block, weights=area) / whole - 1).max()
        above = 100 * np.mean(area > 2.5 * MIN_AREA)
        print(f"{above:.1f} | {error:.0e} |")
    land = some_blocks(1)
    runs = [divided(land, asked.access) for _ in range(REPEATS)]
    best = 1e3 * min(seconds for _, seconds in runs)
    print(f"\nOne block of {runs[0][0].n_faces} parcels: {best:.1f} ms (best of {REPEATS})")


def divided(land: np.ndarray, street_access: float) -> tuple[Pieces, float]:
    """Divide blocks into parcels of 200 to 500 m², and tell the seconds."""
    n = len(land)
    blocks = plain_blocks(land)
    lineage = splitmix64(1_000_000 + np.arange(n).astype(np.uint64))
    ground = Ground(
        blocks.rings, blocks.edge_access, blocks.edge_width, blocks.edge_street, lineage
    )
    side = MIN_AREA**0.5
    rules = Rules(
        min_area=np.full(n, MIN_AREA),
        max_area=np.full(n, 2.5 * MIN_AREA),
        min_width=np.full(n, 0.6 * side),
        max_width=np.full(n, 1.2 * side),
        irregularity=np.full(n, 0.15),
        street_access=np.full(n, street_access),
        offset=np.full(n, np.inf),
        by_length=np.zeros(n, dtype=bool),
        snap=np.full(n, 0.1 * side),
        corner=np.full(n, 40.0),
    )
    begin = time.perf_counter()
    pieces = divide_by_boxes(ground, rules, seed=1)
    return pieces, time.perf_counter() - begin


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
