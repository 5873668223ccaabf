"""The built plugin inside QGIS, as a user has it: the zip unpacked, its provider registered."""

from __future__ import annotations

import importlib
import io
import os
import sys
import zipfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from in_qgis import ID

os.environ.setdefault("QT_QPA_PLATFORM", "offscreen")  # before the application starts

ROOT = Path(__file__).resolve().parents[2]


def load_from_source(name: str) -> Any:
    """Import a module that is not installed, such as the one that builds the plugin."""
    sys.path.insert(0, str(ROOT))
    try:
        return importlib.import_module(name)
    finally:
        sys.path.remove(str(ROOT))


@pytest.fixture(scope="session")
def zipped() -> bytes:
    """The plugin as it is published."""
    content: bytes = load_from_source("qgis_plugin.build").build()
    return content


@pytest.fixture(scope="session")
def plugins(zipped: bytes, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """A folder of plugins with ours in it, where Python finds it as QGIS lets it."""
    folder = tmp_path_factory.mktemp("plugins")
    zipfile.ZipFile(io.BytesIO(zipped)).extractall(folder)
    sys.path.insert(0, str(folder))
    yield folder
    sys.path.remove(str(folder))


@pytest.fixture(scope="session")
def provider(plugins: Path, qgis_processing: None) -> Iterator[Any]:
    """Our provider, registered by the plugin as QGIS starts it."""
    package = importlib.import_module("urban_processing_qgis")
    plugin = package.classFactory(None)
    plugin.initProcessing()
    yield plugin.provider
    plugin.unload()


@pytest.fixture(scope="session")
def engine(provider: Any) -> Callable[[str], Any]:
    """Modules of the plugin's own engine by name, as ``engine("errors")``."""
    return lambda name: importlib.import_module(f"urban_processing_qgis.{name}")


@pytest.fixture
def feedback(qgis_app: Any) -> Any:
    """A feedback that keeps what was said."""
    from qgis.core import QgsProcessingFeedback

    class Kept(QgsProcessingFeedback):
        def __init__(self) -> None:
            super().__init__()
            self.said: list[str] = []
            self.warned: list[str] = []
            self.errors: list[str] = []
            self.texts: list[str] = []
            self.fractions: list[float] = []
            self.progressChanged.connect(self.fractions.append)

        def pushInfo(self, info: str) -> None:
            self.said.append(info)

        def pushWarning(self, warning: str) -> None:
            self.warned.append(warning)

        def reportError(self, error: str, fatalError: bool = False) -> None:
            self.errors.append(error)

        def setProgressText(self, text: str) -> None:
            self.texts.append(text)

    return Kept()


@pytest.fixture
def run(provider: Any, feedback: Any) -> Callable[..., dict[str, Any]]:
    """Run `cogenerate` as a script in QGIS does; sinks that are not named are not made."""
    import processing

    def call(boundary: Any, algorithm: str = ID, **parameters: Any) -> dict[str, Any]:
        named = {"BOUNDARY": boundary, **parameters}
        results: dict[str, Any] = processing.run(algorithm, named, feedback=feedback)
        return results

    return call


@pytest.fixture
def layer(qgis_app: Any) -> Callable[..., Any]:
    """A layer in memory: ``layer(["POLYGON (...)"], crs="EPSG:32630", kind="Polygon")``."""
    from qgis.core import QgsFeature, QgsGeometry, QgsVectorLayer

    def make(
        texts: list[str | None],
        crs: str = "EPSG:32630",
        kind: str = "Polygon",
        fields: str = "",
        name: str = "land",
    ) -> Any:
        made = QgsVectorLayer(f"{kind}?crs={crs}{fields}", name, "memory")
        assert made.isValid()
        features = []
        for text in texts:
            feature = QgsFeature(made.fields())
            if text is not None:
                feature.setGeometry(QgsGeometry.fromWkt(text))
            features.append(feature)
        assert made.dataProvider().addFeatures(features)[0]
        return made

    return make
