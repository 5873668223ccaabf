"""What an edit must leave as it was: the design requirements (Chen 2024, section 3)."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.access_rule import unreached_parcels_of
from urban_processing.errors import EditError
from urban_processing.layout import Layout
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import IntArray, linear_rings
from urban_processing.session.moment import Moment
from urban_processing.session.wording import beginning, parcels_named
from urban_processing.site import AREA_ROUNDING


def check(before: Moment, after: Moment) -> None:
    """Raise `EditError` where an edit breaks a design requirement that was kept before.

    Every parcel is reached, the streets of each part of the land are one network, no parcel is
    smaller than allowed, and all are simple polygons (Chen 2024, section 3). What was amiss
    before may stay amiss.

    Parameters
    ----------
    before, after
        The moments before the edit, and after it and the streets that it asks for.

    Raises
    ------
    EditError
        With a sentence for each requirement that would be broken.
    """
    changed = _changed(before, after)
    problems = [
        *_improper(after, changed),
        *_small(after, changed),
        *_unreached(before, after),
        *_loose(before.state.layout, after.state.layout),
    ]
    if problems:
        raise EditError(problems)


def _changed(before: Moment, after: Moment) -> IntArray:
    """Faces of parcels that were not there before, or had another area."""
    old = before.state.layout.mesh.face_area
    area = dict(zip(before.parcels, old.tolist(), strict=True))
    known = np.array([area.get(number, np.inf) for number in after.parcels])
    now = after.state.layout.mesh.face_area
    return np.flatnonzero(np.abs(now - known) > AREA_ROUNDING * now)


def _improper(after: Moment, changed: IntArray) -> list[str]:
    """Parcels that are no simple polygons."""
    mesh = after.state.layout.mesh
    one_loop = changed[mesh.face_n_loops[changed] == 1]
    if not len(one_loop):
        return []
    h, offsets = mesh.face_rings(one_loop)
    rings = linear_rings(mesh.xy[mesh.origin[h]], offsets)
    bad = ~shapely.is_valid(shapely.polygons(rings)) | ~shapely.is_ccw(rings)
    if not bad.any():
        return []
    named = parcels_named(after.number(f) for f in one_loop[bad].tolist())
    return [f"The boundary of {named} would cross or touch itself."]


def _small(after: Moment, changed: IntArray) -> list[str]:
    """Parcels that are smaller than allowed."""
    layout, least = after.state.layout, after.state.min_area
    area = layout.mesh.face_area[changed]
    small = (area < least * (1.0 - AREA_ROUNDING)) & ~layout.face_locked[changed]
    return [
        f"Parcel {after.number(int(changed[k]))} would have {area[k]:,.0f} m²; the smallest parcel "
        f"allowed is {least:,.0f} m²."
        for k in np.flatnonzero(small).tolist()
    ]


def _unreached(before: Moment, after: Moment) -> list[str]:
    """Parcels that no street reaches any more."""
    faces = unreached_parcels_of(after.state.layout)
    amiss = unreached_parcels_of(before.state.layout)
    known = {before.number(face) for face in amiss.tolist()}
    lost = np.array([f for f in faces.tolist() if after.number(f) not in known], dtype=np.int64)
    if len(lost) and len(amiss):
        # a piece of a parcel that was not reached before need not be
        polygons = after.state.layout.mesh.face_polygons()[lost]
        tree = shapely.STRtree(before.state.layout.mesh.face_polygons()[amiss])
        held, _ = tree.query(shapely.point_on_surface(polygons), predicate="intersects")
        lost = np.delete(lost, np.unique(held))
    if not len(lost):
        return []
    named = parcels_named(after.number(f) for f in lost.tolist())
    return [f"{beginning(named)} would not be reached by any street."]


def _loose(before: Layout, after: Layout) -> list[str]:
    """Parts of the land whose streets fall into more pieces."""
    was, now = _pieces(before), _pieces(after)
    was = np.append(was, np.zeros(max(len(now) - len(was), 0), dtype=np.int64))[: len(now)]
    several = len(now) > 1
    return [
        f"The streets{f' in part {part + 1} of the land' if several else ''} would be in "
        f"{now[part]} pieces that no street joins."
        for part in np.flatnonzero(now > np.maximum(was, 1)).tolist()
    ]


def _pieces(layout: Layout) -> IntArray:
    """(P,) number of connected pieces of the streets of each part of the land."""
    mesh = layout.mesh
    edges = np.flatnonzero(layout.edge_street)
    n_parts = int(layout.face_part.max()) + 1
    if not len(edges):
        return np.zeros(n_parts, dtype=np.int64)
    ends = mesh.origin.reshape(-1, 2)[edges]
    label = components(mesh.n_vertices, ends)[ends[:, 0]]
    part = layout.face_part[mesh.face.reshape(-1, 2)[edges].max(axis=1)]
    pairs = np.unique(np.column_stack([part, label]), axis=0)
    return np.bincount(pairs[:, 0], minlength=n_parts)
