"""The plugin's zip: whole, clean, and made from the one source of everything in it."""

from __future__ import annotations

import ast
import configparser
import importlib
import importlib.util
import io
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path
from types import ModuleType

import pytest

import urban_processing

ROOT = Path(__file__).resolve().parents[2]
TOP = "urban_processing_qgis"
ENGINE_NEEDS = {"jinja2", "matplotlib", "networkx", "numpy", "scipy", "shapely"}
QGIS_HAS = {"osgeo", "processing", "qgis"}

pytestmark = pytest.mark.skipif(
    not (ROOT / "qgis_plugin").is_dir(), reason="the plugin is not beside these tests"
)


@pytest.fixture(scope="module")
def builder() -> ModuleType:
    spec = importlib.util.spec_from_file_location("build_plugin", ROOT / "qgis_plugin/build.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="module")
def zipped(builder: ModuleType) -> bytes:
    content: bytes = builder.build()
    return content


@pytest.fixture(scope="module")
def texts(zipped: bytes) -> dict[str, str]:
    with zipfile.ZipFile(io.BytesIO(zipped)) as archive:
        assert archive.testzip() is None
        return {name: archive.read(name).decode() for name in archive.namelist()}


@pytest.fixture(scope="module")
def folder(zipped: bytes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    place = tmp_path_factory.mktemp("plugin")
    zipfile.ZipFile(io.BytesIO(zipped)).extractall(place)
    return place


@pytest.fixture(scope="module")
def metadata(texts: dict[str, str]) -> configparser.SectionProxy:
    parser = configparser.ConfigParser()  # as QGIS reads it, with interpolation
    parser.read_string(texts[f"{TOP}/metadata.txt"])
    return parser["general"]


def modules(texts: dict[str, str]) -> dict[str, ast.Module]:
    return {name: ast.parse(text) for name, text in texts.items() if name.endswith(".py")}


def test_the_zip_has_one_folder_without_caches_and_binaries(
    zipped: bytes, texts: dict[str, str]
) -> None:
    assert {name.partition("/")[0] for name in texts} == {TOP}
    assert {Path(name).suffix for name in texts} <= {".py", ".txt", ".svg", ".css", ".jinja", ""}
    assert not [name for name in texts if "__pycache__" in name or "/." in name]
    assert f"{TOP}/__init__.py" in texts
    assert f"{TOP}/engine/report/html/page.html.jinja" in texts
    assert f"{TOP}/build.py" not in texts
    assert len(zipped) < 1_000_000


def test_the_licences_are_there(texts: dict[str, str]) -> None:
    licence = texts[f"{TOP}/LICENSE"]
    assert "GPL-2.0-or-later" in licence
    assert "GNU GENERAL PUBLIC LICENSE" in licence
    assert texts[f"{TOP}/engine/LICENSE"] == (ROOT / "LICENSE").read_text(encoding="utf-8")


def test_metadata_is_complete(metadata: configparser.SectionProxy, texts: dict[str, str]) -> None:
    required = "name description about version qgisMinimumVersion author email tracker repository"
    usual = "homepage tags category icon changelog hasProcessingProvider plugin_dependencies"
    for key in f"{required} {usual}".split():
        assert metadata[key].strip(), key
    assert metadata["version"] == urban_processing.__version__
    assert metadata["hasProcessingProvider"] == "yes"
    assert metadata["qgisMaximumVersion"] == "4.99"
    assert f"{TOP}/{metadata['icon']}" in texts
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert metadata["tracker"] == project["urls"]["Issues"]
    assert metadata["repository"] == project["urls"]["Repository"]
    assert "supportsQt6" not in metadata
    assert len(metadata["changelog"].splitlines()) > 1


def test_requirements_are_the_limits_of_the_library(texts: dict[str, str]) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    lines = texts[f"{TOP}/requirements.txt"].splitlines()
    wanted = [line for line in lines if line and not line.startswith("#")]
    assert set(wanted) <= set(project["dependencies"])
    names = {re.split("[>=]", line)[0] for line in wanted}
    assert names == {"scipy", "shapely", "matplotlib", "jinja2"}


def test_imports_stay_in_the_plugin_and_in_what_qgis_has(texts: dict[str, str]) -> None:
    standard = sys.stdlib_module_names
    for name, tree in modules(texts).items():
        for module in imported(tree):
            top = module.partition(".")[0]
            assert top in standard or top in ENGINE_NEEDS | QGIS_HAS | {TOP}, (name, module)
            if top == TOP:
                path = f"{module.replace('.', '/')}"
                assert f"{path}.py" in texts or f"{path}/__init__.py" in texts, (name, module)


def imported(tree: ast.Module) -> list[str]:
    found = []
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            found += [alias.name for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0
            found.append(node.module or "")
    return found


def test_the_engine_in_the_plugin_runs_alone(folder: Path) -> None:
    """A layout by the vendored engine; the library of that name stays out of it."""
    code = f"""
import sys
sys.path.insert(0, {str(folder)!r})
import shapely
from {TOP}.engine.params import CogenerateParams
from {TOP}.engine.pipelines.cogenerate import cogenerate
from {TOP}.engine.metrics import LayoutMeasures, MeasuredLayout
from {TOP}.engine.site import Site
import {TOP}.engine.intake.sites, {TOP}.engine.layout_file.files, {TOP}.engine.report.map
from {TOP}.engine.report.html import Report, report_html, report_side
layout = cogenerate(Site((shapely.box(0, 0, 90, 90),)), CogenerateParams(parcels=9))
assert MeasuredLayout(layout).certificate.holds
assert layout.mesh.n_faces == 9
known = LayoutMeasures(layout).of_fabric
assert "</html>" in report_html(Report((report_side(known, name="nine", samples={{}}),)))
tops = {{name.partition(".")[0] for name in sys.modules}}
print(sorted(tops & {{"urban_processing", "geopandas", "pyproj", "pyogrio", "click"}}))
"""
    done = subprocess.run(
        [sys.executable, "-W", "ignore", "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=folder,
    )
    assert done.stdout.strip() == "[]"


def test_what_any_python_reads_is_old_enough(texts: dict[str, str]) -> None:
    for name in ("__init__.py", "plugin.py"):
        text = texts[f"{TOP}/{name}"]
        ast.parse(text, feature_version=(3, 9))
        assert "from __future__ import annotations" in text
        top = [n for n in ast.parse(text).body if isinstance(n, ast.ImportFrom)]
        assert not [n.module for n in top if (n.module or "").startswith(TOP)]


def test_the_same_sources_give_the_same_bytes(builder: ModuleType, zipped: bytes) -> None:
    assert builder.build() == zipped


def test_the_command_builds_it(tmp_path: Path, zipped: bytes) -> None:
    target = tmp_path / "deep" / "plugin.zip"
    done = subprocess.run(
        [sys.executable, "-m", "qgis_plugin.build", "-o", str(target)],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert done.stdout.strip() == str(target)
    assert target.read_bytes() == zipped
    subprocess.run(
        [sys.executable, "-m", "qgis_plugin.build", "--unpacked", str(tmp_path)],
        capture_output=True,
        text=True,
        check=True,
        cwd=ROOT,
    )
    assert (tmp_path / TOP / "metadata.txt").is_file()


def test_security_scans_find_nothing(folder: Path) -> None:
    pytest.importorskip("bandit", reason="bandit is not installed")
    pytest.importorskip("detect_secrets", reason="detect-secrets is not installed")
    bandit = subprocess.run(
        [sys.executable, "-m", "bandit", "-q", "-r", str(folder)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert bandit.returncode == 0, bandit.stdout
    secrets = subprocess.run(
        [sys.executable, "-m", "detect_secrets", "scan", "--all-files", str(folder)],
        capture_output=True,
        text=True,
        check=True,
    )
    assert '"results": {}' in secrets.stdout


def test_qt_is_imported_through_qgis_alone(texts: dict[str, str]) -> None:
    for name, tree in modules(texts).items():
        assert not [m for m in imported(tree) if re.match(r"PyQt|PySide|sip", m)], name
        called = [n.attr for n in ast.walk(tree) if isinstance(n, ast.Attribute)]
        assert "exec_" not in called, name
