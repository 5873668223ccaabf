"""What is compared: layouts, and what is there in the same land."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import geopandas as gpd

from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.fabric.model import REAL, ComparedFabrics, Fabric
from urban_processing.io.boundaries import read_boundary
from urban_processing.io.fabrics import is_ready, read_fabric, source_name
from urban_processing.io.features import Source
from urban_processing.io.osm import ObservedStreets, read_osm_streets
from urban_processing.params.compare import CompareParams
from urban_processing.pipelines.measure import side_problems
from urban_processing.progress import SILENT, Progress
from urban_processing.site import Issue, Site

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
    crs: object = None,
    params: CompareParams,
    fetch: bool = True,
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
    crs
        Projected CRS in metres to work in with layers; the CRS of layers that have none.
    params
        Parameters of the comparison.
    fetch
        Whether to go on to OpenStreetMap; not where it is known already that a run cannot begin.
    progress
        Told how far the work is; may stop it.

    Raises
    ------
    BoundaryError
        With everything that is wrong.
    ParameterError
        If it is only that there are fewer than two sides, or none of the name of the reference.
    """
    asked = _Real(parcels, streets, land, osm_file, osm, fetch)
    problems = asked.problems()
    names = [name or source_name(source) for name, source in named]
    wrong_sides = side_problems(names, asked.name, params.reference)
    made = [_side(source, crs, params, problems) for _, source in named]
    real = None
    if asked.name:
        first = made[0] if made else None
        real = _real(asked, first, params, problems, progress)
    if problems:
        raise BoundaryError([*problems, *wrong_sides])
    if wrong_sides:
        raise ParameterError(wrong_sides)
    sides = [
        replace(fabric, name=name)
        for fabric, name in zip(made, names, strict=True)
        if fabric is not None
    ]
    return ComparedFabrics(tuple(sides), real)


@dataclass(frozen=True, eq=False)
class _Real:
    """What was given of what is there."""

    parcels: Source | None
    streets: Source | None
    land: Source | None
    osm_file: str | os.PathLike[str] | None
    osm: bool
    fetch: bool

    @property
    def of_osm(self) -> bool:
        return self.osm or self.osm_file is not None

    @property
    def name(self) -> str:
        """What it is called; empty where nothing was given."""
        if self.parcels is None and self.of_osm:
            return OPEN_STREET_MAP
        return REAL if self.of_osm or not (self.parcels is self.streets is None) else ""

    def problems(self) -> list[str]:
        """What contradicts itself."""
        problems = []
        if self.osm and self.osm_file is not None:
            problems.append("Give osm (--osm) or osm_file (--osm-file), not both.")
        if self.of_osm and self.streets is not None:
            problems.append(
                "Streets that are there come from OpenStreetMap or from a layer (streets, "
                "--street-layer), not from both."
            )
        if self.land is not None and not self.name:
            problems.append(
                "Land is for what is there, of which nothing was given: leave it out, or give "
                "OpenStreetMap, parcels or streets besides."
            )
        return problems


def _side(source: Any, crs: object, params: CompareParams, problems: list[str]) -> Fabric | None:
    try:
        return read_fabric(source, crs=None if is_ready(source) else crs, params=params)
    except BoundaryError as error:
        problems += [problem for problem in error.problems if problem not in problems]
        return None


def _real(
    asked: _Real,
    first: Fabric | None,
    params: CompareParams,
    problems: list[str],
    progress: Progress,
) -> Fabric | None:
    """What is there, in the land of the first side; None where that failed."""
    land = asked.land
    if land is None and first is not None:
        land = _land_of(first)
    streets = asked.streets
    said: tuple[Issue, ...] = ()
    try:
        if asked.of_osm:
            observed = _observed(asked, first, params, problems, progress)
            if observed is None:
                return None
            streets, said = observed.streets, observed.issues
        real = read_fabric(parcels=asked.parcels, streets=streets, land=land, params=params)
    except BoundaryError as error:
        problems += error.problems
        return None
    return replace(real, name=asked.name, issues=(*said, *real.issues))


def _observed(
    asked: _Real,
    first: Fabric | None,
    params: CompareParams,
    problems: list[str],
    progress: Progress,
) -> ObservedStreets | None:
    """Streets of OpenStreetMap; None where there is no land, or no need to look them up."""
    if asked.osm_file is not None and not Path(asked.osm_file).exists():
        raise BoundaryError(f"The OpenStreetMap file {os.fspath(asked.osm_file)} does not exist.")
    if asked.land is not None:
        site = read_boundary(asked.land)
    elif first is not None:
        site = _site_of(first)
    else:
        return None
    if problems or not asked.fetch:  # no long way for a run that cannot begin
        return None
    return read_osm_streets(
        site,
        osm_file=asked.osm_file,
        service=params.service,
        clean=params.clean,
        progress=progress,
    )


def _land_of(fabric: Fabric) -> gpd.GeoSeries:
    series = gpd.GeoSeries(fabric.land, crs=fabric.frame.crs or None)
    return series.translate(*fabric.frame.origin)


def _site_of(fabric: Fabric) -> Site:
    return Site(parts=tuple(fabric.land), frame=fabric.frame)
