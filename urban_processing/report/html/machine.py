"""The report for machines: JSON and CSV."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from urban_processing.metrics.certificate import Certificate
from urban_processing.metrics.comparison import DistributionDistance, MetricRow, unique_names
from urban_processing.metrics.comparison_notes import notes
from urban_processing.metrics.distributions import Sample
from urban_processing.metrics.histograms import Histogram
from urban_processing.provenance import Step
from urban_processing.report.html.labels import group, label
from urban_processing.report.html.metric_rows import metric_rows
from urban_processing.report.html.model import Report, ReportSide
from urban_processing.report.html.sentences import quantile
from urban_processing.report.html.text import clean
from urban_processing.tables import Table
from urban_processing.version import __version__

FORMAT = 1
"""Number of the way in which reports are written as JSON; it rises if a key changes its meaning."""

_FORMULAS = "=+-@\t\r"
"""What programs for tables take for the beginning of a formula."""


def report_json(report: Report) -> dict[str, Any]:
    """Return a report as plain values; what is not a finite number is None.

    Parameters
    ----------
    report
        The report.

    Returns
    -------
    dict
        Keys:

        ``format``, ``software``, ``version``, ``title``
            What made it, and its heading.
        ``reference``
            Name of the side that the others are held against; None of a single side.
        ``sides``
            For each side ``name``, ``crs``, ``certificate`` (None, or ``holds`` and ``checks``
            with ``name``, ``holds``, ``value``, ``limit``, ``message``, ``offenders``), ``issues``
            (rows of that layer without geometry), ``parts`` (``part`` and its ``metrics`` by name,
            where there are several) and ``provenance`` (``algorithm``, ``version``, ``seed``,
            ``input_sha256``, ``parameters``, ``results``).
        ``metrics``
            For each metric that a side has ``name``, ``label``, ``group``, ``unit``,
            ``definition``, ``source``, ``better`` (``low``, ``high`` or nothing), ``values`` and
            ``differences`` by name of the side, ``better_side`` (a name or None).
        ``distributions``
            For each distribution that a side has ``name``, ``label``, ``unit``, ``definition``,
            ``source``, ``edges`` of its bins, ``logarithmic``, and ``sides`` by name: ``n``,
            ``mean``, ``median``, ``p10``, ``p90`` and ``shares``.
        ``distances``
            For each distribution and each side but the reference what `DistributionDistance`
            has, with the name of the distribution.
        ``notes``
            What is to be known first: ``about`` (``lands`` or ``density``) and ``message``.
    """
    names = report.names
    return {
        "format": FORMAT,
        "software": "urban_processing",
        "version": __version__,
        "title": clean(report.heading),
        "reference": None if report.reference is None else clean(names[report.reference]),
        "sides": [_side(n, side) for n, side in zip(names, report.sides, strict=True)],
        "metrics": [_metric(row, report) for row in metric_rows(report)],
        "distributions": [_distribution(h, report) for h in report.histograms()],
        "distances": []
        if report.comparison is None
        else [_distance(d) for d in report.comparison.distances],
        "notes": []
        if report.comparison is None
        else [{"about": a, "message": clean(text)} for a, text in notes(report.comparison)],
    }


def report_csv(report: Report) -> str:
    """Return the metrics as CSV: a row for each, a column for each side.

    Columns: ``metric``, ``label``, a column by the name of each side, ``unit``, ``better``
    (``low``, ``high`` or nothing), with several sides ``better_side`` (the name of one, or
    nothing), and ``definition``. Values have all their digits, and are empty where they are not
    defined.
    """
    several = report.comparison is not None
    ends = ["unit", "better", *(["better_side"] if several else []), "definition"]
    heads = unique_names(["metric", "label", *ends, *report.names])
    names = [_cell(clean(name)) for name in heads[2 + len(ends) :]]
    buffer = io.StringIO(newline="")
    writer = csv.writer(buffer, lineterminator="\n")
    writer.writerow(["metric", "label", *names, *ends])
    for row in metric_rows(report):
        values = ["" if not math.isfinite(v) else repr(v) for v in row.values]
        best = "" if row.better is None else names[row.better]
        writer.writerow(
            [
                row.name,
                label(row.name),
                *values,
                row.unit,
                row.spec.better.value,
                *([best] if several else []),
                row.spec.definition,
            ]
        )
    return buffer.getvalue()


def _cell(text: str) -> str:
    """Text that no program takes for a formula, or its carriage returns for the end of a row."""
    safe = f"'{text}" if text[:1] in _FORMULAS and text else text
    return safe.replace("\r\n", "\n").replace("\r", "\n")  # these csv puts into quotes


def _side(name: str, side: ReportSide) -> dict[str, Any]:
    return {
        "name": clean(name),
        "crs": clean(side.layers.frame.crs),
        "certificate": None if side.certificate is None else _certificate(side.certificate),
        "issues": _issues(side.issues),
        "parts": [{"part": part, "metrics": plain(m)} for part, m in side.parts().items()],
        "provenance": [_step(step) for step in side.history],
    }


def _certificate(certificate: Certificate) -> dict[str, Any]:
    checks = [
        {
            "name": check.name,
            "holds": bool(check.holds),
            "value": plain(check.value),
            "limit": plain(check.limit),
            "message": clean(check.message),
            "offenders": [int(i) for i in check.offenders],
        }
        for check in certificate.checks
    ]
    return {"holds": certificate.holds, "checks": checks}


def _issues(issues: Table | None) -> list[dict[str, Any]]:
    if issues is None:
        return []
    columns = {name: plain(values) for name, values in issues.columns.items()}
    return [dict(zip(columns, row, strict=True)) for row in zip(*columns.values(), strict=True)]


def _step(step: Step) -> dict[str, Any]:
    return {
        "algorithm": step.algorithm,
        "version": step.version,
        "seed": int(step.seed),
        "input_sha256": step.input_sha256,
        "parameters": plain(step.parameters),
        "results": plain(step.results),
    }


def _by_side(report: Report, values: Sequence[Any]) -> dict[str, Any]:
    return {clean(name): plain(value) for name, value in zip(report.names, values, strict=True)}


def _metric(row: MetricRow, report: Report) -> dict[str, Any]:
    return {
        "name": row.name,
        "label": label(row.name),
        "group": group(row.spec.name),
        "unit": row.unit,
        "definition": row.spec.definition,
        "source": row.spec.source,
        "better": row.spec.better.value,
        "values": _by_side(report, row.values),
        "differences": {} if report.comparison is None else _by_side(report, row.differences),
        "better_side": None if row.better is None else clean(report.names[row.better]),
    }


def _distribution(h: Histogram, report: Report) -> dict[str, Any]:
    spec = h.distribution
    samples = [side.sample(spec) for side in report.sides]
    sides = [
        {**_figures(sample, circular=bool(spec.circular)), "shares": shares}
        for sample, shares in zip(samples, h.shares, strict=True)
    ]
    return {
        "name": spec.name,
        "label": spec.label,
        "unit": spec.unit,
        "definition": spec.definition,
        "source": spec.source,
        "edges": plain(h.edges),
        "logarithmic": bool(h.logarithmic),
        "sides": _by_side(report, sides),
    }


def _figures(sample: Sample, *, circular: bool) -> dict[str, Any]:
    """What there is to say of values; directions have neither mean nor order."""
    figures = {
        "mean": sample.mean,
        "median": quantile(sample, 0.5),
        "p10": quantile(sample, 0.1),
        "p90": quantile(sample, 0.9),
    }
    return {"n": len(sample), **(dict.fromkeys(figures) if circular else figures)}


def _distance(d: DistributionDistance) -> dict[str, Any]:
    return {
        "distribution": d.distribution.name,
        "side": clean(d.side),
        "reference": clean(d.reference),
        "n_side": d.n_side,
        "n_reference": d.n_reference,
        "wasserstein": plain(d.wasserstein),
        "wasserstein_low": plain(d.wasserstein_low),
        "wasserstein_high": plain(d.wasserstein_high),
        "wasserstein_noise": plain(d.wasserstein_noise),
        "ks": plain(d.ks),
        "ks_low": plain(d.ks_low),
        "ks_high": plain(d.ks_high),
        "ks_noise": plain(d.ks_noise),
        "more_than_noise": bool(d.more_than_noise),
    }


def plain(value: Any) -> Any:
    """Return a value as JSON has it: numbers that are not finite are None.

    >>> plain({"a": [1.5, float("nan")], "b": (True, None)})
    {'a': [1.5, None], 'b': [True, None]}
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {clean(str(name)): plain(each) for name, each in value.items()}
    if isinstance(value, list | tuple | set | frozenset):
        return [plain(each) for each in value]
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if value is None or isinstance(value, bool | int):
        return value
    return clean(str(value))
