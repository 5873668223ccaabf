"""The log of changes as a table."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from urban_processing.mesh.planar import IntArray
from urban_processing.persistence.layers import CHANGES
from urban_processing.persistence.transfer import Transfer
from urban_processing.site import Frame
from urban_processing.tables import Table, make_table, to_map

ObjectArray = npt.NDArray[np.object_]


def changes_table(
    made: Transfer,
    old: tuple[IntArray, ObjectArray],
    new: ObjectArray,
    frame: Frame,
    *,
    new_id: IntArray | None = None,
) -> Table:
    """Return one row for each parcel after, then one for each number that ended.

    Parameters
    ----------
    made
        What was carried over.
    old
        Numbers and polygons of the parcels before.
    new
        Polygons of the parcels after.
    frame
        Where their local coordinates lie.
    new_id
        Numbers of the parcels after, where they have others than were carried over.
    """
    log, m = made.changes, len(made.parcel_id)
    shape = np.append(new, old[1][log.old[m:]])
    number = (
        numbers_of(old[0], log.old),
        numbers_of(made.parcel_id if new_id is None else new_id, log.new),
    )
    order = np.lexsort((number[0], number[1], np.arange(len(shape)) >= m))
    values = {
        "change": log.change,
        "old_id": number[0],
        "new_id": number[1],
        "overlap_old": log.overlap_old,
        "overlap_new": log.overlap_new,
        "distance": log.distance,
    }
    rows = {name: v[order] for name, v in values.items()}
    return make_table(CHANGES, rows, to_map(shape[order], frame))


def numbers_of(numbers: IntArray, rows: IntArray) -> npt.NDArray[np.float64]:
    """(n,) numbers by row, NaN for none."""
    return np.append(numbers.astype(np.float64), np.nan)[rows]
