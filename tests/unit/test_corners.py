"""Approximate polygons and irregularity (Chen 2024, Eq. 1)."""

from __future__ import annotations

import numpy as np
import pytest
from lands import ellipse

from urban_processing.mesh.corners import (
    interior_angles,
    polygon_irregularity,
    reported_polygons,
    ring_areas,
    simplified_vertices,
    thin_corners,
)


def ragged(*rings: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    arrays = [np.array(r, dtype=float) for r in rings]
    return np.concatenate(arrays), np.append(0, np.cumsum([len(a) for a in arrays]))


SQUARE = [(0, 0), (1, 0), (1, 1), (0, 1)]


def test_square_is_regular_and_two_to_one_is_not() -> None:
    xy, offsets = ragged(SQUARE, [(0, 0), (2, 0), (2, 1), (0, 1)])
    square, oblong = polygon_irregularity(xy, offsets)
    assert square == pytest.approx(0)
    # sides 2, 1, 2, 1: variance 0.25, mean 1.5
    assert oblong == pytest.approx(0.25 * 0.25 / 1.5**2)


def test_angles_count_with_the_first_weight() -> None:
    # a rhombus with angles of 60° and 120°, all sides 1
    xy, offsets = ragged([(0, 0), (1, 0), (1.5, np.sqrt(3) / 2), (0.5, np.sqrt(3) / 2)])
    assert polygon_irregularity(xy, offsets)[0] == pytest.approx(0.75 * (np.pi / 6) ** 2)
    assert polygon_irregularity(xy, offsets, (0.0, 1.0))[0] == pytest.approx(0)


def test_collinear_and_nearly_collinear_vertices_are_no_corners() -> None:
    xy, offsets = ragged([(0, 0), (5, 0), (10, 0), (10, 10), (5, 10.1), (0, 10)])
    corners, _ = reported_polygons(xy, offsets)
    assert corners.tolist() == [0, 2, 3, 5]


def test_straightest_corner_goes_first_and_three_remain() -> None:
    octagon = [(np.cos(t), np.sin(t)) for t in np.arange(16) * np.pi / 8]
    xy, offsets = ragged(octagon)
    corners, corner_offsets = reported_polygons(xy, offsets)
    angles = interior_angles(xy[corners], corner_offsets)
    assert len(corners) >= 3
    assert angles.max() <= np.radians(135) + 1e-9


def test_ellipse_has_corners_of_its_own() -> None:
    xy = np.array(ellipse().exterior.coords)[:-1]
    corners, _ = reported_polygons(xy, np.array([0, len(xy)]))
    assert 3 <= len(corners) <= 8


def test_sliver_keeps_three_corners() -> None:
    xy, offsets = ragged([(0, 0), (100, 0), (50, 0.01)], SQUARE)
    _, corner_offsets = reported_polygons(xy, offsets)
    assert np.diff(corner_offsets).tolist() == [3, 4]


def test_given_corners_are_kept() -> None:
    xy, offsets = ragged([(0, 0), (1, -0.1), (2, 0), (2, 2), (0, 2)])
    every = np.arange(5)
    thinned, _ = thin_corners(xy, every, offsets)
    kept, _ = thin_corners(xy, every, offsets, keep=every == 1)
    assert 1 not in thinned
    assert 1 in kept


@pytest.mark.parametrize("turn", [0.3, 1.0, 2.5])
def test_irregularity_does_not_depend_on_place_rotation_or_start(turn: float) -> None:
    rng = np.random.default_rng(1)
    ring = np.array([(0, 0), (3, 0.2), (3.5, 2), (1, 3), (-0.5, 1.5)])
    c, s = np.cos(turn), np.sin(turn)
    moved = np.roll(ring @ np.array([[c, s], [-s, c]]) + rng.random(2) * 1e5, 2, axis=0)
    xy, offsets = np.concatenate([ring, moved]), np.array([0, 5, 10])
    corners, corner_offsets = reported_polygons(xy, offsets)
    values = polygon_irregularity(xy[corners], corner_offsets)
    assert values[0] == pytest.approx(values[1], abs=1e-6)
    assert ring_areas(xy, offsets)[0] == pytest.approx(ring_areas(xy, offsets)[1])


def test_simplified_vertices_are_sorted_and_within_the_tolerance() -> None:
    xy = np.array(ellipse(n=200).exterior.coords)[:-1]
    kept = simplified_vertices(xy, np.array([0, len(xy)]), 0.02)
    assert (np.diff(kept) > 0).all()
    assert 6 < len(kept) < 40
