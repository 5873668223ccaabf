"""Going on with layouts inside QGIS: with files, and with layers that people edited."""

from __future__ import annotations

import sqlite3
from collections.abc import Callable
from contextlib import closing
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from in_qgis import TEMPORARY
from qgis.core import QgsProcessingException, QgsVectorLayer

import urban_processing as up


@pytest.fixture
def stage(tmp_path: Path, sample: Callable[[str], Path]) -> Path:
    path = tmp_path / "stage.gpkg"
    up.cogenerate(sample("ellipse"), parcels=40, stop_at_level=4).save(path)
    return path


@pytest.fixture
def resume(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(**parameters: Any) -> dict[str, Any]:
        results: dict[str, Any] = processing.run(
            "urban_processing:resume", parameters, feedback=feedback
        )
        return results

    return call


def layers_of(path: Path) -> dict[str, QgsVectorLayer]:
    return {
        name: QgsVectorLayer(f"{path}|layername={layer}", layer, "ogr")
        for name, layer in (("PARCEL_LAYER", "parcels"), ("STREET_LAYER", "streets"))
    }


def test_a_file_is_gone_on_with_as_the_library_does(
    resume: Callable[..., Any], stage: Path, tmp_path: Path
) -> None:
    path = resume(LAYOUT=str(stage), STOP_AT_LEVEL=5, OUTPUT=str(tmp_path / "5.gpkg"))["OUTPUT"]
    path = resume(LAYOUT=path, OUTPUT=str(tmp_path / "final.gpkg"))["OUTPUT"]
    made, expected = up.read_layout(path), up.resume(stage)
    assert made.certificate.holds
    assert (made.layout.mesh.xy == expected.layout.mesh.xy).all()
    assert made.parcels.lineage.tolist() == expected.parcels.lineage.tolist()


def test_an_edited_file_is_read_with_what_its_rows_say(
    resume: Callable[..., Any], stage: Path, tmp_path: Path
) -> None:
    layer = layers_of(stage)["PARCEL_LAYER"]
    feature = next(layer.getFeatures())
    assert layer.startEditing()
    fields = layer.fields()
    layer.changeAttributeValue(feature.id(), fields.indexFromName("land_use"), "market")
    layer.changeAttributeValue(feature.id(), fields.indexFromName("locked"), True)
    layer.changeAttributeValue(feature.id(), fields.indexFromName("stage"), None)
    assert layer.commitChanges()
    del layer
    path = resume(LAYOUT=str(stage), OUTPUT=str(tmp_path / "final.gpkg"))["OUTPUT"]
    parcels = up.read_layout(path).parcels
    assert (parcels.land_use == "market").sum() == 1
    assert parcels.locked[parcels.land_use == "market"].all()


def test_columns_of_layers_count(resume: Callable[..., Any], stage: Path) -> None:
    with closing(sqlite3.connect(stage)) as db, db:
        # triggers of the spatial index need functions of GDAL
        for (name,) in db.execute(
            "SELECT name FROM sqlite_master WHERE type = 'trigger' AND tbl_name = 'parcels'"
        ).fetchall():
            db.execute(f'DROP TRIGGER "{name}"')
        db.execute("UPDATE parcels SET land_use = 'school', locked = 1 WHERE parcel_id = 3")
    results = resume(
        **layers_of(stage), MIN_AREA=20_000, OUTPUT_PARCELS=TEMPORARY, OUTPUT_STREETS=TEMPORARY
    )
    made = results["OUTPUT_PARCELS"]
    found = [(f["land_use"], bool(f["locked"])) for f in made.getFeatures()]
    expected = up.resume(parcels=stage, streets=stage, min_area=20_000)
    assert sorted(f["lineage"] for f in made.getFeatures()) == sorted(expected.parcels.lineage)
    assert found.count(("school", True)) == 1
    assert len(found) > 16


def test_layers_need_a_size(resume: Callable[..., Any], stage: Path) -> None:
    with pytest.raises(QgsProcessingException, match="Give"):
        resume(**layers_of(stage), OUTPUT_PARCELS=TEMPORARY)
