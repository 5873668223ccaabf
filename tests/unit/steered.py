"""Moments of steering sessions for tests, and what must hold of every one."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable
from typing import TypeVar

import numpy as np
import shapely
from lands import site_of

from urban_processing.errors import EditError
from urban_processing.layout import GivenStreet, Layout
from urban_processing.mesh.planar import BoolArray, FloatArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.pipelines.levels import State, begin, step, with_streets
from urban_processing.session.moment import Moment, first_moment, next_moment
from urban_processing.session.requirements import check
from urban_processing.session.street_edits import add_street
from urban_processing.site import Site

T = TypeVar("T")

ANY = GivenStreet()
"""A street of which nothing is said."""


def moment_of(
    land: shapely.Polygon | Site, *, min_area: float = 600.0, levels: int = 0, rim: bool = True
) -> Moment:
    """The moment after some levels on a land."""
    site = land if isinstance(land, Site) else site_of(land, rim_is_street=rim)
    state = begin(site, CogenerateParams(min_area=min_area))
    for _ in range(levels):
        if not state.finished:
            state = step(state)
    return first_moment(state)


def locked(moment: Moment, parcel: int, use: str) -> Moment:
    """The moment with a parcel that is locked."""
    layout, face = moment.state.layout, moment.face(parcel)
    lock, uses = layout.face_locked.copy(), layout.face_use.copy()
    lock[face], uses[face] = True, len(layout.land_uses)
    layout = layout.replace(face_locked=lock, face_use=uses, land_uses=(*layout.land_uses, use))
    return dataclasses.replace(moment, state=dataclasses.replace(moment.state, layout=layout))


def drawn(
    moment: Moment,
    line: list[tuple[float, float]] | FloatArray,
    *,
    snap: float = 5.0,
    follow: bool = False,
) -> Moment:
    """The moment after a street was added, every parcel reached and all requirements checked."""
    state, _ = add_street(moment, np.asarray(line), snap=snap, follow=follow, given=ANY)
    after = next_moment(moment, with_streets(state))
    check(moment, after)
    return after


def assert_partition(before: State, after: State) -> None:
    """The parcels are proper, fit together, and cover the same land."""
    mesh = after.layout.mesh
    mesh.validate()
    polygons = mesh.face_polygons()
    assert shapely.is_valid(polygons).all()
    assert shapely.coverage_is_valid(polygons)
    land = shapely.coverage_union_all(before.layout.mesh.face_polygons())
    difference = shapely.symmetric_difference(land, shapely.coverage_union_all(polygons))
    assert difference.area <= 1e-8 * land.area


def streets_of(layout: Layout, edges: BoolArray | None = None) -> shapely.Geometry:
    """The lines of some edges, of all streets by default."""
    chosen = layout.edge_street if edges is None else edges
    ends = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[chosen]]
    return shapely.union_all(shapely.linestrings(ends))


def tried(edit: Callable[[], T]) -> T | EditError:
    """What an edit gives, or the error that it raises."""
    try:
        return edit()
    except EditError as error:
        return error
