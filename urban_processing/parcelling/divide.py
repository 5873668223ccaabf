"""Blocks to parcels, each by its own strategy."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
import shapely

from urban_processing.params.subdivide import Patio, Strategy
from urban_processing.parcelling.boxes.divide import divide_by_boxes
from urban_processing.parcelling.compose import ground_of_faces, replace_faces
from urban_processing.parcelling.ground import Ground, Pieces, Rules, join_parts
from urban_processing.parcelling.rows.divide import divide_in_rows
from urban_processing.parcelling.rules import BlockRules
from urban_processing.parcelling.streamline import divide_by_streamlines


class _Divide(Protocol):
    """A strategy: divides each polygon of the ground for itself."""

    def __call__(self, ground: Ground, rules: Rules, *, seed: int) -> Pieces: ...


_STRATEGIES: Mapping[str, _Divide] = {
    Strategy.SKELETON: divide_in_rows,
    Strategy.HYBRID: divide_in_rows,
    Strategy.OBB: divide_by_boxes,
    Strategy.STREAMLINE: divide_by_streamlines,
}


def divide(ground: Ground, wanted: BlockRules, *, seed: int) -> Pieces:
    """Divide each polygon of the ground by its own strategy, and patios by theirs.

    Polygons do not know of each other: the pieces of one do not depend on which others there
    are, nor on their order.

    Parameters
    ----------
    ground
        B polygons.
    wanted
        B rules.
    seed
        Random seed.
    """
    parts = []
    for strategy, run in _STRATEGIES.items():
        rows = np.flatnonzero(wanted.strategy == strategy)
        if len(rows):
            rules = wanted.of(rows)
            pieces = run(ground.of(rows), rules.rules, seed=seed)
            if run is divide_in_rows:
                pieces = _with_whole_divided(pieces, rules.rules, seed=seed)
            parts.append((rows, _with_patios(pieces, rules, seed=seed)))
    return join_parts(parts, ground)


def _with_whole_divided(pieces: Pieces, rules: Rules, *, seed: int) -> Pieces:
    """Divide by boxes what rows have left whole: contours that touch an edge have no skeleton."""
    whole = np.bincount(pieces.block)[pieces.block] == 1
    at_street = np.bincount(pieces.edge_face, weights=pieces.access) > 0
    doubtful = np.flatnonzero(whole & at_street)
    large = shapely.area(pieces.polygons()[doubtful]) > rules.max_area[pieces.block[doubtful]]
    faces = doubtful[large]
    if not len(faces):
        return pieces
    inside = ground_of_faces(pieces, faces)
    divided = divide_by_boxes(inside, rules.of(pieces.block[faces]), seed=seed)
    return replace_faces(pieces, faces, divided)


def _with_patios(pieces: Pieces, wanted: BlockRules, *, seed: int) -> Pieces:
    """Divide the insides of perimeter blocks that are not to stay whole."""
    for patio in Patio:
        if patio is Patio.OPEN:
            continue
        faces = np.flatnonzero(pieces.patio & (wanted.patio[pieces.block] == patio))
        if len(faces):
            inside = ground_of_faces(pieces, faces)
            rules = wanted.rules.of(pieces.block[faces])
            divided = _STRATEGIES[patio](inside, rules, seed=seed)
            pieces = replace_faces(pieces, faces, divided)
    return pieces
