"""Lines of streets to a network of edges between junctions, and what is known of each edge."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.intake.osm_lines import HIGHWAY
from urban_processing.io.osm_ways import CLASSES, KEPT_TAGS, NAME
from urban_processing.mesh.components import components
from urban_processing.mesh.places import line_segments, lower_end_first
from urban_processing.site import FloatArray, snap_to_grid

Lines: TypeAlias = npt.NDArray[np.object_]
Tags: TypeAlias = Mapping[str, npt.NDArray[np.object_]]

SAMPLE = 5.0
"""Metres between the places along an edge that are asked which street runs there."""

NEAR = 30.0
"""Metres within which the street that an edge stands for is looked for."""

ON = 1.0
"""Metres within which an edge runs where it was mapped."""

AT_RIM = 1e-3
"""Metres within which the end of a street that was cut lies on the boundary."""

PARALLEL = np.cos(np.deg2rad(30.0))
"""Cosine of the angle that two streets may enclose and still run alongside each other."""

_ROUNDING = 6


def segments_of(lines: Lines) -> tuple[FloatArray, npt.NDArray[np.int64]]:
    """(n, 2, 2) segments of lines from their lower end on, and the (n,) line of each.

    Segments without length are left out.
    """
    pairs, row = line_segments(lines)
    long = (pairs[:, 0] != pairs[:, 1]).any(axis=1)
    return lower_end_first(pairs[long]), row[long]


def network_edges(lines: Lines) -> Lines:
    """Join lines to edges from one junction or dead end to the next.

    Lines meet where they share a vertex, as OpenStreetMap has it: a bridge does not meet what
    it crosses. Stretches that are drawn twice count once. The edges depend neither on the order
    and the direction of the lines nor on where one line ends and the next begins.
    """
    pairs, _ = segments_of(lines)
    if not len(pairs):
        return np.empty(0, dtype=object)
    unique = np.unique(pairs.reshape(-1, 4), axis=0).reshape(-1, 2, 2)
    merged = shapely.line_merge(shapely.multilinestrings(shapely.linestrings(unique)))
    edges = np.asarray(shapely.get_parts(shapely.normalize(merged)), dtype=object)
    keys = [tuple(shapely.get_coordinates(edge).ravel().tolist()) for edge in edges]
    order = sorted(range(len(keys)), key=keys.__getitem__)
    return edges[np.array(order, dtype=np.int64)]


def reaching(edges: Lines, region: shapely.Geometry) -> Lines:
    """Edges that come into a region, and those that meet one of these.

    They are left whole: a dual carriageway that was cut would no longer be closed, and one that
    led to nothing would count as a dead end.
    """
    shapely.prepare(region)
    near = shapely.intersects(region, edges)
    _, node = np.unique(ends_of(edges).reshape(-1, 2), axis=0, return_inverse=True)
    node = node.reshape(-1, 2)
    reached = np.isin(node, node[near]).any(axis=1)
    return np.asarray(edges[reached], dtype=object)


def ends_of(edges: Lines) -> FloatArray:
    """(n, 2, 2) first and last coordinates of edges."""
    first, last = shapely.get_point(edges, 0), shapely.get_point(edges, -1)
    return np.stack([shapely.get_coordinates(first), shapely.get_coordinates(last)], axis=1)


def pieces_of(edges: Lines) -> int:
    """Count the pieces of a network that no edge connects."""
    places, node = np.unique(ends_of(edges).reshape(-1, 2), axis=0, return_inverse=True)
    return len(np.unique(components(len(places), node.reshape(-1, 2))))


def intersections_of(edges: Lines) -> int:
    """Count the places where three or more edges end."""
    _, degree = np.unique(ends_of(edges).reshape(-1, 2), axis=0, return_counts=True)
    return int((degree >= 3).sum())


def cut_at(edges: Lines, parts: Sequence[shapely.Polygon], shortest: float) -> Lines:
    """Edges within the parts of the land; ends at its boundary shorter than `shortest` vanish.

    Where such an end was all that made a junction, the street goes on as one edge.
    """
    kept = []
    for part in parts:
        rim = part.boundary
        shapely.prepare(part)
        inside = shapely.contains_properly(part, edges)
        crossing = edges[~inside & shapely.intersects(part, edges)]
        # a line that touches the boundary between its ends goes on
        within = shapely.line_merge(shapely.intersection(crossing, part))
        pieces = shapely.get_parts(shapely.get_parts(within))
        pieces = pieces[shapely.get_type_id(pieces) == shapely.GeometryType.LINESTRING]
        stub = (shapely.length(pieces) < shortest) & shapely.dwithin(pieces, rim, AT_RIM)
        kept += [edges[inside], pieces[~stub]]
    return network_edges(shapely.transform(np.concatenate(kept), snap_to_grid))


def tags_along(edges: Lines, lines: Lines, tags: Tags) -> dict[str, npt.NDArray[np.object_]]:
    """Say of each edge what is known of the streets that it runs along.

    At places along an edge the nearest street that runs in about the same direction is asked
    for, of several as near that of the highest class. The class and the name are those of the
    longest stretch. What holds of a single carriageway only (lanes, width, bridge, tunnel, layer)
    is taken where it holds for more than half the edge, and is left empty for edges that run
    where none was mapped, such as the middle of a dual carriageway.

    Parameters
    ----------
    edges
        (n,) lines.
    lines, tags
        Streets as mapped, and their tags.

    Returns
    -------
    dict
        (n,) values of each of `KEPT_TAGS`; empty where nothing is known.
    """
    places, direction, edge, weight = _places_along(edges)
    pairs, row = segments_of(lines)
    found, distance = _nearest(places, direction, pairs, _rank(tags[HIGHWAY])[row])
    known = found >= 0
    edge, weight, distance = edge[known], weight[known], distance[known]
    street = row[found[known]]
    out = {}
    for name in KEPT_TAGS:
        values = tags[name][street].astype(str)
        if name in (HIGHWAY, NAME):
            ranks = _rank(values) if name == HIGHWAY else (values == "").astype(np.int64)
            out[name] = _longest(edge, values, weight, ranks, len(edges))
        else:
            values = np.where(distance <= ON, values, "")
            out[name] = _longest(edge, values, weight, (values != "").astype(int), len(edges))
    alone = np.flatnonzero(~np.isin(np.arange(len(edges)), edge))
    if len(alone) and len(lines):  # none runs alongside: what is nearest
        middle = shapely.line_interpolate_point(edges[alone], 0.5, normalized=True)
        nearest = shapely.STRtree(lines).nearest(middle)
        for name in (HIGHWAY, NAME):
            out[name][alone] = tags[name][nearest].astype(str)
    return out


def _rank(classes: npt.NDArray[np.generic]) -> npt.NDArray[np.int64]:
    """Places of classes among `CLASSES`, the highest first."""
    order = {name: i for i, name in enumerate(CLASSES)}
    return np.array([order.get(name, len(order)) for name in classes.tolist()], dtype=np.int64)


def _places_along(
    edges: Lines,
) -> tuple[npt.NDArray[np.object_], FloatArray, npt.NDArray[np.int64], FloatArray]:
    """Points in the middle of short stretches: their direction, edge and length."""
    pairs, edge = segments_of(np.asarray(shapely.segmentize(edges, SAMPLE), dtype=object))
    along = pairs[:, 1] - pairs[:, 0]
    length = np.hypot(*along.T)
    return shapely.points(pairs.mean(axis=1)), along / length[:, None], edge, length


def _nearest(
    places: npt.NDArray[np.object_],
    direction: FloatArray,
    pairs: FloatArray,
    rank: npt.NDArray[np.int64],
) -> tuple[npt.NDArray[np.int64], FloatArray]:
    """(n,) nearest segment that runs alongside each place, -1 for none, and how far it is."""
    segments = shapely.linestrings(pairs)
    tree = shapely.STRtree(segments)
    place, near = tree.query(places, predicate="dwithin", distance=NEAR)
    along = pairs[near, 1] - pairs[near, 0]
    along /= np.hypot(*along.T)[:, None]
    aligned = np.abs((along * direction[place]).sum(axis=1)) >= PARALLEL
    place, near = place[aligned], near[aligned]
    distance = shapely.distance(places[place], segments[near])
    order = np.lexsort((near, rank[near], np.round(distance, _ROUNDING), place))
    first = order[np.unique(place[order], return_index=True)[1]]
    found = np.full(len(places), -1)
    found[place[first]] = near[first]
    far = np.full(len(places), np.inf)
    far[place[first]] = distance[first]
    return found, far


def _longest(
    edge: npt.NDArray[np.int64],
    values: npt.NDArray[np.str_],
    weight: FloatArray,
    rank: npt.NDArray[np.int64],
    n: int,
) -> npt.NDArray[np.object_]:
    """(n,) value that holds for the longest part of each edge; of equal ones the lowest rank."""
    out = np.full(n, "", dtype=object)
    if not len(values):
        return out
    names, value = np.unique(values, return_inverse=True)
    of_value = np.zeros(len(names), dtype=np.int64)
    of_value[value] = rank
    keys, group = np.unique(np.stack([edge, value]), axis=1, return_inverse=True)
    total = np.round(np.bincount(group.ravel(), weights=weight), _ROUNDING)
    order = np.lexsort((keys[1], of_value[keys[1]], -total, keys[0]))
    first = order[np.unique(keys[0][order], return_index=True)[1]]
    out[keys[0][first]] = names[keys[1][first]]
    return out
