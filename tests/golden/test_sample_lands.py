"""Layouts of the real sample boundaries: what must hold, and how good they are."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from pathlib import Path

import pytest
import shapely

from urban_processing.io.boundaries import read_boundary
from urban_processing.layout import Layout
from urban_processing.metrics import certificate, measure
from urban_processing.params import CogenerateParams, OptimizeParams
from urban_processing.pipelines.cogenerate import cogenerate
from urban_processing.pipelines.optimize import optimize

SMOOTH = ("rect", "triangle", "ellipse", "irregular_64ha", "wyoming", "sant_adria")
NOTCHED = ("wandsworth", "islington", "schaan", "planken", "schellenberg", "mauren")
IN_PARTS = ("schaan", "planken")
"""Five parts each, small and notched, and two holes: more parcels lie at a rim, and fewer share
a street, since every part has streets of its own."""

Find = Callable[[str], Path]


@cache
def laid_out(
    path: Path, parcels: int, pattern: str, preset: str = "recommended", optimize: bool = True
) -> Layout:
    params = CogenerateParams(parcels=parcels, pattern=pattern, preset=preset, optimize=optimize)
    return cogenerate(read_boundary(path), params)


def figures(layout: Layout) -> dict[str, float]:
    return {m.metric: m.value for m in measure(layout) if m.part is None}


@pytest.mark.parametrize("pattern", ["loop", "cul-de-sac", "tree"])
@pytest.mark.parametrize("parcels", [100, 500])
@pytest.mark.parametrize("name", SMOOTH + NOTCHED)
def test_certificate_holds(sample: Find, name: str, parcels: int, pattern: str) -> None:
    layout = laid_out(sample(name), parcels, pattern)
    proof = certificate(layout)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]
    assert layout.mesh.n_faces == pytest.approx(parcels, rel=0.03)
    found = figures(layout)
    assert found["area_max_over_min_area"] <= 3
    holes = sum(len(part.interiors) for part in layout.input_parts)
    if pattern == "loop" and holes == 0:
        assert found["street_ends"] == 0


@pytest.mark.parametrize("name", SMOOTH + NOTCHED)
def test_quality_of_500_parcels(sample: Find, name: str) -> None:
    found = figures(laid_out(sample(name), 500, "loop"))
    smooth = name in SMOOTH
    assert found["quads_pct"] >= (99 if smooth else 96.5)
    assert found["irregularity_mean"] <= (0.015 if smooth else 0.030)
    assert found["irregular_pct"] <= (1 if smooth else 6.5 if name in IN_PARTS else 3.5)
    assert found["junction_deviation_deg"] <= 2.5
    assert found["street_length_relative"] <= 0.65
    assert found["block_parcels_max"] <= 50
    assert found["parcels_per_street"] >= (7 if name in IN_PARTS else 10)


@pytest.mark.parametrize("name", SMOOTH + NOTCHED)
def test_optimization_makes_every_land_better(sample: Find, name: str) -> None:
    before = laid_out(sample(name), 500, "loop", optimize=False)
    after = optimize(before, OptimizeParams())
    was, now = figures(before), figures(after)
    assert now["irregularity_mean"] < was["irregularity_mean"]
    assert now["junction_deviation_deg"] < was["junction_deviation_deg"]
    assert now["irregular_pct"] <= was["irregular_pct"]
    assert now["unreached"] == 0
    # the rim keeps its shape
    land = [
        shapely.union_all(before.mesh.face_polygons()[before.face_part == part])
        for part in range(int(before.face_part.max()) + 1)
    ]
    proof = certificate(after, land=land)
    assert proof.holds, [(c.name, c.message) for c in proof.failures]


@pytest.mark.parametrize("name", ["triangle", "islington", "schellenberg"])
def test_recommended_rules_are_better_than_those_printed(sample: Find, name: str) -> None:
    ours = figures(laid_out(sample(name), 500, "loop"))
    printed = laid_out(sample(name), 500, "loop", "chen2024")
    assert certificate(printed).holds
    theirs = figures(printed)
    assert ours["irregularity_mean"] < 0.75 * theirs["irregularity_mean"]
    assert ours["irregular_pct"] <= theirs["irregular_pct"]
    assert ours["parcels_per_street"] > theirs["parcels_per_street"]
