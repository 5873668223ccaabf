"""Boundaries in: from files, frames or geometries to a `Site` in local metres."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import pyproj
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.features import Features
from urban_processing.intake.given import GIVEN_COLUMNS, GivenLayers
from urban_processing.intake.sites import build_site
from urban_processing.io.crs import PYPROJ, asked_crs
from urban_processing.io.features import Source, read_features, split_layer_name
from urban_processing.site import Site


def read_boundary(
    source: Source,
    *,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
    corners: Source | npt.ArrayLike | None = None,
    streets: Source | None = None,
    obstacles: Source | None = None,
    locked: Source | None = None,
    rim_lines: Source | None = None,
    entries: Source | npt.ArrayLike | None = None,
) -> Site:
    """Read land boundaries and make them ready for the engine.

    All chosen polygons are united (touching ones become one piece of land), repaired where
    they are invalid, brought into a projected, metric CRS that is true to area, and shifted
    to a whole-metre origin. What was changed is said in the site's issues.

    Parameters
    ----------
    source
        A file that GDAL reads, GeoParquet, a GeoDataFrame, a GeoSeries, or shapely polygons.
        Bare shapely polygons without `crs` are taken as metres on a plane without CRS.
    layer
        Layer of a file that has several with polygons.
    where
        Filter on attributes, as after WHERE in SQL: ``"name = 'Wandsworth'"``.
    crs
        Projected, metric CRS to work in. For a source that has no CRS: its CRS. By default
        the source's own CRS where that is metric and true to area within 1 % on the land,
        else a UTM zone, else a local equal-area projection.
    corners
        Points at the corners of a freeform land, as any `source`, or an array (k, 2) of
        coordinates in the CRS of `source`.
    streets
        Lines of streets that the network begins with, as any `source` in any CRS; columns
        ``class`` and ``width_m`` (or ``width``) are kept. Of a file with several layers the one
        with lines is taken, or that named as in ``file.gpkg|layername=roads``.
    obstacles
        Polygons that no cut and no street crosses.
    locked
        Polygons that stay one parcel each; a column ``land_use`` is kept.
    rim_lines
        Lines along the rim of the land that say which part of it is street, or is not.
    entries
        Points on the rim where the network meets the outside, or an array (k, 2).

    Returns
    -------
    Site
        Parts sorted by area, largest first.

    Raises
    ------
    BoundaryError
        With everything that is wrong with the input.

    Examples
    --------
    >>> import shapely
    >>> site = read_boundary(shapely.box(0, 0, 120, 80), crs="EPSG:32630")
    >>> site.frame.crs, site.area
    ('EPSG:32630', 9600.0)
    """
    problems: list[str] = []
    asked = asked_crs(crs, problems)
    features = _read(source, layer, where, problems)
    given_corners = _read_points(corners, "Corners", problems)
    given = GivenLayers(
        fixed_streets=_read_given(streets, "Fixed streets", "line", problems),
        obstacles=_read_given(obstacles, "Obstacles", "polygon", problems),
        locked=_read_given(locked, "Locked land", "polygon", problems),
        rim_lines=_read_given(rim_lines, "Rim lines", "line", problems),
        entries=_read_points(entries, "Entries", problems),
    )
    return build_site(
        features,
        library=PYPROJ,
        asked=asked,
        corners=given_corners,
        given=given,
        problems=problems,
    )


def _read(
    source: Source, layer: str | None, where: str | None, problems: list[str]
) -> Features[pyproj.CRS] | None:
    try:
        return read_features(source, layer=layer, where=where)
    except BoundaryError as error:
        problems += error.problems
        return None


def _read_points(
    points: Source | npt.ArrayLike | None, name: str, problems: list[str]
) -> Features[pyproj.CRS] | None:
    if points is None:
        return None
    try:
        return _read_layer(_as_points(points), "point")
    except BoundaryError as error:
        problems += [f"{name}: {problem}" for problem in error.problems]
        return None


def _read_given(
    source: Source | None, name: str, kind: str, problems: list[str]
) -> Features[pyproj.CRS] | None:
    if source is None:
        return None
    try:
        return _read_layer(source, kind)
    except BoundaryError as error:
        problems += [f"{name}: {problem}" for problem in error.problems]
        return None


def _read_layer(source: Source, kind: str) -> Features[pyproj.CRS]:
    """Read a layer with geometries of a kind; its file may be followed by a layer's name."""
    source, layer = split_layer_name(source)
    return read_features(source, layer=layer, kind=kind, columns=GIVEN_COLUMNS)


def _as_points(points: Source | npt.ArrayLike) -> Source:
    if isinstance(points, list | tuple | np.ndarray) and not any(
        isinstance(item, shapely.Geometry) for item in points
    ):
        try:
            xy = np.asarray(points, dtype=np.float64)
        except (TypeError, ValueError) as error:
            raise BoundaryError("they must be an array (k, 2) of coordinates.") from error
        if xy.ndim != 2 or xy.shape[1] != 2:
            raise BoundaryError(f"they must be an array (k, 2); got shape {xy.shape}.")
        return shapely.points(xy)
    return points
