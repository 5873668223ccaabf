"""Making one parcel of several that touch."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from urban_processing.errors import EditError
from urban_processing.layout import Layout
from urban_processing.mesh.planar import IntArray
from urban_processing.session.moment import Moment
from urban_processing.subdivision.recut import Pair, join_pairs


def joined(moment: Moment, faces: Sequence[int]) -> tuple[Layout, int]:
    """The layout with some faces as one, and which face that is; streets between them are gone.

    Raises
    ------
    EditError
        If the faces do not hang together, or enclose something.
    """
    layout = moment.state.layout
    numbers = [moment.number(face) for face in faces]
    group = set(faces)
    while len(group) > 1:
        pairs = _pairs(layout, group)
        if not pairs:
            raise EditError(_apart(layout, group, numbers))
        layout, before = join_pairs(layout, pairs)
        gone = {pair.goes for pair in pairs}
        group = set(np.flatnonzero(np.isin(before, sorted(group - gone))).tolist())
    return layout, group.pop()


def streets_between(layout: Layout, faces: Sequence[int]) -> IntArray:
    """Street edges that have one of the faces on either side."""
    sides = np.isin(layout.mesh.face.reshape(-1, 2), faces).all(axis=1)
    return np.flatnonzero(sides & layout.edge_street)


def _pairs(layout: Layout, group: set[int]) -> list[Pair]:
    """Disjoint pairs of a group, each with the one run of half-edges that is between them."""
    mesh = layout.mesh
    taken: set[int] = set()
    pairs = []
    for face in sorted(group):
        if face in taken:
            continue
        ring = mesh.face_half_edges(face).tolist()
        beyond = mesh.face[np.array(ring) ^ 1].tolist()
        for other in sorted(group.intersection(beyond) - taken - {face}):
            chain = _only_run(ring, [f == other for f in beyond])
            if chain is not None and _has_one_loop(layout, face, other):
                pairs.append(Pair(face, other, chain))
                taken |= {face, other}
                break
    return pairs


def _only_run(ring: list[int], chosen: list[bool]) -> tuple[int, ...] | None:
    """The chosen half-edges of a ring in order; None where they are all, or not one run."""
    starts = [i for i, (a, b) in enumerate(pairwise([chosen[-1], *chosen])) if b and not a]
    if len(starts) != 1:
        return None
    turned = [*range(starts[0], len(ring)), *range(starts[0])]
    return tuple(ring[i] for i in turned if chosen[i])


def _has_one_loop(layout: Layout, *faces: int) -> bool:
    return bool((layout.mesh.face_n_loops[list(faces)] == 1).all())


def _apart(layout: Layout, group: set[int], numbers: list[int]) -> str:
    which = ", ".join(map(str, sorted(numbers)))
    sides = layout.mesh.face.reshape(-1, 2)
    touching = np.isin(sides, sorted(group)).all(axis=1) & (sides[:, 0] != sides[:, 1])
    if not touching.any():
        return f"Parcels {which} do not all touch: only neighbours can be one parcel."
    return f"Parcels {which} enclose a lake or other parcels between them: they cannot be one."
