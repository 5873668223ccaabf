"""A layer of blocks, from anywhere, to `Blocks` in local metres."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.centrelines import clean_centrelines
from urban_processing.blocks.edges import streets_beside
from urban_processing.blocks.model import UNKNOWN_STREET, Blocks, plain_blocks
from urban_processing.blocks.numbering import street_numbers
from urban_processing.blocks.streets import chosen_streets
from urban_processing.errors import BoundaryError
from urban_processing.intake.block_values import BLOCK_ID, block_values
from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.intake.given import layers_digest
from urban_processing.intake.numbers import is_whole, numbered
from urban_processing.intake.polygons import CleanedEach, clean_each
from urban_processing.intake.projection import Projection
from urban_processing.intake.street_lines import (
    MAX_NAMED,
    named_rows,
    says_access,
    street_lines_in,
)
from urban_processing.intake.working import source_crs, working_crs
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.planar import IntArray
from urban_processing.params.base import option_name
from urban_processing.params.blocks import BlocksParams
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.site import GRID, Frame, Issue

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]

HAIR = 0.1
"""Overlaps of blocks that are nowhere wider than this, in metres, come from drawing."""

TRIFLE = 1e-3
"""So do those below this share of the smaller block."""

_NEED = (
    "Blocks must be polygons: the algorithm blocks finds those between lines of streets; closed "
    "lines can be turned into polygons first (in QGIS: Lines to Polygons)."
)

MINIMUM_AREA = 1e-3
"""Pieces below this many m² are what projecting and rounding leave, no blocks."""


def build_blocks(
    features: Features[C] | None,
    *,
    library: CrsLibrary[C],
    asked: C | None = None,
    streets: Features[C] | None = None,
    params: SubdivideParams | None = None,
    snap: float = 1.0,
    carry: Collection[str] = (),
    problems: Sequence[str] = (),
) -> Blocks:
    """Make a layer of blocks ready for subdivision.

    Invalid outlines are repaired; a multipolygon becomes several blocks, of which the largest
    keeps the number. Blocks may touch; overlaps nowhere wider than `HAIR`, or below the share
    `TRIFLE` of the smaller block, go to the larger one, others are an error. All shells are
    street sides, holes are not, unless lines of streets say otherwise.

    Parameters
    ----------
    features
        Polygons; columns with the name of a parameter set it for each block, ``block_id``
        numbers the blocks. None where they could not be read, which is then a problem.
    library
        What knows the CRSs.
    asked
        Projected, metric CRS to work in; the CRS of blocks that have none.
    streets
        Lines along the blocks: centrelines, or the edges of blocks that are streets. An edge of a
        block takes width and number of the nearest line that runs along it, no further away than
        half its width and `snap`. If they have a column ``access`` of truth values, edges along
        which no line lies are no street sides; else shells stay street sides.
    params
        What holds where no column says otherwise: bounds are checked against it.
    snap
        Metres.
    carry
        Names of other columns to be carried along as they are.
    problems
        What is wrong already: raised with all else that is.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    """
    found, issues = [*problems], list[Issue]()
    if features is None:
        raise BoundaryError(found)
    own = source_crs(features, asked, library, found, issues)
    cleaned = _cleaned(features, found)
    if cleaned is None:
        raise BoundaryError(found)
    rows = np.unique(cleaned.row)
    columns, wrong = block_values(features, rows, params or SubdivideParams())
    given_id, wrong_ids = _block_ids(features, rows)
    found += [*wrong, *wrong_ids]
    if found:
        raise BoundaryError(found)
    issues += [Issue(note.code, note.message, value=note.value) for note in cleaned.notes]
    issues += _unused(columns, rows, params or SubdivideParams())
    target = working_crs(
        shapely.get_coordinates(cleaned.given),
        own,
        asked,
        library,
        issues,
        what="The blocks are",
        result="the parcels are",
    )
    projection = Projection(own, target, library)
    polygons, row, origin = local_pieces(cleaned, projection, features.name)
    frame = Frame("" if target is None else library.text(target), origin)
    polygons, row = _without_overlaps(polygons, row, given_id, issues)
    block_id, order = _numbered(polygons, row, given_id, issues)
    row = row[order]
    columns = {name: features.columns[name] for name in carry if name in features.columns} | columns
    blocks = plain_blocks(
        polygons[order],
        frame=frame,
        block_id=block_id,
        columns={name: values[row] for name, values in columns.items()},
        issues=tuple(issues),
        input_sha256=layers_digest("", [features]),
    )
    if streets is None:
        return blocks
    return _with_streets(blocks, streets, projection, snap)


def _cleaned(features: Features[Any], problems: list[str]) -> CleanedEach | None:
    try:
        return clean_each(features, need=_NEED)
    except BoundaryError as error:
        problems += error.problems
        return None


def _unused(
    columns: Mapping[str, ObjectArray], rows: IntArray, params: SubdivideParams
) -> list[Issue]:
    """One issue for each parameter that was given, but that a column sets for every block."""
    issues = []
    for field in params.fields():
        given = getattr(params, field.name)
        if field.name not in columns or given == field.default:
            continue
        values = columns[field.name][rows].tolist()
        if None not in values and set(values) != {given}:
            message = (
                f"{option_name(field.name)} ({given}) has no effect: the column {field.name} sets "
                "it for every block."
            )
            issues.append(Issue("parameter_unused", message, value=float(len(values))))
    return issues


def _block_ids(features: Features[Any], rows: IntArray) -> tuple[IntArray | None, list[str]]:
    """(n,) numbers of the rows' blocks, None without a column; and what is wrong with them."""
    values = features.columns.get(BLOCK_ID)
    if values is None:
        return None, []
    out = np.zeros(len(values), dtype=np.int64)
    bad = []
    for row in rows.tolist():
        if is_whole(values[row]):
            out[row] = int(values[row])
        else:
            bad.append(row)
    if bad:
        return out, [f"Column {BLOCK_ID} must be a whole number: row {named_rows(bad)}."]
    known, times = np.unique(out[rows], return_counts=True)
    twice = known[times > 1]
    if not len(twice):
        return out, []
    named = ", ".join(str(i) for i in twice[:MAX_NAMED])
    at = np.flatnonzero(np.isin(out, twice) & np.isin(np.arange(len(out)), rows)).tolist()
    return out, [f"Numbers of blocks are there twice: {BLOCK_ID} {named}, in row {named_rows(at)}."]


def local_pieces(
    cleaned: CleanedEach, projection: Projection[Any], name: str, *, what: str = "blocks"
) -> tuple[ObjectArray, IntArray, tuple[float, float]]:
    """Single polygons on the grid in local metres, the row of each, and the origin.

    Parameters
    ----------
    cleaned
        Polygons in the source's coordinates.
    projection
        To the CRS to work in.
    name, what
        What the layer, and what is in it, is called in sentences.

    Raises
    ------
    BoundaryError
        If some coordinates have no place in that CRS, or no polygon has an area.
    """
    mapped = projection.geometries(cleaned.valid)
    if not np.isfinite(shapely.get_coordinates(mapped)).all():
        raise BoundaryError(
            f"{name}: some coordinates have no place in the CRS asked for: choose one that covers "
            f"the {what}, or leave crs (--crs) out."
        )
    if not len(shapely.get_coordinates(mapped)):
        raise BoundaryError(f"{name}: its polygons have no area.")
    west, south = shapely.total_bounds(mapped)[:2]
    origin = float(math.floor(west)), float(math.floor(south))
    local = shapely.transform(mapped, lambda xy: xy - origin)
    polygons, of = _pieces(shapely.set_precision(shapely.make_valid(local), GRID))
    if not len(polygons):
        raise BoundaryError(
            f"{name}: its polygons have no area. If their coordinates are degrees, give their CRS."
        )
    return polygons, cleaned.row[of], origin


def _pieces(geometries: ObjectArray) -> tuple[ObjectArray, IntArray]:
    """Single polygons that are worth it, and the geometry of each."""
    parts, of = shapely.get_parts(geometries, return_index=True)
    kept = (shapely.get_type_id(parts) == shapely.GeometryType.POLYGON) & (
        shapely.area(parts) >= MINIMUM_AREA
    )
    return canonical_rings(parts[kept]), of[kept]


def _without_overlaps(
    polygons: ObjectArray, row: IntArray, given_id: IntArray | None, issues: list[Issue]
) -> tuple[ObjectArray, IntArray]:
    """Trim overlaps of a hair or a trifle; raise for the others, naming the pairs."""
    a, b = shapely.STRtree(polygons).query(polygons, predicate="intersects")
    a, b = a[a < b], b[a < b]
    shared = shapely.intersection(polygons[a], polygons[b])
    overlap = shapely.area(shared) > 0
    a, b, shared = a[overlap], b[overlap], shared[overlap]
    smaller = np.minimum(shapely.area(polygons[a]), shapely.area(polygons[b]))
    wide = shapely.area(shared) >= TRIFLE * smaller
    wide[wide] = ~shapely.is_empty(shapely.buffer(shared[wide], -HAIR / 2))
    if wide.any():
        raise BoundaryError(_overlap_problems(a[wide], b[wide], shared[wide], row, given_id))
    if not len(a):
        return polygons, row
    out = polygons.copy()
    area = np.round(shapely.area(polygons), 6)
    for i, j in zip(a.tolist(), b.tolist(), strict=True):
        keys = {k: (area[k], polygons[k].bounds) for k in (i, j)}
        small, large = sorted((i, j), key=keys.__getitem__)
        out[small] = shapely.difference(out[small], out[large], grid_size=GRID)
    message = (
        f"{len(a)} overlap(s) of blocks, no wider than {HAIR:g} m or below {TRIFLE:.1%} of the "
        "smaller block, were left to the larger one."
    )
    issues.append(Issue("overlaps_trimmed", message, value=float(len(a)), limit=HAIR))
    pieces, of = _pieces(out)
    return pieces, row[of]


def _overlap_problems(
    a: IntArray, b: IntArray, shared: ObjectArray, row: IntArray, given_id: IntArray | None
) -> list[str]:
    first, second = np.minimum(row[a], row[b]), np.maximum(row[a], row[b])
    pairs = sorted(zip(first.tolist(), second.tolist(), shapely.area(shared).tolist(), strict=True))
    number = np.arange(1, int(row.max()) + 2) if given_id is None else given_id
    what = "row" if given_id is None else "block"
    named = "; ".join(
        f"{what} {number[i]} and {number[j]} ({area:.3g} m²)" for i, j, area in pairs[:MAX_NAMED]
    )
    more = f" and {len(pairs) - MAX_NAMED} more pairs" if len(pairs) > MAX_NAMED else ""
    return [f"Blocks must not overlap: {named}{more}. Correct them, or leave one of each pair out."]


def _numbered(
    polygons: ObjectArray, row: IntArray, given_id: IntArray | None, issues: list[Issue]
) -> tuple[IntArray, IntArray]:
    """Numbers of the blocks, ascending, and the block of each; see `numbered`."""
    number, order, extra = numbered(polygons, row, given_id)
    if extra:
        message = f"{extra} block(s) more than rows: polygons in several pieces are several blocks."
        issues.append(Issue("blocks_of_parts", message, value=float(extra)))
    return number, order


def _with_streets(
    blocks: Blocks, streets: Features[C], projection: Projection[C], snap: float
) -> Blocks:
    """Give the edges of blocks the width and the number of the streets along them."""
    lines = street_lines_in(streets, projection, blocks.frame)
    usable, issues = chosen_streets(lines, BlocksParams())
    work, _ = clean_centrelines(usable, snap=0.0, dead_ends=True)
    width = usable.width[work.line]
    number = street_numbers(work, usable.name, usable.number)
    at = streets_beside(blocks.rings, work.segments, width / 2 + snap)
    along = at >= 0
    access = along if says_access(streets) is not None else blocks.edge_access | along
    said = [*blocks.issues, *lines.issues, *issues]
    bare = int((blocks.edge_access & ~along).sum())
    if bare:
        message = f"{bare} outer edge(s) of blocks have no street line along them" + (
            ": they are no street sides."
            if says_access(streets) is not None
            else ": their street's width is not known."
        )
        said.append(Issue("edges_without_street", message, value=float(bare)))
    return replace(
        blocks,
        edge_access=access,
        edge_width=np.append(width, np.nan)[at],
        edge_street=np.append(number, UNKNOWN_STREET)[at],
        issues=tuple(said),
        input_sha256=layers_digest(blocks.input_sha256, [streets]),
    )
