"""From parameters, and columns that override them, to the rules of each block."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, fields
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.params.subdivide import (
    MAX_OVER_MIN,
    SNAP_SHARE,
    WIDTH_SHARES,
    CornerLots,
    Patio,
    Strategy,
    SubdivideParams,
    per_block_parameters,
)
from urban_processing.parcelling.ground import Rules


@dataclass(frozen=True, eq=False)
class BlockRules:
    """Rules of B blocks.

    Parameters
    ----------
    rules
        Bounds and shape of the parcels.
    strategy, patio
        (B,) `Strategy` of each block, and of its inside where rows leave one; for `Patio.OPEN`
        the inside stays whole.
    """

    rules: Rules
    strategy: npt.NDArray[np.object_]
    patio: npt.NDArray[np.object_]

    def __len__(self) -> int:
        """Return the number of blocks."""
        return len(self.strategy)

    def of(self, rows: IntArray) -> BlockRules:
        """Return the rules of some blocks."""
        return BlockRules(self.rules.of(rows), self.strategy[rows], self.patio[rows])


def rule_values(wanted: BlockRules) -> dict[str, npt.NDArray[np.object_]]:
    """Return rules as values of the parameters that columns may override; None for no offset.

    Given as columns they lead to the same rules.
    """
    rules = wanted.rules
    known: dict[str, list[Any]] = {f.name: getattr(rules, f.name).tolist() for f in fields(rules)}
    known["strategy"] = [Strategy(v).value for v in wanted.strategy.tolist()]
    known["patio"] = [Patio(v).value for v in wanted.patio.tolist()]
    known["offset"] = [None if math.isinf(v) else v for v in known["offset"]]
    lots = {True: CornerLots.STREET_LENGTH.value, False: CornerLots.STREET_WIDTH.value}
    known["corner_lots"] = [lots[v] for v in known["by_length"]]
    return {name: _objects(known[name]) for name in per_block_parameters()}


def _objects(values: list[Any]) -> npt.NDArray[np.object_]:
    out = np.empty(len(values), dtype=object)
    out[:] = values
    return out


def resolve_rules(
    params: SubdivideParams, n: int, columns: Mapping[str, npt.NDArray[Any]] | None = None
) -> BlockRules:
    """Return the rules of `n` blocks.

    Parameters
    ----------
    params
        What holds where no column says otherwise.
    n
        Number of blocks.
    columns
        (n,) values that override parameters of the same name, block by block, already checked;
        None or NaN where the parameter holds.
    """
    known = {} if columns is None else columns
    values = {name: _values(params, name, n, known) for name in per_block_parameters()}
    least = np.asarray(values["min_area"], dtype=np.float64)
    side = np.sqrt(least)
    max_area = _or(values["max_area"], MAX_OVER_MIN * least)
    # a bound that was given alone moves the default of the other one along
    low, high = WIDTH_SHARES
    least_width = _or(values["min_width"], np.zeros(n))
    max_width = _or(values["max_width"], np.maximum(high * side, least_width))
    min_width = _or(values["min_width"], np.minimum(low * side, max_width))
    max_width = np.maximum(max_width, min_width)
    strategy = values["strategy"]
    offset = _or(values["offset"], np.full(n, np.inf))
    hybrid = strategy == Strategy.HYBRID
    mean_depth = (least + max_area) / (min_width + max_width)
    offset = np.where(hybrid & np.isinf(offset), mean_depth, offset)
    patio = values["patio"].copy()
    patio[hybrid & (patio == Patio.OPEN)] = Patio.OBB
    snap = SNAP_SHARE * side
    if params.snap_distance is not None:
        snap = np.full(n, params.snap_distance)
    rules = Rules(
        min_area=least,
        max_area=max_area,
        min_width=min_width,
        max_width=max_width,
        irregularity=np.asarray(values["irregularity"], dtype=np.float64),
        street_access=np.asarray(values["street_access"], dtype=np.float64),
        offset=offset,
        by_length=values["corner_lots"] == CornerLots.STREET_LENGTH,
        snap=snap,
        corner=np.full(n, params.corner_angle),
    )
    return BlockRules(rules, strategy, patio)


def _values(
    params: SubdivideParams, name: str, n: int, columns: Mapping[str, npt.NDArray[Any]]
) -> npt.NDArray[np.object_]:
    """(n,) values of a parameter: those of its column where it has one."""
    general = getattr(params, name)
    out = np.full(n, general, dtype=object)
    if name in columns:
        given = np.array([v is not None and v == v for v in columns[name].tolist()], dtype=bool)
        out[given] = columns[name][given]
    return out


def _or(values: npt.NDArray[np.object_], default: FloatArray) -> FloatArray:
    """(n,) numbers, the default where there is none."""
    missing = np.array([value is None for value in values], dtype=bool)
    return np.where(missing, default, np.where(missing, 0.0, values).astype(np.float64))
