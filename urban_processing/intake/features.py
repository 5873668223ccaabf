"""Features as they were read, before anything is made of them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, Generic, TypeVar

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
        Whether the source cannot carry a CRS (shapely geometries, and what was made of them).
    columns
        (n,) values of those attributes that were asked for and are there, by name.
    """

    geometry: npt.NDArray[np.object_]
    crs: C | None
    name: str
    bare: bool = False
    columns: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)

    def present(self) -> list[int]:
        """Rows that have a geometry."""
        return [i for i, g in enumerate(self.geometry) if g is not None and not g.is_empty]

    def column(self, *names: str) -> npt.NDArray[Any] | None:
        """Return the values of the first of some attributes that is there."""
        return next((self.columns[name] for name in names if name in self.columns), None)
