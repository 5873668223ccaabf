"""The map and the styles of what was measured."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from grid_layouts import grid
from matplotlib.collections import LineCollection
from reports import small_grid, without

from urban_processing.fabric.layers import MEASURED_STREETS
from urban_processing.layout_file.styles import layer_style
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.report.html import ReportSide
from urban_processing.report.layers_map import plot_layers
from urban_processing.tables import LayerSet


def measured() -> LayerSet:
    return fabric_layers(LayoutMeasures(small_grid()).of_fabric)


def changed(made: LayerSet, *, gone: tuple[str, ...] = ()) -> LayerSet:
    side = without(ReportSide("", made, {}, {}), *gone)
    return side.layers


def lines_of(made: LayerSet) -> list[LineCollection]:
    (ax,) = [a for a in plot_layers(made).axes if a.collections]
    return [c for c in ax.collections if isinstance(c, LineCollection)]


def test_streets_are_drawn_over_what_was_measured() -> None:
    made = measured()
    streets = made.table("streets")
    for drawn in (made, changed(made, gone=("parcels",)), changed(made, gone=("right_of_way",))):
        casing, fill = lines_of(drawn)
        assert len(casing.get_paths()) == len(fill.get_paths()) == len(streets)
        assert (np.asarray(casing.get_linewidths()) > np.asarray(fill.get_linewidths())).all()


def test_streets_of_unknown_width_are_drawn() -> None:
    made = measured()
    made.table("streets").columns["width_m"][:] = np.nan
    for lines in lines_of(made):
        assert np.isfinite(lines.get_linewidths()).all()


def test_other_layers_have_no_streets() -> None:
    assert lines_of(replace(measured(), kind="subdivision")) == []


def test_land_without_streets_is_drawn() -> None:
    made = fabric_layers(LayoutMeasures(grid(2, 2)).of_fabric)
    assert lines_of(changed(made, gone=("streets", "junctions"))) == []


@pytest.mark.parametrize("name", ["residential", "local"])
def test_the_style_of_measured_streets_asks_for_columns_that_are_there(name: str) -> None:
    style = layer_style(MEASURED_STREETS)
    assert style is not None
    filters = [rule.get("filter") for rule in ET.fromstring(style).findall(".//rule")]
    assert not any("fixed_id" in str(f) for f in filters)
    assert "ELSE" in filters  # classes of other data
    assert (f"\"class\" = '{name}'" in filters) == (name == "local")
