"""Streets to blocks, blocks to parcels and back, and parcels through edits, in one call each."""

from __future__ import annotations

from os import PathLike
from typing import TYPE_CHECKING, Any

from urban_processing.blocks.streets import StreetsOnLand
from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.io.blocks import read_blocks, read_streets
from urban_processing.io.editions import read_editions
from urban_processing.io.features import Source
from urban_processing.io.files import read_subdivision
from urban_processing.io.frames import GeoLayers, GeoLayout
from urban_processing.io.observed import read_observed
from urban_processing.layout_file.subdivisions import previous_of
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.blocks import BlocksParams
from urban_processing.params.calibrate import CalibrateParams
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.params.transfer import TransferParams
from urban_processing.parcelling.reuse import Previous
from urban_processing.pipelines import blocks as block_finding
from urban_processing.pipelines import calibrate as calibration
from urban_processing.pipelines import subdivide as subdivision
from urban_processing.pipelines import transfer as persistence
from urban_processing.processes import process_pool
from urban_processing.progress import SILENT, Progress
from urban_processing.schema import BLOCK_EDGES, BLOCKS, PARCELS

if TYPE_CHECKING:
    import geopandas as gpd
from urban_processing.api.gathering import gathered


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
    params, ground = gathered(
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
    params, ground, before, processes = gathered(
        lambda: SubdivideParams.from_values(parameters),
        lambda: read_blocks(
            blocks,
            streets=streets,
            layer=layer,
            where=where,
            crs=crs,
            params=SubdivideParams.usable(parameters),
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


def calibrate(
    parcels: Source | GeoLayers,
    blocks: Source | GeoLayers | None = None,
    *,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
    progress: Progress = SILENT,
    **parameters: Any,
) -> GeoLayers:
    """Measure the parcels of each block, to subdivide blocks into parcels like them.

    Mean and standard deviation of areas and widths give the bounds of each block (Vanegas 2012,
    section 6); what is made can be given to `subdivide` as it is.

    Parameters
    ----------
    parcels
        Observed parcels: a file, GeoDataFrame, GeoSeries or shapely polygons; or what `subdivide`
        made, which has blocks as well.
    blocks
        Polygons of their blocks, likewise, or what `find_blocks` made; by default parcels that
        share sides are one block.
    layer, where, crs
        As in `urban_processing.io.observed.read_observed`.
    progress
        Told how far the work is; may stop it.
    **parameters
        Fields of `CalibrateParams`.

    Returns
    -------
    GeoLayers
        ``blocks`` with their bounds, ``parcels`` with their blocks and widths, and ``issues``.

    Raises
    ------
    BoundaryError, ParameterError
        With everything that is wrong; an `UrbanError` where both layers and parameters are.

    References
    ----------
    Vanegas, C. A. et al. (2012). Procedural generation of parcels in urban modeling. Section 6.

    Examples
    --------
    >>> import shapely
    >>> parcels = [shapely.box(x, 0, x + 10, y) for x, y in ((0, 30), (10, 40), (20, 20))]
    >>> found = calibrate(parcels)
    >>> found.blocks[["area_mean_m2", "min_area", "max_area"]].round(1).values.tolist()
    [[300.0, 136.7, 463.3]]
    """
    if isinstance(parcels, GeoLayers):
        if blocks is None and BLOCKS.name in parcels.made.names:
            blocks = parcels
        parcels = _layer_of(parcels, PARCELS.name)
    if isinstance(blocks, GeoLayers):
        blocks = _without_nan(_layer_of(blocks, BLOCKS.name))
    params, observed = gathered(
        lambda: CalibrateParams.from_values(parameters),
        lambda: read_observed(parcels, blocks, layer=layer, where=where, crs=crs),
    )
    return GeoLayers(calibration.calibrate(observed, params, progress))


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
