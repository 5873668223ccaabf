from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
import shapely
from pieces_checks import assert_tile, blocks_of, city, ground_of_blocks, odd_shapes

from urban_processing.blocks.model import Blocks
from urban_processing.errors import BoundaryError, Cancelled
from urban_processing.io.files import write_layers
from urban_processing.io.geopackage import PYOGRIO
from urban_processing.layout_file.subdivisions import read_subdivision
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.subdivide import Strategy, SubdivideParams
from urban_processing.parcelling.reuse import Previous
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.pipelines import subdivide as pipeline
from urban_processing.pipelines.subdivide import subdivide
from urban_processing.processes import process_pool
from urban_processing.progress import CallbackProgress
from urban_processing.site import Frame

STRATEGIES = list(Strategy)
PARAMS = SubdivideParams(min_area=300)


def polygons_of(made: Subdivision, block: int | None = None) -> list[bytes]:
    chosen = made.polygons if block is None else made.polygons[made.pieces.block == block]
    return sorted(shapely.to_wkb(shapely.normalize(chosen)).tolist())


@pytest.fixture(scope="module")
def town() -> Blocks:
    return blocks_of(*city())


@pytest.mark.parametrize("strategy", STRATEGIES)
@pytest.mark.parametrize("shapes", [city(2, 2), odd_shapes()], ids=["city", "odd"])
def test_every_block_is_divided_exactly(strategy: Strategy, shapes: list[shapely.Polygon]) -> None:
    blocks = blocks_of(
        *(shapely.transform(p, lambda xy, k=k: xy + 400 * k) for k, p in enumerate(shapes))
    )
    made = subdivide(blocks, PARAMS.replace(strategy=strategy))
    assert_tile(made.pieces, ground_of_blocks(blocks), blocks.polygons)
    assert made.pieces.n_faces > 2 * len(blocks)


@pytest.mark.parametrize("strategy", [Strategy.SKELETON, Strategy.OBB])
def test_every_parcel_is_at_a_street(strategy: Strategy, town: Blocks) -> None:
    made = subdivide(town, PARAMS.replace(strategy=strategy))
    assert (made.frontage > 1.0).all()
    assert MeasuredSubdivision(made).parcels.reached.all()


def test_strategies_differ_by_column(town: Blocks) -> None:
    names = [STRATEGIES[k % 4].value for k in range(len(town))]
    mixed = dataclasses.replace(town, columns={"strategy": np.array(names, dtype=object)})
    made = subdivide(mixed, PARAMS)
    for strategy in STRATEGIES:
        alone = subdivide(town, PARAMS.replace(strategy=strategy))
        for block in np.flatnonzero(np.array(names) == strategy).tolist():
            assert polygons_of(made, block) == polygons_of(alone, block)


def test_columns_set_bounds_block_by_block(town: Blocks) -> None:
    least = [None if k % 2 else 600.0 for k in range(len(town))]
    columns = {"min_area": np.array(least, dtype=object)}
    made = subdivide(dataclasses.replace(town, columns=columns), PARAMS.replace(strategy="obb"))
    area = shapely.area(made.polygons)
    odd = made.pieces.block % 2 == 1
    assert area[~odd].min() >= 600 * (1 - 1e-9)
    assert 300 * (1 - 1e-9) <= area[odd].min() < 600


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_order_and_company_of_blocks_do_not_matter(strategy: Strategy, town: Blocks) -> None:
    params = PARAMS.replace(strategy=strategy, irregularity=0.5)
    made = subdivide(town, params)
    some = [7, 2, 5]
    part = blocks_of(*town.polygons[some])
    part = dataclasses.replace(part, block_id=town.block_id[some])
    fewer = subdivide(part, params)
    for k, block in enumerate(some):
        assert polygons_of(fewer, k) == polygons_of(made, block)


def test_processes_give_the_same_bytes(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(pipeline, "AT_ONCE", 8)
    blocks = blocks_of(*city(5, 4))  # more than one batch
    files = []
    for name, workers in (("one", 0), ("two", 2)):
        if workers:
            with process_pool(workers) as executor:
                made = subdivide(blocks, PARAMS.replace(strategy="obb"), executor=executor)
        else:
            made = subdivide(blocks, PARAMS.replace(strategy="obb"))
        path = write_layers(MeasuredSubdivision(made).layers(), tmp_path / f"{name}.gpkg")
        files.append(path.read_bytes())
    assert files[0] == files[1]


def test_a_run_can_be_cancelled(town: Blocks) -> None:
    def stop(fraction: float, message: str) -> None:
        raise Cancelled

    with pytest.raises(Cancelled):
        subdivide(town, PARAMS, CallbackProgress(on_update=stop))


def test_small_blocks_stay_whole_and_are_listed() -> None:
    blocks = blocks_of(shapely.box(0, 0, 15, 10), shapely.box(100, 0, 180, 60))
    for strategy in STRATEGIES:
        made = subdivide(blocks, PARAMS.replace(strategy=strategy))
        assert (made.pieces.block == 0).sum() == 1
        (issue,) = [i for i in made.issues if i.code == "block_small"]
        assert (issue.value, issue.limit, issue.part) == (150.0, 300.0, 0)


def test_what_breaks_a_bound_is_listed() -> None:
    blocks = blocks_of(shapely.box(0, 0, 400, 400))
    made = subdivide(blocks, PARAMS.replace(strategy="obb"))
    measured = MeasuredSubdivision(made)
    area = measured.parcels.area
    listed = {i.parcel_id for i in made.issues if i.code == "parcel_large"}
    assert listed == set(made.parcel_id[area > 750 * (1 + 1e-9)].tolist())
    assert listed  # a deep block with street for all cannot keep the bound
    inside = subdivide(blocks, PARAMS.replace(strategy="hybrid"))
    (issue,) = [i for i in inside.issues if i.code == "parcels_inside"]
    assert issue.value == (~MeasuredSubdivision(inside).parcels.reached).sum() > 10


def test_an_open_patio_is_one_piece_of_common_land() -> None:
    blocks = blocks_of(shapely.box(0, 0, 200, 160))
    made = subdivide(blocks, PARAMS.replace(offset=30))
    (patio,) = np.flatnonzero(made.pieces.patio).tolist()
    assert made.polygons[patio].area == pytest.approx(140 * 100, rel=1e-6)
    table = MeasuredSubdivision(made).layers().table("parcels")
    assert table["land_use"].tolist().count("patio") == 1
    assert not [i for i in made.issues if i.parcel_id == made.parcel_id[patio]]


def edited(town: Blocks) -> Blocks:
    """The town with a corner of one block pulled out; rows in another order."""
    polygons = town.polygons.copy()
    corner = shapely.bounds(polygons[5])[2:]
    polygons[5] = shapely.union(polygons[5], shapely.box(corner[0] - 25, corner[1] - 20, *corner))
    return blocks_of(*polygons[::-1])


def kept(made: Subdivision, tmp_path: Path) -> Previous:
    path = write_layers(MeasuredSubdivision(made).layers(), tmp_path / "made.gpkg")
    return read_subdivision(path, library=PYOGRIO)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_parcels_stay_where_nothing_has_changed(
    strategy: Strategy, town: Blocks, tmp_path: Path
) -> None:
    params = PARAMS.replace(strategy=strategy)
    before = subdivide(town, params)
    after = subdivide(edited(town), params, previous=kept(before, tmp_path))
    assert_tile(after.pieces, ground_of_blocks(after.blocks), after.blocks.polygons)
    old = dict(
        zip(
            shapely.to_wkb(shapely.normalize(before.polygons)).tolist(),
            before.parcel_id.tolist(),
            strict=True,
        )
    )
    new = dict(
        zip(
            shapely.to_wkb(shapely.normalize(after.polygons)).tolist(),
            after.parcel_id.tolist(),
            strict=True,
        )
    )
    untouched = before.pieces.block != 5
    for wkb, number in list(old.items()):
        if untouched[before.parcel_id == number][0]:
            assert new[wkb] == number
    assert len(set(after.parcel_id.tolist())) == after.pieces.n_faces
    touched = after.pieces.block == len(town) - 1 - 5
    carried = np.isin(after.parcel_id[touched], before.parcel_id[~untouched])
    assert carried.mean() > 0.6


def test_unchanged_parcels_are_not_made_anew(town: Blocks, tmp_path: Path) -> None:
    # a parcel drawn by hand stays, as its block is what it was
    before = subdivide(town, PARAMS)
    previous = kept(before, tmp_path)
    first = np.flatnonzero(previous.parcels.block == 0)
    one = shapely.union_all(previous.parcels.polygons[first])
    left = np.append(first[0], np.flatnonzero(previous.parcels.block != 0))
    polygons = previous.parcels.polygons.copy()
    polygons[first[0]] = one
    drawn = dataclasses.replace(
        previous,
        parcels=dataclasses.replace(
            previous.parcels,
            polygons=polygons[left],
            **{
                f: getattr(previous.parcels, f)[left]
                for f in ("block", "lineage", "level", "patio")
            },
        ),
        parcel_id=previous.parcel_id[left],
    )
    after = subdivide(town, PARAMS, previous=drawn)
    assert (after.pieces.block == 0).sum() == 1
    assert after.parcel_id[after.pieces.block == 0].tolist() == [before.parcel_id[0]]


def test_what_was_set_for_a_block_holds_for_both_of_its_parts(town: Blocks, tmp_path: Path) -> None:
    least = np.array([None] * len(town), dtype=object)
    least[0] = 900.0
    before = subdivide(dataclasses.replace(town, columns={"min_area": least}), PARAMS)
    x0, y0, x1, y1 = shapely.bounds(town.polygons[0])
    middle = (x0 + x1) / 2
    halves = [
        shapely.intersection(town.polygons[0], shapely.box(*box))
        for box in ((x0, y0, middle - 4, y1), (middle + 4, y0, x1, y1))
    ]
    after = subdivide(
        blocks_of(*halves, *town.polygons[1:]), PARAMS, previous=kept(before, tmp_path)
    )
    assert after.wanted.rules.min_area.tolist() == [900.0, 900.0] + [300.0] * (len(town) - 1)
    assert len(np.unique(after.blocks.block_id)) == len(after.blocks)


def test_another_crs_is_told(town: Blocks, tmp_path: Path) -> None:
    previous = kept(subdivide(town, PARAMS), tmp_path)
    with pytest.raises(
        BoundaryError, match="before is in no CRS, but the blocks are worked on in EPSG:32630"
    ):
        subdivide(dataclasses.replace(town, frame=Frame("EPSG:32630")), PARAMS, previous=previous)


def test_only_subdivisions_are_read(tmp_path: Path) -> None:
    with pytest.raises(BoundaryError, match="does not exist"):
        read_subdivision(tmp_path / "none.gpkg", library=PYOGRIO)
    (tmp_path / "text.gpkg").write_text("no database")
    with pytest.raises(BoundaryError, match="holds no subdivision"):
        read_subdivision(tmp_path / "text.gpkg", library=PYOGRIO)


@pytest.mark.parametrize("hole", [(30, 30, 70, 50), (20, 20, 80, 60), (45, 35, 55, 45)])
@pytest.mark.parametrize("offset", [None, 20.0])
def test_rows_go_around_a_courtyard(hole: tuple[float, ...], offset: float | None) -> None:
    blocks = blocks_of(shapely.box(0, 0, 100, 80).difference(shapely.box(*hole)))
    made = subdivide(blocks, SubdivideParams(offset=offset))
    assert_tile(made.pieces, ground_of_blocks(blocks), blocks.polygons)
    assert made.pieces.n_faces > 7
    assert not made.pieces.patio.any()
    assert MeasuredSubdivision(made).parcels.reached.all()


def test_a_block_without_skeleton_is_divided_by_boxes() -> None:
    shell, hole = [(0, 0), (100, 0), (100, 80), (0, 80)], [(0, 40), (30, 30), (30, 50)]
    blocks = blocks_of(shapely.Polygon(shell, [hole]))  # the hole touches the outline
    for strategy in (Strategy.SKELETON, Strategy.HYBRID):
        made = subdivide(blocks, SubdivideParams(strategy=strategy))
        assert_tile(made.pieces, ground_of_blocks(blocks), blocks.polygons)
        assert made.pieces.n_faces > 7


@pytest.mark.parametrize("strategy", [Strategy.SKELETON, Strategy.HYBRID])
def test_small_patios_go_to_their_neighbours(strategy: Strategy) -> None:
    lobes = [shapely.box(0, 0, 140, 140), shapely.box(140, 60, 170, 80)]
    lobes.append(shapely.box(170, 38, 234, 102))  # 25 m deep rows leave 14 m by 14 m of it
    blocks = blocks_of(shapely.union_all(lobes))
    made = subdivide(blocks, PARAMS.replace(strategy=strategy, offset=25))
    assert_tile(made.pieces, ground_of_blocks(blocks), blocks.polygons)
    assert shapely.area(made.polygons).min() >= 300 * (1 - 1e-9)
    assert made.pieces.patio.sum() == (strategy is Strategy.SKELETON)
