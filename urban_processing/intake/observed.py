"""A layer of observed parcels, and one of their blocks, to `Observed` in local metres."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks
from urban_processing.calibration.grouping import same_as_others
from urban_processing.calibration.layers import BOUNDS
from urban_processing.calibration.model import Observed
from urban_processing.errors import BoundaryError
from urban_processing.intake.blocks import build_blocks, local_pieces
from urban_processing.intake.crs_choice import CrsLibrary, crs_label
from urban_processing.intake.features import Features
from urban_processing.intake.given import layers_digest
from urban_processing.intake.numbers import is_whole
from urban_processing.intake.polygons import clean_each
from urban_processing.intake.projection import Projection
from urban_processing.intake.working import source_crs, working_crs
from urban_processing.mesh.planar import IntArray
from urban_processing.mesh.polygons import by_place
from urban_processing.site import Frame, Issue

C = TypeVar("C")
ObjectArray = npt.NDArray[np.object_]

LEAST_AREA = 1.0
"""Slivers below this many m² are no parcels."""

SAME = 0.9
"""Parcels that have this share of the larger one in common are one that is there twice."""

PARCEL_ID = "parcel_id"

_NEED = (
    "Observed parcels must be polygons; closed lines can be turned into polygons first (in QGIS: "
    "Lines to Polygons)."
)


def build_observed(
    features: Features[C] | None,
    *,
    library: CrsLibrary[C],
    asked: C | None = None,
    blocks: Features[C] | None = None,
    problems: Sequence[str] = (),
) -> Observed:
    """Make observed parcels ready for calibration.

    Invalid outlines are repaired. Parcels in several pieces are several parcels, parcels that are
    there twice count once; overlaps are said.

    Parameters
    ----------
    features
        Polygons, with all their columns. None where they could not be read, which is then a
        problem.
    library
        What knows the CRSs.
    asked
        Projected, metric CRS to work in; the CRS of parcels that have none.
    blocks
        Polygons of blocks, with all their columns; they are brought into the CRS of the parcels.
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
    own = _own_crs(features, blocks, asked, library, found, issues)
    try:
        cleaned = clean_each(features, need=_NEED)
    except BoundaryError as error:
        raise BoundaryError([*found, *error.problems]) from error
    if found:
        raise BoundaryError(found)
    issues += [Issue(note.code, note.message, value=note.value) for note in cleaned.notes]
    target = working_crs(
        shapely.get_coordinates(cleaned.given),
        own,
        asked,
        library,
        issues,
        what="The parcels are",
        result="the result is",
    )
    parcels, row, origin = local_pieces(
        cleaned, Projection(own, target, library), features.name, what="parcels"
    )
    frame = Frame("" if target is None else library.text(target), origin)
    parcels, row = _each_once(parcels, row, issues)
    around = None
    if blocks is not None:
        around = _blocks_in(frame, blocks, target, library, issues)
    return Observed(
        parcels=parcels,
        parcel_id=_numbers(features, row),
        frame=frame,
        blocks=around,
        columns={name: values[row] for name, values in features.columns.items()},
        issues=tuple(issues),
        input_sha256=layers_digest("", [features, *([] if blocks is None else [blocks])]),
    )


def _own_crs(
    features: Features[C],
    blocks: Features[C] | None,
    asked: C | None,
    library: CrsLibrary[C],
    problems: list[str],
    issues: list[Issue],
) -> C | None:
    """CRS of the parcels: their own, else the one asked for, else that of the blocks."""
    if features.crs is None and asked is None and blocks is not None and blocks.crs is not None:
        if not features.bare:
            message = f"{features.name} has no CRS; it was taken to be that of the blocks."
            issues.append(Issue("crs_missing", message))
        return blocks.crs
    return source_crs(features, asked, library, problems, issues)


def _each_once(
    parcels: ObjectArray, row: IntArray, issues: list[Issue]
) -> tuple[ObjectArray, IntArray]:
    """Put parcels in order of place, without those that are there twice; say what overlaps."""
    order = by_place(parcels)
    parcels, row = parcels[order], row[order]
    large = shapely.area(parcels) >= LEAST_AREA
    if not large.any():
        raise BoundaryError(f"No parcel is as large as {LEAST_AREA:g} m².")
    if not large.all():
        message = f"{int((~large).sum())} sliver(s) below {LEAST_AREA:g} m² were left out."
        issues.append(Issue("slivers", message, value=float((~large).sum()), limit=LEAST_AREA))
        parcels, row = parcels[large], row[large]
    extra = len(parcels) - len(np.unique(row))
    if extra > 0:
        message = f"{extra} parcel(s) more than features: those in several pieces are several."
        issues.append(Issue("parcels_of_parts", message, value=float(extra)))
    same, overlapping = same_as_others(parcels, share=SAME)
    if len(same):
        message = f"{len(same)} parcel(s) lie on another one and were left out."
        issues.append(Issue("parcels_twice", message, value=float(len(same))))
    if len(overlapping):
        message = (
            f"{len(overlapping)} parcels overlap each other, by more than {1 - SAME:.0%} of the "
            "smaller one: each was measured as it is."
        )
        issues.append(Issue("parcels_overlap", message, value=float(len(overlapping))))
    return np.delete(parcels, same), np.delete(row, same)


def _numbers(features: Features[Any], row: IntArray) -> IntArray:
    """(n,) numbers of the parcels in their column, or of their features where it has no such."""
    values = features.columns.get(PARCEL_ID)
    if values is not None and all(is_whole(values[k]) for k in np.unique(row).tolist()):
        return np.array([int(values[k]) for k in row.tolist()], dtype=np.int64)
    return row + 1


def _blocks_in(
    frame: Frame,
    features: Features[C],
    target: C | None,
    library: CrsLibrary[C],
    issues: list[Issue],
) -> Blocks:
    """Blocks in the frame of the parcels, with their columns but for the bounds."""
    if features.crs is not None and target is not None and features.crs != target:
        message = (
            f"The blocks were reprojected from {crs_label(features.crs, library)} to "
            f"{crs_label(target, library)}, the CRS of the parcels."
        )
        issues.append(Issue("crs_changed", message))
    if features.crs is None and not features.bare and target is not None:
        message = f"{features.name} has no CRS; it was taken to be that of the parcels."
        issues.append(Issue("crs_missing", message))
        features = dataclasses.replace(features, crs=target)
    kept = {name: values for name, values in features.columns.items() if name not in BOUNDS}
    blocks = build_blocks(
        dataclasses.replace(features, columns=kept), library=library, asked=target, carry=kept
    )
    issues += blocks.issues
    shift = np.subtract(blocks.frame.origin, frame.origin)
    moved = shapely.transform(blocks.polygons, lambda xy: xy + shift)
    return dataclasses.replace(blocks, polygons=np.asarray(moved), frame=frame, issues=())
