"""Carriageways, roundabouts and slip roads to plain streets and junctions, by neatnet."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any

import numpy as np
import pyproj
import shapely

from urban_processing.errors import DependencyError
from urban_processing.io.osm_network import Lines, ends_of, network_edges, pieces_of
from urban_processing.io.osm_ways import objects
from urban_processing.site import snap_to_grid

FEWEST_FACES = 2
"""Faces of a network that neatnet needs to tell small ones from blocks."""

MANY_FACES = 50
"""Faces from which on neatnet may find by itself what divides small ones from blocks."""

SMALL_FACE = 7.0
"""Logarithm of area times compactness that divides them in smaller networks; neatnet's own where
it finds none. Between two clusters of few blocks it would find one that takes blocks away."""

ROUNDABOUT = 5e3
"""Area in m² up to which a face among artifacts may be a roundabout; neatnet's 50,000 takes blocks
away whose only neighbours are such."""

LONG_FACE = 2e4
"""Area in m² up to which a long face beside an artifact is one, too: those of this area are 43 m
wide at most; neatnet's 100,000 takes blocks between parallel streets away, with the dead ends in
them."""

REACH = 30.0
"""Metres within which the end of a motorway's slip road follows a street that was moved."""

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
    2026): faces of the network that are too small or too narrow for a block are replaced by the
    line in their middle, in a way that streets go on as before. It knows nothing of levels and
    would draw a street into the motorway above it: motorways stay as they are mapped, and their
    slip roads end where the street is that they led to.

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
    faces = shapely.get_parts(shapely.polygonize(streets))
    if len(faces) < FEWEST_FACES:
        why = f"neatnet needs a network that encloses {FEWEST_FACES} faces or more"
        return CleanedNetwork(mapped, failure=why if len(faces) else "")
    lines, skipped, failure = _neatified(streets, crs, len(faces) >= MANY_FACES)
    if failure:
        return CleanedNetwork(mapped, failure=failure)
    ground, slip_roads = _met(network_edges(lines), motorways, streets)
    edges = network_edges(np.concatenate([ground, slip_roads]))
    severed = max(0, pieces_of(edges) - pieces_of(mapped))
    return CleanedNetwork(edges, skipped=skipped, severed=severed)


def _neatified(streets: Lines, crs: pyproj.CRS, many: bool) -> tuple[Lines, int, str]:
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
                result = neatnet.neatify(
                    frame,
                    n_loops=rounds,
                    artifact_threshold=None if many else SMALL_FACE,
                    area_threshold_circles=ROUNDABOUT,
                    area_threshold_blocks=LONG_FACE,
                )
            except _FAILURES as error:
                failure = f"{type(error).__name__}: {_line(error)}"
                continue
        lines = shapely.force_2d(shapely.get_parts(np.asarray(result.geometry, dtype=object)))
        skipped = sum(_SKIPPED in str(note.message) for note in said)
        return np.asarray(shapely.transform(lines, snap_to_grid), dtype=object), skipped, ""
    return streets, 0, failure


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
