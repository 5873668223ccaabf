"""What a session hands out: candidate cuts, and what an edit changed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import shapely

from urban_processing.subdivision.streamline import Cut


@dataclass(frozen=True, eq=False)
class Candidate:
    """One way of cutting a parcel in two.

    Parameters
    ----------
    rank
        Its place among the parcel's candidates, counted from 1, the best first.
    quality
        Score, the larger the better (Chen 2024, Eq. 2, with the preset's further terms).
    terms
        What the score is the sum of, by name.
    line
        The cut in map coordinates.
    areas
        Areas in m² of the two halves, the smaller first.
    reason
        One sentence that says what speaks for it and against it.
    cut
        The cut in terms of the mesh.
    tee_snap
        Distance, in √area, within which its ends move to where a neighbour's cut ends.
    """

    rank: int
    quality: float
    terms: Mapping[str, float]
    line: shapely.LineString
    areas: tuple[float, float]
    reason: str
    cut: Cut
    tee_snap: float


@dataclass(frozen=True)
class Change:
    """What an edit, an undo or a redo changed.

    Parameters
    ----------
    sentence
        What was done, and what it brought along, for the person at the table.
    gone
        Numbers of the parcels that are no more.
    new
        Numbers of the parcels that are there now and were not before.
    """

    sentence: str
    gone: tuple[int, ...] = ()
    new: tuple[int, ...] = ()


@dataclass(frozen=True)
class Branch:
    """The end of a line of edits.

    Parameters
    ----------
    number
        For `Session.go_to`.
    sentence
        What was done last on it.
    edits
        Number of its edits from the beginning.
    current
        Whether redo leads to it from now, or it is now.
    """

    number: int
    sentence: str
    edits: int
    current: bool
