"""What streets take of the land, and what they leave of parcels that run to the centreline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.net import street_sides
from urban_processing.blocks.noding import Centrelines
from urban_processing.fabric.frontage import StreetPieces
from urban_processing.fabric.streets_in_land import StreetsInLand
from urban_processing.mesh.overlap import Segments
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.rights_of_way.surfaces import Circles, StreetSides, street_surfaces
from urban_processing.site import GRID

Geometries = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class StreetLand:
    """Land that streets take.

    Parameters
    ----------
    polygons, part
        (W,) right-of-way within each block, less parcels; and piece of the land.
    net_area
        (F,) area of the parcels less right-of-way, m².
    """

    polygons: Geometries
    part: IntArray
    net_area: FloatArray


def nominal_street_land(ground: StreetsInLand) -> Geometries:
    """(B,) what the nominal widths of the streets around and in each block take of it.

    Without rounded corners and turning heads.
    """
    faces, lines = ground.faces, ground.lines
    segments = lines.xy[lines.ends]
    work = Centrelines(segments, lines.line)
    sides = street_sides(work, ground.width, faces, snap=0.0)
    at = sides.segment
    none = np.empty(0)
    surfaces = street_surfaces(
        faces.polygons,
        StreetSides(sides.face, segments[at], ground.width[at], np.zeros(len(at), np.int64)),
        Circles(none.astype(np.int64), none.reshape(0, 2), none, none.astype(np.int64)),
        corner_radius=0.0,
    )
    taken = _united(surfaces.regions, surfaces.block, len(faces.polygons))
    return _areal(shapely.intersection(faces.polygons, taken, grid_size=GRID))


def gross_street_land(ground: StreetsInLand, parcels: Geometries, block: IntArray) -> StreetLand:
    """Take the nominal rights-of-way off parcels that run to the centreline."""
    taken = nominal_street_land(ground)
    area = shapely.area(parcels)
    owner = np.flatnonzero(block >= 0)
    lost = np.zeros(len(parcels))
    lost[owner] = shapely.area(shapely.intersection(parcels[owner], taken[block[owner]]))
    return _street_land(taken, ground.faces.part, area - lost)


def net_street_land(
    ground: StreetsInLand,
    parcels: Geometries,
    streets: Geometries,
    pieces: StreetPieces,
    boundary: Segments,
) -> StreetLand:
    """Return what streets take of the land that is in no parcel.

    That is their nominal right-of-way, what lies between a parcel's frontage and the centreline,
    however wide, and the parcels that are streets.

    Parameters
    ----------
    ground
        Streets and blocks.
    parcels, streets
        Parcels, and those that are streets.
    pieces, boundary
        Pieces of frontage, and the edges that they are on.
    """
    blocks = ground.faces.polygons
    n = len(blocks)
    strips = _strips(ground, pieces, boundary)
    cover = np.concatenate([strips, streets])
    inside, block = _pairs(cover, blocks)
    taken = _united(
        np.concatenate([nominal_street_land(ground), cover[inside]]),
        np.concatenate([np.arange(n), block]),
        n,
    )
    parcel, block = _pairs(parcels, blocks)
    built = _united(parcels[parcel], block, n)
    street = _areal(shapely.intersection(blocks, taken, grid_size=GRID))
    left = _areal(shapely.difference(street, built, grid_size=GRID))
    return _street_land(left, ground.faces.part, shapely.area(parcels))


def _strips(ground: StreetsInLand, pieces: StreetPieces, boundary: Segments) -> Geometries:
    """(A,) land between each piece of frontage and its street."""
    a, b = boundary.start[pieces.edge], boundary.end[pieces.edge]
    p, q = a + pieces.low[:, None] * (b - a), a + pieces.high[:, None] * (b - a)
    lines = ground.lines
    c, d = np.moveaxis(lines.xy[lines.ends[pieces.segment]], 1, 0)
    feet = []
    for place in (p, q):
        share = ((place - c) * (d - c)).sum(axis=1) / ((d - c) ** 2).sum(axis=1)
        feet.append(c + np.clip(share, 0.0, 1.0)[:, None] * (d - c))
    corners = np.stack([p, q, feet[1], feet[0]], axis=1)
    strips = shapely.convex_hull(shapely.multipoints(corners))
    return np.asarray(strips[shapely.get_dimensions(strips) == 2], dtype=object)


def _pairs(polygons: Geometries, blocks: Geometries) -> tuple[IntArray, IntArray]:
    block, polygon = shapely.STRtree(polygons).query(blocks, predicate="intersects")
    order = np.lexsort((polygon, block))
    return polygon[order], block[order]


def _united(polygons: Geometries, owner: IntArray, n: int) -> Geometries:
    """(n,) union of the polygons of each owner."""
    out = np.full(n, shapely.Polygon(), dtype=object)
    order = np.argsort(owner, kind="stable")
    found, first = np.unique(owner[order], return_index=True)
    groups = np.split(polygons[order], first[1:])
    for k, group in zip(found.tolist(), groups, strict=False):
        out[k] = shapely.union_all(group, grid_size=GRID)
    return out


def _areal(geometries: Geometries) -> Geometries:
    """The geometries without lines and points, which overlays leave besides."""
    out = np.array(geometries, dtype=object)
    mixed = np.flatnonzero(shapely.get_type_id(out) == shapely.GeometryType.GEOMETRYCOLLECTION)
    for k in mixed.tolist():
        parts = shapely.get_parts(out[k])
        out[k] = shapely.union_all(parts[shapely.get_dimensions(parts) == 2])
    return out


def _street_land(taken: Geometries, part: IntArray, net_area: FloatArray) -> StreetLand:
    polygons, of = shapely.get_parts(taken, return_index=True)
    kept = shapely.get_dimensions(polygons) == 2
    return StreetLand(polygons[kept], part[of[kept]], net_area)
