"""The log of a transfer: what became of each parcel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.persistence.block_match import NONE
from urban_processing.persistence.layers import Change

ObjectArray = npt.NDArray[np.object_]

SAME = 1e-3
"""A parcel is the same while what it lost and gained is no more than this share of its area."""

MOST = 0.5 + 1e-6
"""A parcel comes out of another, or went into it, with more than this share of its area: more than
half, by so much that rounding decides nothing where a parcel is cut in equal halves."""


@dataclass(frozen=True, eq=False)
class Changes:
    """One row for each new parcel, in their order, then one for each old number that ends.

    Parameters
    ----------
    change
        (r,) values of `Change`.
    old, new
        (r,) rows of the parcels; `NONE` where there is none. For a split parcel the old one is
        the one it was part of, for a merged one the new parcel is the one that it went into.
    overlap_old, overlap_new
        (r,) area in common, after the old parcel was moved along with its block, as a share of
        the area of the old and of the new parcel; NaN without a pair.
    distance
        (r,) distance d of the positions of a pair; NaN where positions were not compared.
    """

    change: npt.NDArray[np.str_]
    old: IntArray
    new: IntArray
    overlap_old: FloatArray
    overlap_new: FloatArray
    distance: FloatArray

    def count(self, change: Change) -> int:
        """Return the number of rows of a kind."""
        return int((self.change == change.value).sum())


@dataclass(frozen=True, eq=False)
class Overlaps:
    """Pairs of an old and a new parcel with area in common.

    Parameters
    ----------
    old, new
        (q,) rows.
    area
        (q,) in m².
    area_old, area_new
        (n,) and (m,) areas of the parcels, old ones after they were moved along.
    still
        (n,) old parcels that did not have to be moved along.
    """

    old: IntArray
    new: IntArray
    area: FloatArray
    area_old: FloatArray
    area_new: FloatArray
    still: BoolArray

    def of(self, old: IntArray, new: IntArray) -> FloatArray:
        """(r,) area in common of given pairs."""
        key = self.old * (len(self.area_new) + 1) + self.new
        order = np.argsort(key)
        wanted = old * (len(self.area_new) + 1) + new
        at = np.minimum(np.searchsorted(key, wanted, sorter=order), max(len(key) - 1, 0))
        if not len(key):
            return np.zeros(len(wanted))
        hit = order[at]
        return np.where(key[hit] == wanted, self.area[hit], 0.0)

    def most_of_new(self) -> tuple[IntArray, IntArray]:
        """New parcels that lie for the most part in one old parcel, and that one."""
        most = self.area > MOST * self.area_new[self.new]
        return self.new[most], self.old[most]

    def most_of_old(self) -> tuple[IntArray, IntArray]:
        """Old parcels that lie for the most part in one new parcel, and that one."""
        most = self.area > MOST * self.area_old[self.old]
        return self.old[most], self.new[most]

    def most_of_both(self) -> tuple[IntArray, IntArray]:
        """Pairs of which each is for the most part in the other."""
        half = self.area > MOST * (self.area_old[self.old] + self.area_new[self.new] - self.area)
        return self.old[half], self.new[half]


def overlaps(
    old: ObjectArray, new: ObjectArray, rows: tuple[IntArray, IntArray], *, still: BoolArray
) -> Overlaps:
    """Measure what some old parcels, moved along, and some new ones have in common.

    Parameters
    ----------
    old, new
        (n,) and (m,) all parcels, old ones where they were moved along to.
    rows
        Those that are looked at.
    still
        (n,) old parcels that did not have to be moved along.
    """
    before, after = old[rows[0]], new[rows[1]]
    a, b = shapely.STRtree(after).query(before, predicate="intersects")
    area = shapely.area(shapely.intersection(before[a], after[b]))
    some = area > 0
    return Overlaps(
        rows[0][a[some]],
        rows[1][b[some]],
        area[some],
        shapely.area(old),
        shapely.area(new),
        still,
    )


def changes_of(
    source: IntArray, same: BoolArray, distance: FloatArray, common: Overlaps
) -> Changes:
    """Write the log of parcels whose numbers are known.

    Parameters
    ----------
    source
        (m,) old parcel whose number each new one has, `NONE` for none.
    same
        (m,) new parcels known to have shape and place of their source.
    distance
        (m,) distance d from the source.
    common
        Area in common of all others.
    """
    after = _of_new(source, same, distance, common)
    return _joined(after, _of_ended(source, common))


def _of_new(source: IntArray, same: BoolArray, distance: FloatArray, common: Overlaps) -> Changes:
    rows = np.arange(len(source))
    old = source.copy()
    part, whole = common.most_of_new()
    fresh = source[part] == NONE
    old[part[fresh]] = whole[fresh]
    area = np.where(same, common.area_new, common.of(old, rows))
    apart = np.append(common.area_old, np.inf)[old] + common.area_new - 2 * area
    kept = same | ((apart <= SAME * common.area_new) & np.append(common.still, False)[old])
    change = np.where(kept, Change.KEPT.value, Change.MOVED.value).astype("U6")
    change[source == NONE] = Change.SPLIT.value
    change[old == NONE] = Change.NEW.value
    return _rows(change, old, rows, area, distance, common)


def _of_ended(source: IntArray, common: Overlaps) -> Changes:
    goes_on = np.zeros(len(common.area_old) + 1, dtype=bool)
    goes_on[source] = True
    ended = np.flatnonzero(~goes_on[:-1])
    new = np.full(len(common.area_old), NONE)
    part, whole = common.most_of_old()
    new[part] = whole
    new = new[ended]
    change = np.where(new == NONE, Change.GONE.value, Change.MERGED.value).astype("U6")
    area = common.of(ended, new)
    return _rows(change, ended, new, area, np.full(len(ended), np.nan), common)


def _rows(
    change: npt.NDArray[np.str_],
    old: IntArray,
    new: IntArray,
    area: FloatArray,
    distance: FloatArray,
    common: Overlaps,
) -> Changes:
    pair = (old != NONE) & (new != NONE)
    share_old, share_new = np.full(len(old), np.nan), np.full(len(old), np.nan)
    share_old[pair] = np.minimum(area[pair] / common.area_old[old[pair]], 1.0)
    share_new[pair] = np.minimum(area[pair] / common.area_new[new[pair]], 1.0)
    return Changes(change, old, new, share_old, share_new, distance)


def _joined(a: Changes, b: Changes) -> Changes:
    return Changes(
        np.concatenate([a.change, b.change]),
        np.concatenate([a.old, b.old]),
        np.concatenate([a.new, b.new]),
        np.concatenate([a.overlap_old, b.overlap_old]),
        np.concatenate([a.overlap_new, b.overlap_new]),
        np.concatenate([a.distance, b.distance]),
    )
