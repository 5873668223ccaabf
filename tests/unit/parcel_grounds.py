"""Grounds and rules for tests of subdivision, and what must hold for all pieces."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import shapely

from urban_processing.blocks.model import plain_blocks
from urban_processing.hashing import splitmix64
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.touches import joined_at_touches
from urban_processing.parcelling.ground import Ground, Pieces, Rules
from urban_processing.site import snap_to_grid

REAL = ("aleppo", "auckland", "slc", "wuhan", "liechtenstein")


def ground_of(polygons, *, access=None, keep_order=False) -> Ground:
    """Polygons as ground; lineages come from their order, all shells are street."""
    shapes = np.atleast_1d(np.asarray(polygons, dtype=object))
    blocks = plain_blocks(shapes if keep_order else canonical_rings(shapes))
    return Ground(
        rings=blocks.rings,
        access=blocks.edge_access if access is None else access,
        width=blocks.edge_width,
        street=blocks.edge_street,
        lineage=splitmix64(1_000_000 + np.arange(len(shapes)).astype(np.uint64)),
    )


def rules_of(n: int, min_area: float = 400.0, **given) -> Rules:
    """Return the same rules for `n` polygons, by default those of the parameters."""
    values = {
        "min_area": min_area,
        "max_area": 2.5 * min_area,
        "min_width": 0.6 * min_area**0.5,
        "max_width": 1.2 * min_area**0.5,
        "irregularity": 0.2,
        "street_access": 1.0,
        "offset": np.inf,
        "by_length": False,
        "snap": 0.1 * min_area**0.5,
        "corner": 40.0,
    } | given
    return Rules(**{name: np.full(n, value) for name, value in values.items()})


def polygons_of(ground: Ground):
    rings = ground.rings
    rows = [rings.xy[a:b] for a, b in zip(rings.offsets[:-1], rings.offsets[1:], strict=True)]
    out = []
    for block in range(len(ground)):
        own = [row for row, of in zip(rows, rings.block, strict=True) if of == block]
        out.append(shapely.Polygon(own[0], own[1:]))
    return np.array(out, dtype=object)


def assert_tiled(pieces: Pieces, ground: Ground, *, close: float = 1e-9) -> None:
    """Pieces tile each polygon exactly, are noded, and name their blocks and streets rightly."""
    land, faces = polygons_of(ground), pieces.polygons()
    assert shapely.is_valid(faces).all()
    assert (shapely.get_type_id(faces) == 3).all()
    assert (np.diff(pieces.block) >= 0).all()
    assert len(np.unique(pieces.lineage)) == pieces.n_faces
    area = np.bincount(pieces.block, weights=shapely.area(faces), minlength=len(ground))
    np.testing.assert_allclose(area, shapely.area(land), rtol=close)
    for block, polygon in enumerate(land):
        own = faces[pieces.block == block]
        assert shapely.coverage_is_valid(joined_at_touches(own)), f"polygon {block} is no coverage"
        outline = shapely.union_all(own)
        assert shapely.hausdorff_distance(outline, polygon) < 1e-7
    np.testing.assert_array_equal(pieces.xy[: len(ground.rings.xy)], ground.rings.xy)
    tail = pieces.xy[pieces.vertex]
    head = pieces.xy[pieces.vertex[_following(pieces)]]
    length = np.hypot(*(head - tail).T)
    edge = ground.rings.xy[ground.rings.following] - ground.rings.xy
    street = np.hypot(*edge.T)[ground.access].sum()
    np.testing.assert_allclose(length[pieces.access].sum(), street, rtol=1e-9)


def frontage_of(pieces: Pieces):
    """(F,) length of street sides."""
    edge = pieces.xy[pieces.vertex[_following(pieces)]] - pieces.xy[pieces.vertex]
    face = np.repeat(pieces.face, np.diff(pieces.offsets))
    weights = np.where(pieces.access, np.hypot(*edge.T), 0.0)
    return np.bincount(face, weights=weights, minlength=pieces.n_faces)


def _following(pieces: Pieces):
    after = np.arange(1, len(pieces.vertex) + 1)
    after[pieces.offsets[1:] - 1] = pieces.offsets[:-1]
    return after


def star(rng: np.random.Generator, n: int, *, radius: float = 60.0, inner: float = 0.35):
    """A polygon around a point, mostly concave."""
    turn = np.sort(rng.uniform(0, 2 * np.pi, n))
    turn += np.linspace(0, 0.01, n)
    far = radius * rng.uniform(inner, 1, n)
    return _clean(np.column_stack([far * np.cos(turn), far * np.sin(turn)]))


def rectilinear(rng: np.random.Generator, n: int, *, cell: float = 15.0):
    """A polygon of square cells, in whole steps, with many sides in line."""
    cells = {(0, 0)}
    for _ in range(20 * n):
        x, y = sorted(cells)[rng.integers(len(cells))]
        dx, dy = [(1, 0), (-1, 0), (0, 1), (0, -1)][rng.integers(4)]
        x, y = x + dx, y + dy
        touches = [
            (x + i, y + j) in cells and (x + i, y) not in cells and (x, y + j) not in cells
            for i in (-1, 1)
            for j in (-1, 1)
        ]
        if len(cells) < n and not any(touches):  # none that meets another at a corner alone
            cells.add((x, y))
    parts = [shapely.box(cell * x, cell * y, cell * (x + 1), cell * (y + 1)) for x, y in cells]
    return shapely.simplify(shapely.normalize(shapely.union_all(parts)), 0)


def with_holes(rng: np.random.Generator, n: int):
    """A square with some triangles cut out."""
    shape = shapely.box(-70, -70, 70, 70)
    for _ in range(n):
        move = rng.uniform(-55, 55, 2)
        hole = shapely.transform(star(rng, 3, radius=12.0), lambda xy, move=move: xy + move)
        shape = shapely.difference(shape, hole)
    parts = shapely.get_parts(shape)
    return _clean_all(parts[np.argmax(shapely.area(parts))])


def with_touching_holes(rng: np.random.Generator, n: int):
    """A polygon with holes that touch its shell, or each other, at vertices."""
    shape = star(rng, 7, inner=0.6) if rng.random() < 0.5 else rectilinear(rng, 12)
    for _ in range(n):
        spots = shapely.get_coordinates(shape)
        spot = spots[rng.integers(len(spots))]
        size = rng.choice([1.0, 8.0, 25.0])
        turn = rng.uniform(0, 2 * np.pi) + np.sort(rng.uniform(0, rng.choice([0.2, 2.0]), 3))
        far = size * rng.uniform(0.3, 1, 3)
        ends = snap_to_grid(spot + far[:, None] * np.column_stack([np.cos(turn), np.sin(turn)]))
        hole = np.vstack([spot, ends])
        holes = [shapely.get_coordinates(ring) for ring in shape.interiors]
        holed = shapely.Polygon(shape.exterior, [*holes, hole])
        if shapely.is_valid(holed):
            shape = holed
    return shape


def with_tiny_edges(rng: np.random.Generator, n: int):
    """A quadrangle whose sides have vertices a few micrometres to millimetres apart."""
    corners = np.array([[0, 0], [90, 5], [85, 70], [-5, 60.0]]) + rng.normal(0, 5, (4, 2))
    points = []
    for a, b in zip(corners, np.roll(corners, -1, axis=0), strict=True):
        points.append(a)
        for share in np.sort(rng.uniform(0.1, 0.9, n)):
            at = a + share * (b - a)
            step = 10.0 ** rng.uniform(-5.5, -2.5)
            points += [at + rng.normal(0, 1e-6, 2), at + step * (b - a) / np.hypot(*(b - a))]
    return _clean(np.array(points))


def blocks_of_network(name: str, folder: Path, *, n: int = 12, seed: int = 0):
    """Faces of a real street network, 6 m within its centrelines."""
    gpd = __import__("geopandas")
    edges = gpd.read_file(folder / f"{name}.gpkg", layer="edges")
    lines = edges.to_crs(edges.estimate_utm_crs()).geometry.values
    faces = shapely.get_parts(shapely.polygonize([shapely.union_all(shapely.get_parts(lines))]))
    faces = shapely.get_parts(shapely.buffer(faces, -6.0, join_style="mitre"))
    faces = faces[(shapely.area(faces) > 1200) & (shapely.area(faces) < 40000)]
    origin = np.floor(shapely.get_coordinates(faces).min(axis=0))
    faces = shapely.transform(faces, lambda xy: snap_to_grid(xy - origin))
    faces = faces[shapely.is_valid(faces)]
    chosen = np.random.default_rng(seed).choice(len(faces), min(n, len(faces)), replace=False)
    return faces[np.sort(chosen)]


def _clean(points):
    return _clean_all(shapely.Polygon(points))


def _clean_all(shape):
    """On the grid of coordinates, and valid."""
    shape = shapely.transform(shape, snap_to_grid)
    if not shapely.is_valid(shape):
        parts = shapely.get_parts(shapely.make_valid(shape))
        parts = parts[shapely.get_type_id(parts) == 3]
        shape = shapely.transform(parts[np.argmax(shapely.area(parts))], snap_to_grid)
    return shape if shapely.is_valid(shape) else shapely.box(0, 0, 40, 40)
