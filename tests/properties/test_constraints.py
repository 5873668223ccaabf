"""Whatever is given besides the land: a layout that holds, or one clear refusal."""

from __future__ import annotations

import dataclasses

import numpy as np
import shapely
import shapely.affinity
import shapely.ops
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from lands import ell, ellipse, holed, site_of, star

from urban_processing.errors import UrbanError
from urban_processing.metrics import certificate
from urban_processing.metrics.tables import street_table
from urban_processing.params import CogenerateParams, StreetPattern
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.site import FixedStreet, LockedLand, Site, snap_to_grid

SNAP = 1.0
"""Default tolerance of given lines in metres."""


def some_land(rng: np.random.Generator) -> list[shapely.Polygon]:
    """One or two parts, regular, notched or with holes."""
    seed = int(rng.integers(1000))
    lands = [
        [shapely.box(0, 0, rng.uniform(100, 800), rng.uniform(60, 500))],
        [star(seed, int(rng.integers(5, 24)), low=rng.uniform(0.3, 0.95))],
        [holed(seed, int(rng.integers(1, 4)))],
        [ell(rng.uniform(100, 300))],
        [star(seed, 9), shapely.affinity.translate(ellipse(120, 80), 700, 100)],
    ]
    chosen = [land for land in lands[rng.integers(len(lands))] if land.is_valid]
    return chosen or [shapely.box(0, 0, 300, 200)]


def blob(rng: np.random.Generator, x: float, y: float, radius: float) -> shapely.Polygon:
    n = int(rng.integers(5, 14))
    t = np.linspace(0, 2 * np.pi, n, endpoint=False)
    r = radius * rng.uniform(0.5, 1.0, n)
    return shapely.Polygon(snap_to_grid(np.column_stack([x + r * np.cos(t), y + r * np.sin(t)])))


def some_site(seed: int) -> tuple[Site, dict[str, object]]:
    """A random land with random layers, and parameters that go with them."""
    rng = np.random.default_rng(seed)
    lands = some_land(rng)
    ring = lands[0].exterior
    x0, y0, x1, y1 = shapely.total_bounds(lands)
    size = sum(land.area for land in lands) ** 0.5

    def place() -> tuple[float, float]:
        return rng.uniform(x0 - 30, x1 + 30), rng.uniform(y0 - 30, y1 + 30)

    def shaken(line: shapely.LineString) -> shapely.LineString:
        return shapely.transform(line, lambda xy: xy + rng.uniform(-0.5, 0.5, xy.shape))

    def obstacle() -> shapely.Polygon:
        return [
            blob(rng, *place(), size * rng.uniform(0.02, 0.25)),
            shapely.LineString([place(), place()]).buffer(size * rng.uniform(0.005, 0.04)),
            ring.interpolate(rng.random(), normalized=True).buffer(size * rng.uniform(0.02, 0.2)),
        ][rng.integers(3)]

    def line() -> shapely.LineString:
        start = 0.7 * rng.random()
        along = shapely.ops.substring(ring, start, start + 0.2, normalized=True)
        return [
            shapely.LineString([place() for _ in range(rng.integers(2, 5))]),
            shapely.LineString(blob(rng, *place(), 0.15 * size).exterior),
            shaken(along),
        ][rng.choice(3, p=[0.6, 0.2, 0.2])]

    lines = [line() for _ in range(rng.integers(0, 5))]
    if lines and rng.random() < 0.3:
        lines.append(shaken(lines[0]))
    start = 0.6 * rng.random()
    rim_line = shapely.ops.substring(ring, start, start + 0.3, normalized=True)
    rim = rng.choice(["street", "none", "along-lines", "except-lines"])
    n_entries = int(rng.integers(0, 3))
    entries = [
        ring.interpolate(share, normalized=True).coords[0] for share in rng.random(n_entries)
    ]
    site = dataclasses.replace(
        site_of(*lands),
        obstacles=tuple(obstacle() for _ in range(rng.integers(0, 3))),
        fixed_streets=tuple(FixedStreet(shapely.transform(g, snap_to_grid)) for g in lines),
        locked=tuple(
            LockedLand(blob(rng, *place(), size * rng.uniform(0.03, 0.2)))
            for _ in range(rng.integers(0, 2))
        ),
        rim_lines=(rim_line,) if str(rim).endswith("lines") else (),
        entries=np.array(entries).reshape(-1, 2),
    )
    values: dict[str, object] = {
        "rim": rim,
        "pattern": rng.choice([p.value for p in StreetPattern]),
        "parcels": int(rng.integers(1, 40)),
        "obstacle_rim": "street" if site.obstacles and rng.random() < 0.3 else "none",
    }
    return site, values


@given(seed=st.integers(0, 10**6))
@settings(
    max_examples=30, deadline=None, derandomize=True, suppress_health_check=[HealthCheck.too_slow]
)
def test_a_layout_that_holds_or_a_refusal(seed: int) -> None:
    site, values = some_site(seed)
    try:
        layout = cogenerate(site, CogenerateParams(**values))
    except UrbanError:
        return  # any other error fails the test
    layout.mesh.validate()
    proof = certificate(layout)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]
    parcels = layout.mesh.face_polygons()
    gone = shapely.union_all(list(layout.obstacles))
    assert shapely.area(shapely.intersection(parcels, gone)).sum() < 1e-3
    at_street = layout.mesh.origin[np.repeat(layout.edge_street, 2)]
    alone = np.bincount(layout.face_part) == 1
    if not alone.any():
        assert np.isin(np.flatnonzero(layout.vertex_entry), at_street).all()
    streets = street_table(layout)
    found = shapely.union_all(streets.geometry[~np.isnan(streets["fixed_id"])])
    given_lines = shapely.union_all([street.line for street in site.fixed_streets])
    assert shapely.difference(found, shapely.buffer(given_lines, 2.5 * SNAP)).length < 1e-3
    inside = shapely.buffer(shapely.union_all(parcels[~layout.face_locked]), -2.5 * SNAP)
    missing = shapely.difference(
        shapely.intersection(given_lines, inside), shapely.buffer(found, 2 * SNAP)
    )
    dropped = sum(i.value or 0.0 for i in layout.issues if i.code == "fixed_street_dropped")
    pieces = [g for g in shapely.get_parts(missing) if g.length > 3 * SNAP]
    # as an area, so that what was given twice counts once
    wide = shapely.buffer(shapely.union_all(pieces), 2 * SNAP, cap_style="flat")
    assert wide.area <= 1.2 * 4 * SNAP * (dropped + SNAP)
