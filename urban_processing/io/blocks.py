"""Streets and blocks out of files and frames."""

from __future__ import annotations

from os import PathLike

from urban_processing.blocks.model import Blocks
from urban_processing.blocks.streets import StreetsOnLand
from urban_processing.intake.block_values import block_columns
from urban_processing.intake.blocks import build_blocks
from urban_processing.intake.street_lines import STREET_COLUMNS, build_streets
from urban_processing.io.crs import PYPROJ, asked_crs
from urban_processing.io.features import Source, split_layer_name
from urban_processing.io.layers import layer_in, read_layer
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.schema import BLOCK_EDGES, BLOCKS


def read_streets(
    source: Source,
    *,
    land: Source | None = None,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
) -> StreetsOnLand:
    """Read centrelines of streets, and the land that blocks are cut at.

    Parameters
    ----------
    source
        Lines: a file, a GeoDataFrame, a GeoSeries or shapely geometries. Columns ``width_m``,
        ``class`` (or ``highway``) and ``name`` are looked for.
    land
        Polygons, likewise; ``file.gpkg|layername=land`` names a layer of a file.
    layer, where
        Layer of a file of streets, and which features of it.
    crs
        Projected CRS in metres to work in; the CRS of what has none.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    """
    problems: list[str] = []
    asked = asked_crs(crs, problems)
    lines = read_layer(
        "Streets",
        source,
        problems,
        layer=layer,
        where=where,
        kind="line",
        columns=STREET_COLUMNS,
    )
    ground = None if land is None else read_layer("Land", land, problems, columns=())
    return build_streets(lines, library=PYPROJ, asked=asked, land=ground, problems=problems)


def read_blocks(
    source: Source,
    *,
    streets: Source | None = None,
    layer: str | None = None,
    where: str | None = None,
    crs: object = None,
    params: SubdivideParams | None = None,
) -> Blocks:
    """Read a layer of blocks, with the parameters that its columns set block by block.

    Parameters
    ----------
    source
        Polygons: a file, a GeoDataFrame, a GeoSeries or shapely geometries. Of a file of blocks its
        layer ``blocks`` is read.
    streets
        Lines along the blocks, likewise, that say how wide the streets are; by default the layer
        ``block_edges`` of a file that has one.
    layer, where
        Layer of a file of blocks, and which features of it.
    crs
        Projected CRS in metres to work in; the CRS of blocks that have none.
    params
        What holds where no column says otherwise.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    """
    problems: list[str] = []
    asked = asked_crs(crs, problems)
    if streets is None:
        streets = _own_edges(source)
    polygons = read_layer(
        "Blocks",
        source,
        problems,
        usual=BLOCKS.name,
        layer=layer,
        where=where,
        columns=block_columns(),
    )
    lines = None
    if streets is not None:
        lines = read_layer("Streets", streets, problems, kind="line", columns=STREET_COLUMNS)
    return build_blocks(
        polygons, library=PYPROJ, asked=asked, streets=lines, params=params, problems=problems
    )


def _own_edges(source: Source) -> str | None:
    """The layer of edges in a file of blocks, as a source of its own; None where it has none."""
    if not isinstance(source, str | PathLike):
        return None
    path, _ = split_layer_name(source)
    edges = layer_in(path, BLOCK_EDGES.name)
    return None if edges is None else f"{path}|layername={edges}"
