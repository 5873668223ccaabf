"""Lands for tests: regular, freeform, notched, with holes, in parts."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.site import Site, snap_to_grid


def site_of(*polygons: shapely.Polygon, rim_is_street: bool = True) -> Site:
    """A site of the given parts, largest first."""
    parts = [
        shapely.orient_polygons(shapely.transform(p, snap_to_grid))
        for p in sorted(polygons, key=lambda p: -p.area)
    ]
    return Site(parts=tuple(parts), rim_is_street=rim_is_street)


def ellipse(a: float = 300.0, b: float = 200.0, n: int = 72) -> shapely.Polygon:
    """An ellipse as a polygon of n vertices."""
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    return shapely.Polygon(np.column_stack([a * np.cos(t), b * np.sin(t)]))


def star(seed: int, n: int = 14, size: float = 300.0, low: float = 0.45) -> shapely.Polygon:
    """A star-shaped land with random radii: notches and spurs."""
    rng = np.random.default_rng(seed)
    t = np.sort(rng.random(n) * 2 * np.pi)
    t = np.linspace(0, 2 * np.pi, n, endpoint=False) + 0.3 * (t - t.mean()) / n
    r = size * rng.uniform(low, 1.0, n)
    return shapely.Polygon(np.column_stack([r * np.cos(t), r * np.sin(t)]))


def ell(size: float = 300.0) -> shapely.Polygon:
    """An L."""
    return shapely.Polygon(
        np.array([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)], dtype=float) * size
    )


def holed(seed: int = 0, holes: int = 2, size: float = 400.0) -> shapely.Polygon:
    """A rectangle with lakes."""
    rng = np.random.default_rng(seed)
    land = shapely.box(0, 0, 2 * size, size)
    for i in range(holes):
        x = (i + 0.5) * 2 * size / holes
        lake = shapely.Point(x, size * rng.uniform(0.35, 0.65)).buffer(
            size * rng.uniform(0.06, 0.16), quad_segs=4
        )
        land = land.difference(lake)
    return land


LANDS: dict[str, shapely.Polygon] = {
    "square": shapely.box(0, 0, 400, 400),
    "triangle": shapely.Polygon([(0, 0), (600, 0), (250, 400)]),
    "ellipse": ellipse(),
    "ell": ell(),
    "star": star(3),
    "lakes": holed(),
    "strip": shapely.box(0, 0, 2000, 45),
}
