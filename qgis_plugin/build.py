"""Build the plugin: ``python -m qgis_plugin.build`` writes dist/urban_processing_qgis.zip.

The engine goes into the plugin, under the plugin's own name, so that it never meets another
version of the library that may be installed beside QGIS. Nothing needs to be installed to build.
"""

from __future__ import annotations

import argparse
import io
import re
import sys
import tomllib
import zipfile
from collections.abc import Iterator
from pathlib import Path

ROOT = Path(__file__).resolve().parents[1]
TOP = "urban_processing_qgis"
"""The one folder in the zip, and so the name of the package."""

ENGINE = f"{TOP}.engine"
EDGES = {"__init__.py", "__main__.py", "api", "cli", "io"}
"""What of the library stays out: the rooms that talk to terminals, pyproj and geopandas."""

OUT_OF_PLUGIN = {"build.py"}
SHIPPED = {".py", ".txt", ".svg", ".css", ".jinja"}
FIXED_TIME = (2000, 1, 1, 0, 0, 0)
GPL = "qgis_plugin/LICENSE"

_IMPORT = re.compile(r"^(\s*from )(urban_processing|qgis_plugin)(?=[. ])", re.MULTILINE)
_NAMES = {"urban_processing": ENGINE, "qgis_plugin": TOP}
_VERSION = re.compile(r'^__version__ = "([^"]+)"', re.MULTILINE)


def main() -> None:
    """Build what was asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("-o", "--output", type=Path, default=ROOT / "dist" / f"{TOP}.zip")
    parser.add_argument(
        "--unpacked", type=Path, metavar="FOLDER", help="write the plugin's folder there instead"
    )
    asked = parser.parse_args()
    if asked.unpacked is not None:
        zipfile.ZipFile(io.BytesIO(build())).extractall(asked.unpacked)
        sys.stdout.write(f"{asked.unpacked / TOP}\n")
        return
    asked.output.parent.mkdir(parents=True, exist_ok=True)
    asked.output.write_bytes(build())
    sys.stdout.write(f"{asked.output}\n")


def build() -> bytes:
    """Return the zip: one top folder, the same bytes for the same sources."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, text in sorted(contents()):
            entry = zipfile.ZipInfo(f"{TOP}/{name}", FIXED_TIME)
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = 0o644 << 16
            archive.writestr(entry, text)
    return buffer.getvalue()


def contents() -> Iterator[tuple[str, str]]:
    """Yield the name in the plugin's folder and the text of every file."""
    for path in _sources(ROOT / "qgis_plugin"):
        name = path.relative_to(ROOT / "qgis_plugin").as_posix()
        if name == "metadata.txt":
            yield name, metadata()
        elif name not in OUT_OF_PLUGIN:
            yield name, vendored(path.read_text(encoding="utf-8"))
    yield "LICENSE", (ROOT / GPL).read_text(encoding="utf-8")
    for path in _sources(ROOT / "urban_processing"):
        place = path.relative_to(ROOT / "urban_processing")
        if place.parts[0] not in EDGES:
            yield f"engine/{place.as_posix()}", vendored(path.read_text(encoding="utf-8"))
    yield "engine/__init__.py", f'"""The engine of urban_processing {version()}."""\n'
    yield "engine/LICENSE", (ROOT / "LICENSE").read_text(encoding="utf-8")


def vendored(text: str) -> str:
    """Return a module whose imports name the plugin's folder.

    >>> vendored("from urban_processing.site import Site")
    'from urban_processing_qgis.engine.site import Site'
    """
    return _IMPORT.sub(lambda match: match[1] + _NAMES[match[2]], text)


def metadata() -> str:
    """Return metadata.txt with what is known elsewhere: version, author, addresses, changes."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    (author,) = project["authors"]
    changes = (ROOT / "CHANGELOG.md").read_text(encoding="utf-8")
    known = {
        "version": version(),
        "author": author["name"],
        "email": author["email"],
        "homepage": project["urls"]["Homepage"],
        "repository": project["urls"]["Repository"],
        "tracker": project["urls"]["Issues"],
        "changelog": _newest(changes),
    }
    text = (ROOT / "qgis_plugin" / "metadata.txt").read_text(encoding="utf-8")
    # QGIS reads the file with interpolation
    return text + "".join(f"{key}={value.replace('%', '%%')}\n" for key, value in known.items())


def version() -> str:
    """Return the version, from the place that pyproject.toml names."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
    source = (ROOT / project["tool"]["hatch"]["version"]["path"]).read_text(encoding="utf-8")
    found = _VERSION.search(source)
    if found is None:
        raise SystemExit("The version is not where pyproject.toml says.")
    return found[1]


def _newest(changes: str) -> str:
    """Return the newest section of the changelog as lines that a continued value may have."""
    section = changes.split("\n## ")[1]
    lines = [line.strip("# ").strip() for line in section.splitlines()]
    return "\n    ".join(line for line in lines if line)


def _sources(folder: Path) -> Iterator[Path]:
    for path in sorted(folder.rglob("*")):
        if path.suffix in SHIPPED and "__pycache__" not in path.parts:
            yield path


if __name__ == "__main__":
    main()
