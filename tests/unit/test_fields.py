"""Cross fields and streamlines."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
import shapely.affinity
from lands import LANDS

from urban_processing.fields.cross import sample_field
from urban_processing.fields.rings import RingBatch, make_batch
from urban_processing.fields.tracing import trace


def batch_of(*polygons: shapely.Polygon) -> RingBatch:
    rings = [np.array(shapely.orient_polygons(p).exterior.coords)[:-1] for p in polygons]
    offsets = np.append(0, np.cumsum([len(r) for r in rings]))
    return make_batch(np.concatenate(rings), offsets, np.arange(len(rings)))


def test_batch_is_normalised_and_comes_back() -> None:
    p = shapely.affinity.rotate(shapely.box(500, 700, 540, 710), 30)
    rings = batch_of(p, LANDS["triangle"])
    assert rings.count.tolist() == [4, 3]
    assert np.ptp(rings.z[0].real) == pytest.approx(2)
    assert np.ptp(rings.z[0].imag) == pytest.approx(0.5)
    back = rings.to_map(np.zeros(4, dtype=int), rings.z[0])
    assert back == pytest.approx(np.array(shapely.orient_polygons(p).exterior.coords)[:-1])


def test_field_of_a_rectangle_follows_its_sides() -> None:
    rings = batch_of(shapely.affinity.rotate(shapely.box(0, 0, 30, 20), 17))
    field = sample_field(rings, 24)
    rng = np.random.default_rng(0)
    z = rng.uniform(-0.55, 0.55, 50) + 1j * rng.uniform(-0.35, 0.35, 50)
    d = field.directions(np.zeros(50, dtype=int), z, np.ones(50, dtype=complex))
    assert np.abs(np.angle(d)).max() < np.radians(1)


def test_field_follows_a_circle() -> None:
    t = np.linspace(0, 2 * np.pi, 64, endpoint=False)
    disc = shapely.Polygon(np.column_stack([np.cos(t), np.sin(t)]))
    rings = batch_of(disc)
    field = sample_field(rings, 48)
    z = 0.9 / np.sqrt(np.pi) * np.exp(1j * t[::5])
    cross = field.crosses(np.zeros(len(z), dtype=int), z)
    expected = (1j * z / np.abs(z)) ** 4
    off = np.abs(np.angle(cross * np.conj(expected))) / 4
    assert np.degrees(np.median(off)) < 3


@pytest.mark.parametrize("name", ["square", "triangle", "ell", "star"])
def test_distance_is_positive_inside_and_right(name: str) -> None:
    rings = batch_of(LANDS[name])
    field = sample_field(rings, 64)
    polygon = shapely.Polygon(np.column_stack([rings.z[0].real, rings.z[0].imag]))
    rng = np.random.default_rng(0)
    x0, y0, x1, y1 = polygon.bounds
    z = rng.uniform(x0, x1, 200) + 1j * rng.uniform(y0, y1, 200)
    points = shapely.points(z.real, z.imag)
    sign = np.where(shapely.contains(polygon, points), 1, -1)
    expected = sign * shapely.distance(polygon.exterior, points)
    found = field.distances(np.zeros(200, dtype=int), z)
    assert np.abs(found - expected).max() < 0.05


def test_streamline_of_a_square_is_straight_and_ends_on_the_far_side() -> None:
    rings = batch_of(LANDS["square"])
    field = sample_field(rings, 24)
    start = np.array([0.1 + 0.05j])
    arms = trace(rings, field, np.array([0]), start, np.array([1 + 0j]), 0.18, np.array([False]))
    assert arms.edge[0] >= 0
    assert arms.end[0] == pytest.approx(0.5 + 0.05j, abs=0.01)
    (path,) = arms.paths(np.array([0]))
    assert path[0] == start[0]
    assert path[-1] == arms.end[0]
    chord = np.sum(path[:-1].real * path[1:].imag - path[:-1].imag * path[1:].real)
    assert arms.twice_area[0] == pytest.approx(chord)


@pytest.mark.parametrize("name", ["triangle", "ellipse", "ell", "star"])
def test_streamlines_stay_inside(name: str) -> None:
    rings = batch_of(LANDS[name])
    field = sample_field(rings, 48)
    polygon = shapely.Polygon(np.column_stack([rings.z[0].real, rings.z[0].imag]))
    seeds = np.array([p.x + 1j * p.y for p in [polygon.representative_point(), polygon.centroid]])
    seeds = np.repeat(seeds, 4)
    n = len(seeds)
    first = field.directions(np.zeros(n, dtype=int), seeds, np.ones(n, dtype=complex))
    arms = trace(
        rings,
        field,
        np.zeros(n, dtype=int),
        seeds,
        first * 1j ** np.arange(n),
        0.18,
        np.zeros(n, dtype=bool),
    )
    good = np.flatnonzero(arms.edge >= 0)
    assert len(good) >= n // 2
    for path in arms.paths(good):
        line = shapely.LineString(np.column_stack([path.real, path.imag]))
        assert polygon.buffer(1e-6).covers(line)
