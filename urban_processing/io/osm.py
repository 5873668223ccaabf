"""Streets of OpenStreetMap within a land, cleaned so that they compare with drawn ones."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
import pyproj
import shapely

from urban_processing.errors import BoundaryError
from urban_processing.intake.osm_lines import HIGHWAY
from urban_processing.io.crs import PYPROJ, WGS84
from urban_processing.io.osm_cleaning import cleaned, import_neatnet
from urban_processing.io.osm_download import fetch_ways
from urban_processing.io.osm_files import read_ways
from urban_processing.io.osm_network import (
    Lines,
    cut_at,
    intersections_of,
    network_edges,
    reaching,
    tags_along,
)
from urban_processing.io.osm_ways import CLASSES, MOTORWAYS, OsmWays, are_streets
from urban_processing.progress import SILENT, Progress
from urban_processing.site import Issue, Site, snap_to_grid

if TYPE_CHECKING:
    import geopandas

ATTRIBUTION = "© OpenStreetMap contributors, ODbL 1.0"
"""The notice that OpenStreetMap's licence asks for wherever its data are shown."""

CLEANED_AROUND = 200.0
"""Metres around the land within which the network is cleaned, before it is cut."""

READ_AROUND = 600.0
"""Metres around the land within which ways are read, so that carriageways close beyond it."""

FAR_FROM_WAYS = 300.0
"""Metres from all ways of a file, footpaths and tracks among them, beyond which it may not cover
the land."""

UNCOVERED = 0.1
"""Share of the land so far from ways from which on it is told."""

SHORTEST_END = 1.0
"""Length in metres under which what the boundary leaves of a street vanishes."""


@dataclass(frozen=True, eq=False)
class ObservedStreets:
    """The streets that are there.

    Parameters
    ----------
    streets
        Lines from junction to junction, cut at the boundary of the land, in its CRS; columns
        highway, name, lanes, width, bridge, tunnel and layer with OpenStreetMap's values, empty
        text where nothing is known. `read_streets` takes it as its source.
    issues
        What was done: the source and its licence, what was left out, what was simplified.
    """

    streets: geopandas.GeoDataFrame
    issues: tuple[Issue, ...] = ()


def read_osm_streets(
    land: Site,
    *,
    osm_file: str | os.PathLike[str] | None = None,
    service: bool = False,
    clean: bool = True,
    cache_folder: str | os.PathLike[str] | None = None,
    progress: Progress = SILENT,
) -> ObservedStreets:
    """Return the streets for vehicles that OpenStreetMap has within a land.

    Carriageways that belong together become one line, roundabouts a junction, and slip roads
    vanish: see `urban_processing.io.osm_cleaning`. That is done on the network some way beyond
    the land, which is then cut at its boundary.

    Parameters
    ----------
    land
        The land, in a CRS.
    osm_file
        An extract of OpenStreetMap: ``.osm``, ``.osm.bz2``, ``.osm.gz`` or ``.osm.pbf``. Without
        one the streets are downloaded, and kept on disk so that they need no network again.
    service
        Whether service ways and tracks count as streets.
    clean
        Whether the network is cleaned; else it is as mapped, joined from junction to junction.
    cache_folder
        Where downloads are kept; by default the user's cache folder.
    progress
        Told what is done.

    Raises
    ------
    BoundaryError
        If the land has no CRS, the file cannot be read, or no street enters the land.
    DependencyError
        If a package or the servers of OpenStreetMap cannot be reached.
    """
    if clean:
        import_neatnet()  # before a download that would be of no use without it
    crs = _crs_of(land)
    near = _bounds_around(land, crs)
    if osm_file is None:
        source = "OpenStreetMap"
        progress.update(0.0, "Downloading streets")
        ways = fetch_ways(near, service=service, cache_folder=cache_folder)
    else:
        source = os.fspath(osm_file)
        ways = read_ways(Path(osm_file), near=near, progress=progress.slice(0.0, 0.4))
    issues = [Issue("osm_source", f"Streets of {source}: {ATTRIBUTION}.")]
    streets = _chosen(ways, source, service, issues)
    lines = _local(streets, land, crs)
    edges = network_edges(lines)
    elsewhere = BoundaryError(_elsewhere(streets, source, _bounds_around(land, crs, 0.0)))
    if not shapely.intersects(shapely.union_all(land.parts), edges).any():
        raise elsewhere
    around = shapely.union_all(shapely.buffer(np.array(land.parts), CLEANED_AROUND))
    mapped = cut_at(edges, land.parts, SHORTEST_END)
    if clean:
        progress.update(0.4, "Cleaning streets")
        fast = np.isin(streets.tags[HIGHWAY].astype(str), sorted(MOTORWAYS))
        ground, motorways = (
            reaching(network_edges(kind), around) for kind in (lines[~fast], lines[fast])
        )
        edges = _cleaned(ground, motorways, crs, issues)
    progress.update(0.9, "Cutting streets at the boundary")
    edges = cut_at(edges, land.parts, SHORTEST_END)
    if not len(edges):
        raise elsewhere
    if clean:
        issues += _smaller(mapped, edges)
    if osm_file is not None:
        issues += _uncovered(_local(ways, land, crs), land, source)
    frame = _frame(edges, lines, streets, land)
    issues.append(_summary(edges))
    progress.update(1.0)
    return ObservedStreets(frame, tuple(issues))


def _crs_of(land: Site) -> pyproj.CRS:
    if not land.frame.crs:
        raise BoundaryError(
            "The boundary has no CRS, so it is not known where on earth it lies: give it one "
            "(--crs) to compare it with OpenStreetMap."
        )
    return PYPROJ.from_text(land.frame.crs)


def _bounds_around(
    land: Site, crs: pyproj.CRS, around: float = READ_AROUND
) -> tuple[float, float, float, float]:
    """West, south, east and north of a box around the land, in degrees."""
    box = shapely.box(*shapely.total_bounds(np.array(land.parts))).buffer(around, join_style=2)
    rim = shapely.get_coordinates(box.segmentize(max(box.length / 40, 1.0))) + land.frame.origin
    degrees = PYPROJ.transform(rim, crs, WGS84)
    (west, south), (east, north) = degrees.min(axis=0).tolist(), degrees.max(axis=0).tolist()
    return west, south, east, north


def _chosen(ways: OsmWays, source: str, service: bool, issues: list[Issue]) -> OsmWays:
    """The ways that are streets for vehicles; says how many are not."""
    streets = ways.take(are_streets(ways, service=service))
    if not len(streets):
        other = f"only {len(ways)} way(s) of other classes" if len(ways) else "no way at all"
        raise BoundaryError(
            f"{source} has no street for vehicles ({', '.join(CLASSES[:6])}, …) near the boundary, "
            f"{other}: check that it is an extract with streets (highway), of this place."
        )
    left = len(ways) - len(streets)
    if left:
        message = (
            f"{left} way(s) of {source} are no streets for vehicles, or closed to them, and count "
            "not" + ("." if service else "; service ways and tracks are among them.")
        )
        issues.append(Issue("osm_left_out", message, value=float(left)))
    if ways.broken:
        message = (
            f"{ways.broken} way(s) of {source} name nodes that it lacks, as extracts cut by a box "
            "do: they are broken there."
        )
        issues.append(Issue("osm_missing_nodes", message, value=float(ways.broken)))
    return streets


def _local(streets: OsmWays, land: Site, crs: pyproj.CRS) -> Lines:
    """Lines in local metres of the land, on the grid of all coordinates."""
    origin = np.array(land.frame.origin)
    lines = shapely.transform(
        streets.lines, lambda xy: snap_to_grid(PYPROJ.transform(xy, WGS84, crs) - origin)
    )
    return np.asarray(lines, dtype=object)


def _elsewhere(streets: OsmWays, source: str, land: tuple[float, float, float, float]) -> str:
    return (
        f"No street enters the boundary: the streets of {source} lie {_range(streets.bounds)}, "
        f"the boundary {_range(land)}. Give an extract that covers the boundary, or check its CRS."
    )


def _range(bounds: Sequence[float]) -> str:
    west, south, east, north = bounds
    return f"at longitude {west:.4f} to {east:.4f}, latitude {south:.4f} to {north:.4f}"


def _cleaned(ground: Lines, motorways: Lines, crs: pyproj.CRS, issues: list[Issue]) -> Lines:
    network = cleaned(ground, motorways, crs)
    if network.failure:
        message = (
            f"The streets could not be cleaned ({network.failure}) and are as mapped: dual "
            "carriageways, roundabouts and slip roads are still there."
        )
        issues.append(Issue("osm_not_cleaned", message))
        return network.edges
    before = len(ground) + len(motorways)
    message = (
        f"{before} edges of the network as mapped, within {CLEANED_AROUND:g} m of the "
        f"boundary, were simplified to {len(network.edges)} (neatnet): dual carriageways to one "
        "line, roundabouts to junctions, slip roads away."
    )
    issues.append(Issue("osm_cleaned", message, value=float(before - len(network.edges))))
    if network.skipped:
        message = f"{network.skipped} place(s) could not be simplified and are as mapped."
        issues.append(Issue("osm_places_not_cleaned", message, value=float(network.skipped)))
    if network.severed:
        message = (
            f"{network.severed} piece(s) of street lost their connection where the network was "
            "simplified, as at interchanges on several levels: look at them on the map."
        )
        issues.append(Issue("osm_severed", message, value=float(network.severed)))
    return network.edges


def _smaller(mapped: Lines, cleaned: Lines) -> list[Issue]:
    """What cleaning took of the network within the boundary."""
    less = float(shapely.length(mapped).sum() - shapely.length(cleaned).sum())
    fewer = intersections_of(mapped) - intersections_of(cleaned)
    message = (
        f"Cleaning made the network within the boundary smaller by {less / 1e3:.2f} km (of "
        f"{shapely.length(mapped).sum() / 1e3:.2f}) and {fewer} intersection(s) (of "
        f"{intersections_of(mapped)})."
    )
    return [Issue("osm_smaller", message, value=less)]


def _uncovered(ways: Lines, land: Site, source: str) -> list[Issue]:
    """Whether a file may be an extract of a part of the land only."""
    parts = shapely.union_all(land.parts)
    reached = shapely.union_all(shapely.buffer(ways, FAR_FROM_WAYS, quad_segs=2))
    share = 1.0 - shapely.intersection(parts, reached).area / parts.area
    if share < UNCOVERED:
        return []
    message = (
        f"{share:.0%} of the land lies more than {FAR_FROM_WAYS:g} m from any way of "
        f"{source}: there is none, or it is an extract that covers only a part of the land."
    )
    return [Issue("osm_uncovered", message, value=share)]


def _frame(edges: Lines, lines: Lines, streets: OsmWays, land: Site) -> geopandas.GeoDataFrame:
    import geopandas

    origin = np.array(land.frame.origin, dtype=np.float64)
    return geopandas.GeoDataFrame(
        tags_along(edges, lines, streets.tags),
        geometry=shapely.transform(edges, lambda xy: xy + origin),
        crs=land.frame.crs,
    )


def _summary(edges: Lines) -> Issue:
    length = float(shapely.length(edges).sum())
    message = f"{len(edges)} edges of streets, {length / 1e3:.1f} km, lie within the boundary."
    return Issue("osm_streets", message, value=length)
