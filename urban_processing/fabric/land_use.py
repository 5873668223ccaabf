"""What streets take of the land, and what they leave of parcels that run to the centreline."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.net import street_sides
from urban_processing.blocks.noding import Centrelines
from urban_processing.fabric.streets_in_land import StreetsInLand
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.mesh.polygons import united_by_owner
from urban_processing.rights_of_way.surfaces import Circles, StreetSides, street_surfaces
from urban_processing.site import GRID

Geometries = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class StreetLand:
    """Land that streets take.

    Parameters
    ----------
    polygons, part
        (W,) right-of-way, less parcels, and piece of the land.
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
    taken = united_by_owner(surfaces.regions, surfaces.block, len(faces.polygons))
    return _areal(shapely.intersection(faces.polygons, taken))


def gross_street_land(ground: StreetsInLand, parcels: Geometries, block: IntArray) -> StreetLand:
    """Take the nominal rights-of-way off parcels that run to the centreline."""
    taken = nominal_street_land(ground)
    owner = np.flatnonzero(block >= 0)
    net = shapely.area(parcels)
    net[owner] -= shapely.area(shapely.intersection(parcels[owner], taken[block[owner]]))
    polygons, of = shapely.get_parts(taken, return_index=True)
    kept = shapely.get_dimensions(polygons) == 2
    return StreetLand(polygons[kept], ground.faces.part[of[kept]], net)


def net_street_land(
    ground: StreetsInLand,
    body: shapely.Geometry,
    area: FloatArray,
    streets: Geometries,
    *,
    reach: float,
) -> StreetLand:
    """Return what streets take of the land that is in no parcel.

    That is what is no further from a centreline than half its width and `reach`, as frontage may
    be, and the parcels that are streets.

    Parameters
    ----------
    ground
        Streets and blocks.
    body, area
        Union of the parcels, and (F,) their areas.
    streets
        Parcels that are streets.
    reach
        Metres.
    """
    lines = ground.network.lines(ground.lines)
    near = shapely.buffer(lines, ground.network.edge_width / 2 + reach, quad_segs=4)
    taken = shapely.union_all(np.concatenate([near, streets]))
    gaps = shapely.difference(shapely.union_all(ground.land), body)
    left = shapely.get_parts(shapely.intersection(taken, gaps))
    left = left[shapely.get_dimensions(left) == 2]
    at, of = shapely.STRtree(ground.land).query(
        shapely.point_on_surface(left), predicate="dwithin", distance=GRID
    )
    part = np.zeros(len(left), dtype=np.int64)
    part[at[::-1]] = of[::-1]
    return StreetLand(left, part, area)


def _areal(geometries: Geometries) -> Geometries:
    """The geometries without lines and points, which overlays leave besides."""
    out = np.array(geometries, dtype=object)
    mixed = np.flatnonzero(shapely.get_type_id(out) == shapely.GeometryType.GEOMETRYCOLLECTION)
    for k in mixed.tolist():
        parts = shapely.get_parts(out[k])
        out[k] = shapely.union_all(parts[shapely.get_dimensions(parts) == 2])
    return out
