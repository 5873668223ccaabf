"""The library in one call: a boundary in, a layout out."""

from __future__ import annotations

import warnings
from collections.abc import Callable
from os import PathLike
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from urban_processing.blocks.streets import StreetsOnLand
from urban_processing.errors import BoundaryError, ParameterError, UrbanError
from urban_processing.io.blocks import read_blocks, read_streets
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.editions import read_editions
from urban_processing.io.features import Source
from urban_processing.io.files import read_layout, read_subdivision
from urban_processing.io.frames import GeoLayers, GeoLayout
from urban_processing.io.layouts import read_layers
from urban_processing.layout import Layout
from urban_processing.layout_file.subdivisions import previous_of
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.blocks import BlocksParams
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.params.optimize import OptimizeParams
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.params.transfer import TransferParams
from urban_processing.parcelling.reuse import Previous
from urban_processing.pipelines import blocks as block_finding
from urban_processing.pipelines import cogenerate as pipeline
from urban_processing.pipelines import optimize as optimization
from urban_processing.pipelines import subdivide as subdivision
from urban_processing.pipelines import transfer as persistence
from urban_processing.pipelines.ground import given_layers
from urban_processing.processes import process_pool
from urban_processing.progress import MANY_PARCELS, SILENT, Progress
from urban_processing.schema import BLOCK_EDGES, BLOCKS, PARCELS
from urban_processing.site import Site

if TYPE_CHECKING:
    import geopandas as gpd


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
    layers = {
        "streets": streets,
        "obstacles": obstacles,
        "locked": locked,
        "rim_lines": rim_lines,
        "entries": entries,
    }
    given = [name for name, value in layers.items() if value is not None]
    if isinstance(boundary, Site):
        given += given_layers(boundary)
    params, site = _gathered(
        lambda: CogenerateParams.from_values(parameters, given),
        lambda: _site(boundary, crs=crs, layer=layer, where=where, corners=corners, **layers),
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


def find_blocks(
    streets: Source | StreetsOnLand,
    *,
    land: Source | None = None,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayers:
    """Find the blocks between streets, less the land that the streets take.

    Parameters
    ----------
    streets
        Centrelines: a file, GeoDataFrame, GeoSeries or shapely lines; their columns may say width,
        class and name.
    land, layer, where, crs
        As in `urban_processing.io.blocks.read_streets`.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `BlocksParams`.

    Returns
    -------
    GeoLayers
        ``blocks``, ``block_edges`` with the streets along them, ``right_of_way`` and ``issues``.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both streets and parameters are.

    References
    ----------
    Vanegas, C. A. et al. (2012). Procedural generation of parcels in urban modeling. Section 3.

    Examples
    --------
    >>> import shapely
    >>> streets = [shapely.box(0, 0, 90, 60).exterior, shapely.LineString([(40, 0), (40, 60)])]
    >>> found = find_blocks(streets, default_width=10)
    >>> found.blocks.area_m2.tolist()
    [1500.0, 2000.0]
    """
    params, ground = _gathered(
        lambda: BlocksParams.from_values(parameters),
        lambda: _streets(streets, land=land, layer=layer, where=where, crs=crs),
    )
    return GeoLayers(block_finding.blocks(ground, params, progress))


def subdivide(
    blocks: Source | GeoLayers,
    *,
    streets: Source | None = None,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
    previous: GeoLayers | str | PathLike[str] | None = None,
    processes: int = 1,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayers:
    """Divide blocks into parcels, each block for itself.

    Parameters
    ----------
    blocks
        Polygons: a file, GeoDataFrame, GeoSeries or shapely polygons, or what `find_blocks` made;
        columns with the names of parameters set these block by block.
    streets, layer, where, crs
        As in `urban_processing.io.blocks.read_blocks`.
    previous
        A subdivision made before, or its file: blocks in which nothing has changed keep their
        parcels, and all parcels their numbers as far as they are the same.
    processes
        Number of processes that work side by side; the result is the same.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `SubdivideParams`.

    Returns
    -------
    GeoLayers
        ``parcels``, ``blocks`` and ``issues``.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both blocks and parameters are.

    References
    ----------
    Vanegas, C. A. et al. (2012). Procedural generation of parcels in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> made = subdivide(shapely.box(0, 0, 90, 60), min_area=600, irregularity=0)
    >>> float(made.parcels.area_m2.sum()), bool(made.parcels.area_m2.min() >= 600)
    (5400.0, True)
    """
    if isinstance(blocks, GeoLayers):
        if streets is None and BLOCK_EDGES.name in blocks.made.names:
            streets = blocks.frame(BLOCK_EDGES.name)
        blocks = _without_nan(blocks.frame(BLOCKS.name))
    usable = not SubdivideParams.problems_with(parameters)
    params, ground, before, processes = _gathered(
        lambda: SubdivideParams.from_values(parameters),
        lambda: read_blocks(
            blocks,
            streets=streets,
            layer=layer,
            where=where,
            crs=crs,
            params=SubdivideParams.from_values(parameters) if usable else None,
        ),
        lambda: _previous(previous),
        lambda: _number_of_processes(processes),
    )
    if processes == 1:
        made = subdivision.subdivide(ground, params, progress, previous=before)
    else:
        with process_pool(processes) as executor:
            made = subdivision.subdivide(
                ground, params, progress, previous=before, executor=executor
            )
    return GeoLayers(MeasuredSubdivision(made).layers())


def _gathered(*steps: Callable[[], Any]) -> list[Any]:
    """Take all steps and return what they give; raise all that is wrong with any together."""
    errors: list[UrbanError] = []
    found = []
    for step in steps:
        try:
            found.append(step())
        except (ParameterError, BoundaryError) as error:
            errors.append(error)
    if errors:
        raise errors[0] if len(errors) == 1 else UrbanError(p for e in errors for p in e.problems)
    return found


def _number_of_processes(given: int) -> int:
    if given < 1:
        raise ParameterError(f"processes must be at least 1; got {given}.")
    return given


def _previous(given: GeoLayers | str | PathLike[str] | None) -> Previous | None:
    if given is None:
        return None
    if isinstance(given, GeoLayers):
        return previous_of(given.made)
    if not isinstance(given, str | PathLike):
        raise BoundaryError(
            f"{type(given).__name__} is no subdivision: give what subdivide made, or its file."
        )
    return read_subdivision(given)


def _without_nan(frame: gpd.GeoDataFrame) -> gpd.GeoDataFrame:
    """A frame of our own layers, in which NaN stands for an empty cell, with None there."""
    attributes = frame.drop(columns=frame.geometry.name).astype(object)
    return frame.assign(**attributes.where(attributes.notna(), None))


def _streets(source: Source | StreetsOnLand, **options: Any) -> StreetsOnLand:
    if not isinstance(source, StreetsOnLand):
        return read_streets(source, **options)
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise BoundaryError(f"Streets are ready as they are: leave out {', '.join(given)}.")
    return source


def transfer(
    before: Source | GeoLayout | GeoLayers,
    after: Source | GeoLayout | GeoLayers,
    *,
    blocks_before: Source | GeoLayers | None = None,
    blocks_after: Source | GeoLayers | None = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayers:
    """Give the parcels after an edit the numbers and columns of the same parcels before it.

    Positions relative to the corners of blocks say which parcel is which (Vanegas 2012,
    section 5). Numbers stay unique; new ones are above all old ones.

    Parameters
    ----------
    before, after
        Parcels: files, GeoDataFrames or geometries; or layouts, also as files: then their
        streets say what a block is. What `subdivide` made has parcels and their blocks.
    blocks_before, blocks_after
        Polygons of blocks, or lines around them, likewise; or what `find_blocks` made.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `TransferParams`.

    Returns
    -------
    GeoLayers
        The layers ``parcels`` and ``changes``.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong.

    References
    ----------
    Vanegas, C. A. et al. (2012). Procedural generation of parcels in urban modeling.

    Examples
    --------
    >>> import shapely
    >>> before = [shapely.box(x, 0, x + 20, 30) for x in (0, 20, 40)]
    >>> after = [shapely.box(x, 0, x + 22, 30) for x in (44, 0, 22)]
    >>> made = transfer(before, after)
    >>> made.parcels.parcel_id.tolist(), made.parcels.change.tolist()
    ([1, 2, 3], ['moved', 'moved', 'moved'])
    """
    params = TransferParams.from_values(parameters)
    old, new = _state(before, blocks_before), _state(after, blocks_after)
    editions = read_editions(old[0], new[0], old[1], new[1])
    return GeoLayers(persistence.transfer(editions, params, progress))


def _state(
    parcels: Source | GeoLayout | GeoLayers, blocks: Source | GeoLayers | None
) -> tuple[Source, Source | None]:
    """Return parcels, and blocks or the streets between them where they are known."""
    if isinstance(blocks, GeoLayers):
        blocks = _layer_of(blocks, BLOCKS.name)
    if isinstance(parcels, GeoLayers):
        if blocks is None and BLOCKS.name in parcels.made.names:
            blocks = parcels.frame(BLOCKS.name)
        return _layer_of(parcels, PARCELS.name), blocks
    if not isinstance(parcels, GeoLayout):
        return parcels, blocks
    return parcels.parcels, parcels.streets if blocks is None else blocks


def _layer_of(layers: GeoLayers, name: str) -> gpd.GeoDataFrame:
    """Return a layer of what an algorithm made."""
    if name not in layers.made.names:
        raise BoundaryError(
            f"There is no layer {name} in {layers!r}; there are {', '.join(layers.made.names)}."
        )
    return layers.frame(name)


def _layout(
    layout: GeoLayout | Layout | str | PathLike[str] | None,
    parcels: Source | None,
    streets: Source | None,
    params: OptimizeParams,
) -> Layout:
    if (layout is None) == (parcels is None) or (parcels is None) != (streets is None):
        raise BoundaryError("Give a layout, or parcels and streets.")
    if layout is None:
        return read_layers(parcels, streets, snap=params.snap)
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
    return read_layout(layout, snap=params.snap).layout


def _site(boundary: Source | Site, **options: Any) -> Site:
    if not isinstance(boundary, Site):
        return read_boundary(boundary, **options)
    given = [name for name, value in options.items() if value is not None]
    if given:
        raise BoundaryError(f"A Site is ready as it is: leave out {', '.join(given)}.")
    return boundary
