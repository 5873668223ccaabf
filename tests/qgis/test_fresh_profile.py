"""The built zip in an empty profile, run by QGIS's own program; its result opened and certified."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import sysconfig
import zipfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("qgis.core", reason="QGIS is not here")

import pyogrio
from qgis.core import Qgis

import urban_processing as up
from urban_processing.metrics import Table, certify

PROGRAM = shutil.which("qgis_process.bin")

pytestmark = pytest.mark.skipif(PROGRAM is None, reason="qgis_process is not here")

Process = Callable[..., "subprocess.CompletedProcess[str]"]


@pytest.fixture(scope="module")
def profile(zipped: bytes, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A home with nothing in it but the plugin."""
    home = tmp_path_factory.mktemp("home")
    archive = home / "urban_processing_qgis.zip"
    archive.write_bytes(zipped)
    plugins = home / "profile" / "python" / "plugins"
    zipfile.ZipFile(archive).extractall(plugins)
    (home / "run").mkdir(mode=0o700)
    return home


@pytest.fixture(scope="module")
def process(profile: Path) -> Process:
    def call(*arguments: str, packages: str | None = None) -> subprocess.CompletedProcess[str]:
        environment = {
            "PATH": os.environ["PATH"],
            "HOME": str(profile),
            "XDG_RUNTIME_DIR": str(profile / "run"),
            "QGIS_CUSTOM_CONFIG_PATH": str(profile),
            "QGIS_PLUGINPATH": str(profile / "profile" / "python" / "plugins"),
            "QT_QPA_PLATFORM": "offscreen",
            "PYTHONPATH": sysconfig.get_path("purelib") if packages is None else packages,
            "PYTHONWARNINGS": "ignore",
            "PYTHONDONTWRITEBYTECODE": "1",
            "LC_ALL": "C.UTF-8",
        }
        if Qgis.QGIS_VERSION_INT >= 33800:  # loads shapely itself: as the plugin then advises
            startup = profile / "profile/python/plugins/urban_processing_qgis"
            environment["PYQGIS_STARTUP"] = str(startup / "import_shapely_first.py")
        return subprocess.run(
            [str(PROGRAM), *arguments],
            env=environment,
            capture_output=True,
            text=True,
            check=False,
            timeout=300,
        )

    done = call("plugins", "enable", "urban_processing_qgis")
    assert done.returncode == 0, done.stderr
    return call


def test_a_boundary_in_degrees_from_the_zip_alone(
    process: Process, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    land = sample("wandsworth")
    assert pyogrio.read_info(land)["crs"] == "EPSG:4326"
    layers = {name: tmp_path / f"{name}.gpkg" for name in ("parcels", "streets", "boundary")}
    sinks = [f"OUTPUT_{name.upper()}={path}" for name, path in layers.items()]
    done = process(
        *("run", "urban_processing:cogenerate", "--", f"BOUNDARY={land}", "PARCELS=300"),
        *(*sinks, f"OUTPUT={tmp_path / 'layout.gpkg'}", f"PLOT={tmp_path / 'map.png'}"),
    )
    assert done.returncode == 0, done.stdout + done.stderr
    assert "Traceback" not in done.stdout + done.stderr
    assert "EPSG:32630" in done.stdout
    tables = {}
    for name, path in layers.items():
        frame = pyogrio.read_dataframe(path)
        assert str(frame.crs) == "EPSG:32630"
        columns = {c: frame[c].to_numpy() for c in frame.columns if c != "geometry"}
        tables[name] = Table(columns, np.asarray(frame.geometry, dtype=object))
    assert len(tables["parcels"]) == 300
    smallest = float(tables["parcels"]["area_m2"].min())
    certified = certify(*tables.values(), min_area=smallest)
    assert certified.holds, certified.failures
    layout = up.read_layout(tmp_path / "layout.gpkg")
    assert layout.certificate.holds
    assert len(layout.parcels) == 300
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_a_mistake_is_a_sentence_and_an_exit_code(
    process: Process, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    done = process(
        *("run", "urban_processing:cogenerate", "--", f"BOUNDARY={sample('rect')}"),
        f"OUTPUT_PARCELS={tmp_path / 'p.gpkg'}",
    )
    assert done.returncode != 0
    said = done.stdout + done.stderr
    assert "Give “Smallest parcel” (m²) or “Number of parcels”" in said
    assert "Traceback" not in said
    assert not list(tmp_path.iterdir())


def test_what_is_missing_is_named_and_nothing_crashes(
    process: Process, sample: Callable[[str], Path], tmp_path: Path
) -> None:
    empty = tmp_path / "empty"
    empty.mkdir()
    done = process(
        *("run", "urban_processing:cogenerate", "--", f"BOUNDARY={sample('rect')}", "PARCELS=4"),
        packages=str(empty),
    )
    said = done.stdout + done.stderr
    try:
        subprocess.run(
            ["/usr/bin/python3", "-c", "import shapely; assert shapely.__version__ >= '2.1'"],
            check=True,
            capture_output=True,
        )
    except (OSError, subprocess.CalledProcessError):
        assert done.returncode == 1
        assert "shapely" in said
        assert "QPIP" in said
        assert "Traceback" not in said
    else:
        assert sys.platform  # the distribution's own shapely is new enough
