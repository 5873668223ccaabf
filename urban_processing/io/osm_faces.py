"""Faces of a network that carriageways enclose, blocks, and what of a network is lost."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.io.osm_network import Lines, network_edges, segments_of

NARROW = 25.0
"""Metres across the largest circle within a face up to which it may be what lies between two
carriageways, or between a slip road and its junction."""

LONG_WIDTH, LONG_MEAN_WIDTH, LONG_ROUNDNESS = 40.0, 28.0, 0.4
"""Metres across, metres across on average and roundness up to which a long face may be what lies
between two carriageways that part at their ends; a strip of this roundness is 8 times as long as
it is wide."""

TRIANGLE_AREA, TRIANGLE_WIDTH, TRIANGLE_ROUNDNESS = 1500.0, 35.0, 0.65
"""Area in m², metres across and roundness up to which a face may be the triangle of a junction;
no triangle is rounder than 0.605."""

ROUNDABOUT = 5e3
"""Area in m² up to which a round face may be a roundabout, of a radius of 40 m."""

ROUND = 0.85
"""Roundness (4 pi area / perimeter²) from which on a face is round; a square has 0.785."""

SMALLEST_BLOCK = 100.0
"""Area in m² under which a face is never a block: what remains where ways almost meet."""

LOST = 25.0
"""Metres around a cleaned network beyond which a stretch as mapped is lost: carriageways that
became one line, and junctions that became one, lie nearer."""

STRETCH = 10.0
"""Metres of a street that are lost or not as a whole."""


def faces_of(streets: Lines) -> Lines:
    """Faces that streets enclose on the map, as polygons; a bridge parts what it crosses.

    neatnet looks at these.
    """
    noded = shapely.get_parts(shapely.node(shapely.multilinestrings(streets)))
    return np.asarray(shapely.get_parts(shapely.polygonize(noded)), dtype=object)


def are_blocks(faces: Lines) -> npt.NDArray[np.bool_]:
    """Tell the faces that are blocks from those that carriageways may enclose.

    What dual carriageways and slip roads enclose is narrow, the island of a junction a small
    triangle, and a roundabout round and small. Every other face is a block, whatever the other
    faces of its network are like.

    Parameters
    ----------
    faces
        (n,) polygons in metres.

    Returns
    -------
    numpy.ndarray
        (n,) whether each is a block.
    """
    area, perimeter = shapely.area(faces), shapely.length(faces)
    roundness = 4 * np.pi * area / perimeter**2
    width = 2 * shapely.length(shapely.maximum_inscribed_circle(faces))
    strip = (width < LONG_WIDTH) & (2 * area / perimeter < LONG_MEAN_WIDTH)
    strip &= roundness < LONG_ROUNDNESS
    island = (area < TRIANGLE_AREA) & (width < TRIANGLE_WIDTH) & (roundness < TRIANGLE_ROUNDNESS)
    between = (width < NARROW) | strip | island | are_roundabouts(faces) | (area < SMALLEST_BLOCK)
    return np.asarray(~between, dtype=bool)


def are_roundabouts(faces: Lines) -> npt.NDArray[np.bool_]:
    """Tell the faces that are round and small."""
    area = shapely.area(faces)
    roundness = 4 * np.pi * area / shapely.length(faces) ** 2
    return np.asarray((area < ROUNDABOUT) & (roundness > ROUND), dtype=bool)


def middles_of(faces: Lines) -> Lines:
    """Points in faces that stay within where their rims move a little."""
    circles = shapely.maximum_inscribed_circle(faces)
    return np.asarray(shapely.get_point(circles, 0), dtype=object)


def lost_streets(mapped: Lines, cleaned: Lines) -> Lines:
    """Stretches of a network that have nothing of a cleaned one near them, joined to streets."""
    pairs, _ = segments_of(np.asarray(shapely.segmentize(mapped, STRETCH), dtype=object))
    stretches = np.asarray(shapely.linestrings(pairs), dtype=object)
    middles = shapely.points(pairs.mean(axis=1))
    found, _ = shapely.STRtree(cleaned).query_nearest(middles, max_distance=LOST, all_matches=False)
    lost = np.ones(len(stretches), dtype=bool)
    lost[found] = False
    return network_edges(stretches[lost])
