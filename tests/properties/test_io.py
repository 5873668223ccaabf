"""What holds for every land and every layout on its way in and out."""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import (
    AREA_SCALE_TOLERANCE,
    area_scale_error,
    choose_crs,
)
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.crs import PYPROJ, WGS84
from urban_processing.io.files import read_layout, write_layout
from urban_processing.layout import Layout, layout_from_mesh
from urban_processing.mesh.build import mesh_from_polygons
from urban_processing.rebuild import canonical
from urban_processing.site import Frame, snap_to_grid

UTM = "EPSG:32630"
seeds = st.integers(0, 2**32 - 1)


def any_ring(seed: int) -> shapely.Polygon:
    """A ring around a centre that may cross itself."""
    rng = np.random.default_rng(seed)
    n = int(rng.integers(3, 30))
    angle = np.sort(rng.uniform(0, 2 * np.pi, n)) + rng.normal(0, 0.1, n)
    radius = rng.uniform(20, 2000) * rng.uniform(0.3, 1, n)
    centre = rng.uniform([2e5, 0], [8e5, 9e6])
    return shapely.Polygon(
        centre + radius[:, None] * np.column_stack([np.cos(angle), np.sin(angle)])
    )


@given(st.lists(seeds, min_size=1, max_size=4))
@settings(max_examples=60, deadline=None)
def test_every_land_is_ready_or_refused(chosen: list[int]) -> None:
    rings = [any_ring(seed) for seed in chosen]
    try:
        site = read_boundary(rings, crs=UTM)
    except BoundaryError:
        return
    origin = np.asarray(site.frame.origin)
    assert shapely.is_valid(site.parts).all()
    assert all(p.exterior.is_ccw for p in site.parts)
    xy = shapely.get_coordinates(site.parts)
    np.testing.assert_array_equal(xy, snap_to_grid(xy))
    np.testing.assert_array_equal((xy + origin) - origin, xy)
    assert not shapely.intersects(
        shapely.buffer(site.parts[0], -1e-3), shapely.union_all(site.parts[1:])
    )


@given(seeds, st.integers(0, 40), st.booleans())
@settings(max_examples=40, deadline=None)
def test_start_and_direction_of_rings_do_not_matter(seed: int, turn: int, back: bool) -> None:
    ring = any_ring(seed)
    xy = np.roll(shapely.get_coordinates(ring)[:-1], turn, axis=0)
    other = shapely.Polygon(xy[::-1] if back else xy)
    if not ring.is_valid:
        return
    one, two = (read_boundary(polygon, crs=UTM) for polygon in (ring, other))
    assert one.input_sha256 == two.input_sha256
    assert all(a.equals_exact(b) for a, b in zip(one.parts, two.parts, strict=True))


@given(
    st.floats(-180, 180),
    st.floats(-85, 85),
    st.floats(-3, 1.2).map(lambda power: 10.0**power),
)
@settings(max_examples=80, deadline=None)
def test_chosen_crs_is_true_to_area(lon: float, lat: float, size: float) -> None:
    low, high = max(lat - size / 2, -89.0), min(lat + size / 2, 89.0)
    xy = np.array([[lon, low], [lon + size, low], [lon + size, high], [lon, high]])
    xy[:, 0] = (xy[:, 0] + 180) % 360 - 180
    chosen = choose_crs(WGS84, xy, PYPROJ)
    assert PYPROJ.facts(chosen.crs).metric
    assert area_scale_error(chosen.crs, xy, PYPROJ) <= AREA_SCALE_TOLERANCE


def any_layout(seed: int) -> Layout:
    """A shaken grid with random streets, far from the origin or near it."""
    rng = np.random.default_rng(seed)
    nx, ny = rng.integers(1, 6, 2)
    xy = np.stack(np.meshgrid(np.arange(nx + 1), np.arange(ny + 1)), axis=-1) * 25.0
    xy = snap_to_grid(xy + rng.uniform(-6, 6, xy.shape))
    cells = [
        shapely.Polygon([xy[j, i], xy[j, i + 1], xy[j + 1, i + 1], xy[j + 1, i]])
        for j in range(ny)
        for i in range(nx)
    ]
    origin = tuple(np.round(rng.uniform(-1, 1, 2) * 10.0 ** rng.integers(0, 8)).tolist())
    plain = layout_from_mesh(
        mesh_from_polygons(cells),
        frame=Frame(UTM, origin),
        face_part=np.zeros(len(cells), dtype=np.int64),
        min_area=float(rng.uniform(1, 400)),
        rim_is_street=bool(rng.integers(2)),
    )
    street = plain.edge_street | (rng.random(plain.mesh.n_edges) < 0.3)
    return plain.replace(
        edge_street=street,
        edge_level=np.where(street, 1, -1).astype(np.int16),
        face_lineage=rng.integers(0, 2**64, len(cells), dtype=np.uint64),
        vertex_corner=rng.random(plain.mesh.n_vertices) < 0.2,
    )


@given(seeds)
@settings(max_examples=15, deadline=None)
def test_layouts_come_back_as_they_were(seed: int) -> None:
    layout = canonical(any_layout(seed))
    with tempfile.TemporaryDirectory() as folder:
        read = read_layout(write_layout(layout, Path(folder) / "a.gpkg")).layout
    assert read.frame == layout.frame
    assert read.min_area == pytest.approx(layout.min_area, abs=0)
    np.testing.assert_array_equal(read.mesh.xy, layout.mesh.xy)
    np.testing.assert_array_equal(read.mesh.origin, layout.mesh.origin)
    np.testing.assert_array_equal(read.mesh.face, layout.mesh.face)
    for name in ("edge_street", "edge_level", "face_lineage", "vertex_corner"):
        np.testing.assert_array_equal(getattr(read, name), getattr(layout, name))
