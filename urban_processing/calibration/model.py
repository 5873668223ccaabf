"""`Observed`: parcels as they are, and the blocks they are in."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.blocks.model import Blocks
from urban_processing.mesh.planar import IntArray
from urban_processing.site import Frame, Issue

ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class Observed:
    """n parcels in local metres.

    Parameters
    ----------
    parcels
        (n,) valid polygons, each ring from its lowest vertex on, in the order of place.
    parcel_id
        (n,) number of each, not unique where a parcel has several pieces.
    frame
        Where the local coordinates lie on the map.
    blocks
        Blocks in the same frame; None where the parcels are to make them.
    columns
        (n,) values of columns of the parcels to be carried along.
    issues
        What reading and repairing has to say.
    input_sha256
        Hash of the input, for provenance.
    """

    parcels: ObjectArray
    parcel_id: IntArray
    frame: Frame
    blocks: Blocks | None = None
    columns: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    issues: tuple[Issue, ...] = ()
    input_sha256: str = ""

    def __len__(self) -> int:
        """Return the number of parcels."""
        return len(self.parcels)
