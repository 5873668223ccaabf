"""Random polygons of six families for tests of the straight skeleton, and regular ones."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import shapely

Rings = tuple[npt.NDArray[np.float64], npt.NDArray[np.int64]]
FAMILIES = {"star": 600, "snapped": 300, "ortho": 400, "collinear": 300, "holes": 300, "nasty": 100}
"""How many polygons of each family make the full 2,000."""


def rings_of_polygon(polygon: shapely.Polygon) -> Rings:
    """Vertices of the rings of a polygon, and where rings begin."""
    turned = shapely.orient_polygons(polygon)
    rings = [shapely.get_coordinates(r)[:-1] for r in [turned.exterior, *turned.interiors]]
    return np.concatenate(rings), np.append(0, np.cumsum([len(r) for r in rings]))


def polygon_of(xy: npt.NDArray[np.float64], offsets: npt.NDArray[np.int64]) -> shapely.Polygon:
    """The polygon of rings."""
    rings = np.split(xy, offsets[1:-1])
    return shapely.Polygon(rings[0], rings[1:])


def random_polygons(share: float = 1.0, seed: int = 1) -> Iterator[tuple[str, shapely.Polygon]]:
    """Valid polygons of all families with their family's name."""
    rng = np.random.default_rng(seed)
    for family, count in FAMILIES.items():
        made = 0
        while made < round(share * count):
            polygon = _MAKERS[family](rng)
            if polygon.geom_type != "Polygon" or not polygon.is_valid or polygon.area < 1e-9:
                continue
            polygon = shapely.remove_repeated_points(polygon)
            if polygon.is_valid and (family != "holes" or polygon.interiors):
                made += 1
                yield family, polygon


def _spokes(rng: np.random.Generator, n: int, least: float = 0.3) -> npt.NDArray[np.float64]:
    angle = np.sort(rng.uniform(0, 2 * np.pi, n))
    radius = 100 * rng.uniform(least, 1, n)
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle)])


def _boxes(rng: np.random.Generator, n: int) -> shapely.Polygon:
    """The largest part of a union of boxes with whole coordinates, without its holes."""
    low = rng.integers(1, 14, (n, 2))
    high = low + rng.integers(1, 10, (n, 2))
    union = shapely.union_all(shapely.box(*low.T, *high.T))
    parts = shapely.get_parts(union)
    return shapely.Polygon(parts[np.argmax(shapely.area(parts))].exterior)


def _star(rng: np.random.Generator) -> shapely.Polygon:
    return shapely.Polygon(_spokes(rng, int(rng.integers(3, 60))))


def _snapped(rng: np.random.Generator) -> shapely.Polygon:
    return shapely.Polygon(np.round(_spokes(rng, int(rng.integers(3, 60))) / 10))


def _ortho(rng: np.random.Generator) -> shapely.Polygon:
    return _boxes(rng, int(rng.integers(2, 9)))


def _collinear(rng: np.random.Generator) -> shapely.Polygon:
    corners = (
        _spokes(rng, int(rng.integers(3, 20)))
        if rng.random() < 0.5
        else shapely.get_coordinates(_boxes(rng, 4))[:-1]
    )
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        shares = np.sort(rng.choice([0.25, 0.5, 0.75], rng.integers(0, 3), replace=False))
        points += [a, *(a + s * (b - a) for s in shares)]
    return shapely.Polygon(points)


def _holes(rng: np.random.Generator) -> shapely.Polygon:
    if rng.random() < 0.5:
        polygon = shapely.box(0, 0, 20, 14)
        for _ in range(rng.integers(1, 4)):
            x, y = rng.integers(1, 15), rng.integers(1, 9)
            polygon = polygon.difference(shapely.box(x, y, x + 3, y + 3))
        return polygon
    polygon = shapely.Polygon(_spokes(rng, int(rng.integers(3, 60)), 0.6))
    for _ in range(rng.integers(1, 4)):
        spokes = 0.15 * _spokes(rng, int(rng.integers(3, 9))) + rng.uniform(-25, 25, 2)
        hole = shapely.Polygon(spokes)
        if hole.is_valid and polygon.is_valid and polygon.buffer(-1).contains(hole):
            polygon = polygon.difference(hole)
    return polygon


def _nasty(rng: np.random.Generator) -> shapely.Polygon:
    """A tiny edge, nearly in line with the one before, at times far from the origin."""
    spokes = _spokes(rng, int(rng.integers(5, 30)))
    k = int(rng.integers(len(spokes)))
    edge = spokes[(k + 1) % len(spokes)] - spokes[k]
    noise = rng.normal(0, rng.choice([0, 1e-5, 1e-3]), 2)
    point = spokes[k] + edge * rng.choice([1e-4, 1e-6]) + noise
    return shapely.Polygon(np.insert(spokes, k + 1, point, axis=0) + rng.choice([0, 5e5]))


_MAKERS = {
    "star": _star,
    "snapped": _snapped,
    "ortho": _ortho,
    "collinear": _collinear,
    "holes": _holes,
    "nasty": _nasty,
}
