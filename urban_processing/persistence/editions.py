"""Two states of a layout, ready to be compared."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from urban_processing.site import Frame, Issue

ObjectArray = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class Edition:
    """Parcels of one state, in local metres.

    Parameters
    ----------
    polygons
        (n,) valid polygons or multipolygons.
    columns
        (n,) attributes by name.
    blocks
        Polygons of blocks; None where none were given.
    name
        What to call the layer in messages.
    """

    polygons: ObjectArray
    columns: Mapping[str, npt.NDArray[Any]]
    blocks: ObjectArray | None
    name: str


@dataclass(frozen=True, eq=False)
class Editions:
    """Two states of a layout in one frame, with what reading them has to say."""

    before: Edition
    after: Edition
    frame: Frame
    issues: tuple[Issue, ...]
    input_sha256: str
