"""Lines of streets, from a plan or from OpenStreetMap, to `StreetLines` in local metres."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import UNKNOWN_STREET
from urban_processing.blocks.streets import StreetLines, StreetsOnLand
from urban_processing.errors import BoundaryError
from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.intake.given import (
    CLASS_COLUMNS,
    WIDTH_COLUMNS,
    is_blank,
    layers_digest,
    text,
    wrong_kind,
)
from urban_processing.intake.osm_lines import HIGHWAY, with_tags, without_other_lines
from urban_processing.intake.projection import Projection
from urban_processing.intake.sites import build_site
from urban_processing.intake.tag_values import length_of, values_of
from urban_processing.intake.working import source_crs, working_crs
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import Frame, Issue, snap_to_grid
from urban_processing.street_rules import CLASS_WIDTHS, LANE_WIDTH, OSM_KEYS, VERGES

C = TypeVar("C")

LANES = "lanes"
NAME_COLUMNS = ("name", "street_name")
OFF_GROUND = ("bridge", "tunnel", "layer")
STREET_ID, ACCESS = "street_id", "access"

STREET_COLUMNS = (
    *CLASS_COLUMNS,
    HIGHWAY,
    *WIDTH_COLUMNS,
    LANES,
    *NAME_COLUMNS,
    *OFF_GROUND,
    STREET_ID,
    ACCESS,
    *OSM_KEYS,
)
"""Attributes of centrelines that are looked for."""

TAGS = (WIDTH_COLUMNS[1], LANES, *OFF_GROUND)
"""Tags of OpenStreetMap that are looked for where a layer keeps several in one column."""

MAX_NAMED = 5
"""Rows that a sentence names before it says how many more there are."""


def build_streets(
    features: Features[C] | None,
    *,
    library: CrsLibrary[C],
    asked: C | None = None,
    land: Features[C] | None = None,
    result: str = "the blocks are",
    problems: Sequence[str] = (),
) -> StreetsOnLand:
    """Make centrelines ready for the search for blocks.

    Class, width and name are read from their columns. In data of OpenStreetMap, which has a
    column ``highway``, ``width`` is that of the carriageway: pavements and verges are added;
    the number of lanes says how wide a street is at least. Lists, as OSMnx makes them, and units
    are understood: the widest counts. Of all lines of OpenStreetMap those are left out that are no
    streets: see `urban_processing.intake.osm_lines`.

    Parameters
    ----------
    features
        Lines; None where they could not be read, which is then a problem.
    library
        What knows the CRSs.
    asked
        Projected, metric CRS to work in; the CRS of lines that have none.
    land
        Polygons that blocks are cut at.
    result
        What the result is called in sentences, with its verb.
    problems
        What is wrong already: raised with all else that is.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the input.
    """
    found = [*problems, *wrong_kind(features, "Streets", "line")]
    if features is None:
        raise BoundaryError(found)
    if land is not None:
        return _on_land(features, land, library, asked, found)
    issues: list[Issue] = []
    own = source_crs(features, asked, library, found, issues)
    if found:
        raise BoundaryError(found)
    features = without_other_lines(with_tags(features, TAGS), issues)
    lines, row = _lines(features)
    target = working_crs(
        shapely.get_coordinates(lines),
        own,
        asked,
        library,
        issues,
        what="The streets are",
        result=result,
    )
    mapped = Projection(own, target, library).geometries(lines)
    _must_be_finite(mapped, features.name)
    west, south = shapely.total_bounds(mapped)[:2]
    frame = Frame(
        "" if target is None else library.text(target), (math.floor(west), math.floor(south))
    )
    return StreetsOnLand(_street_lines(features, mapped, row, frame, issues))


def _on_land(
    features: Features[C],
    land: Features[C],
    library: CrsLibrary[C],
    asked: C | None,
    problems: Sequence[str],
) -> StreetsOnLand:
    """Lines in the frame of the land."""
    site = build_site(land, library=library, asked=asked, problems=problems)
    source = land.crs if land.crs is not None else asked
    target = library.from_text(site.frame.crs) if site.frame.crs else None
    streets = street_lines_in(features, Projection(source, target, library), site.frame)
    digest = layers_digest(site.input_sha256, [features])
    issues = (*site.issues, *streets.issues)
    return StreetsOnLand(replace(streets, issues=issues, input_sha256=digest), site.parts)


def street_lines_in(features: Features[C], projection: Projection[C], frame: Frame) -> StreetLines:
    """Return lines in a frame that is known.

    Parameters
    ----------
    features
        Lines; without a CRS they have that of the source of `projection`.
    projection
        To the CRS of the frame.
    frame
        The frame.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the lines.
    """
    problems = wrong_kind(features, "Streets", "line")
    if problems:
        raise BoundaryError(problems)
    issues: list[Issue] = []
    features = without_other_lines(with_tags(features, TAGS), issues)
    lines, row = _lines(features)
    mapped = projection.of(features).geometries(lines)
    _must_be_finite(mapped, features.name)
    return _street_lines(features, mapped, row, frame, issues)


def _lines(features: Features[Any]) -> tuple[npt.NDArray[np.object_], IntArray]:
    """Single lines without heights, and the row of each."""
    rows = np.array(features.present(), dtype=np.int64)
    geometry, of = features.geometry[rows], np.arange(len(rows))
    while not (shapely.get_type_id(geometry) <= shapely.GeometryType.LINEARRING).all():
        geometry, parent = shapely.get_parts(geometry, return_index=True)
        of = of[parent]
    xy, line = shapely.get_coordinates(geometry, return_index=True)
    return np.asarray(shapely.linestrings(xy, indices=line), dtype=object), rows[of]


def _must_be_finite(lines: npt.NDArray[np.object_], name: str) -> None:
    if not np.isfinite(shapely.get_coordinates(lines)).all():
        raise BoundaryError(
            f"{name}: some coordinates have no place in the CRS of the blocks. Check the CRS of "
            "the layer."
        )


def _street_lines(
    features: Features[Any],
    mapped: npt.NDArray[np.object_],
    row: IntArray,
    frame: Frame,
    issues: list[Issue],
) -> StreetLines:
    known = _read_columns(features)
    if known.problems:
        raise BoundaryError(known.problems)
    if known.ignored:
        message = (
            f"{known.ignored} width(s) or number(s) of lanes of {features.name} are no numbers "
            "and count as not given."
        )
        issues.append(Issue("width_ignored", message, value=float(known.ignored)))
    whole = StreetLines(
        lines=shapely.transform(mapped, lambda xy: snap_to_grid(xy - frame.origin)),
        street_class=known.street_class[row],
        name=known.name[row],
        width=known.width[row],
        least_width=known.least_width[row],
        off_ground=known.off_ground[row],
        number=known.number[row],
        frame=frame,
        issues=tuple(issues),
        input_sha256=layers_digest("", [features]),
    )
    access = says_access(features)
    return whole if access is None else whole.take(access[row])


def says_access(features: Features[Any]) -> npt.NDArray[np.bool_] | None:
    """(n,) whether lines are streets that give access; None where no column says so.

    In OpenStreetMap a column of the same name has texts, which say who may use a street.
    """
    values = features.columns.get(ACCESS)
    if values is None or any(isinstance(v, str) for v in values):
        return None
    return np.array([is_blank(v) or bool(v) for v in values], dtype=bool)


@dataclass
class _Known:
    """What the columns say of each row, and what is wrong with them."""

    street_class: npt.NDArray[np.str_]
    name: npt.NDArray[np.str_]
    width: FloatArray
    least_width: FloatArray
    off_ground: npt.NDArray[np.bool_]
    number: IntArray
    ignored: int
    problems: list[str]


def _read_columns(features: Features[Any]) -> _Known:
    n = len(features.geometry)
    classes = features.column(*CLASS_COLUMNS, HIGHWAY)
    names = features.column(*NAME_COLUMNS)
    of_osm = HIGHWAY in features.columns
    width, ignored, problems = np.full(n, np.nan), 0, []
    for column in WIDTH_COLUMNS:
        if column not in features.columns:
            continue
        found, bad, wrong = _lengths(features, column)
        if of_osm and column != WIDTH_COLUMNS[0]:
            found = found + VERGES
        width = np.where(np.isnan(width), found, width)
        ignored += bad
        problems += wrong
    least = np.full(n, np.nan)
    if LANES in features.columns:
        lanes, bad, wrong = _lengths(features, LANES)
        least = lanes * LANE_WIDTH + VERGES
        ignored += bad
        problems += wrong
    off = np.zeros(n, dtype=bool)
    for column in OFF_GROUND:
        if column in features.columns:
            off |= np.array([_is_set(value) for value in features.columns[column]])
    blank = np.full(n, "")
    number = np.full(n, UNKNOWN_STREET)
    for row, value in enumerate(features.columns.get(STREET_ID, ())):
        if isinstance(value, int | float | np.number) and value > 0 and value == int(value):
            number[row] = int(value)
    return _Known(
        blank if classes is None else np.array([_class(value) for value in classes], np.str_),
        blank if names is None else np.array([text(_first(value)) for value in names], np.str_),
        width,
        least,
        off,
        number,
        ignored,
        problems,
    )


def _first(value: Any) -> Any:
    return next(iter(values_of(value)), None)


def _class(value: Any) -> str:
    """The class, of several the highest."""
    order = {name: i for i, name in enumerate(CLASS_WIDTHS)}
    found = [text(v) for v in values_of(value)]
    return min(found, key=lambda name: (order.get(name, len(order)), name), default="")


def _lengths(features: Features[Any], column: str) -> tuple[FloatArray, int, list[str]]:
    """Numbers of a column, NaN where there is none; how many make no sense; what is wrong."""
    values = features.columns[column]
    out, ignored, bad = np.full(len(values), np.nan), 0, []
    for row in features.present():
        found = [length_of(v) for v in values_of(values[row]) if not is_blank(v)]
        numbers = [v for v in found if not math.isnan(v)]
        ignored += len(numbers) < len(found) and not numbers
        if not numbers:
            continue
        out[row] = max(numbers)
        if not out[row] > 0 or math.isinf(out[row]):
            bad.append(row)
    problems = []
    if bad:
        problems.append(
            f"Column {column} of {features.name} must be above 0: row {named_rows(bad)} "
            f"({', '.join(f'{out[row]:g}' for row in bad[:MAX_NAMED])})."
        )
    return out, ignored, problems


def named_rows(rows: Sequence[int]) -> str:
    """Rows as people count them, from 1: ``2, 5, 7, 8, 9 and 3 more``."""
    more = f" and {len(rows) - MAX_NAMED} more" if len(rows) > MAX_NAMED else ""
    return ", ".join(str(row + 1) for row in rows[:MAX_NAMED]) + more


def _is_set(value: Any) -> bool:
    """Whether a bridge, a tunnel or a layer above or below the ground is said."""
    return any(text(v) not in ("", "no", "0", "0.0", "False") for v in values_of(value))
