"""Features as they were read, before anything is made of them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt

C = TypeVar("C")


@dataclass(frozen=True)
class Features(Generic[C]):
    """Geometries as given.

    Parameters
    ----------
    geometry
        (n,) shapely geometries or None.
    crs
        Horizontal CRS, None where the source has none; of the type that the reader's CRS
        library has for it.
    name
        What to call the source in messages.
    bare
        Whether the source cannot carry a CRS (shapely geometries).
    """

    geometry: npt.NDArray[np.object_]
    crs: C | None
    name: str
    bare: bool = False
