"""The distribution: one version, types, no tests inside, quick to import."""

from __future__ import annotations

import importlib.metadata
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from pathlib import Path

import pytest

import urban_processing

ROOT = Path(__file__).resolve().parents[2]
WHEEL = os.environ.get("URBAN_PROCESSING_WHEEL", "")
HEAVY = {"geopandas", "matplotlib", "numpy", "osmnx", "pandas", "pyogrio", "scipy", "shapely"}


def _loaded_after(statement: str, tmp_path: Path) -> set[str]:
    code = f"{statement}\nimport sys\nprint(*{{m.partition('.')[0] for m in sys.modules}})"
    place = str(Path(urban_processing.__file__).parents[1])
    out = subprocess.run(
        [sys.executable, "-c", code],
        capture_output=True,
        text=True,
        check=True,
        cwd=tmp_path,
        env={**os.environ, "PYTHONPATH": place},
    )
    return set(out.stdout.split())


def test_the_version_comes_from_one_place() -> None:
    assert re.fullmatch(r"\d+\.\d+\.\d+([a-z0-9.]+)?", urban_processing.__version__)
    if not (ROOT / "pyproject.toml").exists():
        pytest.skip("the project file is not beside these tests")
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    assert "version" not in project["project"]
    path = project["tool"]["hatch"]["version"]["path"]
    assert urban_processing.__version__ in (ROOT / path).read_text(encoding="utf-8")


def test_importing_loads_nothing_heavy(tmp_path: Path) -> None:
    assert not HEAVY & _loaded_after("import urban_processing", tmp_path)


def test_help_loads_nothing_heavy(tmp_path: Path) -> None:
    loaded = _loaded_after(
        "from urban_processing.cli.app import app\n"
        "app(['cogenerate', '--help'], standalone_mode=False)",
        tmp_path,
    )
    assert "click" in loaded
    assert not HEAVY & loaded


def test_the_engine_loads_none_of_the_packages_of_the_edges(tmp_path: Path) -> None:
    loaded = _loaded_after("import urban_processing.pipelines.cogenerate", tmp_path)
    edges = {"click", "geopandas", "matplotlib", "osmnx", "pandas", "pyogrio", "pyproj", "rich"}
    assert not loaded & (edges | {"networkx"})


def test_public_names_are_there() -> None:
    for name in urban_processing.__all__:
        assert getattr(urban_processing, name) is not None
    assert set(urban_processing.__all__) == set(dir(urban_processing))
    with pytest.raises(AttributeError, match="no attribute 'nothing'"):
        urban_processing.nothing  # noqa: B018


@pytest.mark.skipif(not WHEEL, reason="runs where the wheel is tested")
def test_the_wheel_is_what_is_tested() -> None:
    assert ROOT not in Path(urban_processing.__file__).resolve().parents or (
        "site-packages" in Path(urban_processing.__file__).parts
    )
    assert importlib.metadata.version("urban_processing") == urban_processing.__version__
    with zipfile.ZipFile(WHEEL) as wheel:
        names = wheel.namelist()
    assert "urban_processing/py.typed" in names
    assert {f"urban_processing/report/html/page.{end}" for end in ("css", "html.jinja")} <= {*names}
    assert not [name for name in names if "test" in name or name.endswith(".gpkg")]
    assert [name for name in names if name.endswith("licenses/LICENSE")]
    assert {name.split("/")[0] for name in names} == {
        "urban_processing",
        f"urban_processing-{urban_processing.__version__}.dist-info",
    }
