"""What must hold of the calibration of any parcels."""

from __future__ import annotations

from itertools import pairwise

import geopandas as gpd
import numpy as np
import numpy.typing as npt
import shapely
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from urban_processing.calibration.bounds import LEAST_SHARE, SLACK, bounds_of, statistics_of
from urban_processing.calibration.grouping import block_of_each, blocks_of
from urban_processing.calibration.layers import BOUNDS
from urban_processing.intake.features import Features
from urban_processing.intake.observed import build_observed
from urban_processing.io.blocks import read_blocks
from urban_processing.io.crs import PYPROJ
from urban_processing.params.calibrate import CalibrateParams
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.pipelines.calibrate import calibrate
from urban_processing.pipelines.subdivide import subdivide
from urban_processing.tables import LayerSet

FEW = settings(
    max_examples=25, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck)
)
ObjectArray = npt.NDArray[np.object_]


@st.composite
def towns(draw: st.DrawFn) -> tuple[ObjectArray, npt.NDArray[np.int64]]:
    """Parcels in rows, in blocks with streets between them; and the true block of each."""
    seed = draw(st.integers(0, 10_000))
    rng = np.random.default_rng(seed)
    columns, rows = draw(st.integers(1, 3)), draw(st.integers(1, 3))
    parcels, block = [], []
    for k in range(columns * rows):
        x, y = 140.0 * (k % columns), 100.0 * (k // columns)
        length, depth = rng.uniform(40, 125), rng.uniform(20, 42)
        for row in range(draw(st.integers(1, 2))):
            n = int(rng.integers(1, 9))
            ends = np.append(0.0, np.cumsum(rng.dirichlet(np.full(n, 9.0))) * length)
            for a, b in pairwise(ends):
                low = y + row * depth
                parcels.append(shapely.box(x + a, low, x + b, low + depth))
                block.append(k)
    return np.array(parcels, dtype=object), np.array(block)


def soups() -> st.SearchStrategy[list[shapely.Polygon]]:
    """Parcels anyhow: they overlap, contain each other, meet at corners, or are far apart."""
    place = st.integers(0, 20).map(lambda k: 5.0 * k) | st.floats(0, 100)
    side = st.sampled_from([1.5, 2.3, 5.0, 10.0, 30.0])
    box = st.builds(lambda x, y, w, h: shapely.box(x, y, x + w, y + h), place, place, side, side)
    triangle = st.builds(
        lambda x, y, w, h: shapely.Polygon([(x, y), (x + w, y), (x, y + h)]),
        *(place, place, side, side),
    )
    ring = box.map(lambda b: b.buffer(12, join_style="mitre") - b.buffer(4, join_style="mitre"))
    return st.lists(box | triangle | ring, min_size=1, max_size=14)


def calibrated(parcels: ObjectArray, **parameters: float) -> LayerSet:
    columns = {"parcel_id": np.arange(len(parcels)).astype(object)}
    features = Features(parcels, None, "parcels", bare=True, columns=columns)
    return calibrate(build_observed(features, library=PYPROJ), CalibrateParams(**parameters))


def turned(polygons: ObjectArray, degrees: float) -> ObjectArray:
    angle = np.radians(degrees)
    matrix = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    return np.asarray(shapely.transform(polygons, lambda xy: xy @ matrix))


def started_elsewhere(polygon: shapely.Polygon, by: int) -> shapely.Polygon:
    xy = shapely.get_coordinates(polygon)[:-1]
    xy = np.roll(xy, by, axis=0)
    return shapely.Polygon(xy if by % 2 else xy[::-1])


@FEW
@given(town=towns(), degrees=st.floats(0, 90))
def test_blocks_are_found_again_as_the_union_of_their_parcels(
    town: tuple[ObjectArray, npt.NDArray[np.int64]], degrees: float
) -> None:
    parcels, truth = turned(town[0], degrees), town[1]
    blocks, block = blocks_of(parcels, gap=0.1)
    assert len(blocks) == len(np.unique(truth))
    for number in range(len(blocks)):
        assert len(np.unique(truth[block == number])) == 1
    area = np.bincount(block, weights=shapely.area(parcels))
    assert np.allclose(shapely.area(blocks), area, rtol=1e-4)
    assert (block_of_each(parcels, blocks) == block).all()


@FEW
@given(town=towns(), seed=st.integers(0, 99))
def test_rows_and_starting_vertices_do_not_matter(
    town: tuple[ObjectArray, npt.NDArray[np.int64]], seed: int
) -> None:
    parcels = turned(town[0], 17.0)
    order = np.random.default_rng(seed).permutation(len(parcels))
    other = np.array(
        [started_elsewhere(parcels[k], i + seed) for i, k in enumerate(order)], dtype=object
    )
    one, two = calibrated(parcels), calibrated(other)
    a, b = one.table("blocks"), two.table("blocks")
    assert shapely.to_wkb(a.shapes).tolist() == shapely.to_wkb(b.shapes).tolist()
    for name in a.columns:
        assert a[name].tolist() == b[name].tolist()
    mine, its = one.table("parcels"), two.table("parcels")
    number = dict(zip(its["parcel_id"].tolist(), its["block_id"].tolist(), strict=True))
    back = {int(order[k]): v for k, v in number.items()}
    assert back == dict(zip(mine["parcel_id"].tolist(), mine["block_id"].tolist(), strict=True))


@FEW
@given(town=towns(), degrees=st.floats(1, 89))
def test_figures_stay_when_all_is_turned(
    town: tuple[ObjectArray, npt.NDArray[np.int64]], degrees: float
) -> None:
    one, two = calibrated(town[0]), calibrated(turned(town[0], degrees))
    a, b = one.table("blocks"), two.table("blocks")
    for name in ("parcels", "area_mean_m2", "area_sd_m2", "width_mean_m", *BOUNDS):
        assert np.allclose(np.sort(a[name]), np.sort(b[name]), rtol=1e-4, atol=1e-3)


@FEW
@given(
    values=st.lists(st.floats(1e-3, 1e6), min_size=1, max_size=40),
    n=st.integers(1, 6),
    spread=st.floats(0, 10),
    seed=st.integers(0, 99),
)
def test_bounds_lie_around_the_mean(values: list[float], n: int, spread: float, seed: int) -> None:
    block = np.random.default_rng(seed).integers(0, n, len(values))
    made = statistics_of(np.array(values), block, n)
    low, high = bounds_of(made, spread=spread)
    assert (low > 0).all()
    assert (low < high).all()
    for k in range(n):
        own = np.array(values)[block == k]
        assert made.count[k] == len(own)
        if not len(own):
            continue
        mean, deviation = own.mean(), own.std()
        assert np.isclose(made.mean[k], mean)
        assert np.isclose(made.deviation[k], deviation, atol=1e-9 * mean)
        away = max(spread * deviation, SLACK * mean)
        assert np.isclose(high[k], mean + away)
        assert np.isclose(low[k], max(mean - away, LEAST_SHARE * mean))


@FEW
@given(parcels=soups(), gap=st.sampled_from([0.0, 0.1, 2.0]))
def test_whatever_parcels_are_subdivision_takes_their_blocks(
    parcels: list[shapely.Polygon], gap: float
) -> None:
    made = calibrated(np.array(parcels, dtype=object), gap=gap, least_compactness=0.0)
    blocks, seen = made.table("blocks"), made.table("parcels")
    assert not np.isnan(seen["block_id"]).any()
    assert blocks["parcels"].sum() == len(seen)
    assert (blocks["parcels"] > 0).all()
    assert shapely.is_valid(blocks.shapes).all()
    a, b = shapely.STRtree(blocks.shapes).query(blocks.shapes, predicate="intersects")
    shared = shapely.area(shapely.intersection(blocks.shapes[a], blocks.shapes[b]))
    assert shared[a != b].max(initial=0.0) < 1e-5
    columns = {name: blocks[name] for name in ("block_id", *BOUNDS)}
    frame = gpd.GeoDataFrame(columns, geometry=list(blocks.shapes), crs="EPSG:32632")
    ground = read_blocks(frame)
    assert len(ground) == len(blocks)
    pieces = subdivide(ground, SubdivideParams(strategy="obb")).polygons
    assert np.isclose(shapely.area(pieces).sum(), shapely.area(blocks.shapes).sum(), rtol=1e-6)
