"""What a QGIS lacks is named in one message; what it has works; nothing is loaded too early."""

from __future__ import annotations

import importlib.util
import json
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

from in_qgis import TEMPORARY, square
from qgis.core import QgsProcessingException

Run = Callable[..., dict[str, Any]]


@pytest.fixture
def dependencies(engine: Callable[[str], Any]) -> Any:
    return engine("dependencies")


def without(monkeypatch: pytest.MonkeyPatch, *names: str) -> None:
    find = importlib.util.find_spec
    monkeypatch.setattr(
        importlib.util, "find_spec", lambda name: None if name in names else find(name)
    )


def test_all_that_is_missing_is_named_at_once(
    run: Run, layer: Callable[..., Any], monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "scipy", "shapely")
    with pytest.raises(QgsProcessingException) as caught:
        run(layer([square(100)]), PARCELS=4, OUTPUT_PARCELS=TEMPORARY)
    said = str(caught.value)
    assert "lacks scipy >= 1.10 and shapely >= 2.1" in said
    assert "QPIP" in said
    assert "requirements.txt" in said
    assert "pip install --user scipy shapely" in said
    assert "Traceback" not in said


def test_what_only_maps_need_is_asked_for_maps_alone(
    run: Run, layer: Callable[..., Any], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    without(monkeypatch, "matplotlib")
    land = layer([square(100)])
    run(land, PARCELS=4, OUTPUT_PARCELS=TEMPORARY)
    with pytest.raises(QgsProcessingException, match="lacks matplotlib"):
        run(land, PARCELS=4, PLOT=str(tmp_path / "map.png"))


def test_what_only_reports_need_is_asked_for_reports_alone(
    layer: Callable[..., Any], provider: Any, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    import processing

    without(monkeypatch, "jinja2")
    call = {"PARCEL_LAYER": layer([square(100)]), "JSON": str(tmp_path / "m.json")}
    processing.run("urban_processing:measure", call)
    call["REPORT"] = str(tmp_path / "m.html")
    with pytest.raises(QgsProcessingException, match=r"lacks jinja2 >= 3\.1"):
        processing.run("urban_processing:measure", call)


def with_shapely(dependencies: Any, monkeypatch: pytest.MonkeyPatch, version: str) -> None:
    load = importlib.import_module

    def import_module(name: str) -> Any:
        return SimpleNamespace(__version__=version) if name == "shapely" else load(name)

    monkeypatch.setattr(dependencies.importlib, "import_module", import_module)


def test_what_is_too_old_is_named(dependencies: Any, monkeypatch: pytest.MonkeyPatch) -> None:
    with_shapely(dependencies, monkeypatch, "1.8.5")
    with pytest.raises(Exception, match=r"shapely 1\.8\.5 \(2\.1 or newer is needed\)"):
        dependencies.require_engine()


def test_versions_are_compared_by_their_numbers(
    dependencies: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    with_shapely(dependencies, monkeypatch, "2.10.0rc1")
    dependencies.require_engine()


def test_a_shapely_in_the_wrong_geos_is_told(
    dependencies: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    import shapely

    def broken(geometry: Any) -> bytes:
        raise shapely.errors.GEOSException("WKB output dimension must be 2 or 3")

    monkeypatch.setattr(shapely, "to_wkb", broken)
    with pytest.raises(Exception, match="PYQGIS_STARTUP") as caught:
        dependencies.require_engine()
    path = str(caught.value).split("PYQGIS_STARTUP set to ")[1].split(", for example")[0]
    assert Path(path).is_file()


def test_the_startup_script_is_harmless_where_nothing_is_wrong(plugins: Path) -> None:
    script = plugins / "urban_processing_qgis" / "import_shapely_first.py"
    done = subprocess.run([sys.executable, str(script)], capture_output=True, text=True, check=True)
    assert done.stdout == done.stderr == ""


def test_flags_are_as_before_after_loading(dependencies: Any) -> None:
    before = sys.getdlopenflags()
    dependencies.require_engine(maps=True)
    assert sys.getdlopenflags() == before


START = """
import json, sys
from qgis.core import QgsApplication, QgsProcessingContext
app = QgsApplication([], False)
app.initQgis()
before = set(sys.modules)
import urban_processing_qgis
plugin = urban_processing_qgis.classFactory(None)
plugin.initProcessing()
algorithm = QgsApplication.processingRegistry().createAlgorithmById("urban_processing:cogenerate")
algorithm.shortHelpString(), algorithm.icon(), algorithm.parameterDefinitions()
values = {"BOUNDARY": "a.gpkg", "PARCELS": 4, "OUTPUT": "out.gpkg"}
algorithm.checkParameterValues(values, QgsProcessingContext())
print(json.dumps(sorted({m.partition(".")[0] for m in set(sys.modules) - before})))
"""
HEAVY = {"geopandas", "matplotlib", "networkx", "numpy", "pandas", "pyogrio", "pyproj", "scipy"}


def test_nothing_heavy_is_loaded_before_an_algorithm_runs(plugins: Path) -> None:
    done = subprocess.run(
        [
            sys.executable,
            "-W",
            "ignore",
            "-c",
            f"import sys; sys.path.insert(0, {str(plugins)!r})" + START,
        ],
        capture_output=True,
        text=True,
        check=True,
    )
    loaded = set(json.loads(done.stdout.splitlines()[-1]))
    assert "urban_processing_qgis" in loaded
    assert not loaded & (HEAVY | {"shapely", "urban_processing"})


def test_a_package_that_cannot_be_loaded_is_named(
    dependencies: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    load = importlib.import_module

    def import_module(name: str) -> Any:
        if name == "scipy":
            raise ImportError("numpy.core.multiarray failed to import")
        return load(name)

    monkeypatch.setattr(dependencies.importlib, "import_module", import_module)
    with pytest.raises(Exception, match=r"not to be loaded: scipy \(numpy\.core\.multiarray"):
        dependencies.require_engine()
