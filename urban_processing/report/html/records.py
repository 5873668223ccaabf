"""Certificate, issues and provenance as a page shows them."""

from __future__ import annotations

from collections import Counter
from dataclasses import dataclass
from typing import Any

from urban_processing.metrics.certificate import Certificate, Check
from urban_processing.provenance import Step
from urban_processing.report.html.digits import counted, number
from urban_processing.report.html.sentences import PROMISES
from urban_processing.report.html.text import listed
from urban_processing.tables import Table

_RAISED = str.maketrans("-0123456789", "⁻⁰¹²³⁴⁵⁶⁷⁸⁹")

FROM_READING = frozenset(
    {
        *("osm_source", "osm_left_out", "osm_cleaned", "osm_smaller", "osm_streets", "ends_joined"),
        *("crossings_noded", "crs_changed", "layer_reprojected", "land_assumed"),
    }
)
"""Issues that tell how something was read, of which nothing is wrong."""

MOST = 50
"""Rows and numbers of parcels that are shown; of the others the page says how many there are."""


@dataclass(frozen=True)
class CheckLine:
    """One promise, and how it is kept."""

    promise: str
    holds: bool
    value: str
    limit: str
    message: str
    offenders: tuple[int, ...]
    more: int


@dataclass(frozen=True)
class IssueList:
    """The issues of one side: how many of each kind, and the first of them.

    `counts` is their number in words, where notes from reading are told apart; `wrong` of them are
    none.
    """

    side: str
    total: int
    counts: str
    wrong: int
    kinds: tuple[tuple[str, int], ...]
    rows: tuple[tuple[str, str, str, str, str, str], ...]
    more: int


@dataclass(frozen=True)
class StepLine:
    """One step of the history; parameters and results as names and texts."""

    number: int
    algorithm: str
    version: str
    seed: str
    input_sha256: str
    parameters: tuple[tuple[str, str], ...]
    results: tuple[tuple[str, str], ...]


def check_lines(certificate: Certificate) -> list[CheckLine]:
    """Return all checks, those that do not hold first."""
    checks = sorted(certificate.checks, key=lambda check: check.holds)
    return [_check_line(check) for check in checks]


def _check_line(check: Check) -> CheckLine:
    return CheckLine(
        PROMISES.get(check.name, check.name.replace("_", " ").capitalize()),
        check.holds,
        _exact(check.value),
        _exact(check.limit),
        check.message,
        check.offenders[:MOST],
        max(len(check.offenders) - MOST, 0),
    )


def _exact(value: float) -> str:
    r"""Small shares keep their power of ten.

    >>> [_exact(value).replace("\u00a0", " ") for value in (1e-8, 1.24e-16, 0.0, 1234.0)]
    ['1 × 10⁻⁸', '1.24 × 10⁻¹⁶', '0', '1,234']
    """
    if not 0.0 < abs(value) < 1e-3:
        return number(value)
    digits, power = f"{value:.2e}".split("e")
    return f"{float(digits):g}\u00a0×\u00a010{str(int(power)).translate(_RAISED)}"


def issue_list(side: str, issues: Table | None) -> IssueList:
    """Return the issues of one side, in the order in which they are listed."""
    if issues is None:
        return IssueList(side, 0, "", 0, (), (), 0)
    codes = Counter(map(str, issues["code"].tolist()))
    columns = [
        [_known(value) for value in issues[name][:MOST].tolist()]
        for name in ("code", "message", "parcel_id", "part", "value", "limit")
    ]
    rows: list[Any] = list(zip(*columns, strict=True))
    total = len(issues)
    kinds = tuple(sorted(codes.items(), key=lambda kind: (-kind[1], kind[0])))
    read = sum(n for code, n in codes.items() if code in FROM_READING)
    wrong = total - read
    counts = [counted(wrong, "issue")] if wrong else []
    counts += [counted(read, "note from reading", "notes from reading")] if read else []
    return IssueList(side, total, listed(counts), wrong, kinds, tuple(rows), max(total - MOST, 0))


def _known(value: Any) -> str:
    if value is None:
        return ""
    return number(value) if isinstance(value, float) else str(value)


def step_lines(history: tuple[Step, ...]) -> list[StepLine]:
    """Return the steps, oldest first."""
    return [
        StepLine(
            k,
            step.algorithm,
            step.version,
            str(step.seed),
            step.input_sha256,
            tuple((name, _plain(value)) for name, value in step.parameters.items()),
            tuple((name, _plain(value)) for name, value in step.results.items()),
        )
        for k, step in enumerate(history, start=1)
    ]


def _plain(value: Any) -> str:
    """A parameter in words; nothing where it is not given."""
    if value is None or value == "":
        return ""
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:,.6g}"
    return str(value)
