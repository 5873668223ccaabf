"""A small town as files of every kind that `measure` and `compare` read."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import geopandas as gpd
import numpy as np
import shapely
from osm_towns import CRS, EAST, NORTH, Town

WIDTH = 8.0
COLUMNS, DEEP, WIDE, LONG = 6, 40.0, 20.0, 120.0
"""Two rows of six plots of 20 by 40 m, a street of 8 m between them and streets around."""


def placed(geometry: Any) -> Any:
    return shapely.transform(geometry, lambda xy: xy + np.array((EAST, NORTH)))


def plots() -> list[shapely.Polygon]:
    half = WIDTH / 2
    rows = [half, DEEP + 3 * half]
    return [
        placed(shapely.box(WIDE * i, low, WIDE * (i + 1), low + DEEP))
        for low in rows
        for i in range(COLUMNS)
    ]


def streets() -> list[shapely.LineString]:
    across = [0.0, DEEP + WIDTH, 2 * (DEEP + WIDTH)]
    lines = [shapely.LineString([(0, y), (LONG, y)]) for y in across]
    lines += [shapely.LineString([(x, 0), (x, across[-1])]) for x in (0.0, LONG)]
    return [placed(line) for line in lines]


def land(*, until: float = LONG) -> shapely.Polygon:
    return placed(shapely.box(0, 0, until, 2 * (DEEP + WIDTH)))


def frame(geometries: Sequence[Any], crs: str | None = CRS, **columns: Any) -> gpd.GeoDataFrame:
    return gpd.GeoDataFrame(columns, geometry=gpd.GeoSeries(list(geometries), crs=crs))


def plot_frame(crs: str | None = CRS) -> gpd.GeoDataFrame:
    uses = ["house"] * 11 + ["school"]
    return frame(plots(), crs, parcel_id=range(101, 113), land_use=uses)


def street_frame(crs: str | None = CRS) -> gpd.GeoDataFrame:
    return frame(streets(), crs, width_m=[WIDTH] * 5)


def write(made: gpd.GeoDataFrame, path: Path, layer: str | None = None, **how: Any) -> Path:
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", "'crs' was not provided")
        made.to_file(path, **({} if layer is None else {"layer": layer}), **how)
    return path


def osm_town(path: Path) -> Path:
    """An extract of OpenStreetMap with the same streets, and a footpath."""
    across = [0.0, DEEP + WIDTH, 2 * (DEEP + WIDTH)]
    town = Town()
    for y in across:
        town.way((-200.0, y), (0.0, y), (LONG / 2, y), (LONG, y), (LONG + 200.0, y))
    for x in (0.0, LONG / 2, LONG):
        town.way((x, -200.0), *[(x, y) for y in across], (x, 300.0))
    town.way((10.0, 0.0), (10.0, 48.0), highway="footway")
    return town.write(path)
