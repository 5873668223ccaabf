"""Steering a layout level by level."""

from __future__ import annotations

from os import PathLike
from typing import Any

import numpy.typing as npt

from urban_processing.api.land import land_and_params
from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.io.edits import as_layout
from urban_processing.io.features import Source
from urban_processing.io.frames import GeoLayout
from urban_processing.io.sessions import GeoSession
from urban_processing.layout import Layout
from urban_processing.params.optimize import OptimizeParams
from urban_processing.progress import SILENT, Progress
from urban_processing.session.files import read
from urban_processing.site import Site


def steer(
    boundary: Source | Site | None = None,
    *,
    layout: GeoLayout | Layout | str | PathLike[str] | None = None,
    replay: str | PathLike[str] | None = None,
    crs: object = None,
    layer: str | None = None,
    where: str | None = None,
    corners: Source | npt.ArrayLike | None = None,
    streets: Source | None = None,
    obstacles: Source | None = None,
    locked: Source | None = None,
    rim_lines: Source | None = None,
    entries: Source | npt.ArrayLike | None = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoSession:
    """Begin a session that lays out parcels and streets level by level, edited by you.

    Local control (Chen 2024, section 6, Fig. 15): look at the parcels and streets of a level,
    choose other cuts, undo cuts, keep parks, add streets, and let the system go on.

    Parameters
    ----------
    boundary
        The land, as for `urban_processing.cogenerate`.
    layout
        Instead of land: a layout that `cogenerate` made, stopped at a level or finished, or its
        file.
    replay
        A saved session, or a list of edits, that is done first.
    crs, layer, where, corners, streets, obstacles, locked, rim_lines, entries
        As for `urban_processing.cogenerate`.
    progress
        Told how far replaying is; may stop it.
    **parameters
        With land: fields of `CogenerateParams`; `min_area` (m²) or `parcels` is needed, unless a
        saved session says them.

    Returns
    -------
    GeoSession
        The session.

    Raises
    ------
    BoundaryError, ParameterError, EditError
        With everything that is wrong; `EditError` where edits cannot be done.

    References
    ----------
    Chen, W. et al. (2024). Hierarchical co-generation of parcels and streets in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> session = steer(shapely.box(0, 0, 300, 200), crs="EPSG:32630", parcels=8)
    >>> [session.step().sentence for _ in range(2)]
    ['Level 1: 2 parcels.', 'Level 2: 4 parcels.']
    """
    if (boundary is None) == (layout is None):
        raise BoundaryError("Give the land that a session begins with, or a layout.")
    if parameters.get("stop_at_level") is not None:
        raise ParameterError("A session stops after every level: leave out stop_at_level.")
    saved = None if replay is None else read(replay)
    if layout is not None:
        options = (crs, layer, where, corners, streets, obstacles, locked, rim_lines, entries)
        if parameters or any(option is not None for option in options):
            raise BoundaryError("A layout brings its parameters along: leave out all others.")
        session = GeoSession.of_layout(as_layout(layout, snap=OptimizeParams.snap))
    else:
        if saved is not None and not parameters:
            parameters = saved.params().as_dict()
        site, params = land_and_params(
            boundary,
            parameters,
            crs=crs,
            layer=layer,
            where=where,
            corners=corners,
            streets=streets,
            obstacles=obstacles,
            locked=locked,
            rim_lines=rim_lines,
            entries=entries,
        )
        session = GeoSession.begin(site, params)
    if saved is not None:
        session.replay(saved, progress)
    return session
