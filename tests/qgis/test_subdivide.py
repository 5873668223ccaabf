"""`subdivide` inside QGIS gives what the library gives, and says what is wrong."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import geopandas as gpd
import pyogrio
import shapely
from in_qgis import TEMPORARY, rows, shapes
from qgis.core import QgsProcessingException

import urban_processing as up
from urban_processing.params.subdivide import Strategy
from urban_processing.parcelling.layers import SUBDIVIDED_BLOCKS, SUBDIVIDED_PARCELS

ID = "urban_processing:subdivide"
CRS = "EPSG:32630"
X, Y = 500_000.0, 5_700_000.0
PARCELS, BLOCKS, ISSUES = "OUTPUT_PARCELS", "OUTPUT_BLOCKS", "OUTPUT_ISSUES"
SINKS = dict.fromkeys((PARCELS, BLOCKS, ISSUES), TEMPORARY)


def box(*bounds: float) -> shapely.Polygon:
    return shapely.transform(shapely.box(*bounds), lambda xy: xy + np.array((X, Y)))


TWO = [box(0, 0, 80, 50), box(90, 0, 170, 50)]

Blocks = Callable[..., Any]


@pytest.fixture
def blocks(layer: Callable[..., Any]) -> Blocks:
    """A layer of blocks with the columns that are named: ``blocks(min_area=[300.0, None])``."""

    def make(
        polygons: list[shapely.Geometry] = TWO,
        crs: str = CRS,
        kind: str = "Polygon",
        **columns: list[Any],
    ) -> Any:
        def type_of(values: list[Any]) -> str:
            text = any(isinstance(value, str) for value in values)
            return "string" if text else "double"

        fields = "".join(f"&field={name}:{type_of(v)}" for name, v in columns.items())
        made = layer([p.wkt for p in polygons], crs, kind, fields, "blocks")
        made.startEditing()
        for row, feature in enumerate(made.getFeatures()):
            for number, values in enumerate(columns.values()):
                made.changeAttributeValue(feature.id(), number, values[row])
        assert made.commitChanges()
        return made

    return make


@pytest.fixture
def subdivide(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(blocks: Any, **parameters: Any) -> dict[str, Any]:
        named = {"BLOCKS": blocks, PARCELS: TEMPORARY, **parameters}
        results: dict[str, Any] = processing.run(ID, named, feedback=feedback)
        return results

    return call


@pytest.fixture
def refused(subdivide: Callable[..., Any]) -> Callable[..., str]:
    """The sentence that a run fails with."""

    def call(blocks: Any, **parameters: Any) -> str:
        with pytest.raises(QgsProcessingException) as error:
            subdivide(blocks, **parameters)
        return str(error.value)

    return call


def frame(**columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=TWO, crs=CRS)


def table(made: Any) -> list[dict[str, Any]]:
    names = [field.name() for field in made.fields()]
    return [dict(zip(names, row, strict=True)) for row in rows(made)]


def assert_same(results: Mapping[str, Any], expected: up.GeoLayers) -> None:
    """That sinks hold the layers of the library, in geometry and in every value."""
    for name, each in ((PARCELS, SUBDIVIDED_PARCELS), (BLOCKS, SUBDIVIDED_BLOCKS)):
        made, wanted = results[name], expected.frame(each.name)
        assert [f.name() for f in made.fields()] == list(each.column_names)
        found = np.array(shapes(made), dtype=object)
        assert shapely.equals_exact(found, np.array(wanted.geometry, dtype=object), 1e-6).all()
        for row, values in zip(
            rows(made), wanted.drop(columns="geometry").itertuples(index=False), strict=True
        ):
            for value, known in zip(row, values, strict=True):
                if known is None or known != known:
                    assert value is None
                else:
                    number = isinstance(known, float)
                    assert value == (pytest.approx(known, rel=1e-9) if number else known)


# ---- runs


@pytest.mark.parametrize("strategy", Strategy)
def test_layers_are_those_of_the_library(
    strategy: Strategy, subdivide: Any, blocks: Blocks, feedback: Any
) -> None:
    number = list(Strategy).index(strategy)
    results = subdivide(blocks(), STRATEGY=number, MIN_AREA=300, SEED=4, **SINKS)
    expected = up.subdivide(frame(), strategy=strategy.value, min_area=300, seed=4)
    assert_same(results, expected)
    assert any(said.startswith("parcels: ") for said in feedback.said)
    assert "2 of 2 blocks" in feedback.texts


def test_columns_set_parameters_block_by_block(subdivide: Any, blocks: Blocks) -> None:
    layer = blocks(min_area=[300.0, None], strategy=["obb", None], block_id=[7, 3])
    results = subdivide(layer, **SINKS)
    columns = {"min_area": [300.0, None], "strategy": ["obb", None], "block_id": [7, 3]}
    expected = frame(**columns).astype({"min_area": "Float64"})
    assert_same(results, up.subdivide(expected))
    assert [row["block_id"] for row in table(results[BLOCKS])] == [3, 7]


def test_a_file_of_blocks_with_the_streets_along_them(
    subdivide: Any, tmp_path: Path, feedback: Any
) -> None:
    ring, across = box(0, 0, 240, 100).exterior, [(X + 120, Y), (X + 120, Y + 100)]
    streets = gpd.GeoDataFrame(
        {"width_m": [8.0, 20.0]}, geometry=[ring, shapely.LineString(across)], crs=CRS
    )
    found = up.find_blocks(streets).save(tmp_path / "blocks.gpkg")
    results = subdivide(
        f"{found}|layername=blocks",
        STREETS=f"{found}|layername=block_edges",
        MIN_AREA=300,
        OUTPUT=str(tmp_path / "parcels.gpkg"),
        PLOT=str(tmp_path / "map.png"),
        **SINKS,
    )
    assert_same(results, up.subdivide(found, min_area=300))
    assert {"parcels", "blocks"} <= set(pyogrio.list_layers(tmp_path / "parcels.gpkg")[:, 0])
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
    # the file is the one that the library writes, so that both can go on from it
    mine = up.subdivide(found, min_area=300).save(tmp_path / "library.gpkg")
    again = up.subdivide(found, min_area=300, previous=tmp_path / "parcels.gpkg")
    assert again.parcels.equals(up.subdivide(found, min_area=300, previous=mine).parcels)


def test_parcels_keep_their_numbers_where_blocks_were_edited(
    subdivide: Any, blocks: Blocks, tmp_path: Path
) -> None:
    before = tmp_path / "before.gpkg"
    made = table(subdivide(blocks(), MIN_AREA=300, OUTPUT=str(before))[PARCELS])
    edited = blocks([box(90, 0, 170, 60), TWO[0]])  # another order, and one block larger
    after = table(subdivide(edited, MIN_AREA=300, PREVIOUS=str(before))[PARCELS])

    def numbers(parcels: list[dict[str, Any]], block: int) -> set[tuple[int, float]]:
        own = [p for p in parcels if p["block_id"] == block]
        return {(p["parcel_id"], round(p["area_m2"], 6)) for p in own}

    assert numbers(after, 1) == numbers(made, 1)
    assert numbers(after, 2) != numbers(made, 2)
    shared = {i for i, _ in numbers(after, 2)} & {i for i, _ in numbers(made, 2)}
    assert len(shared) > 0.6 * len(numbers(made, 2))


def test_degrees_become_metres_and_it_is_said(
    subdivide: Any, blocks: Blocks, feedback: Any
) -> None:
    degrees = gpd.GeoSeries(TWO, crs=CRS).to_crs(4326)
    results = subdivide(blocks(list(degrees), "EPSG:4326"), **SINKS)
    assert results[PARCELS].crs().authid() == CRS
    assert sum(row["area_m2"] for row in table(results[PARCELS])) == pytest.approx(8000, rel=1e-4)
    assert any("The blocks are in WGS 84 (EPSG:4326)" in said for said in feedback.said)
    assert "crs_changed" in {row["code"] for row in table(results[ISSUES])}
    chosen = subdivide(blocks(), CRS="EPSG:25830", **SINKS)
    assert chosen[PARCELS].crs().authid() == "EPSG:25830"


def test_blocks_too_small_or_too_narrow_for_parcels_are_listed(
    subdivide: Any, blocks: Blocks, feedback: Any
) -> None:
    layer = blocks([box(0, 0, 15, 10), box(30, 0, 110, 50)], min_width=[None, 90.0])
    issues = {row["code"]: row for row in table(subdivide(layer, **SINKS)[ISSUES])}
    said = issues["block_small"]["message"]
    assert said == "A block of 150 m² is smaller than the smallest parcel, 400 m²: it stays whole."
    assert "less than the smallest width of a parcel, 90.0 m" in issues["block_narrow"]["message"]
    (counted,) = [said for said in feedback.said if said.startswith("issues: ")]
    assert "1 block_narrow, 1 block_small" in counted


# ---- bad input


def test_blocks_must_be_polygons_with_a_crs(refused: Any, blocks: Blocks) -> None:
    lines = blocks([shapely.LineString(TWO[0].exterior.coords)], kind="LineString")
    said = refused(lines)
    assert "blocks holds 1 line, but no polygon. Blocks must be polygons" in said
    said = refused(blocks(crs=""))
    assert "blocks has no CRS. Give it with crs, or assign it" in said
    assert "has no features" in refused(blocks([]))


def test_blocks_that_overlap_are_named_in_pairs(refused: Any, blocks: Blocks) -> None:
    three = [box(0, 0, 80, 50), box(70, 0, 160, 50), box(150, 0, 240, 50)]
    said = refused(blocks(three, block_id=[4, 9, 6]))
    assert "Blocks must not overlap: " in said
    assert "block 4 and 9 (500 m²)" in said
    assert "block 9 and 6 (500 m²)" in said


@pytest.mark.parametrize(
    ("column", "values", "said"),
    [
        ("min_width", [-5.0, 8.0], "Column min_width must be above 0 m: -5.0 in row 1 of blocks"),
        ("max_area", [900.0, 300.0], "min_area must not be above max_area: 400 and 300 in row 2"),
        ("min_area", ["a lot", "300"], "Column min_area must be a number: 'a lot' in rows 1, 2"),
        ("min_area", [float("nan"), 300.0],
         "Column min_area must be a finite number, or an empty cell (NULL): nan in row 1"),
        ("strategy", ["obb", "squares"],
         "Column strategy must be one of skeleton, obb, hybrid, streamline: 'squares' in row 2"),
        ("block_id", [3.0, 3.0], "Numbers of blocks are there twice: block_id 3, in row 1, 2."),
        ("block_id", [1.0, None], "Column block_id must be a whole number: row 2."),
    ],
)  # fmt: skip
def test_columns_that_are_wrong_name_their_rows(
    refused: Any, blocks: Blocks, column: str, values: list[Any], said: str
) -> None:
    assert said in refused(blocks(**{column: values}))


@pytest.mark.parametrize(
    ("parameters", "said"),
    [
        ({"MAX_AREA": 300}, "“Smallest parcel” (400) must not be above “Largest parcel” (300)."),
        ({"MIN_WIDTH": -4}, "MIN_WIDTH"),
        ({"MIN_AREA": 0}, "“Smallest parcel” must be above 0 m²; got 0"),
        ({"MIN_WIDTH": 9, "MAX_WIDTH": 8}, "“Smallest width” (9) must not be above"),
    ],
)
def test_parameters_that_are_wrong(
    refused: Any, blocks: Blocks, parameters: dict[str, float], said: str
) -> None:
    assert said in refused(blocks(), **parameters)


def test_what_is_no_subdivision_before(
    subdivide: Any, refused: Any, blocks: Blocks, tmp_path: Path
) -> None:
    made = tmp_path / "made.gpkg"
    subdivide(blocks(), OUTPUT=str(made), CRS="EPSG:25830")
    said = refused(blocks(), PREVIOUS=str(made))
    assert "The subdivision before is in EPSG:25830, but the blocks are worked on in" in said
    assert "choose the CRS of the subdivision with crs." in said
    layout = up.cogenerate(TWO[0], crs=CRS, parcels=4).save(tmp_path / "layout.gpkg")
    said = refused(blocks(), PREVIOUS=str(layout))
    assert "holds no subdivision but a layout: give a GeoPackage that subdivide wrote" in said
    plain = tmp_path / "plain.gpkg"
    frame().to_file(plain)
    assert "plain.gpkg holds no subdivision: " in refused(blocks(), PREVIOUS=str(plain))
    assert "none.gpkg" in refused(blocks(), PREVIOUS=str(tmp_path / "none.gpkg"))


def test_a_subdivision_is_no_layout(subdivide: Any, blocks: Blocks, tmp_path: Path) -> None:
    import processing

    made = tmp_path / "made.gpkg"
    subdivide(blocks(), OUTPUT=str(made))
    call = {"LAYOUT": str(made), PARCELS: TEMPORARY}
    with pytest.raises(QgsProcessingException, match=r"of another kind \(subdivision\)"):
        processing.run("urban_processing:optimize", call)


def test_no_result_replaces_an_input(refused: Any, blocks: Blocks, tmp_path: Path) -> None:
    file = tmp_path / "blocks.gpkg"
    frame().to_file(file)
    before = file.read_bytes()
    for name in ("OUTPUT", PARCELS):
        assert "would replace the input" in refused(str(file), **{name: str(file)})
    assert file.read_bytes() == before
