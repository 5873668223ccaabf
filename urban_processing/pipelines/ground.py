"""From a site and what was given with it to the layout that a run begins with."""

from __future__ import annotations

import dataclasses

import numpy as np
import shapely

from urban_processing.constraints.ground import divide_land
from urban_processing.constraints.obstacles import take_off_obstacles
from urban_processing.constraints.rim import check_entries, place_on_rim, run_lines
from urban_processing.errors import InfeasibleError, ParameterError
from urban_processing.land import first_layout, simplify_site
from urban_processing.layout import Layout
from urban_processing.mesh.planar import OUTSIDE
from urban_processing.params.base import option_name
from urban_processing.params.cogenerate import CogenerateParams, ObstacleRim, RimStreet
from urban_processing.site import Issue, Site


def lay_ground(
    site: Site, params: CogenerateParams, *, min_area: float, tolerance: float
) -> Layout:
    """Simplify the land, take the obstacles off it, and divide it by what was given.

    Parameters
    ----------
    site
        The land and what was given with it.
    params
        Which rims are streets, and the tolerance for what was given.
    min_area
        Smallest area in m² that a line may leave which prolongs a street.
    tolerance
        Tolerance in metres of the simplification of the boundary; 0 for none.

    Raises
    ------
    BoundaryError, ParameterError
        If obstacles cover the land or an entry, or layers and parameters contradict.
    """
    problems = params.contradictions_with(given_layers(site), option_name)
    if problems:
        raise ParameterError(problems)
    snap = params.snap_tolerance
    site, runs, places = place_on_rim(site, snap=snap)
    site = simplify_site(site, tolerance, keep=places)
    lines = run_lines(site, runs)
    site = take_off_obstacles(site, narrow=max(tolerance, snap), min_area=min_area)
    if len(site.entries):
        check_entries(site)
    rim = params.rim
    if rim is None and (lines or not site.rim_is_street):
        rim = RimStreet.ALONG_LINES if lines else RimStreet.NONE
    site = dataclasses.replace(
        site, rim_is_street=rim in (None, RimStreet.STREET, RimStreet.EXCEPT_LINES)
    )
    return first_layout(
        site,
        min_area=min_area,
        ground=divide_land(site, min_area=min_area, snap=snap),
        rim_lines=lines,
        obstacle_rim_is_street=params.obstacle_rim is ObstacleRim.STREET,
    )


def settle_islands(layout: Layout, *, min_area: float) -> Layout:
    """Take streets off the shores of lakes within a parcel that could not be cut through them.

    No street could lead there; it is told of.

    Raises
    ------
    InfeasibleError
        With one sentence for each parcel with locked land or a ring of given streets in it that
        could not be cut through what it surrounds.
    """
    mesh = layout.mesh
    loops = mesh.loops
    inner = loops.face != OUTSIDE
    inner[mesh.face_loop] = False
    first = loops.half_edges[loops.offsets[:-1]]
    is_land = mesh.face[first ^ 1] != OUTSIDE
    around = np.unique(loops.face[inner & is_land])
    if len(around):
        raise InfeasibleError(
            f"Locked land or a ring of given streets lies within {mesh.face_area[f]:.0f} m² that "
            f"cannot be cut around it into parcels of {min_area:.0f} m²: no street can lead "
            "there. Give a smaller smallest parcel, or leave it out."
            for f in around.tolist()
        )
    shore = loops.half_edges[inner[loops.of_half_edge[loops.half_edges]]] >> 1
    shore = shore[layout.edge_street[shore]]
    if not len(shore):
        return layout
    street, level = layout.edge_street.copy(), layout.edge_level.copy()
    street[shore], level[shore] = False, -1
    length = float(mesh.edge_length[shore].sum())
    issue = Issue(
        code="shore_without_street",
        message=f"{length:.0f} m of the rims of obstacles are no street: their parcels are too "
        "small to be cut, so that no street can lead there.",
        value=length,
    )
    return layout.replace(edge_street=street, edge_level=level, issues=(*layout.issues, issue))


def given_layers(site: Site) -> set[str]:
    """Names of the layers that were given with a site."""
    layers = {
        "streets": site.fixed_streets,
        "obstacles": site.obstacles,
        "locked": site.locked,
        "rim_lines": site.rim_lines,
        "entries": site.entries,
    }
    return {name for name, values in layers.items() if len(values)}


def land_area(site: Site) -> float:
    """Area in m² of the land that parcels are made of: without obstacles and locked land."""
    closed = [*site.obstacles, *(each.polygon for each in site.locked)]
    if not closed:
        return site.area
    return float(shapely.difference(shapely.union_all(site.parts), shapely.union_all(closed)).area)
