"""What the rows of layers say of parcels and streets besides their shape.

A row may have been drawn or changed by hand: what it does not say, or says so that it means
nothing, is left to defaults.
"""

from __future__ import annotations

import dataclasses
import math
import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.hashing import child, mix
from urban_processing.layout import NOT_FIXED, PARCEL_USE, Stage
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.quotas import divided
from urban_processing.schema import PARCELS, STREETS
from urban_processing.site import AREA_ROUNDING, Issue

V = TypeVar("V")
ObjectArray = npt.NDArray[np.object_]

LEVEL, USE, LOCKED, LINEAGE, STAGE, QUOTA = PARCEL_COLUMNS = tuple(
    PARCELS.column(name).name
    for name in ("level", "land_use", "locked", "lineage", "stage", "quota")
)
"""Columns of parcels that no geometry tells."""

STREET_LEVEL, FIXED_ID = STREET_COLUMNS = tuple(
    STREETS.column(name).name for name in ("level", "fixed_id")
)
"""Columns of streets that no geometry tells."""

VALUES_IGNORED = "values_ignored"
"""Code of the issue that says which values of a column mean nothing."""

_LARGEST, _HIGHEST_LEVEL = 2**31, 1000
_HALVES = 2
_TRUE, _FALSE = ("true", "t", "yes", "y", "1"), ("false", "f", "no", "n", "0")
_PLACES = 1000.0
"""Places are told apart to so many parts of a metre, so that rounding decides nothing."""


@dataclass(frozen=True, eq=False)
class Said(Generic[V]):
    """Values of a column; None where a row says nothing, or what means nothing."""

    values: tuple[V | None, ...]

    def filled(self, default: V) -> list[V]:
        """Values with a default in the gaps."""
        return [default if value is None else value for value in self.values]

    def taken(self, rows: IntArray) -> Said[V]:
        """Values of some rows."""
        return Said(tuple(self.values[row] for row in rows.tolist()))

    @property
    def gaps(self) -> BoolArray:
        """(n,) rows that say nothing."""
        return np.array([value is None for value in self.values], dtype=bool)


@dataclass(frozen=True, eq=False)
class ParcelRows:
    """What n rows say of parcels.

    Parameters
    ----------
    row
        (n,) number of the row in its layer: a row in several pieces comes several times.
    level, use, locked, lineage, stage, quota
        Values, as in `Layout`.
    issues
        Which values mean nothing.
    """

    row: IntArray
    level: Said[int]
    use: Said[str]
    locked: Said[bool]
    lineage: Said[int]
    stage: Said[Stage]
    quota: Said[int]
    issues: tuple[Issue, ...] = ()

    def taken(self, rows: IntArray) -> ParcelRows:
        """Some of the rows."""
        return ParcelRows(
            self.row[rows],
            self.level.taken(rows),
            self.use.taken(rows),
            self.locked.taken(rows),
            self.lineage.taken(rows),
            self.stage.taken(rows),
            self.quota.taken(rows),
            self.issues,
        )

    @property
    def is_whole(self) -> bool:
        """Whether all rows say all that must be said of parcels, and nothing without meaning."""
        needed = (self.level, self.use, self.locked, self.lineage, self.stage)
        return not self.issues and not any(said.gaps.any() for said in needed)


@dataclass(frozen=True, eq=False)
class StreetRows:
    """What m rows say of streets.

    Parameters
    ----------
    level
        (m,) level at which each was laid out; -1 where nothing is said.
    fixed
        (m,) entry of `Layout.fixed_streets`; `NOT_FIXED` for all other streets.
    issues
        Which values mean nothing.
    """

    level: IntArray
    fixed: IntArray
    issues: tuple[Issue, ...] = ()

    def taken(self, rows: IntArray) -> StreetRows:
        """Some of the rows."""
        return StreetRows(self.level[rows], self.fixed[rows], self.issues)


def parcel_rows(columns: Mapping[str, npt.NDArray[Any]], n: int) -> ParcelRows:
    """Read what the rows of a layer of parcels say.

    Parameters
    ----------
    columns
        (n,) values of those of `PARCEL_COLUMNS` that the layer has, by name.
    n
        Number of rows.
    """
    issues: list[Issue] = []

    def said(name: str, meaning: Callable[[Any], V]) -> Said[V]:
        return _said(columns.get(name), n, meaning, what=f"Column {name} of the parcels", to=issues)

    return ParcelRows(
        np.arange(n),
        said(LEVEL, _level),
        said(USE, str),
        said(LOCKED, _truth),
        said(LINEAGE, _lineage),
        said(STAGE, _stage),
        said(QUOTA, _whole),
        tuple(issues),
    )


def kept_for_uses(rows: ParcelRows) -> ParcelRows:
    """The rows, those with a use of their own locked for it, as the parcels of layouts are."""
    plain = (None, PARCEL_USE)
    pairs = zip(rows.locked.values, rows.use.values, strict=True)
    locked = Said(tuple(is_locked if use in plain else True for is_locked, use in pairs))
    return dataclasses.replace(rows, locked=locked)


def street_rows(columns: Mapping[str, npt.NDArray[Any]], n: int, *, n_given: int = 0) -> StreetRows:
    """Read what the rows of a layer of streets say.

    Parameters
    ----------
    columns
        (n,) values of those of `STREET_COLUMNS` that the layer has, by name.
    n
        Number of rows.
    n_given
        Number of streets that were given: numbers above it mean nothing.
    """
    issues: list[Issue] = []

    def numbers(name: str, default: int, meaning: Callable[[Any], int]) -> IntArray:
        what = f"Column {name} of the streets"
        values = _said(columns.get(name), n, meaning, what=what, to=issues)
        return np.array(values.filled(default), dtype=np.int64)

    level, fixed = numbers(STREET_LEVEL, -1, _level), numbers(FIXED_ID, 0, _whole) - 1
    return StreetRows(level, np.where(fixed < n_given, fixed, NOT_FIXED), tuple(issues))


@dataclass(frozen=True, eq=False)
class FaceValues:
    """Attributes of F faces as in `Layout`, and which of them are pieces of one row."""

    face_level: IntArray
    face_lineage: npt.NDArray[np.uint64]
    face_locked: BoolArray
    face_use: IntArray
    face_stage: npt.NDArray[np.int8]
    face_quota: IntArray
    land_uses: tuple[str, ...]
    in_pieces: BoolArray

    def fields(self) -> dict[str, Any]:
        """The attributes by the names of the fields of `Layout`."""
        return {name: value for name, value in vars(self).items() if name != "in_pieces"}


def values_of_faces(
    rows: ParcelRows,
    polygons: ObjectArray,
    *,
    min_area: float,
    origin: tuple[float, float] = (0.0, 0.0),
    land_uses: Sequence[str] = (PARCEL_USE,),
) -> FaceValues:
    """Give faces the attributes of their rows.

    Faces of one lineage, or of one row that has none, are pieces of one parcel that was split:
    their lineages are made of the one that they have in common, with one level of cuts more, and
    they share its quota. A parcel that says nothing has level 0, the use `PARCEL_USE` and a
    lineage made of its place, is not locked, and goes on being cut where it is at least twice the
    smallest area; where others are to become a number of parcels, it is to become as many as
    fall to its area.

    Parameters
    ----------
    rows
        What the row of each face says.
    polygons
        (F,) the faces, in local metres.
    min_area
        The smallest parcel allowed, m².
    origin
        Of the local coordinates on the map.
    land_uses
        Names of uses that keep their numbers; others follow.
    """
    family, known = _families(rows)
    in_pieces = np.bincount(family)[family] > 1
    area = shapely.area(polygons)
    centre = shapely.get_coordinates(shapely.centroid(polygons)).reshape(-1, 2)
    where = np.column_stack([centre + np.asarray(origin), area])
    place = np.round(where * _PLACES).astype(np.int64)
    locked = np.array(rows.locked.filled(False), dtype=bool)
    level = np.array(rows.level.filled(0), dtype=np.int64)
    large = area >= 2.0 * min_area * (1.0 - AREA_ROUNDING)
    stage = np.array(rows.stage.filled(Stage.OPEN), dtype=np.int8)
    names = rows.use.filled(PARCEL_USE)
    uses = [*land_uses, *sorted(set(names) - set(land_uses))]
    return FaceValues(
        face_level=level + (in_pieces & known),
        face_lineage=_lineages(rows, family, place),
        face_locked=locked,
        face_use=np.array([uses.index(name) for name in names], dtype=np.int64),
        face_stage=np.where(rows.stage.gaps & ~large, np.int8(Stage.DONE), stage),
        face_quota=_quotas(rows, family, area, drawn=~known & ~locked),
        land_uses=tuple(uses),
        in_pieces=in_pieces,
    )


def _families(rows: ParcelRows) -> tuple[IntArray, BoolArray]:
    """(F,) parcel that each face is a piece of; (F,) whether its lineage is known."""
    known = ~rows.lineage.gaps
    keys = [
        (0, row) if lineage is None else (1, lineage)
        for lineage, row in zip(rows.lineage.values, rows.row.tolist(), strict=True)
    ]
    number = {key: i for i, key in enumerate(dict.fromkeys(keys))}
    return np.array([number[key] for key in keys], dtype=np.int64), known


def _lineages(rows: ParcelRows, family: IntArray, place: IntArray) -> npt.NDArray[np.uint64]:
    """(F,) lineages, each there once, whatever the order of rows.

    Two pieces are the halves of a cut; more have ranks that no half has.
    """
    out: list[int | None] = list(rows.lineage.values)
    pieces = np.bincount(family)[family].tolist()
    taken = {v for v, n in zip(out, pieces, strict=True) if n == 1 and v is not None}
    for face in np.lexsort(place.T[::-1]).tolist():
        parent = rows.lineage.values[face]
        if parent is not None and pieces[face] == 1:
            continue
        if parent is None:
            x, y = (int(v) % 2**64 for v in place[face, :2])
            parent, rank = mix(x) ^ y, 0
        else:
            rank = 0 if pieces[face] == _HALVES else _HALVES
        while (lineage := child(parent, rank)) in taken:
            rank += 1
        taken.add(lineage)
        out[face] = lineage
    return np.array(out, dtype=np.uint64)


def _quotas(rows: ParcelRows, family: IntArray, area: FloatArray, *, drawn: BoolArray) -> IntArray:
    """(F,) quotas: pieces that say the same share it, each row that says another has its own."""
    said = np.array(rows.quota.filled(0), dtype=np.int64)
    pairs, pair = np.unique(np.column_stack([family, said]), axis=0, return_inverse=True)
    quota = divided(pairs[:, 1], pair.ravel(), area)
    fresh, some = drawn & rows.quota.gaps, quota > 0
    if some.any():
        fair = np.round(area * (quota[some].sum() / area[some].sum()))
        quota[fresh] = np.maximum(fair[fresh], 1).astype(np.int64)
    return quota


def _said(
    values: npt.NDArray[Any] | None,
    n: int,
    meaning: Callable[[Any], V],
    *,
    what: str,
    to: list[Issue],
) -> Said[V]:
    """Read a column; add to the issues what of it means nothing."""
    found: list[V | None] = [None] * n
    strange = []
    for i, value in enumerate([] if values is None else values.tolist()):
        value = value.strip() if isinstance(value, str) else value
        if _is_missing(value):
            continue
        try:
            found[i] = meaning(value)
        except (TypeError, ValueError, OverflowError):
            strange.append(value)
    if strange:
        rows = "1 row" if len(strange) == 1 else f"{len(strange):,} rows"
        message = f"{what}: {strange[0]!r} means nothing; {rows} took the default."
        to.append(Issue(VALUES_IGNORED, message, value=float(len(strange))))
    return Said(tuple(found))


def _is_missing(value: Any) -> bool:
    return value is None or value == "" or (isinstance(value, float) and math.isnan(value))


def _whole(value: Any) -> int:
    """A number of things: whole, not negative."""
    if isinstance(value, bool):
        raise ValueError("neither yes nor no is a number")
    number = float(value)
    if not 0 <= number < _LARGEST or number != math.floor(number):
        raise ValueError("no number of things")
    return int(number)


def _level(value: Any) -> int:
    level = _whole(value)
    if level > _HIGHEST_LEVEL:
        raise ValueError("no level")
    return level


def _truth(value: Any) -> bool:
    text = str(value).lower().removesuffix(".0")
    if text not in _TRUE + _FALSE:
        raise ValueError("neither yes nor no")
    return text in _TRUE


def _lineage(value: Any) -> int:
    if not re.fullmatch(r"[0-9a-fA-F]{1,16}", str(value)):
        raise ValueError("no hexadecimal number of 64 bits")
    return int(str(value), 16)


def _stage(value: Any) -> Stage:
    try:
        return Stage[str(value).upper()]
    except KeyError:
        raise ValueError("no stage") from None
