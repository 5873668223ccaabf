"""Co-generation whose last levels another strategy makes."""

from __future__ import annotations

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lands import LANDS, ellipse, holed, site_of, star

from urban_processing.blocks.model import UNKNOWN_STREET, BlockRings
from urban_processing.errors import ParameterError
from urban_processing.layout import Layout
from urban_processing.metrics import certificate
from urban_processing.metrics.parcels import measure_parcels
from urban_processing.params import CogenerateParams, StreetPattern
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.parcelling.divide import divide
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.rules import resolve_rules
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.pipelines.small_pieces import join_small
from urban_processing.site import FixedStreet, LockedLand, Site

OTHERS = [Strategy.SKELETON, Strategy.OBB, Strategy.HYBRID]
FEW = settings(
    max_examples=12, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)


def run(site: Site, **values: object) -> Layout:
    return cogenerate(site, CogenerateParams(**values))


def must_hold(layout: Layout, min_area: float) -> None:
    layout.mesh.validate()
    proof = certificate(layout)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]
    free = ~layout.face_locked
    assert layout.mesh.face_area[free].min() >= min_area * (1 - 1e-9)


@pytest.mark.parametrize("name", sorted(LANDS))
@pytest.mark.parametrize("strategy", OTHERS)
def test_certificate_holds(name: str, strategy: Strategy) -> None:
    layout = run(site_of(LANDS[name]), min_area=3000, strategy=strategy)
    must_hold(layout, 3000)
    assert layout.mesh.n_faces > 0.4 * LANDS[name].area / 3000


@FEW
@given(
    seed=st.integers(0, 1000),
    corners=st.integers(5, 20),
    levels=st.integers(1, 4),
    strategy=st.sampled_from(OTHERS),
    pattern=st.sampled_from(list(StreetPattern)),
)
def test_any_land(
    seed: int, corners: int, levels: int, strategy: Strategy, pattern: StreetPattern
) -> None:
    site = site_of(star(seed, n=corners, size=150))
    must_hold(
        run(site, min_area=1000, strategy=strategy, last_levels=levels, pattern=pattern), 1000
    )


WEDGES = {
    "corner": "237 133,380 258,300 362,211 453,135 353,88 276,37 155,1 49,102 26,266 0,277 78",
    "bend": "401 512,182 468,127 497,0 497,23 466,15 298,259 295,325 273,375 253,564 149,807 0,"
    "879 169,498 395,455 429",
    "tongue": "528 766,393 825,204 928,120 770,326 640,211 467,67 238,0 141,190 1,287 180",
}
"""Blocks in whose corners rows of parcels leave a wedge beside the patio."""


def pieces_of(land: shapely.Polygon, min_area: float) -> Pieces:
    """The land as one block, divided into rows around a patio."""
    ring = shapely.get_coordinates(shapely.orient_polygons(land).exterior)[:-1]
    n = len(ring)
    ground = Ground(
        rings=BlockRings(ring, np.array([0, n]), np.array([0])),
        access=np.ones(n, dtype=bool),
        width=np.full(n, np.nan),
        street=np.full(n, UNKNOWN_STREET),
        lineage=np.array([7], dtype=np.uint64),
    )
    params = SubdivideParams(strategy="hybrid", min_area=min_area, max_area=2 * min_area)
    return divide(ground, resolve_rules(params, 1), seed=0)


@pytest.mark.parametrize("name", WEDGES)
def test_wedges_in_corners_are_no_parcels_of_their_own(name: str) -> None:
    land = shapely.from_wkt(f"LINEARRING({WEDGES[name]},{WEDGES[name].split(',')[0]})")
    block = shapely.Polygon(land)
    assert shapely.area(pieces_of(block, 3000).polygons()).min() >= 3000 * (1 - 1e-9)
    levels = int(np.ceil(np.log2(block.area / 3000)))
    layout = run(site_of(block), min_area=3000, strategy="hybrid", last_levels=levels)
    must_hold(layout, 3000)
    assert layout.mesh.n_faces > 0.4 * block.area / 3000


@FEW
@given(seed=st.integers(0, 1000), corners=st.integers(4, 20), times=st.floats(0.5, 8.0))
def test_joined_pieces_tile_the_land(seed: int, corners: int, times: float) -> None:
    land = star(seed, n=corners)
    pieces = pieces_of(land, 700)
    whole = join_small(pieces, 700 * times)
    area = shapely.area(whole.polygons)
    assert shapely.is_valid(whole.polygons).all()
    assert shapely.coverage_is_valid(whole.polygons)
    assert area.sum() == pytest.approx(land.area, rel=1e-9)
    assert area.min() >= min(700 * times, land.area) * (1 - 1e-9)
    assert len(np.unique(whole.piece)) == len(area)
    before = shapely.area(pieces.polygons())
    untouched = shapely.equals_exact(whole.polygons, pieces.polygons()[whole.piece])
    assert (area[~untouched] > before[whole.piece[~untouched]]).all()


@FEW
@given(
    seed=st.integers(0, 1000),
    corners=st.integers(5, 20),
    levels=st.integers(1, 7),
    min_area=st.floats(900, 4000),
)
def test_hybrid_keeps_the_smallest_area(
    seed: int, corners: int, levels: int, min_area: float
) -> None:
    site = site_of(star(seed, n=corners, size=200))
    values = {"strategy": "hybrid", "last_levels": levels, "optimize": False}
    must_hold(run(site, min_area=min_area, **values), min_area)


def test_holes_locked_land_and_given_streets_stay() -> None:
    site = site_of(holed(1))
    across = FixedStreet(shapely.LineString([(0, 90), (800, 110)]), "main", 14.0)
    estate = LockedLand(shapely.box(560, 250, 660, 330), "estate")
    site = Site(
        parts=site.parts, fixed_streets=(across,), locked=(estate,), obstacles=site.obstacles
    )
    layout = run(site, min_area=1800, strategy="skeleton")
    must_hold(layout, 1800)
    (locked,) = np.flatnonzero(layout.face_locked).tolist()
    assert layout.mesh.face_polygons()[locked].area == pytest.approx(8000, rel=1e-3)
    assert layout.land_uses[layout.face_use[locked]] == "estate"
    fixed = layout.edge_fixed >= 0
    assert layout.mesh.edge_length[fixed].sum() > 700
    assert layout.edge_street[fixed].all()


def test_the_same_seed_gives_the_same_layout() -> None:
    site = site_of(ellipse(150, 100))
    a, b = (run(site, min_area=1500, strategy="obb", seed=5) for _ in range(2))
    assert np.array_equal(a.mesh.xy, b.mesh.xy)
    assert np.array_equal(a.edge_street, b.edge_street)
    c = run(site, min_area=1500, strategy="obb", seed=6)
    assert not np.array_equal(a.mesh.xy, c.mesh.xy)


def test_rows_of_parcels_are_square_to_the_street() -> None:
    layout = run(site_of(shapely.box(0, 0, 300, 240)), min_area=700, strategy="skeleton")
    measured = measure_parcels(layout)
    assert (measured.sides == 4).mean() > 0.95
    assert np.median(measured.angle_deviation) < 1.0


def test_a_number_of_parcels_needs_streamlines() -> None:
    with pytest.raises(ParameterError, match="does not count parcels"):
        CogenerateParams(parcels=100, strategy="skeleton")
