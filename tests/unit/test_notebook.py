"""The notebook of the documentation runs, without a network, and is what its script makes."""

from __future__ import annotations

import importlib.util
import shutil
import warnings
from pathlib import Path
from types import ModuleType

import pytest

nbformat = pytest.importorskip("nbformat", reason="nbformat is not installed")
pytest.importorskip("nbclient", reason="nbclient is not installed")
pytest.importorskip("ipykernel", reason="ipykernel is not installed")

ROOT = Path(__file__).resolve().parents[2]
DOCS, SAMPLES = ROOT / "docs", ROOT / "sample_data"


@pytest.fixture
def script() -> ModuleType:
    if not DOCS.is_dir() or not SAMPLES.is_dir():
        pytest.skip("the docs and the samples are not beside these tests")
    spec = importlib.util.spec_from_file_location("docs_notebook", DOCS / "notebook.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_notebook_is_what_its_script_makes(script: ModuleType) -> None:
    kept = nbformat.read(script.NOTEBOOK, as_version=4)
    assert [(c.cell_type, c.source) for c in kept.cells] == list(script.CELLS)
    assert all(c.outputs for c in kept.cells if c.cell_type == "code"), (
        "run python docs/notebook.py"
    )


def test_the_notebook_runs_offline(
    script: ModuleType, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = tmp_path / "docs"
    folder.mkdir()
    shutil.copytree(SAMPLES, tmp_path / "sample_data")
    for proxy in ("http_proxy", "https_proxy", "HTTP_PROXY", "HTTPS_PROXY"):
        monkeypatch.setenv(proxy, "http://127.0.0.1:9")  # nobody answers there
    monkeypatch.delenv("MPLBACKEND", raising=False)  # pictures go into the notebook
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # of the kernel's own
        made = script.executed(script.notebook(), folder)
    page = (folder / "mauren.html").read_text(encoding="utf-8")
    assert "OpenStreetMap" in page
    outputs = [o for c in made.cells if c.cell_type == "code" for o in c.outputs]
    assert not [o for o in outputs if o.output_type == "error"]
    assert not [o for o in outputs if o.get("name") == "stderr"], "no warnings either"
    pictures = [o for o in outputs if "image/png" in o.get("data", {})]
    assert len(pictures) == 2
