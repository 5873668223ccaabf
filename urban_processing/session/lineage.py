"""The tree of cuts, read off the lineages of the parcels that there are."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from urban_processing.hashing import UintArray, mix, splitmix64, unmixed
from urban_processing.session.moment import PARTS_OF_CUT


def parents(lineage: UintArray, seen: Iterable[int] = ()) -> dict[int, int]:
    """Return the parent of every lineage whose sibling is known, through all generations.

    The lineage of a half is its parent's, hashed with which half it is (`hashing.child`). Undone
    for two parcels, this tells that they are siblings, and gives two possible parents, since
    either may be the first half: that is the parent which was seen, or else the first half is
    the one with the lower face.

    Parameters
    ----------
    lineage
        (F,) lineages of the parcels.
    seen
        Lineages that parcels had before.
    """
    first, second = (np.uint64(mix(rank + 1)) for rank in PARTS_OF_CUT)
    before = np.array(sorted(seen), dtype=np.uint64)
    found: dict[int, int] = {}
    known, face = np.unique(lineage, return_index=True)
    while True:
        mixed = unmixed(known)
        parent, a, b = np.intersect1d(
            mixed ^ first, mixed ^ second, assume_unique=True, return_indices=True
        )
        otherwise = np.isin(parent ^ first ^ second, before)
        kept = np.isin(parent, before) | (~otherwise & (face[a] < face[b]))
        kept &= ~np.isin(parent, known)
        if not kept.any():
            return found
        parent, a, b = parent[kept], a[kept], b[kept]
        for children in (known[a], known[b]):
            found.update(zip(children.tolist(), parent.tolist(), strict=True))
        face = np.append(face, np.minimum(face[a], face[b]))
        known = np.append(known, parent)


def descendants(lineage: UintArray, ancestor: int, parent: dict[int, int]) -> list[int]:
    """Faces whose parcels came of an ancestor by cuts."""
    faces = []
    for face, own in enumerate(lineage.tolist()):
        line = own
        while line in parent and line != ancestor:
            line = parent[line]
        if line == ancestor:
            faces.append(face)
    return faces


def merged(lineage: UintArray) -> int:
    """Return the lineage of parcels that became one, whatever their order."""
    return mix(int(np.bitwise_xor.reduce(splitmix64(lineage))))
