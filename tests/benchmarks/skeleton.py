"""Straight skeletons of 2,000 random polygons: checked, timed, compared with CGAL's.

``python -m tests.benchmarks.skeleton`` checks and times them;
``python -m tests.benchmarks.skeleton --networks folder`` does so for the blocks of street networks,
GeoPackages with a layer `edges`;
``python -m tests.benchmarks.skeleton --oracle venv/bin/python`` compares them with those of CGAL,
for which that Python must have the package pysfcgal.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections import Counter, defaultdict
from pathlib import Path

import geopandas as gpd
import numpy as np
import shapely

from tests.unit.skeleton_oracle import skeletons_by_cgal
from tests.unit.skeleton_polygons import random_polygons, rings_of_polygon
from urban_processing.errors import TopologyError
from urban_processing.site import snap_to_grid
from urban_processing.skeleton.straight import Skeleton, straight_skeleton

SAME = 1e-5
"""Distance in metres within which arcs are the same."""
SIZES = (8, 16, 32, 64)


def main() -> None:
    """Print one line for each family, and times by the number of vertices."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--oracle", metavar="PYTHON", help="a Python that has pysfcgal")
    parser.add_argument("--share", type=float, default=1.0, help="share of the 2,000 polygons")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--networks", metavar="FOLDER", type=Path, help="blocks of these instead")
    args = parser.parse_args()
    if args.networks:
        polygons = [(p.stem, b) for p in sorted(args.networks.glob("*.gpkg")) for b in _blocks(p)]
    else:
        polygons = list(random_polygons(args.share, args.seed))
    skeletons, seconds = [], defaultdict(list)
    for _, polygon in polygons:
        xy, offsets = rings_of_polygon(polygon)
        started = time.process_time()
        try:
            skeletons.append(straight_skeleton(xy, offsets))
        except TopologyError:
            skeletons.append(None)
        seconds[next((s for s in SIZES if len(xy) <= s), 9999)].append(
            time.process_time() - started
        )
    for family in dict.fromkeys(name for name, _ in polygons):
        mine = [k for k, (name, _) in enumerate(polygons) if name == family]
        good = sum(_tiles(skeletons[k], polygons[k][1]) for k in mine)
        print(f"{family}: {good} of {len(mine)} tile exactly with simple faces")
    for size, taken in sorted(seconds.items()):
        print(
            f"up to {size} vertices: {len(taken)} polygons, median "
            f"{1e3 * np.median(taken):.2f} ms, longest {1e3 * max(taken):.2f} ms"
        )
    if args.oracle:
        _compare(polygons, skeletons, args.oracle)


def _blocks(path: Path) -> list[shapely.Polygon]:
    """What the streets of a network enclose, less 6 m on all sides, on the usual grid."""
    edges = gpd.read_file(path, layer="edges")
    lines = shapely.union_all(edges.to_crs(edges.estimate_utm_crs()).geometry.to_numpy())
    enclosed = shapely.get_parts(shapely.polygonize(shapely.get_parts(lines)))
    blocks = shapely.get_parts(shapely.buffer(enclosed, -6, join_style="mitre"))
    origin = np.floor(shapely.get_coordinates(blocks).min(axis=0))
    blocks = shapely.transform(blocks, lambda xy: snap_to_grid(xy - origin))
    blocks = shapely.remove_repeated_points(blocks[shapely.area(blocks) > 50])
    return list(blocks[shapely.is_valid(blocks)])


def _tiles(skeleton: Skeleton | None, polygon: shapely.Polygon) -> bool:
    """Whether faces are valid and tile a polygon exactly."""
    if skeleton is None:
        return False
    faces = [shapely.Polygon(skeleton.xy[face]) for face in skeleton.faces]
    return bool(
        shapely.is_valid(faces).all()
        and shapely.coverage_is_valid(faces)
        and abs(shapely.area(faces).sum() - polygon.area) <= 1e-9 * polygon.area
    )


def arcs_of(skeleton: Skeleton) -> shapely.MultiLineString:
    """The arcs of a skeleton: edges of its faces that are not on the contour."""
    n = len(skeleton.edge_face)
    pairs = {
        (min(a, b), max(a, b))
        for face in skeleton.faces
        for a, b in zip(face.tolist(), np.roll(face, -1).tolist(), strict=True)
        if a >= n or b >= n
    }
    return shapely.multilinestrings([skeleton.xy[list(pair)] for pair in sorted(pairs)])


def merged_polygon(skeleton: Skeleton, offsets: np.ndarray) -> shapely.Polygon:
    """The contour without vertices inside merged edges."""
    rings = []
    for first, last in itertools.pairwise(offsets):
        face = skeleton.edge_face[first:last]
        rings.append(skeleton.xy[first:last][face != np.roll(face, 1)])
    return shapely.Polygon(rings[0], rings[1:])


def difference(a: shapely.MultiLineString, b: shapely.MultiLineString) -> float:
    """Largest distance of a place on the arcs of one to those of the other."""
    step = np.ptp(shapely.get_coordinates(a), axis=0).max() / 100
    apart = 0.0
    for these, those in ((a, b), (b, a)):
        shapely.prepare(those)
        places = shapely.points(shapely.get_coordinates(shapely.segmentize(these, step)))
        apart = max(apart, float(shapely.distance(places, those).max()))
    return apart


def _compare(
    polygons: list[tuple[str, shapely.Polygon]], skeletons: list[Skeleton | None], python: str
) -> None:
    """Print how often CGAL has the same arcs."""
    solved = [k for k, skeleton in enumerate(skeletons) if skeleton is not None]
    merged = []
    for k in solved:
        _, offsets = rings_of_polygon(polygons[k][1])
        polygon = merged_polygon(skeletons[k], offsets)
        origin = np.floor(shapely.get_coordinates(polygon).mean(axis=0))
        merged.append((polygon, origin))
    local = [shapely.transform(p, lambda xy, o=o: xy - o) for p, o in merged]
    count: Counter[tuple[str, str]] = Counter()
    for k, (_, origin), theirs in zip(
        solved, merged, skeletons_by_cgal(local, python), strict=True
    ):
        family = polygons[k][0]
        if theirs is None:
            count[family, "no answer"] += 1
            continue
        mine = shapely.transform(arcs_of(skeletons[k]), lambda xy, o=origin: xy - o)
        apart = difference(mine, theirs)
        count[family, "same" if apart < SAME else "other"] += 1
        if apart >= SAME:
            print(f"polygon {k} ({family}): arcs lie {apart:.3g} m apart")
    for (family, verdict), number in sorted(count.items()):
        print(f"CGAL, {family}: {verdict} {number}")


if __name__ == "__main__":
    main()
