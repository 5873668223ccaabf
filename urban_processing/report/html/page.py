"""The page: one HTML file that needs nothing else."""

from __future__ import annotations

from functools import cache
from importlib.resources import files
from typing import TYPE_CHECKING, Any

from urban_processing.errors import DependencyError
from urban_processing.metrics.distributions import DISTRIBUTIONS
from urban_processing.metrics.registry import METRICS
from urban_processing.report.html.charts import line_of
from urban_processing.report.html.distribution_views import distribution_views
from urban_processing.report.html.labels import label
from urban_processing.report.html.maps import map_sheet
from urban_processing.report.html.metric_rows import metric_groups, one_sided, part_tables
from urban_processing.report.html.model import Report
from urban_processing.report.html.records import check_lines, issue_list, step_lines
from urban_processing.report.html.sentences import BETTER, FIGURES, first_figures
from urban_processing.report.html.summary import verdict
from urban_processing.report.html.text import isolate, listed, shown
from urban_processing.version import __version__

if TYPE_CHECKING:
    from jinja2 import Template

TEMPLATE, STYLE = "page.html.jinja", "page.css"


def report_html(report: Report) -> str:
    """Return a report as one HTML page without scripts that loads nothing.

    Parameters
    ----------
    report
        The report. The same report gives the same text.

    Raises
    ------
    DependencyError
        If jinja2 is not installed.
    """
    return _template().render(_context(report))


@cache
def _template() -> Template:
    try:
        from jinja2 import Environment, StrictUndefined
    except ImportError as error:
        raise DependencyError("A report needs the Python package jinja2: install it.") from error
    environment = Environment(
        autoescape=True,
        finalize=shown,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.from_string(_file(TEMPLATE))


@cache
def _file(name: str) -> str:
    """Text of a file that lies beside this module."""
    package = __package__
    return files(package).joinpath(name).read_text(encoding="utf-8")


def _context(report: Report) -> dict[str, Any]:
    names = tuple(isolate(name) for name in report.names)
    sides = list(zip(names, report.sides, strict=True))
    n = len(sides)
    figures = [dict(first_figures(side.values)) for side in report.sides]
    comparison = report.comparison
    others = [name for k, name in enumerate(names) if k != report.reference]
    # what all sides have comes first
    known = sorted(FIGURES, key=lambda f: sum(f.about not in each for each in figures))
    rows = [(f.about, [each.get(f.about, "") for each in figures]) for f in known]
    alike = [about for about, texts in rows if n > 1 and len(set(texts)) == 1 and texts[0]]
    return {
        "style": _file(STYLE),
        "title": isolate(report.heading),
        "names": names,
        "reference": report.reference,
        "others": others,
        "listed": listed(others),
        "lines": [line_of(k, n) for k in range(n)],
        "figures": [(about, texts) for about, texts in rows if any(texts) and about not in alike],
        "alike": listed([about.lower() for about in alike]) if alike else "",
        "verdict": () if comparison is None else verdict(comparison, names),
        "confidence": None if comparison is None else comparison.resampling.confidence,
        "sheet": map_sheet(report),
        "metrics": metric_groups(report),
        "one_sided": one_sided(report),
        "parts": part_tables(report),
        "distributions": distribution_views(report, names),
        "certificates": [
            (name, None if side.certificate is None else check_lines(side.certificate))
            for name, side in sides
        ],
        "issues": [issue_list(name, side.issues) for name, side in sides],
        "provenance": [
            (name, side.layers.frame.crs, step_lines(side.history)) for name, side in sides
        ],
        "terms": [(label(m.name), m, BETTER[m.better]) for m in METRICS],
        "distribution_terms": DISTRIBUTIONS,
        "version": __version__,
    }
