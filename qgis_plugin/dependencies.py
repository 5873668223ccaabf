"""The packages that the engine needs beside QGIS: found, or named in one message.

Wheels bring a GEOS of their own. In the programs of QGIS on Linux, which hold a GEOS already, the
wheel's calls would end up in the wrong one, unless its first import binds deeply.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import re
import sys
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path

from urban_processing.errors import DependencyError

REQUIREMENTS = Path(__file__).with_name("requirements.txt")
STARTUP = Path(__file__).with_name("import_shapely_first.py")
FOR_MAPS, FOR_REPORTS = "matplotlib", "jinja2"
"""Packages that only maps and only reports need."""

_LINE = re.compile(r"([A-Za-z_0-9]+)\s*>=\s*([\d.]+)")


def require_engine(*, maps: bool = False, reports: bool = False) -> None:
    """Import what the engine needs, in the way in which it works inside QGIS.

    Parameters
    ----------
    maps
        Whether a map will be drawn.
    reports
        Whether a report will be written.

    Raises
    ------
    DependencyError
        With one sentence for each package that is missing, too old, or does not work.
    """
    unneeded = {name for name, asked in ((FOR_MAPS, maps), (FOR_REPORTS, reports)) if not asked}
    wanted = {name: least for name, least in _required() if name not in unneeded}
    missing, old, broken = [], [], []
    with deep_binding():
        for name, least in wanted.items():
            if importlib.util.find_spec(name) is None:
                missing.append(f"{name} >= {least}")
                continue
            try:
                found = importlib.import_module(name).__version__
            except ImportError as error:
                broken.append(f"{name} ({error})")
                continue
            if _numbers(found) < _numbers(least):
                old.append(f"{name} {found} ({least} or newer is needed)")
    problems, again = [], _how_to_install(wanted)
    if missing:
        problems.append(f"This QGIS lacks {_listed(missing)}. {again}")
    if old:
        problems.append(f"Too old for this plugin: {_listed(old)}. {again}")
    if broken:
        problems.append(f"Installed, but not to be loaded: {_listed(broken)}. {again}")
    if not problems and not _shapely_works():
        problems.append(
            "The package shapely does not work inside this QGIS, because QGIS has loaded it "
            "before the plugin could (the two hold different versions of GEOS). Start QGIS with "
            f"the environment variable PYQGIS_STARTUP set to {STARTUP}, for example in "
            "Settings > Options > System > Environment, or install shapely with the plugin QPIP "
            "instead of system-wide."
        )
    if problems:
        raise DependencyError(problems)


@contextmanager
def deep_binding() -> Iterator[None]:
    """Let libraries that are loaded meanwhile prefer their own symbols, where that matters."""
    if not _inside_a_program_of_qgis():
        yield
        return
    flags = sys.getdlopenflags()
    sys.setdlopenflags(os.RTLD_NOW | os.RTLD_LOCAL | os.RTLD_DEEPBIND)
    try:
        yield
    finally:
        sys.setdlopenflags(flags)


def _inside_a_program_of_qgis() -> bool:
    """Whether this is QGIS or qgis_process on Linux; `sys.executable` says python there too."""
    if not sys.platform.startswith("linux"):
        return False
    return not Path("/proc/self/exe").resolve().name.startswith("python")


def _shapely_works() -> bool:
    import shapely

    try:
        return bool(shapely.from_wkb(shapely.to_wkb(shapely.Point(1, 2))).x == 1)
    except shapely.errors.GEOSException:
        return False


def _required() -> list[tuple[str, str]]:
    text = REQUIREMENTS.read_text(encoding="utf-8")
    found = (_LINE.match(line) for line in text.splitlines())
    return [(match[1], match[2]) for match in found if match]


def _how_to_install(packages: Iterable[str]) -> str:
    distributed = ""
    if sys.platform.startswith("linux"):
        distributed = " (a distribution's own packages may be too old)"
    return (
        "Install with the plugin QPIP, which reads the list of this plugin "
        f"({REQUIREMENTS}){distributed}, or run in a terminal the Python of QGIS with "
        f"-m pip install --user {' '.join(packages)}. Then start QGIS again."
    )


def _listed(items: list[str]) -> str:
    return items[0] if len(items) == 1 else f"{', '.join(items[:-1])} and {items[-1]}"


def _numbers(version: str) -> tuple[int, ...]:
    """Return the numbers of a version: ``2.1.0rc1`` is (2, 1, 0)."""
    return tuple(int(n) for n in re.findall(r"\d+", version)[:3])
