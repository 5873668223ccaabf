"""A layout with everything that files of networks have to cope with."""

from __future__ import annotations

import math

import numpy as np
import shapely
from grid_layouts import SIDE, boxes, layout_of

from urban_processing.layout import EdgeKind, GivenStreet, Layout
from urban_processing.mesh.planar import BoolArray, FloatArray
from urban_processing.site import Frame
from urban_processing.street_rules import StreetRules

ODD_CLASS = 'Allee "1" <&>\x07 é'

GIVEN = (
    GivenStreet(ODD_CLASS, math.nan),
    GivenStreet("living_street", 9.5),
    GivenStreet("footway", 2.5),
    GivenStreet("primary", 24.0),
)
GIVEN_LINES = (
    [(0, 2), (2, 2)],
    [(2, 2), (6, 2)],
    [(1, 0), (1, 2)],
    [(2, 2), (2, 5)],
)
STREETS = ([(5, 5), (5, 2)], [(4, 2), (4, 1)])
"""The second one is a dead end."""


def odd_layout(
    crs: str = "EPSG:32630", origin: tuple[float, float] = (690_423.0, 5_700_151.0)
) -> Layout:
    """Three parts: a lake and given streets of any class; a ring alone; a parcel in a parcel."""
    cells = boxes(6, 5, without=[(3, 3)])
    alone = boxes(1, 2, at=(8, 0))
    around = shapely.box(10 * SIDE, 0, 14 * SIDE, 4 * SIDE)
    within = shapely.box(11 * SIDE, SIDE, 12 * SIDE, 2 * SIDE)
    lake = shapely.box(12.5 * SIDE, SIDE, 13 * SIDE, 2 * SIDE)
    polygons = [*cells, *alone, around - within - lake, within]
    plain = layout_of(
        polygons, *STREETS, *GIVEN_LINES, part=[0] * 29 + [1] * 2 + [2] * 2, origin=origin
    )
    fixed = np.full(plain.mesh.n_edges, -1)
    for i, line in enumerate(GIVEN_LINES):
        fixed[_on(plain, shapely.LineString(np.array(line) * SIDE))] = i
    use = np.zeros(plain.mesh.n_faces, dtype=np.int64)
    use[:3] = 1, 2, 1
    return plain.replace(
        frame=Frame(crs, origin),
        edge_fixed=fixed,
        fixed_streets=GIVEN,
        face_use=use,
        land_uses=("parcel", "retail", "a <park> & more"),
        street_rules=StreetRules(laid_out=True),
    )


def rotated(layout: Layout, degrees: float) -> Layout:
    """The same layout turned about its origin."""
    turn = np.radians(degrees)
    matrix = np.array([[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]])
    xy: FloatArray = layout.mesh.xy @ matrix
    mesh = type(layout.mesh)(
        xy, layout.mesh.origin, layout.mesh.next, layout.mesh.face, layout.mesh.n_faces
    )
    return layout.replace(mesh=mesh)


def _on(layout: Layout, line: shapely.LineString) -> BoolArray:
    mesh = layout.mesh
    ends = mesh.xy[mesh.origin.reshape(-1, 2)]
    near = shapely.distance(shapely.points(ends), line).max(axis=1) < 1e-6
    return np.asarray(near & (layout.edge_kind == EdgeKind.INTERIOR) & layout.edge_street)
