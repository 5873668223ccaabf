"""Whether files can be written where they are to go, asked before a long run."""

from __future__ import annotations

import os
from collections.abc import Collection
from pathlib import Path

GEOPACKAGE = ".gpkg"
MAPS = (".png", ".svg", ".pdf")
"""Kinds of files that a map can be written to."""

_SIDE_FILES = ("-journal", "-wal")


def folder_problems(folder: Path) -> list[str]:
    """Return why nothing can be written into a folder; nothing where it can."""
    if not folder.exists():
        return [f"The folder {folder} does not exist: create it first."]
    if not folder.is_dir():
        return [f"{folder} is not a folder."]
    if not os.access(folder, os.W_OK | os.X_OK):
        return [f"The folder {folder} is not writable: choose another, or change its rights."]
    return []


def file_problems(target: Path) -> list[str]:
    """Return why a file cannot be written or replaced; nothing where it can."""
    problems = folder_problems(target.parent)
    if target.is_dir():
        problems.append(f"The output {target} is a folder: give the name of a file.")
    elif target.exists() and not os.access(target, os.W_OK):
        problems.append(f"The output {target} is write-protected: choose another name.")
    return problems


def replaced_problems(target: Path, *, overwrite: bool) -> list[str]:
    """Return why a file may not be replaced; nothing where it may, or there is none."""
    if overwrite or not target.is_file():
        return []
    return [
        f"The output {target} exists already: choose another name, or allow overwriting "
        "(--overwrite)."
    ]


def geopackage_problems(target: Path) -> list[str]:
    """Return why a GeoPackage cannot be written or replaced as a whole."""
    problems = []
    if target.suffix.lower() != GEOPACKAGE:
        problems.append(f"The output {target} must be a GeoPackage: end its name in {GEOPACKAGE}.")
    problems += file_problems(target)
    beside = [target.with_name(target.name + end) for end in _SIDE_FILES]
    if any(file.exists() for file in beside):
        named = " and ".join(file.name for file in beside if file.exists())
        problems.append(
            f"The output {target} is open in another program ({named} lies beside it): close it "
            "there, or choose another name."
        )
    return problems


def map_problems(target: Path) -> list[str]:
    """Return why a map cannot be written to a path; nothing where it can."""
    return ending_problems(target, "map", MAPS)


def ending_problems(target: Path, what: str, endings: Collection[str]) -> list[str]:
    """Return why a file of some kind cannot be written to a path; nothing where it can."""
    problems = file_problems(target)
    if target.suffix.lower() not in endings:
        one_of = "" if len(endings) == 1 else "one of "
        problems.append(f"The {what} {target} must end in {one_of}{', '.join(endings)}.")
    return problems
