"""What an optimized layout may not lose: valid faces, areas, access, shape.

Movements are taken back, where a face would lose one of these, until none does. Since the layout
before loses nothing, this ends; since every face stays a simple polygon and the rim keeps its
shape, the faces still partition the land.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.access_rule import required_frontage
from urban_processing.layout import Layout
from urban_processing.mesh.corners import (
    IRREGULAR,
    polygon_irregularity,
    reported_polygons,
    ring_areas,
)
from urban_processing.mesh.planar import (
    OUTSIDE,
    BoolArray,
    FloatArray,
    IntArray,
    PlanarMesh,
    linear_rings,
)
from urban_processing.site import AREA_ROUNDING, snap_to_grid

WORSE = 0.02
"""A parcel that is irregular may become this much more so; the others do not become irregular."""

FADING = 0.25
"""Largest difference of the shares of the movement between neighbouring vertices: without it a
vertex that is held back makes a kink."""

HALVINGS = 5
"""Number of times that the movement around a face is halved before it is taken back."""


@dataclass(frozen=True, eq=False)
class _Faces:
    """Measures of some faces at given positions."""

    area: FloatArray
    frontage: FloatArray
    irregularity: FloatArray
    sound: BoolArray
    """Simple rings that run counter-clockwise, and no rim edge turned round; others have an
    infinite irregularity."""


def safe_positions(
    layout: Layout, wanted: FloatArray, *, least_frontage: float = 0.0
) -> FloatArray:
    """Return positions as near to the wanted ones as every face allows.

    Parameters
    ----------
    layout
        The layout before.
    wanted
        (V, 2) local coordinates; vertices of the rim keep its shape.
    least_frontage
        Frontage in metres below which no parcel falls that has it before.

    Returns
    -------
    (V, 2) array on the coordinate grid at which no face is inverted or crosses itself, none
    falls under the layout's smallest area, loses its access to a street, or becomes irregular,
    if it was not so before.
    """
    mesh = layout.mesh
    shift = wanted - mesh.xy
    share = np.ones(mesh.n_vertices)
    every = np.arange(mesh.n_faces)
    before = _measured(layout, mesh.xy, every)
    suspects = every
    rounds = 0
    while True:
        xy = np.where(share[:, None] > 0, snap_to_grid(mesh.xy + share[:, None] * shift), mesh.xy)
        after = _measured(layout, xy, suspects)
        bad = suspects[_loses(layout, before, after, suspects, least_frontage)]
        if len(bad) == 0:
            return xy
        half_edges, _ = mesh.face_rings(bad)
        at = np.unique(mesh.origin[half_edges])
        less = share.copy()
        less[at] = share[at] / 2 if rounds < HALVINGS else 0.0
        less = _fading(mesh, less)
        suspects = _faces_at(mesh, less < share)
        share, rounds = less, rounds + 1


def _fading(mesh: PlanarMesh, share: FloatArray) -> FloatArray:
    """Lower the shares around low ones, so that no vertex lags far behind its neighbours."""
    out = share.copy()
    for _ in range(round(1 / FADING)):
        np.minimum.at(out, mesh.target, out[mesh.origin] + FADING)
    return out


def _loses(
    layout: Layout, before: _Faces, after: _Faces, faces: IntArray, least_frontage: float
) -> BoolArray:
    area, frontage = before.area[faces], before.frontage[faces]
    least = np.minimum(area, layout.min_area * (1.0 + AREA_ROUNDING))
    needed = np.minimum(frontage, required_frontage(after.area, least=least_frontage))
    was = before.irregularity[faces]
    return np.asarray(
        (before.sound[faces] & ~after.sound)
        | (after.area < least)
        | (after.frontage < needed)
        | (after.irregularity > np.maximum(was + WORSE * (was > IRREGULAR), IRREGULAR))
    )


def _measured(layout: Layout, xy: FloatArray, faces: IntArray) -> _Faces:
    """Measure faces with the mesh's vertices at `xy`."""
    mesh = layout.mesh
    half, offsets = mesh.face_rings(faces)
    points = xy[mesh.origin[half]]
    edge = xy[mesh.target[half]] - points
    length = np.hypot(edge[:, 0], edge[:, 1])
    on_street = np.where(layout.edge_street[half >> 1], length, 0.0)
    area = ring_areas(points, offsets)
    simple = shapely.is_valid(shapely.polygons(linear_rings(points, offsets)))
    old = mesh.xy[mesh.target[half]] - mesh.xy[mesh.origin[half]]
    turned = mesh.edge_is_boundary[half >> 1] & ((edge * old).sum(axis=1) <= 0)
    sound = simple & (area > 0) & ~np.logical_or.reduceat(turned, offsets[:-1])
    irregularity = np.full(len(faces), np.inf)
    if sound.any():
        good, good_offsets = mesh.face_rings(faces[sound])
        outline = xy[mesh.origin[good]]
        corners, corner_offsets = reported_polygons(outline, good_offsets)
        irregularity[sound] = polygon_irregularity(outline[corners], corner_offsets)
    return _Faces(
        area=np.maximum(area, 0.0),
        frontage=np.add.reduceat(on_street, offsets[:-1]),
        irregularity=irregularity,
        sound=np.asarray(sound),
    )


def _faces_at(mesh: PlanarMesh, vertices: BoolArray) -> IntArray:
    """Faces that meet at one of the chosen vertices, (V,)."""
    faces = mesh.face[vertices[mesh.origin]]
    return np.unique(faces[faces != OUTSIDE])


def moved_to(layout: Layout, xy: FloatArray) -> Layout:
    """Return the layout with its vertices at other positions."""
    mesh = layout.mesh
    return layout.replace(mesh=PlanarMesh(xy, mesh.origin, mesh.next, mesh.face, mesh.n_faces))
