"""What a subdivision takes over from the one before an edit (Vanegas 2012, section 5)."""

from __future__ import annotations

import dataclasses

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks, ragged_rows
from urban_processing.errors import BoundaryError
from urban_processing.mesh.planar import IntArray
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.reuse import Parcels, Previous, pieces_of_parcels
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.persistence.block_match import NONE, carry_block_columns
from urban_processing.persistence.tables import changes_table
from urban_processing.persistence.transfer import ParcelsInBlocks, transfer
from urban_processing.site import Frame


def inherit(old: Blocks, new: Blocks) -> Blocks:
    """Give blocks the numbers and columns of those that they come from.

    Of several parts of a block that was split the largest keeps its number; the others, and
    blocks that come from none, get numbers above all there are.

    Raises
    ------
    BoundaryError
        If the blocks are in different CRSs.
    """
    if old.frame.crs != new.frame.crs:
        raise BoundaryError(
            f"The subdivision before is in {_crs_name(old.frame)}, but the blocks are worked on in "
            f"{_crs_name(new.frame)}: choose the CRS of the subdivision with crs (--crs)."
        )
    columns, source = carry_block_columns(old, new)
    order = np.lexsort((-np.round(shapely.area(new.polygons), 6), source))
    first = order[np.append(True, np.diff(source[order]) != 0)]
    heirs = first[source[first] != NONE]
    block_id = np.zeros(len(new), dtype=np.int64)
    block_id[heirs] = source[heirs]
    others = np.flatnonzero(block_id == 0)
    block_id[others] = old.block_id.max(initial=0) + 1 + np.arange(len(others))
    return dataclasses.replace(new, columns=columns, block_id=block_id)


def _crs_name(frame: Frame) -> str:
    """Code of a CRS, or the name in its definition."""
    name = frame.crs.split('"')[1] if '"' in frame.crs else frame.crs
    return name or "no CRS"


def unchanged(
    previous: Previous, key: npt.NDArray[np.str_], ground: Ground, frame: Frame
) -> tuple[IntArray, Pieces]:
    """Return the blocks in which nothing has changed, and their parcels as they were."""
    known = {text: row for row, text in enumerate(previous.block_key.tolist())}
    source = np.array([known.get(text, NONE) for text in key.tolist()], dtype=np.int64)
    kept = np.flatnonzero(source != NONE)
    old = previous.parcels
    by_block = np.argsort(old.block, kind="stable")
    begin = np.searchsorted(old.block[by_block], np.arange(len(previous.blocks) + 1))
    rows = by_block[ragged_rows(begin, source[kept])]
    count = np.diff(begin)[source[kept]]
    parcels = Parcels(
        polygons=_shifted(old.polygons[rows], previous.blocks.frame, frame),
        block=np.repeat(np.arange(len(kept)), count),
        lineage=old.lineage[rows],
        level=old.level[rows],
        patio=old.patio[rows],
    )
    return kept, pieces_of_parcels(parcels, ground.of(kept))


def with_numbers(previous: Previous, made: Subdivision) -> Subdivision:
    """Give parcels the numbers of those before the edit that they are; log what changed."""
    origin, frame = previous.blocks.frame, made.blocks.frame
    polygons = _shifted(previous.parcels.polygons, origin, frame)
    outlines = _shifted(previous.blocks.polygons, origin, frame)
    number = previous.parcel_id
    found = transfer(
        ParcelsInBlocks(polygons, previous.parcels.block, outlines),
        number,
        ParcelsInBlocks(made.polygons, made.pieces.block, made.blocks.polygons),
    )
    changes = changes_table(found, (number, polygons), made.polygons, frame)
    return dataclasses.replace(made, parcel_id=found.parcel_id, changes=changes)


def _shifted(
    polygons: npt.NDArray[np.object_], origin: Frame, frame: Frame
) -> npt.NDArray[np.object_]:
    """Polygons in the local coordinates of another frame."""
    shift = np.subtract(origin.origin, frame.origin)
    return np.asarray(shapely.transform(polygons, lambda xy: xy + shift), dtype=object)
