"""Parcels that exist already, as pieces of the ground that they lie on."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import Blocks, rings_of
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.parcelling.ground import Ground, Pieces, UintArray, sort_faces

ON_CONTOUR = 1e-6
"""An edge within so many metres of the contour of its block lies on it."""


@dataclass(frozen=True, eq=False)
class Parcels:
    """P parcels as polygons in local metres.

    Parameters
    ----------
    polygons
        (P,) valid polygons; those of one block share their vertices exactly.
    block
        (P,) row of the block of each.
    lineage, level, patio
        (P,) as in `Pieces`.
    """

    polygons: npt.NDArray[np.object_]
    block: IntArray
    lineage: UintArray
    level: IntArray
    patio: BoolArray


@dataclass(frozen=True, eq=False)
class Previous:
    """A subdivision made before, whose parcels are to stay where nothing has changed.

    Parameters
    ----------
    blocks
        Its blocks; their columns are what was set for single blocks.
    block_key
        (B,) hash of contour, streets and rules of each block.
    parcels
        Its parcels.
    parcel_id
        (P,) their numbers.
    """

    blocks: Blocks
    block_key: npt.NDArray[np.object_]
    parcels: Parcels
    parcel_id: IntArray


def pieces_of_parcels(parcels: Parcels, ground: Ground) -> Pieces:
    """Return parcels as pieces of the ground that they tile.

    Parameters
    ----------
    parcels
        Parcels whose blocks are the polygons of `ground`.
    ground
        The blocks, with their street sides.
    """
    shapes = np.asarray(shapely.orient_polygons(parcels.polygons), dtype=object)
    rings = rings_of(shapes)
    block = parcels.block[rings.edge_block]
    xy, vertex = _numbered(ground, rings.xy, block)
    ends = np.stack([rings.xy, rings.xy[rings.following]], axis=1)
    return sort_faces(
        Pieces(
            xy=xy,
            vertex=vertex,
            offsets=rings.offsets,
            face=rings.block,
            access=_on_streets(ends, block, ground),
            block=parcels.block,
            lineage=parcels.lineage,
            level=parcels.level,
            patio=parcels.patio,
        )
    )


def _numbered(ground: Ground, xy: FloatArray, block: IntArray) -> tuple[FloatArray, IntArray]:
    """Coordinates of all vertices, those of the ground first, and the number of each place."""
    n = len(ground.rings.xy)
    places = np.concatenate(
        [
            np.column_stack([ground.rings.edge_block, ground.rings.xy]),
            np.column_stack([block, xy]),
        ]
    )
    _, first, inverse = np.unique(places + 0.0, axis=0, return_index=True, return_inverse=True)
    lowest = first[inverse.ravel()]
    added = np.unique(lowest[lowest >= n])
    number = np.where(lowest < n, lowest, n + np.searchsorted(added, lowest))
    return places[np.append(np.arange(n), added), 1:], number[n:]


def _on_streets(ends: FloatArray, block: IntArray, ground: Ground) -> BoolArray:
    """(N,) edges that lie on a street side of their block."""
    rings = ground.rings
    sides = np.flatnonzero(ground.access)
    lines = shapely.linestrings(np.stack([rings.xy, rings.xy[rings.following]], axis=1)[sides])
    middle = shapely.points(ends.mean(axis=1))
    edge, side = shapely.STRtree(lines).query(middle, predicate="dwithin", distance=ON_CONTOUR)
    own = block[edge] == rings.edge_block[sides[side]]
    out = np.zeros(len(ends), dtype=bool)
    out[edge[own]] = True
    return out
