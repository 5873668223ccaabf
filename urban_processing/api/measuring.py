"""Measuring and comparing in one call."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import zip_longest
from os import PathLike
from typing import Any

from urban_processing.api.gathering import gathered
from urban_processing.errors import ParameterError
from urban_processing.io.comparison import read_compared
from urban_processing.io.fabrics import Measurable, read_fabric
from urban_processing.io.features import Source
from urban_processing.io.measured import GeoComparison, GeoFabric
from urban_processing.params.compare import CompareParams
from urban_processing.params.measure import MeasureParams
from urban_processing.pipelines import measure as pipeline
from urban_processing.progress import SILENT, Progress


def measure(
    layout: Measurable | None = None,
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    land: Source | None = None,
    crs: object = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoFabric:
    """Measure a layout, or any parcels and streets.

    Parameters
    ----------
    layout
        What `cogenerate`, `optimize` or `subdivide` made, its file, another file with one layer
        of parcels and one of streets, or a GeoDataFrame of either.
    parcels, streets
        Instead: polygons and lines, as files, GeoDataFrames or geometries; one may be left out.
    land
        Polygons that they are cut at; by default what they cover.
    crs
        Projected CRS in metres to work in with layers; the CRS of layers that have none.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `MeasureParams`.

    Returns
    -------
    GeoFabric
        Parcels, streets and blocks with their measures as frames, metrics, and the report.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both layers and parameters are.

    Examples
    --------
    >>> import shapely
    >>> left, right = shapely.box(0, 0, 30, 40), shapely.box(30, 0, 60, 40)
    >>> street = shapely.LineString([(0, 0), (60, 0)])
    >>> found = measure(parcels=[left, right], streets=[street])
    >>> found.metric("parcels"), found.metric("quads_pct")
    (2.0, 100.0)
    >>> found.report("report.html")  # doctest: +SKIP
    """
    params, fabric = gathered(
        lambda: MeasureParams.from_values(parameters),
        lambda: read_fabric(
            layout,
            parcels=parcels,
            streets=streets,
            land=land,
            crs=crs,
            params=MeasureParams.usable(parameters),
        ),
    )
    return GeoFabric.of(pipeline.measure(fabric, params, progress))


def compare(
    *layouts: Measurable | Mapping[str, Measurable],
    names: Sequence[str] = (),
    parcels: Source | None = None,
    streets: Source | None = None,
    osm_file: str | PathLike[str] | None = None,
    osm: bool = False,
    land: Source | None = None,
    crs: object = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoComparison:
    """Set layouts, and what is there in the same land, side by side.

    Parameters
    ----------
    *layouts
        As in `measure`; or one mapping of names to them.
    names
        What the sides are called; by default as their files are.
    parcels, streets
        Parcels and streets that are there: one more side.
    osm_file
        An extract of OpenStreetMap with the streets that are there.
    osm
        Whether these are fetched from OpenStreetMap's server; they are kept for the next time.
    land
        Polygons that what is there is cut at; by default the land of the first layout.
    crs
        Projected CRS in metres to work in with layers; the CRS of layers that have none.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `CompareParams`.

    Returns
    -------
    GeoComparison
        The sides, the table of metrics, the distances of distributions, and the report.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both sides and parameters are.

    Examples
    --------
    >>> import urban_processing as up
    >>> layout = up.cogenerate("sample_data/mauren.gpkg", parcels=300)  # doctest: +SKIP
    >>> found = up.compare(layout, osm_file="mauren.osm.bz2")  # doctest: +SKIP
    >>> found.comparison[["metric", "difference"]]  # doctest: +SKIP
    """
    named = _named(layouts, names)
    usable = CompareParams.usable(parameters)
    params, compared = gathered(
        lambda: CompareParams.from_values(parameters),
        lambda: read_compared(
            named,
            parcels=parcels,
            streets=streets,
            land=land,
            osm_file=osm_file,
            osm=osm,
            crs=crs,
            params=usable or CompareParams(),
            fetch=usable is not None,
            progress=progress.slice(0.0, 0.3),
        ),
    )
    return GeoComparison.of(pipeline.compare_fabrics(compared, params, progress.slice(0.3, 1.0)))


def _named(
    layouts: Sequence[Measurable | Mapping[str, Measurable]], names: Sequence[str]
) -> list[tuple[str, Measurable]]:
    """Layouts with the names that were given to the first of them, or those of a mapping."""
    given = [names] if isinstance(names, str) else list(names)
    plain = [each for each in layouts if not isinstance(each, Mapping)]
    mappings = [each for each in layouts if isinstance(each, Mapping)]
    if mappings and (len(layouts) > 1 or given):
        raise ParameterError(
            "Give either one mapping of names to layouts, or the layouts one by one and what "
            "they are called as names=[...]."
        )
    if mappings:
        return [(str(name), each) for name, each in mappings[0].items()]
    if len(given) > len(layouts):
        raise ParameterError(f"names has {len(given)} names for {len(layouts)} layout(s).")
    return list(zip_longest(given, plain, fillvalue=""))
