"""Where pieces of land become too narrow: the lines that cut off their tails and necks."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.planar import FloatArray

Geometries = npt.NDArray[np.object_]

SHARPEST = 5.0
"""Corners are cut where a mitre would be longer than this many half widths: below 23°."""

BESIDE_KERB = 0.05
"""Metres by which buffers may miss the outline."""

THICKNESS = 0.2
"""Tails that no circle of this diameter in metres fits into stay."""

BEYOND = 0.5
"""Metres by which the lines go on beyond the outline."""


def neck_lines(pieces: Geometries, width: float) -> Geometries:
    """Lines across pieces of land where these become narrower than a width.

    What a disc of that diameter does not reach is a tail, as between two carriageways that
    part, or a neck between two wider pieces; sharp corners are tails only at their very tip.

    Parameters
    ----------
    pieces
        Valid polygons in metres.
    width
        Metres.
    """
    if width <= 0 or not len(pieces):
        return np.empty(0, dtype=object)
    inner = shapely.buffer(pieces, -width / 2, join_style="mitre", mitre_limit=SHARPEST)
    core = shapely.buffer(inner, width / 2, join_style="mitre", mitre_limit=SHARPEST)
    partial = np.flatnonzero(~shapely.is_empty(core))
    tails, of = shapely.get_parts(
        shapely.difference(pieces[partial], core[partial]), return_index=True
    )
    thick = ~shapely.is_empty(shapely.buffer(tails, -THICKNESS / 2))
    tails, outline = tails[thick], shapely.boundary(pieces[partial[of[thick]]])
    across = shapely.difference(shapely.boundary(tails), shapely.buffer(outline, BESIDE_KERB))
    lines = shapely.get_parts(shapely.line_merge(shapely.get_parts(across)))
    lines = shapely.get_parts(shapely.line_merge(shapely.union_all(lines)))
    return _prolonged(_straight(lines))


def _straight(lines: Geometries) -> FloatArray:
    """(n, 2, 2) both ends of lines, without those that close or have no length."""
    lines = lines[shapely.length(lines) > BESIDE_KERB]
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
