"""Layers of random layouts, read again as if another program had made them."""

from __future__ import annotations

import math

import numpy as np
import pytest
import shapely
from hypothesis import HealthCheck, assume, given, settings

from tests.properties.test_metrics import SEEDS, layout_with_random_streets, random_cells
from urban_processing.blocks.streets import street_lines
from urban_processing.fabric.observed import observed_parcels
from urban_processing.fabric.of_layers import fabric_of_layers
from urban_processing.layout import Layout
from urban_processing.metrics.measures import FabricMeasures, LayoutMeasures

SAME = (
    "parcels", "area_m2", "perimeter_m", "streets", "street_length_m", "junctions", "unreached",
    "frontage_mean_m", "frontage_min_m", "neighbours_mean", "blocks", "block_area_mean_m2",
    "intersections", "dead_ends", "meshedness", "circuity", "through_lots", "irregularity_mean",
    "rim_distance_m", "parcel_distance_m", "parcels_interior",
)  # fmt: skip


def layers_of(
    layout: Layout, turn: float
) -> tuple[list[shapely.Polygon], list[shapely.LineString]]:
    mesh = layout.mesh
    network = LayoutMeasures(layout).network
    c, s = math.cos(turn), math.sin(turn)
    matrix = np.array([[c, s], [-s, c]])
    shapes = [
        shapely.transform(np.asarray(g, dtype=object), lambda xy: xy @ matrix)
        for g in (mesh.face_polygons(), network.lines(mesh))
    ]
    return shapes[0].tolist(), shapes[1].tolist()


# in most random towns something is smaller than the tolerances
@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.filter_too_much])
@given(SEEDS)
def test_layers_of_a_layout_have_its_figures(seed: int) -> None:
    cells = random_cells(seed)
    layout = layout_with_random_streets(seed, cells)
    # what is smaller than the tolerances is another matter
    assume(layout.mesh.edge_length.min() > 2.5)
    assume(min(shapely.maximum_inscribed_circle(p).length for p in cells) > 3)
    known = LayoutMeasures(layout).of_fabric.values
    for turn in (0.0, 0.7):
        parcels, streets = layers_of(layout, turn)
        made = fabric_of_layers(street_lines(streets, width=2), observed_parcels(parcels))
        found = FabricMeasures(made).values
        for name in SAME:
            assert found[name] == pytest.approx(known[name], rel=5e-3, abs=0.02, nan_ok=True), name
