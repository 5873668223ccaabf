"""What is compared: layouts, and what is there in the same land."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import geopandas as gpd

from urban_processing.fabric.model import REAL, ComparedFabrics, Fabric
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.fabrics import read_fabric
from urban_processing.io.features import Source
from urban_processing.io.osm import ObservedStreets, read_osm_streets
from urban_processing.params.compare import CompareParams
from urban_processing.progress import SILENT, Progress
from urban_processing.site import Site

OPEN_STREET_MAP = "OpenStreetMap"
"""What the side is called that is there, if all of it comes from OpenStreetMap."""


def read_compared(
    named: Sequence[tuple[str, Any]],
    *,
    parcels: Source | None = None,
    streets: Source | None = None,
    land: Source | None = None,
    osm_file: str | os.PathLike[str] | None = None,
    osm: bool = False,
    params: CompareParams,
    progress: Progress = SILENT,
) -> ComparedFabrics:
    """Read what is compared.

    Parameters
    ----------
    named
        Name, empty for that of the file, and source of each side, as `read_fabric` takes it.
    parcels, streets
        Parcels and streets that are there.
    land
        Polygons that these are cut at; by default the land of the first side.
    osm_file
        Extract of OpenStreetMap with the streets that are there.
    osm
        Whether these are downloaded.
    params
        Parameters of the comparison.
    progress
        Told how far the work is; may stop it.

    Raises
    ------
    BoundaryError
        With everything that is wrong with a side.
    """
    made = []
    for name, source in named:
        fabric = read_fabric(source, params=params)
        made.append(replace(fabric, name=name or fabric.name))
    there = parcels is not None or streets is not None or osm or osm_file is not None
    if not there:
        return ComparedFabrics(tuple(made))
    first = made[0]
    ground = _land_of(first) if land is None else land
    observed = None
    if osm or osm_file is not None:
        site = _site_of(first) if land is None else read_boundary(land)
        observed = read_osm_streets(
            site, osm_file=osm_file, service=params.service, clean=params.clean, progress=progress
        )
    real = read_fabric(
        parcels=parcels,
        streets=streets if observed is None else observed.streets,
        land=ground,
        params=params,
    )
    return ComparedFabrics(tuple(made), _called(real, observed, parcels is not None))


def _called(real: Fabric, observed: ObservedStreets | None, has_parcels: bool) -> Fabric:
    name = REAL if observed is None or has_parcels else OPEN_STREET_MAP
    said = () if observed is None else observed.issues
    return replace(real, name=name, issues=(*said, *real.issues))


def _land_of(fabric: Fabric) -> gpd.GeoSeries:
    series = gpd.GeoSeries(fabric.land, crs=fabric.frame.crs or None)
    return series.translate(*fabric.frame.origin)


def _site_of(fabric: Fabric) -> Site:
    return Site(parts=tuple(fabric.land), frame=fabric.frame)
