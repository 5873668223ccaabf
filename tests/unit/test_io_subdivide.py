"""`subdivide` in Python: frames, files, columns, what was made before, and what is refused."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import pandas as pd
import pytest
import shapely

import urban_processing as up
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.params.subdivide import Strategy, per_block_parameters
from urban_processing.parcelling.layers import SUBDIVIDED_BLOCKS, SUBDIVIDED_PARCELS

CRS = "EPSG:32632"
X, Y = 500_000.0, 5_200_000.0


def box(*bounds: float) -> shapely.Polygon:
    return shapely.transform(shapely.box(*bounds), lambda xy: xy + np.array((X, Y)))


TWO = [box(0, 0, 80, 50), box(90, 0, 170, 50)]


def frame(
    polygons: list[shapely.Polygon] = TWO, crs: str | None = CRS, **columns: Any
) -> gpd.GeoDataFrame:
    values = {name: pd.Series(v, dtype=object) for name, v in columns.items()}
    return gpd.GeoDataFrame(values, geometry=gpd.GeoSeries(polygons, crs=crs))


def refused(blocks: Any, **options: Any) -> str:
    with pytest.raises(UrbanError) as error:
        up.subdivide(blocks, **options)
    return str(error.value)


def same(a: up.GeoLayers, b: up.GeoLayers) -> bool:
    return a.parcels.equals(b.parcels) and a.blocks.equals(b.blocks)


@pytest.fixture(scope="module")
def found() -> up.GeoLayers:
    """Two blocks, between which the street is wider than around."""
    across = shapely.LineString([(X + 120, Y), (X + 120, Y + 100)])
    lines = [box(0, 0, 240, 100).exterior, across]
    return up.find_blocks(gpd.GeoDataFrame({"width_m": [8.0, 20.0]}, geometry=lines, crs=CRS))


# ---- what is read


def test_layers_say_what_parcels_are() -> None:
    made = up.subdivide(frame(block_id=[7, 3]), min_area=300)
    parcels, blocks = made.parcels, made.blocks
    assert list(parcels.columns) == [*SUBDIVIDED_PARCELS.column_names, "geometry"]
    assert list(blocks.columns) == [*SUBDIVIDED_BLOCKS.column_names, "geometry"]
    assert (parcels.crs, blocks.crs) == (CRS, CRS)
    assert blocks.block_id.tolist() == [3, 7]
    assert blocks.parcels.tolist() == parcels.groupby("block_id").size().tolist()
    assert parcels.parcel_id.tolist() == list(range(1, len(parcels) + 1))
    assert parcels.area_m2.tolist() == pytest.approx(parcels.area.tolist())
    assert parcels.frontage_m.groupby(parcels.block_id).sum().tolist() == pytest.approx([260, 260])
    inside = blocks.set_index("block_id").geometry[parcels.block_id]
    overlap = parcels.geometry.intersection(inside, align=False).area
    assert overlap.tolist() == pytest.approx(parcels.area.tolist())
    assert made.issues.empty


def test_frames_files_series_and_shapes_give_the_same(tmp_path: Path) -> None:
    made = up.subdivide(frame(), seed=2)
    for suffix in (".gpkg", ".shp", ".parquet"):
        path = tmp_path / f"blocks{suffix}"
        if suffix == ".parquet":
            pytest.importorskip("pyarrow")
            frame().to_parquet(path)
        else:
            frame().to_file(path)
        assert same(up.subdivide(path, seed=2), made)
    assert same(up.subdivide(frame().geometry, seed=2), made)
    assert same(up.subdivide(TWO, crs=CRS, seed=2), made)
    assert up.subdivide(TWO, seed=2).crs is None
    assert not same(up.subdivide(frame(), seed=3), made)


def test_edges_of_blocks_come_along_from_a_file_and_from_layers(
    found: up.GeoLayers, tmp_path: Path
) -> None:
    file = found.save(tmp_path / "blocks.gpkg")
    options: dict[str, Any] = {"min_area": 300, "irregularity": 0}
    made = up.subdivide(found, **options)
    assert same(up.subdivide(file, **options), made)
    assert same(up.subdivide(found.blocks, streets=found.block_edges, **options), made)
    assert same(up.subdivide(f"{file}|layername=blocks", **options), made)
    bare = up.subdivide(found.blocks, **options)
    assert not bare.parcels.geometry.equals(made.parcels.geometry)
    # the corners belong to the wide street: more parcels have their front there
    wide = box(105, 0, 135, 100)
    assert made.parcels.intersects(wide).sum() > bare.parcels.intersects(wide).sum()


@pytest.mark.parametrize("strategy", Strategy)
def test_columns_do_what_parameters_do(strategy: Strategy) -> None:
    values: dict[str, Any] = {
        "strategy": strategy.value,
        "min_area": 300.0,
        "max_area": 900.0,
        "min_width": 10.0,
        "max_width": 22.0,
        "irregularity": 0.4,
        "street_access": 0.5,
        "offset": 18.0,
        "patio": "obb",
        "corner_lots": "street-length",
    }
    assert set(values) == set(per_block_parameters())
    by_column = up.subdivide(frame(**{name: [v, v] for name, v in values.items()}))
    by_parameter = up.subdivide(frame(), **values)
    assert by_column.parcels.equals(by_parameter.parcels)
    assert by_column.blocks.equals(by_parameter.blocks)
    half = up.subdivide(frame(**{name: [v, None] for name, v in values.items()}))
    plain = up.subdivide(frame())
    for block, like in ((1, by_parameter), (2, plain)):
        own = half.parcels[half.parcels.block_id == block]
        known = like.parcels[like.parcels.block_id == block]
        assert own.geometry.tolist() == known.geometry.tolist()


def test_a_subdivision_may_be_divided_again(found: up.GeoLayers, tmp_path: Path) -> None:
    made = up.subdivide(found.blocks, min_area=300)
    assert up.subdivide(made).parcels.equals(made.parcels)
    assert up.subdivide(made.save(tmp_path / "made.gpkg")).parcels.equals(made.parcels)
    again = up.subdivide(made, min_area=900)
    assert again.issues.message.tolist() == [
        "min-area (900.0) has no effect: the column min_area sets it for every block."
    ]


def test_a_width_given_alone_moves_the_other_bound_along() -> None:
    block = [box(0, 0, 400, 60)]
    wide = up.subdivide(frame(block), min_width=40, strategy="obb", max_area=2500)
    assert wide.blocks[["min_width", "max_width"]].to_numpy().tolist() == [[40, 40]]
    assert wide.parcels.width_m.min() >= 30
    slim = up.subdivide(frame(block), max_width=8)
    assert slim.blocks[["min_width", "max_width"]].to_numpy().tolist() == [[8, 8]]
    by_column = up.subdivide(frame(block, min_width=[40.0]), max_area=2500, strategy="obb")
    assert by_column.parcels.equals(wide.parcels)


# ---- edits


def test_a_subdivision_before_is_taken_as_layers_and_as_a_file(tmp_path: Path) -> None:
    before = up.subdivide(frame(), min_area=300)
    edited = frame([box(90, 0, 170, 65), TWO[0]])
    after = up.subdivide(edited, min_area=300, previous=before)
    file = before.save(tmp_path / "before.gpkg")
    assert same(up.subdivide(edited, min_area=300, previous=file), after)

    def parcels(made: up.GeoLayers, block: int) -> gpd.GeoDataFrame:
        own = made.parcels[made.parcels.block_id == block]
        return own.set_index("parcel_id").geometry.normalize().sort_index()

    assert parcels(after, 1).equals(parcels(before, 1))
    assert not parcels(after, 2).equals(parcels(before, 2))
    assert after.parcels.parcel_id.is_unique
    kept = parcels(after, 2).index.isin(before.parcels.parcel_id)
    assert kept.mean() > 0.6
    assert min(parcels(after, 2).index[~kept], default=99) > before.parcels.parcel_id.max()


def test_the_crs_of_a_subdivision_before_can_be_asked_for(tmp_path: Path) -> None:
    before = up.subdivide(frame(), crs="EPSG:25832", min_area=300)
    said = refused(frame(), previous=before)
    assert (
        "The subdivision before is in EPSG:25832, but the blocks are worked on in EPSG:32632"
        in (said)
    )
    after = up.subdivide(frame(), previous=before, crs="EPSG:25832", min_area=300)
    assert after.parcels.parcel_id.tolist() == before.parcels.parcel_id.tolist()


# ---- what is refused


@pytest.mark.parametrize(
    ("column", "values", "said"),
    [
        ("min_area", [math.nan, 300.0],
         "Column min_area must be a finite number, or an empty cell (None): nan in row 1 of"),
        ("max_width", [9, math.nan], "nan in row 2 of The frame"),
        ("min_width", ["wide", 300], "Column min_width must be a number: 'wide' in row 1 of"),
        ("patio", ["open", "pond"], "one of open, obb, skeleton, streamline: 'pond' in row 2"),
        ("block_id", [1.0, math.nan], "Column block_id must be a whole number: row 2."),
        ("block_id", [math.inf, 1.0], "Column block_id must be a whole number: row 1."),
        ("block_id", [1, 2**63], "Column block_id must be a whole number: row 2."),
        ("block_id", [4, 4], "Numbers of blocks are there twice: block_id 4, in row 1, 2."),
    ],
)  # fmt: skip
def test_columns_that_are_wrong_name_their_rows(column: str, values: list[Any], said: str) -> None:
    assert said in refused(frame(**{column: values}))


def test_blocks_that_are_no_blocks() -> None:
    lines = gpd.GeoDataFrame(geometry=[TWO[0].exterior], crs=CRS)
    said = refused(lines)
    assert said.startswith("The frame holds 1 line, but no polygon. Blocks must be polygons: ")
    assert "has no CRS" in refused(frame(crs=None))
    assert "has no features" in refused(frame([]))
    assert "row 1 and 2 (500 m²)" in refused(frame([TWO[0], box(70, 0, 150, 50)]))
    assert "Blocks: int is nothing that can be read: give a path," in refused(3)


def test_everything_wrong_is_said_at_once(tmp_path: Path) -> None:
    wrong = frame(min_area=[math.nan, -3.0], strategy=["squares", None])
    said = refused(
        wrong,
        max_width=-1,
        colour="red",
        previous=tmp_path / "none.gpkg",
        processes=0,
    ).splitlines()
    assert len(said) == 7
    for words in ("finite number", "above 0 m²: -3.0", "'squares' in row 1", "max-width", "colour"):
        assert any(words in line for line in said)
    assert any("none.gpkg does not exist" in line for line in said)
    assert "processes must be at least 1; got 0." in said


def test_what_is_no_subdivision_before(found: up.GeoLayers) -> None:
    layout = up.cogenerate(TWO[0], crs=CRS, parcels=4)
    assert "Layers of blocks are no subdivision" in refused(frame(), previous=found)
    for wrong in (layout, frame(), 3):
        said = refused(frame(), previous=wrong)
        assert said == (
            f"{type(wrong).__name__} is no subdivision: give what subdivide made, or its file."
        )


def test_a_subdivision_is_no_layout(tmp_path: Path) -> None:
    made = up.subdivide(frame())
    with pytest.raises(BoundaryError, match=r"GeoLayers is no layout: give parcels=made.parcels"):
        up.optimize(made)
    file = made.save(tmp_path / "made.gpkg")
    for read in (up.optimize, up.read_layout):
        with pytest.raises(BoundaryError, match=r"of another kind \(subdivision\)"):
            read(file)


def test_bounds_must_leave_something_between_them() -> None:
    with pytest.raises(ParameterError, match=r"min-area \(900\) must not be above max-area"):
        up.subdivide(frame(), min_area=900, max_area=300)
    # a bound of a column against one of the call
    said = refused(frame(min_area=[None, 1200.0], block_id=[5, 6]), max_area=1000)
    assert said == (
        "min_area must not be above max_area: 1200 and 1000 in row 2 of The frame (block 6)."
    )


def test_what_was_made_can_be_divided_again() -> None:
    land = gpd.GeoDataFrame(geometry=[shapely.box(0, 0, 100, 60)], crs="EPSG:32633")
    made = up.subdivide(land, min_area=400)
    again = up.subdivide(made.blocks)
    assert again.parcels.geometry.geom_equals(made.parcels.geometry).all()
