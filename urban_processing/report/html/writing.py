"""Reports as files that appear whole or not at all."""

from __future__ import annotations

import json
from os import PathLike
from pathlib import Path

from urban_processing.errors import OutputError
from urban_processing.layout_file.writing import replacing
from urban_processing.paths import file_problems, replaced_problems
from urban_processing.report.html.machine import report_csv, report_json
from urban_processing.report.html.model import Report
from urban_processing.report.html.page import report_html

PAGE, JSON, CSV = (".html", ".htm"), (".json",), (".csv",)
"""Endings of the names of files."""

_KINDS = {PAGE: "report", JSON: "report as JSON", CSV: "table of metrics"}


def report_problems(
    path: str | PathLike[str], *, endings: tuple[str, ...] = PAGE, overwrite: bool = False
) -> list[str]:
    """Return one sentence for each reason why a report cannot be written.

    Meant to be asked before a long run.

    Parameters
    ----------
    path
        File that is to be written.
    endings
        How its name may end: `PAGE`, `JSON` or `CSV`.
    overwrite
        Whether an existing file may be replaced.
    """
    target = Path(path)
    problems = file_problems(target)
    if target.suffix.lower() not in endings:
        problems.append(f"The {_KINDS[endings]} {target} must end in {' or '.join(endings)}.")
    return [*problems, *replaced_problems(target, overwrite=overwrite)]


def write(report: Report, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a report as the ending of the file says.

    ``.html`` is the page, ``.json`` all its figures (see `report_json`), ``.csv`` the table of
    metrics (see `report_csv`).

    Raises
    ------
    OutputError
        If the file cannot be written there.
    DependencyError
        If it is a page and jinja2 is not installed.
    """
    ending = Path(path).suffix.lower()
    writers = {PAGE: write_report, JSON: write_json, CSV: write_csv}
    for endings, writer in writers.items():
        if ending in endings:
            return writer(report, path, overwrite=overwrite)
    raise OutputError(f"The report {path} must end in {PAGE[0]}, {JSON[0]} or {CSV[0]}.")


def write_report(report: Report, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Write a report as one HTML file that needs nothing else; the same report, the same bytes.

    Parameters
    ----------
    report
        The report.
    path
        File to write, ending in ``.html``.
    overwrite
        Whether an existing file may be replaced.

    Returns
    -------
    Path
        The file.

    Raises
    ------
    OutputError
        If the file cannot be written there.
    DependencyError
        If jinja2 is not installed.
    """
    target = _writable(path, PAGE, overwrite=overwrite)
    return _write(target, report_html(report))


def write_json(report: Report, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Write what `report_json` gives; raises `OutputError` if that fails."""
    target = _writable(path, JSON, overwrite=overwrite)
    text = json.dumps(report_json(report), ensure_ascii=False, indent=1, allow_nan=False)
    return _write(target, f"{text}\n")


def write_csv(report: Report, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
    """Write what `report_csv` gives; raises `OutputError` if that fails."""
    target = _writable(path, CSV, overwrite=overwrite)
    return _write(target, report_csv(report))


def _writable(path: str | PathLike[str], endings: tuple[str, ...], *, overwrite: bool) -> Path:
    problems = report_problems(path, endings=endings, overwrite=overwrite)
    if problems:
        raise OutputError(problems)
    return Path(path)


def _write(target: Path, text: str) -> Path:
    with replacing(target) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")
    return target
