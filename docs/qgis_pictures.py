"""Pictures of the plugin in a real QGIS window: ``python docs/qgis_pictures.py``.

Builds the plugin, starts QGIS on a virtual screen with a profile of its own, opens the toolbox and
the dialog, runs the algorithm on a sample boundary, and writes what the screen shows to
docs/images. Needs QGIS, xvfb and openbox, and the environment that ``.ci/setup-qgis .[qgis]``
makes; the packages of another one can be given with --packages.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import signal
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
INSIDE = Path(__file__).with_name("qgis_pictures_inside.py")
SIZE = "1600x1000"
PROFILE = """[PythonPlugins]
urban_processing_qgis=true
[UI]
UITheme=default
[app]
checkVersion=false
[qgis]
showTips322=false
"""
SECONDS = 120


def main() -> int:
    """Start QGIS on a virtual screen and wait for the pictures."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--packages", type=Path, default=_packages())
    parser.add_argument("--images", type=Path, default=ROOT / "docs" / "images")
    parser.add_argument("--only", choices=("toolbox", "steering"), default="")
    asked = parser.parse_args()
    asked.images.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as home:
        settings = Path(home) / "profiles" / "default"
        (settings / "QGIS").mkdir(parents=True)
        (settings / "QGIS" / "QGIS3.ini").write_text(PROFILE, encoding="utf-8")
        plugins = settings / "python" / "plugins"
        subprocess.run(
            [sys.executable, "-m", "qgis_plugin.build", "--unpacked", str(plugins)],
            cwd=ROOT,
            check=True,
        )
        qgis = f"qgis.bin --nologo --noversioncheck --profiles-path {home} --code {INSIDE}"
        screen = ["xvfb-run", "-a", "-s", f"-screen 0 {SIZE}x24"]
        running = subprocess.Popen(
            [*screen, "bash", "-c", f"openbox & sleep 1; {qgis}"],
            env={
                **os.environ,
                "HOME": home,
                "XDG_RUNTIME_DIR": home,
                "PYTHONPATH": str(asked.packages),
                "PYTHONWARNINGS": "ignore",
                "URBAN_PROCESSING_SAMPLES": str(ROOT / "sample_data"),
                "URBAN_PROCESSING_ONLY": asked.only,
                "URBAN_PROCESSING_IMAGES": str(asked.images.resolve()),
            },
            start_new_session=True,
        )
        try:
            return running.wait(SECONDS)
        except subprocess.TimeoutExpired:
            sys.stderr.write("QGIS did not finish in time.\n")
            return 1
        finally:
            with contextlib.suppress(ProcessLookupError):
                os.killpg(running.pid, signal.SIGKILL)


def _packages() -> Path:
    found = sorted((ROOT / "build" / "qgis" / "lib").glob("python3*/site-packages"))
    return found[-1] if found else Path()


if __name__ == "__main__":
    sys.exit(main())
