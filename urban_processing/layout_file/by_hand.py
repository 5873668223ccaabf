"""What people do to layout files in a GIS that their parcels and streets alone do not tell."""

from __future__ import annotations

import sqlite3
from collections.abc import Mapping, Sequence
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import shapely

from urban_processing.assembly import EDITED, land_changes
from urban_processing.errors import BoundaryError
from urban_processing.layout import Layout, Stage, Steering
from urban_processing.schema import BOUNDARY, PARCELS, STREETS
from urban_processing.site import Issue

PRECISION = 100.0
"""Places of streets are kept to so many parts of a metre."""

LAND_CHANGED = "land_changed"
"""Code of the issue that says that edited parcels cover other land than before."""

_CRS_OF_LAYERS = """
SELECT g.table_name, s.organization, s.organization_coordsys_id, s.srs_name
FROM gpkg_geometry_columns g JOIN gpkg_spatial_ref_sys s ON g.srs_id = s.srs_id
"""


def check_crs(path: Path) -> None:
    """Raise `BoundaryError` if parcels or streets were written in another CRS than the rest."""
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True)) as connection:
        rows = connection.execute(_CRS_OF_LAYERS).fetchall()
    code = {name: (str(author), number) for name, author, number, _ in rows}
    called = {name: title for name, _, _, title in rows}
    if BOUNDARY.name not in code:
        return
    other = [
        name
        for name in (PARCELS.name, STREETS.name)
        if name in code and _differ(code[name], code[BOUNDARY.name])
    ]
    if other:
        raise BoundaryError(
            f"The layer {name} of {path} is in {called[name]}, and the layout in "
            f"{called[BOUNDARY.name]}: write it in the CRS of the layout."
            for name in other
        )


def _differ(one: tuple[str, int], other: tuple[str, int]) -> bool:
    """Whether two codes stand for two CRSs; those of CRSs without a code do not tell."""
    return one != other and "EPSG" in (one[0].upper(), other[0].upper())


def street_places(layout: Layout) -> list[list[float]]:
    """Middles of the street edges of a layout in the making, for `barred_where_deleted`."""
    if (layout.face_stage == Stage.DONE).all():
        return []
    mesh = layout.mesh
    middles = mesh.xy[mesh.origin.reshape(-1, 2)[layout.edge_street]].mean(axis=1)
    places: list[list[float]] = (np.round(middles * PRECISION) / PRECISION).tolist()
    return places


def barred_where_deleted(layout: Layout, state: Mapping[str, Any], snap: float) -> Layout:
    """The layout with no street to be laid where one was deleted by hand.

    Parameters
    ----------
    layout
        As it was read.
    state
        What the file says besides its layers.
    snap
        Metres within which edges are the same.
    """
    places = np.asarray(state.get("street_places", []), dtype=np.float64).reshape(-1, 2)
    if not len(places):
        return layout
    mesh = layout.mesh
    edges = shapely.linestrings(mesh.xy[mesh.origin.reshape(-1, 2)])
    place, edge = shapely.STRtree(edges).query(
        shapely.points(places), predicate="dwithin", distance=max(snap, 1.0 / PRECISION)
    )
    kept = np.zeros(len(places), dtype=bool)
    kept[place[layout.edge_street[edge]]] = True
    gone = np.unique(edge[~kept[place]])
    if not len(gone):
        return layout
    steering = layout.edge_steering.copy()
    steering[gone] |= np.uint8(Steering.NO_STREET)
    message = (
        f"{float(mesh.edge_length[gone].sum()):,.0f} m of streets were deleted by hand: none is "
        "laid there again, unless a parcel cannot be reached otherwise."
    )
    issues = (*layout.issues, Issue(EDITED, message))
    return layout.replace(edge_steering=steering, issues=issues)


def land_note(layout: Layout, land: Sequence[shapely.Polygon], snap: float) -> list[Issue]:
    """Say that parcels cover other land than before, if they do; `land` is in local coordinates."""
    before = shapely.union_all(land)
    if before.is_empty:
        return []
    missing, more = land_changes(before, layout, snap)
    said = [
        f"{area:,.0f} m² of {what}"
        for area, what in ((missing, "it belong to no parcel now"), (more, "parcels lie outside"))
        if area
    ]
    if not said:
        return []
    message = f"The land is not what it was: {' and '.join(said)}."
    return [Issue(LAND_CHANGED, message, value=missing + more)]
