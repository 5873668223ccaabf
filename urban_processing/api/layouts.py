"""Land to layouts in one call."""

from __future__ import annotations

import warnings
from os import PathLike
from typing import Any

import numpy.typing as npt

from urban_processing.api.gathering import gathered
from urban_processing.api.land import land_and_params
from urban_processing.errors import BoundaryError
from urban_processing.io.features import Source
from urban_processing.io.files import read_layout
from urban_processing.io.frames import GeoLayers, GeoLayout
from urban_processing.io.layouts import read_layers
from urban_processing.layout import Layout
from urban_processing.params.optimize import OptimizeParams
from urban_processing.params.resume import PARCEL_LAYER, ResumeParams
from urban_processing.pipelines import cogenerate as pipeline
from urban_processing.pipelines import optimize as optimization
from urban_processing.pipelines import resume as going_on
from urban_processing.progress import MANY_PARCELS, SILENT, Progress
from urban_processing.site import Site


def cogenerate(
    boundary: Source | Site,
    *,
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
) -> GeoLayout:
    """Divide land into well-shaped parcels, all reached by one connected street network.

    Hierarchical co-generation (Chen 2024, sections 3 and 4): level by level, parcels are cut
    along streamlines of a cross field and streets are added along parcel boundaries.

    Parameters
    ----------
    boundary
        A file, GeoDataFrame, GeoSeries or shapely polygon, or a `Site`.
    crs, layer, where, corners, streets, obstacles, locked, rim_lines, entries
        As in `urban_processing.io.boundaries.read_boundary`.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `CogenerateParams`; `min_area` (m²) or `parcels` is needed.

    Returns
    -------
    GeoLayout
        Parcels, streets, junctions, metrics and issues.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both land and parameters are.

    References
    ----------
    Chen, W. et al. (2024). Hierarchical co-generation of parcels and streets in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> layout = cogenerate(shapely.box(0, 0, 200, 120), crs="EPSG:32630", min_area=1500)
    >>> bool(layout.parcels.area_m2.min() >= 1500)
    True
    """
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
    expected = pipeline.estimate(site, params)
    if expected.parcels > MANY_PARCELS and progress is SILENT:
        warnings.warn(
            f"About {expected.parcels:,} parcels: this will take about {expected.seconds:.0f} s. "
            "Give a progress to follow it.",
            stacklevel=2,
        )
    return GeoLayout(pipeline.cogenerate(site, params, progress))


def optimize(
    layout: GeoLayout | Layout | str | PathLike[str] | None = None,
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayout:
    """Smooth the streets and parcel sides of a layout and make its parcels more regular.

    Global optimization (Chen 2024, section 5): vertices move, parcels and streets stay what
    they are.

    Parameters
    ----------
    layout
        A layout, or a layout file, whose parcels and streets may have been edited.
    parcels, streets
        Instead: polygons and lines, as files, GeoDataFrames or geometries.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `OptimizeParams`.

    Returns
    -------
    GeoLayout
        With each energy before and after in the results of its last step.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong.

    References
    ----------
    Chen, W. et al. (2024). Hierarchical co-generation of parcels and streets in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> left, right = shapely.box(0, 0, 30, 40), shapely.box(30, 0, 60, 40)
    >>> street = shapely.LineString([(0, 0), (60, 0)])
    >>> layout = optimize(parcels=[left, right], streets=[street])
    >>> [round(float(area)) for area in layout.parcels.area_m2]
    [1200, 1200]
    """
    params = OptimizeParams.from_values(parameters)
    given = _layout(layout, parcels, streets, params)
    return GeoLayout(optimization.optimize(given, params, progress))


def resume(
    layout: GeoLayout | Layout | str | PathLike[str] | None = None,
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayout:
    """Go on with a layout that stopped at a level, as it is or after it was edited by hand.

    The levels that are still to come (Chen 2024, section 4) and what comes after them, with the
    parameters that the layout was begun with.

    Parameters
    ----------
    layout
        A layout, or a layout file, whose parcels and streets may have been edited.
    parcels, streets
        Instead: polygons and lines, as files, GeoDataFrames or geometries; columns of the parcels
        such as level, locked or stage count. Then `min_area` is needed.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `ResumeParams`.

    Returns
    -------
    GeoLayout
        The same as of one run, where nothing was edited.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong.

    References
    ----------
    Chen, W. et al. (2024). Hierarchical co-generation of parcels and streets in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> land = shapely.box(0, 0, 200, 120)
    >>> begun = cogenerate(land, crs="EPSG:32630", min_area=1500, stop_at_level=2)
    >>> len(begun.parcels), len(resume(begun).parcels)
    (4, 12)
    """
    given_layers = [] if parcels is None else [PARCEL_LAYER]
    params, given = gathered(
        lambda: ResumeParams.from_values(parameters, given_layers),
        lambda: _layout(layout, parcels, streets, ResumeParams.usable(parameters)),
    )
    return GeoLayout(going_on.resume(given, params, progress))


def _layout(
    layout: GeoLayout | Layout | str | PathLike[str] | None,
    parcels: Source | None,
    streets: Source | None,
    params: OptimizeParams | ResumeParams | None,
) -> Layout:
    if (layout is None) == (parcels is None) or (parcels is None) != (streets is None):
        raise BoundaryError("Give a layout, or parcels and streets.")
    snap = OptimizeParams.snap if params is None else params.snap
    if layout is None:
        min_area = None if params is None else params.min_area
        return read_layers(parcels, streets, snap=snap, min_area=min_area)
    if isinstance(layout, GeoLayout):
        return layout.layout
    if isinstance(layout, Layout):
        return layout
    if isinstance(layout, GeoLayers):
        raise BoundaryError(
            "GeoLayers is no layout: give parcels=made.parcels of what subdivide made and "
            "streets=found.block_edges of what find_blocks found."
        )
    if not isinstance(layout, str | PathLike):
        raise BoundaryError(
            f"{type(layout).__name__} is no layout: give what cogenerate made, or its file."
        )
    return read_layout(layout, snap=snap).layout
