"""Columns of a layer of blocks that set parameters block by block, checked."""

from __future__ import annotations

import enum
import math
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.intake.features import Features
from urban_processing.intake.given import is_blank
from urban_processing.intake.street_lines import named_rows
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.params.base import ParamField
from urban_processing.params.subdivide import SubdivideParams

ObjectArray = npt.NDArray[np.object_]

BLOCK_ID = "block_id"

SHAPEFILE_NAME = 10
"""Letters that the names of columns in a shapefile have at most."""

BOUNDS = (("min_area", "max_area"), ("min_width", "max_width"))
"""Pairs of which the first must not be above the second."""


def block_columns() -> tuple[str, ...]:
    """Return the names of the attributes of blocks that are looked for."""
    names = [field.name for field in _fields()]
    return (BLOCK_ID, *names, *(n[:SHAPEFILE_NAME] for n in names if n[SHAPEFILE_NAME:]))


def block_values(
    features: Features[Any], rows: IntArray, params: SubdivideParams
) -> tuple[dict[str, ObjectArray], list[str]]:
    """Return the parameters that the columns set, row by row, and what is wrong with them.

    None stands where a cell is empty; NaN in a column of numbers is no empty cell but a mistake.
    Names that a shapefile has cut short are known.

    Parameters
    ----------
    features
        The layer.
    rows
        Rows that are blocks.
    params
        What holds where a cell is empty.
    """
    called = _Rows(features)
    problems: list[str] = []
    out: dict[str, ObjectArray] = {}
    for field in _fields():
        short = field.name[:SHAPEFILE_NAME]
        values = features.columns.get(field.name, features.columns.get(short))
        if values is None:
            continue
        read = _texts if issubclass(field.kind, enum.Enum) else _numbers
        out[field.name] = read(field, values, rows, called, problems)
    for low, high in BOUNDS:
        if low in out or high in out:
            _check_bounds(out, (low, high), params, rows, called, problems)
    return out, problems


def _fields() -> tuple[ParamField, ...]:
    return tuple(field for field in SubdivideParams.fields() if field.param.per_feature)


class _Rows:
    """How rows are called in sentences: by their number, and that of their block."""

    def __init__(self, features: Features[Any]) -> None:
        self.ids = features.columns.get(BLOCK_ID)
        self.name = features.name

    def __call__(self, rows: list[int]) -> str:
        said = f"row{'s' if len(rows) > 1 else ''} {named_rows(rows)} of {self.name}"
        if self.ids is None:
            return said
        ids = ", ".join(str(self.ids[row]) for row in rows[:3])
        return f"{said} (block {ids}{', …' if len(rows) > 3 else ''})"


def _texts(
    field: ParamField,
    values: npt.NDArray[Any],
    rows: IntArray,
    called: _Rows,
    problems: list[str],
) -> ObjectArray:
    """Choices of a parameter; None for empty cells."""
    out = np.full(len(values), None, dtype=object)
    wrong = []
    for row in rows.tolist():
        if is_blank(values[row]):
            continue
        try:
            out[row] = field.kind(values[row])
        except ValueError:
            wrong.append(row)
    if wrong:
        choices = ", ".join(str(member.value) for member in field.kind)  # type: ignore[attr-defined]
        problems.append(
            f"Column {field.name} must be one of {choices}: {values[wrong[0]]!r} in "
            f"{called(wrong)}."
        )
    return out


def _numbers(
    field: ParamField,
    values: npt.NDArray[Any],
    rows: IntArray,
    called: _Rows,
    problems: list[str],
) -> ObjectArray:
    """Numbers of a parameter; None for empty cells.

    A column of a parameter that may be left open is no column where all of it is NaN, as frames
    have it of a layer with empty cells; NaN beside numbers is a mistake.
    """
    out = np.full(len(values), None, dtype=object)
    unit = f" {field.param.unit}" if field.param.unit else ""
    wrong: dict[str, list[int]] = {}
    if field.optional and all(is_blank(values[row]) for row in rows.tolist()):
        return out
    for row in rows.tolist():
        value = values[row]
        if value is None:
            continue
        reason, number = _number(value), math.nan
        if not reason:
            number = float(value)
            reason = next((said for said, kept in _limits(field, unit) if not kept(number)), "")
        if reason:
            wrong.setdefault(reason, []).append(row)
        else:
            out[row] = number
    problems += [
        f"Column {field.name} must be {reason}: {_shown(values[bad[0]])} in {called(bad)}."
        for reason, bad in wrong.items()
    ]
    return out


def _shown(value: Any) -> str:
    """A value as a reader sees it in the table; text in quotes."""
    return repr(value) if isinstance(value, str) else str(value)


def _number(value: Any) -> str:
    """What a value must be but is not, if it is no finite number."""
    if isinstance(value, str | bool | np.bool_) or not isinstance(value, int | float | np.number):
        return "a number"
    return "" if math.isfinite(value) else "a finite number, or an empty cell (None)"


def _limits(field: ParamField, unit: str) -> list[tuple[str, Callable[[float], bool]]]:
    param = field.param
    above, least, most = param.above, param.minimum, param.maximum
    out: list[tuple[str, Callable[[float], bool]]] = []
    if above is not None:
        out.append((f"above {above:g}{unit}", lambda v: v > above))
    if least is not None:
        out.append((f"at least {least:g}{unit}", lambda v: v >= least))
    if most is not None:
        out.append((f"at most {most:g}{unit}", lambda v: v <= most))
    return out


def _check_bounds(
    columns: Mapping[str, ObjectArray],
    names: tuple[str, str],
    params: SubdivideParams,
    rows: IntArray,
    called: _Rows,
    problems: list[str],
) -> None:
    low, high = (_effective(columns.get(name), getattr(params, name), rows) for name in names)
    bad = low > high
    if bad.any():
        k = int(np.flatnonzero(bad)[0])
        problems.append(
            f"{names[0]} must not be above {names[1]}: {low[k]:g} and {high[k]:g} in "
            f"{called(rows[bad].tolist())}."
        )


def _effective(values: ObjectArray | None, general: float | None, rows: IntArray) -> FloatArray:
    """(n,) numbers that hold, NaN where neither a cell nor the parameter says one."""
    default = math.nan if general is None else general
    if values is None:
        return np.full(len(rows), default)
    return np.array([default if v is None else v for v in values[rows]], dtype=np.float64)
