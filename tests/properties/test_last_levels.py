"""Co-generation whose last levels another strategy makes."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lands import LANDS, holed, site_of, star

from urban_processing.errors import ParameterError
from urban_processing.layout import Layout
from urban_processing.metrics import certificate
from urban_processing.metrics.parcels import measure_parcels
from urban_processing.params import CogenerateParams, StreetPattern
from urban_processing.params.subdivide import Strategy
from urban_processing.pipelines.cogenerate import cogenerate
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


@cache
def plain_faces(name: str) -> int:
    """Number of parcels of a land without another strategy."""
    return run(site_of(LANDS[name]), min_area=1500).mesh.n_faces


@pytest.mark.parametrize("name", sorted(LANDS))
@pytest.mark.parametrize("strategy", OTHERS)
def test_certificate_holds(name: str, strategy: Strategy) -> None:
    layout = run(site_of(LANDS[name]), min_area=1500, strategy=strategy)
    must_hold(layout, 1500)
    assert layout.mesh.n_faces > 0.6 * plain_faces(name)


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
    site = site_of(star(seed, n=corners, size=200))
    must_hold(
        run(site, min_area=1200, strategy=strategy, last_levels=levels, pattern=pattern), 1200
    )


def test_holes_locked_land_and_given_streets_stay() -> None:
    site = site_of(holed(1))
    across = FixedStreet(shapely.LineString([(0, 90), (800, 110)]), "main", 14.0)
    estate = LockedLand(shapely.box(560, 250, 660, 330), "estate")
    site = Site(
        parts=site.parts, fixed_streets=(across,), locked=(estate,), obstacles=site.obstacles
    )
    layout = run(site, min_area=900, strategy="skeleton")
    must_hold(layout, 900)
    (locked,) = np.flatnonzero(layout.face_locked).tolist()
    assert layout.mesh.face_polygons()[locked].area == pytest.approx(8000, rel=1e-3)
    assert layout.land_uses[layout.face_use[locked]] == "estate"
    fixed = layout.edge_fixed >= 0
    assert layout.mesh.edge_length[fixed].sum() > 700
    assert layout.edge_street[fixed].all()


def test_the_same_seed_gives_the_same_layout() -> None:
    site = site_of(LANDS["ellipse"])
    a, b = (run(site, min_area=1500, strategy="obb", seed=5) for _ in range(2))
    assert np.array_equal(a.mesh.xy, b.mesh.xy)
    assert np.array_equal(a.edge_street, b.edge_street)
    c = run(site, min_area=1500, strategy="obb", seed=6)
    assert not np.array_equal(a.mesh.xy, c.mesh.xy)


def test_rows_of_parcels_are_square_to_the_street() -> None:
    layout = run(site_of(shapely.box(0, 0, 500, 400)), min_area=700, strategy="skeleton")
    measured = measure_parcels(layout)
    assert (measured.sides == 4).mean() > 0.95
    assert np.median(measured.angle_deviation) < 1.0


def test_a_number_of_parcels_needs_streamlines() -> None:
    with pytest.raises(ParameterError, match="does not count parcels"):
        CogenerateParams(parcels=100, strategy="skeleton")
