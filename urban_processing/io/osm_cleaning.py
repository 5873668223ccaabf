"""Carriageways, roundabouts and slip roads to plain streets and junctions, by neatnet."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj
import shapely

from urban_processing.errors import DependencyError
from urban_processing.io.osm_faces import (
    ROUNDABOUT,
    are_blocks,
    are_roundabouts,
    faces_of,
    lost_streets,
    middles_of,
)
from urban_processing.io.osm_network import Lines, ends_of, network_edges, pieces_of
from urban_processing.io.osm_ways import objects
from urban_processing.site import snap_to_grid

FEWEST_FACES = 2
"""Faces of a network that neatnet needs to tell small ones from blocks."""

LARGEST_ARTIFACT = float(np.log(ROUNDABOUT))
"""Logarithm of area times compactness up to which neatnet takes a face for an artifact, unless
`are_blocks` says otherwise: that of the largest roundabout, which no narrow face reaches. The one
that neatnet would find depends on the other faces, and in a grid it may take the blocks away."""

MOST_LOST = 0.01
"""Share of a network's length that may be lost when it is cleaned: dead ends between carriageways,
and what interchanges have at their rims."""

LONGEST_LOST = 100.0
"""Length in metres of a single street from which on its loss is no matter of cleaning."""

CONSOLIDATED = 2.1
"""Metres within which neatnet makes one of several junctions before it looks at faces."""

REACH = 30.0
"""Metres within which the end of a motorway's slip road follows a street that was moved."""

MOST_GROWN = 0.01
"""Share of its length by which a network may grow by cleaning."""

AT_VERTEX = 0.5
"""Metres to a vertex within which no other is made."""

_FAILURES = (ArithmeticError, AttributeError, LookupError, RuntimeError, TypeError, ValueError)
"""What neatnet raises on networks that it was not made for; shapely's errors are among them."""

_SKIPPED = "has not been simplified"


@dataclass(frozen=True, eq=False)
class CleanedNetwork:
    """Edges of a network that was cleaned.

    Parameters
    ----------
    edges
        Lines from one junction or dead end to the next.
    skipped
        Places that could not be simplified.
    severed
        Pieces of street that no longer reach the others.
    failure
        Why the whole network could not be, and is as it was; empty where it could.
    """

    edges: Lines
    skipped: int = 0
    severed: int = 0
    failure: str = ""


def import_neatnet() -> Any:
    """Return the package neatnet.

    Raises
    ------
    DependencyError
        If it is not installed.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of its dependencies among themselves
            import neatnet
    except ImportError as error:
        raise DependencyError(
            "Cleaning the streets of OpenStreetMap needs the package neatnet: install it with "
            "pip install 'urban_processing[osm]', or take the streets as they are mapped "
            "(clean=False)."
        ) from error
    return neatnet


def cleaned(streets: Lines, motorways: Lines, crs: pyproj.CRS) -> CleanedNetwork:
    """Bring both carriageways of a street to one line, and roundabouts to a junction.

    The method is neatnet's adaptive continuity-preserving simplification (Fleischmann et al.
    2026): faces of the network that are no blocks (`osm_faces.are_blocks`) are replaced by the
    line in their middle, in a way that streets go on as before. Where streets are lost for
    all that (`LONGEST_LOST`, `MOST_LOST`), the faces beside them stay as they are mapped, and the
    whole network if that does not help, or if it would grow (`MOST_GROWN`). neatnet knows nothing
    of levels and would draw a street into the motorway above it: motorways stay as they are
    mapped, and their slip roads end where the street is that they led to.

    Parameters
    ----------
    streets
        Edges in metres between junctions, of a network wider than the land that is looked at: at
        its rim carriageways are not closed and remain.
    motorways
        Edges of motorways and their links.
    crs
        Their projected, metric CRS.

    Raises
    ------
    DependencyError
        If neatnet is not installed.
    """
    mapped = network_edges(np.concatenate([streets, motorways]))
    faces = faces_of(streets)
    if len(faces) < FEWEST_FACES:
        why = f"neatnet needs a network that encloses {FEWEST_FACES} faces or more"
        return CleanedNetwork(mapped, failure=why if len(faces) else "")
    kept, left = are_blocks(faces), 0
    rings = faces[are_roundabouts(faces)]  # no loss: a junction in their middle
    lines, skipped, failure = _neatified(streets, faces[kept], crs)
    lost = lost_streets(streets, np.concatenate([lines, rings]))
    if _share(lost, streets) > MOST_LOST or shapely.length(lost).max(initial=0.0) > LONGEST_LOST:
        beside = shapely.dwithin(shapely.union_all(lost), faces, AT_VERTEX) & ~kept
        left = int(beside.sum())
        lines, skipped, failure = _neatified(streets, faces[kept | beside], crs)
        lost = lost_streets(streets, np.concatenate([lines, rings]))
        if _share(lost, streets) > MOST_LOST:
            failure = f"{shapely.length(lost).sum() / 1e3:.1f} km of streets would be lost"
    # middle lines are shorter than what they stand for: more street is street made up
    grown = float(shapely.length(lines).sum() - shapely.length(streets).sum())
    if grown > MOST_GROWN * float(shapely.length(streets).sum()):
        failure = failure or f"{grown / 1e3:.1f} km of street would be made up"
    if failure:
        return CleanedNetwork(mapped, failure=failure)
    ground, slip_roads = _met(network_edges(lines), motorways, streets)
    edges = network_edges(np.concatenate([ground, slip_roads]))
    severed = max(0, pieces_of(edges) - pieces_of(mapped))
    return CleanedNetwork(edges, skipped=skipped + left, severed=severed)


def _share(lost: Lines, streets: Lines) -> float:
    return float(shapely.length(lost).sum() / shapely.length(streets).sum())


def _neatified(streets: Lines, blocks: Lines, crs: pyproj.CRS) -> tuple[Lines, int, str]:
    """Lines of neatnet, the places that it skipped, and why it failed, if it did.

    Its second round fails where the first one left no face; then the first one's result counts.
    """
    neatnet = import_neatnet()
    import geopandas

    failure = ""
    for rounds in (2, 1):
        # neatnet and what it stands on warn of pandas' deprecations, of networks without
        # artifacts and of places that stay as they are; the last are counted
        with warnings.catch_warnings(record=True) as said:
            warnings.simplefilter("always")
            try:
                frame = geopandas.GeoDataFrame(geometry=streets, crs=crs)
                inside = geopandas.GeoSeries(
                    middles_of(np.concatenate([blocks, _blocks_of(frame)])), crs=crs
                )
                result = neatnet.neatify(
                    frame,
                    n_loops=rounds,
                    exclusion_mask=inside,
                    artifact_threshold=LARGEST_ARTIFACT,
                    area_threshold_blocks=0.0,  # nor do neighbours make a face an artifact
                    area_threshold_circles=0.0,
                )
            except _FAILURES as error:
                failure = f"{type(error).__name__}: {_line(error)}"
                continue
        lines = shapely.force_2d(shapely.get_parts(np.asarray(result.geometry, dtype=object)))
        skipped = sum(_SKIPPED in str(note.message) for note in said)
        return np.asarray(shapely.transform(lines, snap_to_grid), dtype=object), skipped, ""
    return streets, 0, failure


def _blocks_of(frame: Any) -> Lines:
    """Blocks of a network where neatnet has closed its gaps, as it does before it looks at faces.

    A face that a gap of some millimetres left open in the network as mapped is among them.
    """
    neatnet = import_neatnet()
    closed = neatnet.consolidate_nodes(neatnet.fix_topology(frame), tolerance=CONSOLIDATED)
    faces = faces_of(np.asarray(closed.geometry, dtype=object))
    return faces[are_blocks(faces)]


def _met(ground: Lines, motorways: Lines, streets: Lines) -> tuple[Lines, Lines]:
    """Let motorways end on the cleaned network where they met the streets as mapped.

    Returns the cleaned network, with vertices where it is met, and the motorways.
    """
    ground = ground.copy()
    mapped = {tuple(at) for at in shapely.get_coordinates(streets).tolist()}
    ends = sorted({tuple(at) for at in ends_of(motorways).reshape(-1, 2).tolist()} & mapped)
    points = shapely.points(np.array(ends, dtype=np.float64).reshape(-1, 2))
    of, near = shapely.STRtree(ground).query_nearest(points, max_distance=REACH, all_matches=False)
    moved = {}
    for end, edge in zip(of.tolist(), near.tolist(), strict=True):
        ground[edge], moved[ends[end]] = _with_vertex(ground[edge], points[end])
    out = []
    for line in motorways:
        xy = [tuple(at) for at in shapely.get_coordinates(line).tolist()]
        out.append(shapely.LineString([moved.get(at, at) for at in xy]))
    return ground, objects(out)


def _with_vertex(
    line: shapely.LineString, point: shapely.Point
) -> tuple[shapely.LineString, tuple[float, float]]:
    """Return a line with a vertex where it is nearest to a point, and that vertex."""
    xy = shapely.get_coordinates(line)
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(xy, axis=0).T))])
    at = float(shapely.line_locate_point(line, point))
    nearest = int(np.argmin(np.abs(along - at)))
    if abs(along[nearest] - at) < AT_VERTEX:
        return line, (float(xy[nearest, 0]), float(xy[nearest, 1]))
    new = snap_to_grid(shapely.get_coordinates(shapely.line_interpolate_point(line, at)))[0]
    before = int(np.searchsorted(along, at))
    return shapely.LineString(np.insert(xy, before, new, axis=0)), (float(new[0]), float(new[1]))


def _line(error: Exception) -> str:
    lines = str(error).strip().splitlines()
    return lines[0].rstrip(".") if lines else "no reason given"
