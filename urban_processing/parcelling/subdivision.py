"""`Subdivision`: blocks with the parcels that they were divided into."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from urban_processing.blocks.model import Blocks
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.parcelling.ground import Pieces
from urban_processing.parcelling.rules import BlockRules
from urban_processing.provenance import Step
from urban_processing.site import Issue
from urban_processing.tables import Table


@dataclass(frozen=True, eq=False)
class Subdivision:
    """Blocks and the parcels that they were divided into.

    Parameters
    ----------
    blocks
        B blocks.
    wanted
        Rules of each block.
    block_key
        (B,) hash of contour, streets and rules of each block.
    pieces
        The parcels: faces that tile the blocks.
    parcel_id
        (F,) numbers of the parcels, unique.
    issues
        What the blocks do not allow, parcel by parcel.
    changes
        What became of the parcels of the subdivision before; None where there is none.
    history
        Steps that made it, oldest first.
    """

    blocks: Blocks
    wanted: BlockRules
    block_key: npt.NDArray[np.str_]
    pieces: Pieces
    parcel_id: IntArray
    issues: tuple[Issue, ...]
    changes: Table | None
    history: tuple[Step, ...]

    @cached_property
    def polygons(self) -> npt.NDArray[np.object_]:
        """(F,) the parcels as polygons in local metres."""
        return self.pieces.polygons()

    @cached_property
    def edge_frontage(self) -> FloatArray:
        """(N,) length of street along each edge of the rings of the parcels."""
        pieces = self.pieces
        step = pieces.xy[pieces.vertex[pieces.following]] - pieces.xy[pieces.vertex]
        return np.where(pieces.access, np.hypot(step[:, 0], step[:, 1]), 0.0)

    @cached_property
    def frontage(self) -> FloatArray:
        """(F,) length in metres of the boundary of each parcel on streets."""
        pieces = self.pieces
        found = np.bincount(pieces.edge_face, weights=self.edge_frontage, minlength=pieces.n_faces)
        return np.asarray(found, dtype=np.float64)
