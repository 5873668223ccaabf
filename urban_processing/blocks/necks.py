"""Where pieces of land become too narrow: the lines that cut off their tails and necks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray

Geometries = npt.NDArray[np.object_]

MITRE = 1.0
"""How far a disc reaches into a corner, in half widths from its centre."""

LONG = 2.5
"""A tail is cut off if half its outline is longer than this many widths; a corner is one below
about 22°."""

BESIDE_KERB = 0.05
"""Metres by which buffers may miss the outline."""

THICKNESS = 0.2
"""Tails and necks that no circle of this diameter in metres fits into stay."""

BEYOND = 0.5
"""Metres by which the lines go on beyond the outline."""


def neck_lines(pieces: Geometries, width: float) -> Geometries:
    """Lines across pieces of land where these become narrower than a width.

    What a disc of that diameter does not reach is a neck between two wider pieces, or a tail, as
    between two carriageways that part; corners are none unless they are very sharp.

    Parameters
    ----------
    pieces
        Valid polygons in metres.
    width
        Metres.
    """
    if width <= 0 or not len(pieces):
        return np.empty(0, dtype=object)
    inner = shapely.buffer(pieces, -width / 2, join_style="mitre", mitre_limit=MITRE)
    core = shapely.buffer(inner, width / 2 + BESIDE_KERB, join_style="mitre", mitre_limit=MITRE)
    partial = np.flatnonzero(~shapely.is_empty(core))
    tails, of = shapely.get_parts(
        shapely.difference(pieces[partial], core[partial]), return_index=True
    )
    thick = ~shapely.is_empty(shapely.buffer(tails, -THICKNESS / 2))
    tails, outline = tails[thick], shapely.boundary(pieces[partial[of[thick]]])
    across = shapely.difference(shapely.boundary(tails), shapely.buffer(outline, BESIDE_KERB))
    lines, tail = shapely.get_parts(shapely.line_merge(across), return_index=True)
    drawn = shapely.length(lines) > BESIDE_KERB
    lines, tail = lines[drawn], tail[drawn]
    is_neck = np.bincount(tail, minlength=len(tails)) > 1
    is_long = shapely.length(tails) / 2 > LONG * width
    return _prolonged(_straight(lines[(is_neck | is_long)[tail]]))


def _straight(lines: Geometries) -> FloatArray:
    """(n, 2, 2) both ends of lines that do not close."""
    first = shapely.get_coordinates(shapely.get_point(lines, 0))
    last = shapely.get_coordinates(shapely.get_point(lines, -1))
    ends = np.stack([first, last], axis=1)
    return np.asarray(ends[np.hypot(*(last - first).T) > BESIDE_KERB])


def _prolonged(ends: FloatArray) -> Geometries:
    """Lines between ends and a little beyond."""
    way = ends[:, 1] - ends[:, 0]
    way *= BEYOND / np.hypot(way[:, 0], way[:, 1])[:, None]
    return np.asarray(
        shapely.linestrings(np.stack([ends[:, 0] - way, ends[:, 1] + way], axis=1)), dtype=object
    )
