"""Layers as plain tables: named columns of the schema and a geometry."""

from __future__ import annotations

import dataclasses
import json
import math
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.provenance import Step, timeless
from urban_processing.schema import ISSUES, PROVENANCE, Column, ColumnType, Layer
from urban_processing.site import FloatArray, Frame, Issue


@dataclass(frozen=True, eq=False)
class Table:
    """Columns of one length, in the order of the schema, and a geometry in map coordinates.

    Missing values are NaN in columns of numbers (a column of whole numbers, or of yes and no,
    that may be missing is float64), ``None`` in geometries.
    """

    columns: dict[str, npt.NDArray[Any]]
    geometry: npt.NDArray[np.object_] | None = None

    def __post_init__(self) -> None:
        """Check that all columns have one length."""
        lengths = {len(c) for c in self.columns.values()}
        if self.geometry is not None:
            lengths.add(len(self.geometry))
        if len(lengths) != 1:
            raise ValueError(f"The columns of a table have different lengths: {sorted(lengths)}.")

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(next(iter(self.columns.values())))

    @property
    def in_pieces(self) -> bool:
        """Whether a geometry consists of several pieces."""
        return bool((shapely.get_num_geometries(self.shapes) > 1).any())

    @property
    def shapes(self) -> npt.NDArray[np.object_]:
        """The geometries; none where the layer has none."""
        return np.empty(0, dtype=object) if self.geometry is None else self.geometry

    def __getitem__(self, column: str) -> npt.NDArray[Any]:
        """Return the values of a column."""
        return self.columns[column]


def issue_table(issues: Sequence[Issue], frame: Frame) -> Table:
    """Return what could not be done, and what the user should know."""
    return make_table(
        ISSUES,
        {
            "part": numbers([i.part for i in issues]),
            "parcel_id": numbers([i.parcel_id for i in issues]),
            "code": [i.code for i in issues],
            "message": [i.message for i in issues],
            "value": numbers([i.value for i in issues]),
            "limit": numbers([i.limit for i in issues]),
        },
        to_map([i.geometry for i in issues], frame),
    )


def issues_in_words(issues: Sequence[Issue]) -> str:
    """Return how many issues there are of each kind: ``2 parcel_large, 1 parcel_wide``."""
    counts = Counter(issue.code for issue in issues)
    return ", ".join(f"{n:,} {code}" for code, n in sorted(counts.items()))


def provenance_table(steps: Sequence[Step]) -> Table:
    """Return the steps that made something, oldest first."""
    return make_table(
        PROVENANCE,
        {
            "step": np.arange(1, len(steps) + 1),
            "algorithm": [s.algorithm for s in steps],
            "parameters": [json.dumps(dict(s.parameters), ensure_ascii=False) for s in steps],
            "seed": [s.seed for s in steps],
            "version": [s.version for s in steps],
            "input_sha256": [s.input_sha256 for s in steps],
            "seconds": [s.seconds for s in steps],
            "results": [json.dumps(dict(s.results)) for s in steps],
            "part": np.full(len(steps), np.nan),
        },
    )


def make_table(
    layer: Layer, values: Mapping[str, Any], geometry: npt.NDArray[np.object_] | None = None
) -> Table:
    """Put the values of a layer into the order and the types of the schema."""
    columns: dict[str, npt.NDArray[Any]] = {}
    for column in layer.columns:
        given = values[column.name]
        if column.dtype is ColumnType.TEXT:
            columns[column.name] = objects(np.asarray(given, dtype=object).tolist())
        elif column.dtype in (ColumnType.INTEGER, ColumnType.BOOLEAN) and column.nullable:
            columns[column.name] = np.asarray(given, dtype=np.float64)
        else:
            columns[column.name] = np.asarray(given, dtype=column.dtype.value)
    return Table(columns, geometry)


def with_columns(
    layer: Layer, values: Mapping[str, npt.NDArray[Any]]
) -> tuple[Layer, dict[str, npt.NDArray[Any]]]:
    """Return a layer with more columns, and their values in the types that it declares."""
    columns, typed = [], {}
    for name, column in values.items():
        kind, typed[name] = _typed(column)
        columns.append(Column(name, kind, "", "As given.", name, nullable=True))
    return dataclasses.replace(layer, columns=(*layer.columns, *columns)), typed


def _typed(values: npt.NDArray[Any]) -> tuple[ColumnType, npt.NDArray[Any]]:
    """Type of some values, any of which may be missing, and the values in it."""
    plain = values.tolist() if values.dtype.kind != "M" else np.datetime_as_string(values).tolist()
    missing = [value is None or value != value or value == "NaT" for value in plain]
    there = [value for value, gap in zip(plain, missing, strict=True) if not gap]
    truths = bool(there) and all(isinstance(value, bool | np.bool_) for value in there)
    if truths or (there and all(isinstance(v, int | float | np.number) for v in there)):
        numbers = np.array(
            [np.nan if gap else float(v) for v, gap in zip(plain, missing, strict=True)]
        )
        if truths:
            return ColumnType.BOOLEAN, numbers
        whole = all(isinstance(value, int | np.integer) for value in there)
        exact = whole and (np.abs(numbers[~np.array(missing)]) < 2.0**53).all()
        return (ColumnType.INTEGER if exact else ColumnType.REAL), numbers
    texts = [None if gap else _text(v) for v, gap in zip(plain, missing, strict=True)]
    return ColumnType.TEXT, objects(texts)


def _text(value: Any) -> str:
    return value.isoformat() if hasattr(value, "isoformat") else str(value)


def numbers(values: Sequence[float | None]) -> FloatArray:
    """(n,) numbers, NaN where one is missing."""
    return np.array([math.nan if v is None else v for v in values], dtype=np.float64)


def objects(values: Any) -> npt.NDArray[np.object_]:
    """(n,) any values as an array of objects."""
    out = np.empty(len(values), dtype=object)
    out[:] = list(values)
    return out


def to_map(geometries: Any, frame: Frame) -> npt.NDArray[np.object_]:
    """(n,) local geometries in map coordinates; ``None`` stays."""
    origin = np.asarray(frame.origin)
    return np.asarray(shapely.transform(objects(geometries), lambda xy: xy + origin))


@dataclass(frozen=True, eq=False)
class LayerSet:
    """What an algorithm made that is no layout: layers, and what there is to say of them.

    Parameters
    ----------
    kind
        What it is, in a word or two: ``blocks``, ``subdivision``.
    tables
        Rows of each layer, in the order in which a file lists them; provenance follows by itself.
    frame
        CRS of the geometries, and the origin of the local coordinates they were made in.
    history
        Steps that made it, oldest first.
    summary
        The few figures that a run ends with: names, and values as text.
    """

    kind: str
    tables: Mapping[Layer, Table]
    frame: Frame
    history: tuple[Step, ...] = ()
    summary: tuple[tuple[str, str], ...] = ()

    def layers(self, *, record_seconds: bool = False) -> dict[Layer, Table]:
        """Return all layers, as files hold them; with the time that steps took if asked for."""
        history = self.history if record_seconds else timeless(self.history)
        return {**self.tables, PROVENANCE: provenance_table(history)}

    def table(self, name: str) -> Table:
        """Return the rows of the layer of that name; `KeyError` if there is no such layer."""
        for layer, table in self.tables.items():
            if layer.name == name:
                return table
        raise KeyError(f"There is no layer {name}; there are {', '.join(self.names)}.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the layers."""
        return tuple(layer.name for layer in self.tables)
