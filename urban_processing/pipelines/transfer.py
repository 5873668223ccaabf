"""Numbers and columns of parcels carried over from one state of a layout to the next."""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.mesh.planar import IntArray
from urban_processing.params.transfer import Inherit, TransferParams
from urban_processing.persistence import transfer as engine
from urban_processing.persistence.block_match import NONE, taken
from urban_processing.persistence.editions import Edition, Editions
from urban_processing.persistence.layers import (
    CHANGES,
    OWN,
    TRANSFERRED_PARCELS,
    Change,
)
from urban_processing.persistence.tables import changes_table, numbers_of
from urban_processing.persistence.transfer import ParcelsInBlocks, Transfer, in_blocks, labelled
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.schema import ISSUES, Layer
from urban_processing.site import Issue
from urban_processing.tables import LayerSet, Table, issue_table, make_table, to_map, with_columns
from urban_processing.version import __version__

NOTHING_IN_COMMON, MOVED = "nothing_in_common", "layout_moved"
TOLD = frozenset({NOTHING_IN_COMMON, MOVED})
"""Codes of the issues that a run ends with: they may mean that a layer is the wrong one."""

_MAX_NAMED = 5

_STILL = 1e-3
"""A layout whose scale changed by less was moved or turned, not scaled."""


def transfer(editions: Editions, params: TransferParams, progress: Progress = SILENT) -> LayerSet:
    """Carry numbers and columns over to the parcels after an edit (Vanegas 2012, section 5).

    Parameters
    ----------
    editions
        The two states.
    params
        Which columns, and who inherits them.
    progress
        Told how far the work is; may cancel it.

    Returns
    -------
    LayerSet
        The layers of `urban_processing.persistence.layers.TRANSFER`.

    Raises
    ------
    BoundaryError
        If numbers of parcels are there twice, or are no whole numbers.
    ParameterError
        If a column is asked for that is not there.
    """
    started = time.perf_counter()
    before, after = editions.before, editions.after
    old_id, issues = _numbers(before, params.id_column)
    names = _columns_to_carry(before, params)
    progress.update(0.1, "Finding the blocks")
    states = _in_blocks(before, params.block_column), _in_blocks(after, params.block_column)
    progress.update(0.4, "Matching parcels")
    made = engine.transfer(states[0], old_id, states[1])
    progress.update(0.9, "Carrying columns over")
    issues += _said(made, editions)
    columns = _carried(before, after, made, names, params)
    tables = dict([_parcels(editions, made, old_id, columns)])
    old = old_id, before.polygons
    tables[CHANGES] = changes_table(made, old, after.polygons, editions.frame)
    notes = (*editions.issues, *issues)
    if notes:
        tables[ISSUES] = issue_table(notes, editions.frame)
    step = Step(
        algorithm="transfer",
        parameters=params.as_dict(),
        seed=0,
        version=__version__,
        input_sha256=editions.input_sha256,
        seconds=time.perf_counter() - started,
        results={change.value: made.changes.count(change) for change in Change},
    )
    summary = [(change.value, f"{made.changes.count(change):,} parcels") for change in Change]
    summary += [("note", issue.message) for issue in issues if issue.code in TOLD]
    return LayerSet("transfer", tables, editions.frame, (step,), tuple(summary))


def _numbers(before: Edition, name: str) -> tuple[IntArray, list[Issue]]:
    """Return the numbers of the parcels before."""
    if name not in before.columns:
        message = f"{before.name} has no column {name}: its parcels were counted from 1."
        return np.arange(1, len(before.polygons) + 1), [Issue("numbers_missing", message)]
    values = before.columns[name].tolist()
    wrong = [v for v in values if not _is_whole(v)]
    if wrong:
        raise BoundaryError(
            f"The column {name} of {before.name} must be whole numbers; it has "
            f"{_listed(wrong)}. Choose another with id_column (--id-column): text is carried "
            "over as any other column."
        )
    numbers = np.array([int(v) for v in values], dtype=np.int64)
    twice = [number for number, count in Counter(numbers.tolist()).items() if count > 1]
    if twice:
        raise BoundaryError(
            f"Numbers of parcels must be there once; in the column {name} of {before.name} "
            f"{_listed(twice)} {'is' if len(twice) == 1 else 'are'} there several times."
        )
    return numbers, []


def _is_whole(value: Any) -> bool:
    """Whether a value is a whole number; text of digits alone is one too."""
    if isinstance(value, str):
        return value.strip().isdecimal()
    if isinstance(value, bool) or not isinstance(value, int | float | np.number):
        return False
    return bool(np.isfinite(value)) and float(value) == int(value)


def _listed(values: list[Any]) -> str:
    more = f" and {len(values) - _MAX_NAMED} more" if len(values) > _MAX_NAMED else ""
    return ", ".join("nothing" if v is None else str(v) for v in values[:_MAX_NAMED]) + more


def _columns_to_carry(before: Edition, params: TransferParams) -> list[str]:
    """Names of the columns to carry, in the order of the layer."""
    if params.columns is None:
        left_out = {*OWN, *TRANSFERRED_PARCELS.column_names, "fid", params.id_column}
        return [n for n in before.columns if n not in left_out and n != params.block_column]
    missing = [name for name in params.column_names if name not in before.columns]
    if missing:
        there = ", ".join(before.columns) or "none"
        raise ParameterError(
            [f"{before.name} has no column {name}; its columns are {there}." for name in missing]
        )
    return [name for name in params.column_names if name not in TRANSFERRED_PARCELS.column_names]


def _in_blocks(edition: Edition, column: str) -> ParcelsInBlocks:
    """Parcels in the blocks given, else in those of their column, else in those they make."""
    if edition.blocks is None and column in edition.columns:
        values = edition.columns[column]
        gap = np.array([value is None or value != value for value in values.tolist()], dtype=bool)
        if not gap.any():
            return labelled(edition.polygons, np.array([str(v) for v in values.tolist()]))
    return in_blocks(edition.polygons, edition.blocks)


def _said(made: Transfer, editions: Editions) -> list[Issue]:
    """Say how the layout moved as a whole, and if nothing was found again."""
    issues = []
    if not made.motion.is_none:
        scale, matrix = made.motion.scale, made.motion.matrix
        turn = np.degrees(np.arctan2(matrix[1, 0] - matrix[0, 1], matrix[0, 0] + matrix[1, 1]))
        size = f"scaled by {scale:.4g}" if abs(scale - 1.0) > _STILL else "not scaled"
        message = f"The layout as a whole was moved, turned by {turn:.4g}° and {size}."
        issues.append(Issue(MOVED, message, value=scale))
    if (made.source == NONE).all():
        message = (
            f"No parcel of {editions.before.name} was found again in {editions.after.name}: all "
            "numbers are new. Do the layers show the same place?"
        )
        issues.append(Issue(NOTHING_IN_COMMON, message))
    elif _are_apart(editions):
        message = (
            f"{editions.before.name} and {editions.after.name} have no land in common: what was "
            "found again lies elsewhere. Do the layers show the same place?"
        )
        issues.append(Issue(NOTHING_IN_COMMON, message))
    return issues


def _are_apart(editions: Editions) -> bool:
    """Whether the extents of both states do not meet."""
    before, after = (
        shapely.box(*shapely.total_bounds(e.polygons)) for e in (editions.before, editions.after)
    )
    return not shapely.intersects(before, after)


def _carried(
    before: Edition, after: Edition, made: Transfer, names: list[str], params: TransferParams
) -> dict[str, npt.NDArray[Any]]:
    """Columns of the parcels after: their own, and those carried over in place of them."""
    inherited = {
        Inherit.NONE: made.source,
        Inherit.PART: made.part_of,
        Inherit.NEAREST: np.where(made.part_of == NONE, made.nearest, made.part_of),
    }
    rows = inherited[params.inherit]
    declared = {*TRANSFERRED_PARCELS.column_names, "fid", params.id_column}
    columns = {name: v for name, v in after.columns.items() if name not in declared}
    for name in names:
        values = taken(before.columns[name], rows)
        own = columns.get(name)
        if own is not None and (rows == NONE).any():
            mixed = values.astype(object)
            mixed[rows == NONE] = own[rows == NONE]
            values = mixed
        columns[name] = values
    return columns


def _parcels(
    editions: Editions, made: Transfer, old_id: IntArray, columns: Mapping[str, npt.NDArray[Any]]
) -> tuple[Layer, Table]:
    layer, values = with_columns(TRANSFERRED_PARCELS, columns)
    polygons = editions.after.polygons
    order = np.argsort(made.parcel_id)
    declared = {
        "parcel_id": made.parcel_id,
        "area_m2": shapely.area(polygons),
        "change": made.changes.change[: len(polygons)],
        "old_id": numbers_of(old_id, made.part_of),
    }
    sorted_values = {name: v[order] for name, v in {**declared, **values}.items()}
    return layer, make_table(layer, sorted_values, to_map(polygons[order], editions.frame))
