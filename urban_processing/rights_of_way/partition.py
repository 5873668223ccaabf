"""The exact partition of land into right-of-way and what it leaves of each parcel."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.rights_of_way.surfaces import Geometries, Surfaces
from urban_processing.site import GRID

SWALLOWED_SHARE = 0.05
"""A parcel of which the right-of-way leaves less than this share has no net parcel."""

_NO_CLASS = np.iinfo(np.int64).max


@dataclass(frozen=True, eq=False)
class RightsOfWay:
    """Right-of-way and net parcels; together they are the land, without overlap.

    Polygons share their vertices exactly where they meet.

    Parameters
    ----------
    polygons
        (W,) right-of-way, one polygon for each connected piece of one class in one part.
    rank, part
        (W,) class as a number, the highest 0, and part of the land.
    net
        (F,) what is left of each parcel; None where nothing is.
    cut_off
        (F,) area in m² of pieces of each parcel that the right-of-way cuts off from its net
        parcel: they belong to the right-of-way.
    """

    polygons: Geometries
    rank: IntArray
    part: IntArray
    net: Geometries
    cut_off: FloatArray

    @property
    def net_area(self) -> FloatArray:
        """(F,) area of the net parcels in m²; 0 where there is none."""
        return np.asarray(np.nan_to_num(shapely.area(self.net)))


def partition(
    parcels: Geometries,
    edges: Geometries,
    surfaces: Surfaces,
    *,
    block: IntArray,
    part: IntArray,
) -> RightsOfWay:
    """Divide parcels into right-of-way and net parcels.

    All lines are noded together and once, on the grid of all coordinates; the faces between
    them are given out. So gaps and overlaps cannot arise.

    Parameters
    ----------
    parcels
        (F,) polygons.
    edges
        Lines of all parcel boundaries.
    surfaces
        What the streets take of each block.
    block, part
        (F,) block and part of each parcel.
    """
    cut = cut_out(parcels, edges, surfaces, block=block)
    loose, cut_off = _cut_off(cut.faces, cut.owner, cut.net, shapely.area(parcels))
    cut = cut.joined(loose)
    net = np.full(len(parcels), None, dtype=object)
    net[cut.owner[cut.net]] = canonical_rings(cut.faces[cut.net])
    polygons, rank, of_part = cut.rights_of_way(part)
    return RightsOfWay(polygons, rank, of_part, net, cut_off)


@dataclass(frozen=True, eq=False)
class Cut:
    """Faces between the boundaries of parcels and of street surfaces.

    Parameters
    ----------
    faces
        (n,) polygons that tile the parcels.
    owner
        (n,) parcel of each.
    rank
        (n,) class that a face is right-of-way of; a number above all classes where it is none.
    """

    faces: Geometries
    owner: IntArray
    rank: IntArray

    @property
    def net(self) -> BoolArray:
        """(n,) faces that no street takes."""
        return np.asarray(self.rank == _NO_CLASS)

    def joined(self, loose: BoolArray) -> Cut:
        """Give loose faces to the right-of-way with which they share the longest edge."""
        return Cut(self.faces, self.owner, _joined(self.faces, self.rank, loose))

    def rights_of_way(self, part: IntArray) -> tuple[Geometries, IntArray, IntArray]:
        """Unite the right-of-way: polygons, class and part of each; `part` is that of parcels."""
        street = ~self.net
        keys = np.column_stack([part[self.owner[street]], self.rank[street]])
        polygons, key = _dissolved(self.faces[street], keys)
        return polygons, key[:, 1], key[:, 0]


def cut_out(parcels: Geometries, edges: Geometries, surfaces: Surfaces, *, block: IntArray) -> Cut:
    """Node the boundaries of parcels and street surfaces, and give out the faces between them.

    The parameters are those of `partition`.
    """
    faces, owner, inside = _faces(parcels, np.append(edges, surfaces.outlines))
    return Cut(faces, owner, _classes(inside, block[owner], surfaces))


def _faces(parcels: Geometries, lines: Geometries) -> tuple[Geometries, IntArray, FloatArray]:
    """Faces between lines within parcels, the parcel of each and a point inside each."""
    noded = shapely.union_all(lines, grid_size=GRID)
    faces = shapely.get_parts(shapely.polygonize(shapely.get_parts(noded)))
    points = shapely.point_on_surface(faces)
    face, parcel = shapely.STRtree(parcels).query(points, predicate="intersects")
    face, first = np.unique(face, return_index=True)  # the others lie in holes
    return faces[face], parcel[first], shapely.get_coordinates(points[face])


def _classes(points: FloatArray, block: IntArray, surfaces: Surfaces) -> IntArray:
    """Rank of the highest class whose surface a point of a block lies on, or `_NO_CLASS`."""
    point, region = shapely.STRtree(surfaces.regions).query(shapely.points(points))
    own = block[point] == surfaces.block[region]
    point, region = point[own], region[own]
    shapely.prepare(surfaces.regions)
    hit = shapely.intersects_xy(surfaces.regions[region], *points[point].T)
    out = np.full(len(points), _NO_CLASS)
    np.minimum.at(out, point[hit], surfaces.rank[region[hit]])
    return out


def _cut_off(
    faces: Geometries, owner: IntArray, net: BoolArray, parcel_area: FloatArray
) -> tuple[BoolArray, FloatArray]:
    """Faces that are no street, but no net parcel either; their area in each parcel.

    Of the pieces that are left of a parcel the largest is its net parcel, if it is worth
    having.
    """
    at = np.flatnonzero(net)
    area = shapely.area(faces[at])
    order = np.lexsort((at, -area, owner[at]))
    largest = np.r_[True, np.diff(owner[at][order]) != 0] if len(at) else np.empty(0, dtype=bool)
    kept = order[largest]
    kept = kept[area[kept] >= SWALLOWED_SHARE * parcel_area[owner[at[kept]]]]
    loose = net.copy()
    loose[at[kept]] = False
    left = np.flatnonzero(loose)
    cut_off = np.bincount(
        owner[left], weights=shapely.area(faces[left]), minlength=len(parcel_area)
    )
    return loose, np.asarray(cut_off, dtype=np.float64)


def _joined(faces: Geometries, rank: IntArray, loose: BoolArray) -> IntArray:
    """Give loose faces the class of the right-of-way with which they share the longest edge."""
    out = rank.copy()
    left = np.flatnonzero(loose)
    while len(left):
        street = np.flatnonzero(out != _NO_CLASS)
        i, j = shapely.STRtree(faces[street]).query(faces[left], predicate="intersects")
        shared = shapely.length(shapely.intersection(faces[left[i]], faces[street[j]]))
        i, j, shared = i[shared > 0], j[shared > 0], shared[shared > 0]
        order = np.lexsort((out[street[j]], -np.round(shared, 6), i))
        found, first = np.unique(i[order], return_index=True)
        if not len(found):
            out[left] = 0  # a lobe that hangs on a point of its parcel
            break
        out[left[found]] = out[street[j[order[first]]]]
        left = np.delete(left, found)
    return out


def _dissolved(faces: Geometries, key: IntArray) -> tuple[Geometries, npt.NDArray[np.int64]]:
    """Unite the faces of each key; the connected pieces in order, and their keys."""
    if not len(faces):
        return np.empty(0, dtype=object), np.empty((0, 2), dtype=np.int64)
    unique, group = np.unique(key, axis=0, return_inverse=True)
    order = np.argsort(group.ravel(), kind="stable")
    cuts = np.flatnonzero(np.diff(group.ravel()[order])) + 1
    united = [shapely.coverage_union_all(faces[g]) for g in np.split(order, cuts)]
    pieces, of = shapely.get_parts(united, return_index=True)
    pieces = canonical_rings(pieces)
    place = shapely.bounds(pieces)
    order = np.lexsort((place[:, 1], place[:, 0], of))
    return pieces[order], unique[of[order]]
