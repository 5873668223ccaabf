"""The optimization inside QGIS: of layout files, and of layers that people edited."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from in_qgis import TEMPORARY, shapes
from qgis.core import QgsProcessingException, QgsVectorLayer

import urban_processing as up

OPTIMIZE = "urban_processing:optimize"


@pytest.fixture
def rough(tmp_path: Path, sample: Callable[[str], Path]) -> Path:
    path = tmp_path / "rough.gpkg"
    up.cogenerate(sample("ellipse"), parcels=40, optimize=False).save(path)
    return path


@pytest.fixture
def optimize(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    import processing

    def call(**parameters: Any) -> dict[str, Any]:
        results: dict[str, Any] = processing.run(OPTIMIZE, parameters, feedback=feedback)
        return results

    return call


def test_a_file_is_optimized_as_the_library_does(
    optimize: Callable[..., Any], rough: Path, tmp_path: Path, feedback: Any
) -> None:
    results = optimize(LAYOUT=str(rough), OUTPUT=str(tmp_path / "smooth.gpkg"))
    made = up.read_layout(results["OUTPUT"])
    expected = up.optimize(rough)
    assert made.certificate.holds
    assert (made.layout.mesh.xy == expected.layout.mesh.xy).all()
    assert made.layout.history[-1].results == expected.layout.history[-1].results
    assert any(said.startswith("energies: regularity") for said in feedback.said)


def test_edited_layers_are_optimized(optimize: Callable[..., Any], rough: Path) -> None:
    layers = {
        name: QgsVectorLayer(f"{rough}|layername={layer}", layer, "ogr")
        for name, layer in (("PARCEL_LAYER", "parcels"), ("STREET_LAYER", "streets"))
    }
    results = optimize(**layers, OUTPUT_PARCELS=TEMPORARY, OUTPUT_STREETS=TEMPORARY)
    expected = up.optimize(parcels=rough, streets=rough)
    assert len(shapes(results["OUTPUT_PARCELS"])) == 40
    found = sum(shape.length for shape in shapes(results["OUTPUT_STREETS"]))
    assert found == pytest.approx(float(expected.streets.length.sum()), rel=1e-6)


def test_what_is_missing_is_told(optimize: Callable[..., Any], rough: Path) -> None:
    parcels = QgsVectorLayer(f"{rough}|layername=parcels", "parcels", "ogr")
    with pytest.raises(QgsProcessingException, match="“Streets” is missing"):
        optimize(PARCEL_LAYER=parcels, OUTPUT_PARCELS=TEMPORARY)
    with pytest.raises(QgsProcessingException, match="Give “Layout file”"):
        optimize(OUTPUT_PARCELS=TEMPORARY)
