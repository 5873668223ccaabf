"""Ways of OpenStreetMap from its Overpass servers, by osmnx."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any

import shapely

from urban_processing.errors import BoundaryError, DependencyError
from urban_processing.io.osm_ways import TAGS, OsmWays, overpass_filter, ways_of
from urban_processing.io.places import asking, default_cache_folder, import_osmnx

TIMEOUT_SECONDS = 180
"""What a server may take to gather the streets of a town."""

_INSTEAD = "give an extract of OpenStreetMap as a file (--osm-file)"


def fetch_ways(
    near: tuple[float, float, float, float],
    *,
    service: bool = False,
    cache_folder: str | os.PathLike[str] | None = None,
) -> OsmWays:
    """Download the streets for vehicles in a box, or take them from the cache.

    Parameters
    ----------
    near
        West, south, east and north in degrees.
    service
        Whether service ways and tracks count.
    cache_folder
        Where to keep answers; by default the user's cache folder.

    Returns
    -------
    OsmWays
        A line from each node to the next, once in each direction that is driven.

    Raises
    ------
    BoundaryError
        If OpenStreetMap has no street there.
    DependencyError
        If osmnx is not installed or the servers cannot be reached.
    """
    osmnx = import_osmnx("Streets of OpenStreetMap without a file of them")
    folder = default_cache_folder() if cache_folder is None else Path(cache_folder)
    with asking(
        osmnx,
        folder,
        unreached="The streets could not be downloaded: the Overpass server of OpenStreetMap",
        instead=_INSTEAD,
        what="the streets",
        settings={"useful_tags_way": list(TAGS), "requests_timeout": TIMEOUT_SECONDS},
    ):
        graph = _graph(osmnx, near, service)
    at = {node: (values["x"], values["y"]) for node, values in graph.nodes(data=True)}
    lines = [shapely.LineString([at[u], at[v]]) for u, v in graph.edges()]
    return ways_of(lines, [values for *_, values in graph.edges(data=True)])


def _graph(osmnx: Any, near: tuple[float, float, float, float], service: bool) -> Any:
    """Nodes and edges as mapped: nothing is joined before streets are told from other ways."""
    try:
        return osmnx.graph_from_polygon(
            shapely.box(*near),
            simplify=False,
            retain_all=True,
            truncate_by_edge=True,
            custom_filter=overpass_filter(service=service),
        )
    except ValueError as error:
        said = str(error).lower()
        if "no data elements" in said or "no graph nodes" in said:
            raise BoundaryError(
                "OpenStreetMap has no street for vehicles in the boundary or near it."
            ) from error
        raise DependencyError(
            "The Overpass server of OpenStreetMap gave no usable answer: try again later, or "
            f"{_INSTEAD}."
        ) from error
