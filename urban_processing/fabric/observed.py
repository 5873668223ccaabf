"""`ObservedParcels`: parcels as a layer has them, and which of them are streets."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.noding import Centrelines
from urban_processing.layout import PARCEL_USE
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.polygons import united_by_owner
from urban_processing.site import Frame, Issue

Geometries = npt.NDArray[np.object_]

STREET_SHARE, STREET_LENGTH = 0.5, 1.0
"""A street's parcel has at least this share of its area in nominal rights-of-way, and this length
of centreline over the root of its area."""

AVENUE_ROUNDNESS, AVENUE_LENGTH = 0.25, 1.5
"""Or it is thin, that is 4π area / perimeter² at most this (rectangles of 1 : 11), and has this
length of centreline over the root of its area: avenues are wider than their class says."""


@dataclass(frozen=True, eq=False)
class ObservedParcels:
    """P parcels in local metres, on the grid of all coordinates.

    Parameters
    ----------
    polygons
        (P,) valid polygons; a parcel of several pieces is several.
    parcel_id
        (P,) numbers, unique.
    land_use
        (P,) text, `layout.PARCEL_USE` where nothing else is known.
    frame
        Where the local coordinates lie on the map.
    issues
        What reading them has to say.
    input_sha256
        Hash of the input, for provenance.
    """

    polygons: Geometries
    parcel_id: IntArray
    land_use: npt.NDArray[np.object_]
    frame: Frame = field(default_factory=Frame)
    issues: tuple[Issue, ...] = ()
    input_sha256: str = ""

    def __len__(self) -> int:
        """Return the number of parcels."""
        return len(self.polygons)

    @cached_property
    def union(self) -> shapely.Geometry:
        """The land that they cover."""
        # uniting a valid coverage is faster, and only right, where its boundaries match
        covers = shapely.coverage_is_valid(self.polygons)
        unite = shapely.coverage_union_all if covers else shapely.union_all
        return unite(self.polygons)

    def take(self, rows: IntArray | BoolArray) -> ObservedParcels:
        """Return some of the parcels."""
        whole = ("frame", "issues", "input_sha256")
        names = [f.name for f in fields(self) if f.name not in whole]
        return replace(self, **{name: getattr(self, name)[rows] for name in names})


def observed_parcels(polygons: npt.ArrayLike) -> ObservedParcels:
    """Return polygons as parcels of which nothing else is known, numbered as they come."""
    shapes = np.asarray(polygons, dtype=object)
    n = len(shapes)
    return ObservedParcels(
        canonical_rings(shapes),
        np.arange(1, n + 1),
        np.full(n, PARCEL_USE, dtype=object),
    )


def street_parcels(
    polygons: Geometries, work: Centrelines, width: FloatArray, *, snap: float
) -> BoolArray:
    """(P,) which parcels are streets: cadastres have them as parcels, too.

    Centrelines run through it, further than `snap` off its boundary, for `STREET_LENGTH` and the
    rights-of-way cover `STREET_SHARE` of it; or it is an avenue.

    Parameters
    ----------
    polygons
        (P,) parcels.
    work, width
        Segments of streets and the width of each.
    snap
        Metres.
    """
    out = np.zeros(len(polygons), dtype=bool)
    if not len(work.line) or not len(polygons):
        return out
    lines = np.asarray(shapely.linestrings(work.segments), dtype=object)
    parcel, segment = shapely.STRtree(lines).query(polygons, predicate="intersects")
    crossed, own = np.unique(parcel, return_inverse=True)
    inner = shapely.buffer(polygons[crossed], -snap)
    within = shapely.length(shapely.intersection(inner[own], lines[segment]))
    through = np.bincount(own, weights=within, minlength=len(crossed))
    area = shapely.area(polygons[crossed])
    length = through / np.sqrt(area)
    roundness = 4.0 * np.pi * area / shapely.length(polygons[crossed]) ** 2
    out[crossed[(length >= AVENUE_LENGTH) & (roundness <= AVENUE_ROUNDNESS)]] = True
    long = np.flatnonzero(length >= STREET_LENGTH)
    share = _covered(polygons[crossed[long]], lines, width) / area[long]
    out[crossed[long[share >= STREET_SHARE]]] = True
    return out


def _covered(polygons: Geometries, lines: Geometries, width: FloatArray) -> FloatArray:
    """(n,) area in m² of each polygon that lines of some width cover."""
    strips = shapely.buffer(lines, width / 2, quad_segs=4)
    polygon, strip = shapely.STRtree(strips).query(polygons, predicate="intersects")
    order = np.lexsort((strip, polygon))
    covers = united_by_owner(strips[strip[order]], polygon[order], len(polygons))
    return np.asarray(shapely.area(shapely.intersection(polygons, covers)))
