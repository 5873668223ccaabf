"""Which parcels of a layout that was edited by hand are which of the layout before."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.assembly import EDITED_SINCE
from urban_processing.errors import BoundaryError
from urban_processing.layout import Layout
from urban_processing.mesh.planar import IntArray
from urban_processing.persistence.layers import CHANGES, Change
from urban_processing.persistence.tables import changes_table
from urban_processing.persistence.transfer import ParcelsInBlocks, Transfer, transfer
from urban_processing.site import Issue
from urban_processing.tables import LayerSet

_IN_WORDS = {
    Change.KEPT: "{n:,} kept as they were",
    Change.MOVED: "{n:,} moved or changed shape",
    Change.SPLIT: "{n:,} new by a split",
    Change.MERGED: "{n:,} merged into others",
    Change.GONE: "{n:,} gone",
    Change.NEW: "{n:,} new",
}
"""What the summary says of each kind of change."""


@dataclass(frozen=True, eq=False)
class ParcelMatch:
    """Which parcel is which; n faces before, m faces after.

    Parameters
    ----------
    source
        (m,) face of the layout before that each face after is the same parcel as; -1 for none.
        No face before stands there twice.
    part_of
        (m,) the same, and for a parcel that is not the same as any the face before that more
        than half of it was a part of; -1 for none.
    counts
        Number of changes of each kind.
    made
        All that was found out, in rows of faces.
    """

    source: IntArray
    part_of: IntArray
    counts: Mapping[Change, int]
    made: Transfer

    @property
    def in_words(self) -> str:
        """What became of the parcels: ``12 kept as they were, 1 merged into others``."""
        said = [_IN_WORDS[kind].format(n=n) for kind, n in self.counts.items() if n]
        return ", ".join(said) if said else "there are none"


def match_parcels(before: Layout, after: Layout) -> ParcelMatch:
    """Find the parcels of a layout again after its parcels or streets were edited by hand.

    The layouts may have different local origins; they must have one CRS. Parcels of the same
    shape in the same place are the same. The others are compared block by block, by their
    places relative to the corners of blocks that belong together, so that they are found again
    where a street was moved or bent (Vanegas 2012, section 5; see
    `urban_processing.persistence.transfer`). Of a parcel that was split, one piece is the same
    parcel and the others are none; of parcels that were merged, one goes on at most. Neither the
    numbering of faces nor lineages count, so that a layout may come from any program.

    Parameters
    ----------
    before, after
        Layouts of n and m parcels.

    Returns
    -------
    ParcelMatch
        Its `source` (m,) has the face of `before` for each face of `after`, -1 for none.

    Raises
    ------
    BoundaryError
        If the layouts are in different CRSs.
    """
    if before.frame.crs != after.frame.crs:
        raise BoundaryError(
            "The layouts before and after are in different CRSs: "
            f"{before.frame.crs or 'none'} and {after.frame.crs or 'none'}."
        )
    made = transfer(
        _in_blocks(before, after), np.arange(1, before.mesh.n_faces + 1), _in_blocks(after, after)
    )
    counts = {change: made.changes.count(change) for change in Change}
    return ParcelMatch(made.source, made.part_of, counts, made)


def _in_blocks(layout: Layout, shown_in: Layout) -> ParcelsInBlocks:
    """Parcels in the blocks between streets, in the local coordinates of another layout."""
    shift = np.subtract(layout.frame.origin, shown_in.frame.origin)
    polygons = shapely.transform(layout.mesh.face_polygons(), lambda xy: xy + shift)
    block = np.unique(layout.face_block, return_inverse=True)[1].ravel()
    return ParcelsInBlocks(np.asarray(polygons, dtype=object), block)


def edits_listed(
    before: Layout, after: Layout, *, called: str = "the layout before"
) -> tuple[Layout, LayerSet]:
    """Say in the issues of an edited layout what became of its parcels, and list it.

    Parameters
    ----------
    before, after
        The layout before it was edited by hand, and after it.
    called
        What to call the layout before.

    Returns
    -------
    layout, changes
        `after` with one issue more, and the layer
        `urban_processing.persistence.layers.CHANGES`, whose numbers are those of the parcels of
        both layouts (`parcel_id`).
    """
    match = match_parcels(before, after)
    old = _in_blocks(before, after).polygons
    number = np.arange(1, before.mesh.n_faces + 1), np.arange(1, after.mesh.n_faces + 1)
    table = changes_table(
        match.made, (number[0], old), after.mesh.face_polygons(), after.frame, new_id=number[1]
    )
    issue = Issue(EDITED_SINCE, f"Parcels since {called}: {match.in_words}.")
    summary = [(change.value, f"{n:,} parcels") for change, n in match.counts.items()]
    made = LayerSet("changes", {CHANGES: table}, after.frame, after.history, tuple(summary))
    return after.replace(issues=(*after.issues, issue)), made
