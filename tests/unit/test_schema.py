"""The schema has the layers and columns that others read."""

from __future__ import annotations

import pytest

from urban_processing.schema import LAYERS, ColumnType, GeometryType, layer

BINDING = {
    "parcels": "parcel_id part level area_m2 net_area_m2 sides irregularity frontage_m width_m "
    "depth_m thinness rim land_use locked",
    "streets": "edge_id street_id part class level width_m length_m",
    "junctions": "junction_id part kind degree angle_dev_deg",
    "boundary": "part area_m2",
    "input_boundary": "part area_m2",
    "obstacles": "part area_m2",
    "issues": "part parcel_id code message value limit",
    "metrics": "part metric value unit",
    "provenance": "step algorithm parameters seed version input_sha256 seconds",
}


@pytest.mark.parametrize("name", BINDING)
def test_binding_columns_come_first_and_in_order(name: str) -> None:
    columns = BINDING[name].split()
    assert layer(name).column_names[: len(columns)] == tuple(columns)


@pytest.mark.parametrize("name", ["right_of_way", "net_parcels"])
def test_surfaces_of_streets_have_a_part_and_an_area(name: str) -> None:
    assert {"part", "area_m2"} <= set(layer(name).column_names)
    assert layer(name).geometry is GeometryType.POLYGON


def test_every_layer_carries_part() -> None:
    assert all("part" in each.column_names for each in LAYERS)


def test_names_are_unique_and_texts_are_given() -> None:
    assert len({each.name for each in LAYERS}) == len(LAYERS)
    for each in LAYERS:
        assert len(set(each.column_names)) == len(each.columns)
        assert each.title
        for column in each.columns:
            assert column.alias
            assert column.description.endswith(".")


def test_units_are_in_the_names() -> None:
    suffix = {"m": "_m", "m²": "_m2", "°": "_deg"}
    for each in LAYERS:
        for column in each.columns:
            if column.unit in suffix:
                assert column.name.endswith(suffix[column.unit])


def test_lineage_is_text_so_that_64_bits_survive_every_format() -> None:
    assert layer("parcels").column("lineage").dtype is ColumnType.TEXT


def test_unknown_names_are_refused() -> None:
    with pytest.raises(KeyError, match="no column nothing"):
        layer("parcels").column("nothing")
    with pytest.raises(KeyError):
        layer("nothing")
