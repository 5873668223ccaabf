"""From the coordinates of a source to those that a layout is made in."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.intake.crs_choice import CrsLibrary
from urban_processing.intake.features import Features
from urban_processing.site import FloatArray

C = TypeVar("C")

MAX_STEP_DEGREES = 0.25
"""Longest edge of a geographic boundary that is projected as a straight line."""


@dataclass(frozen=True)
class Projection(Generic[C]):
    """From the source's coordinates to the working CRS; identity where either is missing."""

    source: C | None
    target: C | None
    library: CrsLibrary[C]

    @property
    def is_identity(self) -> bool:
        """Whether coordinates stay as they are."""
        return self.source is None or self.target is None or self.source == self.target

    def of(self, features: Features[C]) -> Projection[C]:
        """The same for other features; those without a CRS have that of the source."""
        source = self.source if features.crs is None else features.crs
        return Projection(source, self.target, self.library)

    def points(self, xy: FloatArray) -> FloatArray:
        """(n, 2) coordinates in the target."""
        if self.source is None or self.target is None or self.is_identity:
            return xy
        return self.library.transform(xy, self.source, self.target)

    def geometry(self, geometry: shapely.Geometry) -> shapely.Geometry:
        """Return a geometry in the target; long edges in degrees become several."""
        return self.geometries(np.array([geometry], dtype=object))[0]

    def geometries(self, geometries: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
        """(n,) geometries in the target; long edges in degrees become several."""
        if self.source is None or self.is_identity:
            return geometries
        if self.library.facts(self.source).geographic:
            geometries = _densified(geometries)
        return np.asarray(shapely.transform(geometries, self.points), dtype=object)


def _densified(geometries: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
    """Geometries in degrees with several edges for each long one.

    GEOS fails on lines without length: alone they are none of those with long edges, as members
    of such they are left out.
    """
    west, south, east, north = shapely.bounds(geometries).T
    wide = np.flatnonzero(np.hypot(east - west, north - south) > MAX_STEP_DEGREES)
    out = np.array(geometries, dtype=object)
    for i in wide[shapely.get_type_id(out[wide]) == shapely.GeometryType.MULTILINESTRING]:
        lines = shapely.get_parts(out[i])
        out[i] = shapely.multilinestrings(lines[shapely.length(lines) > 0])
    out[wide] = shapely.segmentize(out[wide], MAX_STEP_DEGREES)
    return out
