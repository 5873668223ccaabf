"""Numbers of parcels carried through an edit inside QGIS, as the library does it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import geopandas as gpd
import shapely
from in_qgis import TEMPORARY
from qgis.core import QgsVectorLayer

import urban_processing as up

TRANSFER = "urban_processing:transfer"


def _write(path: Path, width: float, **columns: Any) -> Path:
    cells = [
        shapely.transform(shapely.box(0, 0, width, 30), lambda xy, to=to: xy + to)
        for to in ((600_000 + i * width, 5_200_000 + j * 30) for j in range(2) for i in range(8))
    ]
    cells[0] = shapely.MultiPolygon([cells[0], shapely.box(600_000, 5_200_100, 600_005, 5_200_105)])
    gpd.GeoDataFrame(columns, geometry=cells, crs="EPSG:32632").to_file(path, layer="plots")
    return path


@pytest.fixture
def layers(tmp_path: Path) -> tuple[Path, Path]:
    days = np.datetime64("2001-02-03", "ms") + np.arange(16).astype("timedelta64[D]")
    names = [f"owner {i}" if i else None for i in range(16)]
    before = _write(
        tmp_path / "before.gpkg", 20, parcel_id=np.arange(16) + 100, owner=names, since=days
    )
    return before, _write(tmp_path / "after.gpkg", 22)


@pytest.fixture
def transfer(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(**parameters: Any) -> dict[str, Any]:
        results: dict[str, Any] = processing.run(TRANSFER, parameters, feedback=feedback)
        return results

    return call


def _rows(layer: QgsVectorLayer) -> list[dict[str, Any]]:
    names = layer.fields().names()
    return [dict(zip(names, f.attributes(), strict=True)) for f in layer.getFeatures()]


def test_layers_are_matched_with_their_columns(
    transfer: Callable[..., Any], layers: tuple[Path, Path], tmp_path: Path
) -> None:
    before, after = (QgsVectorLayer(str(path), path.stem, "ogr") for path in layers)
    results = transfer(
        BEFORE=before,
        AFTER=after,
        OUTPUT_PARCELS=TEMPORARY,
        OUTPUT_CHANGES=TEMPORARY,
        OUTPUT=str(tmp_path / "made.gpkg"),
    )
    expected = up.transfer(*layers)
    rows = _rows(results["OUTPUT_PARCELS"])
    assert [row["parcel_id"] for row in rows] == expected.parcels.parcel_id.tolist()
    assert [row["owner"] or None for row in rows] == [
        name if isinstance(name, str) else None for name in expected.parcels.owner
    ]
    assert [row["since"][:10] for row in rows] == [
        value[:10] for value in expected.parcels["since"]
    ]
    changes = _rows(results["OUTPUT_CHANGES"])
    assert [row["change"] for row in changes] == expected.changes.change.tolist()
    written = gpd.read_file(tmp_path / "made.gpkg", layer="parcels")
    assert written.parcel_id.tolist() == expected.parcels.parcel_id.tolist()
    assert set(written.geometry.geom_type) == {"MultiPolygon"}


def test_blocks_of_lines_and_another_crs(
    transfer: Callable[..., Any], layers: tuple[Path, Path], tmp_path: Path, feedback: Any
) -> None:
    streets = tmp_path / "streets.gpkg"
    rim = shapely.LineString(shapely.box(599_990, 5_199_990, 600_200, 5_200_110).exterior.coords)
    gpd.GeoDataFrame(geometry=[rim], crs="EPSG:32632").to_crs(25832).to_file(streets)
    results = transfer(
        BEFORE=str(layers[0]),
        AFTER=str(layers[1]),
        BLOCKS_BEFORE=str(streets),
        BLOCKS_AFTER=str(streets),
        INHERIT=0,
        OUTPUT_PARCELS=TEMPORARY,
    )
    expected = up.transfer(*layers, blocks_before=streets, blocks_after=streets, inherit="none")
    rows = _rows(results["OUTPUT_PARCELS"])
    assert [row["parcel_id"] for row in rows] == expected.parcels.parcel_id.tolist()


def test_numbers_there_twice_are_told(
    transfer: Callable[..., Any], tmp_path: Path, layers: tuple[Path, Path]
) -> None:
    from qgis.core import QgsProcessingException

    twice = _write(tmp_path / "twice.gpkg", 20, parcel_id=np.arange(16) // 2)
    with pytest.raises(QgsProcessingException, match="must be there once"):
        transfer(BEFORE=str(twice), AFTER=str(layers[1]), OUTPUT_PARCELS=TEMPORARY)
