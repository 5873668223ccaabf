"""The straight skeleton of a polygon with holes, and what is left of it at a depth.

A face of the skeleton is the land nearest, in the sense of a wavefront, to one edge of a block:
the first row of parcels along it (Aichholzer et al. 1995; Vanegas 2012, section 4.2.1).
"""

from __future__ import annotations

import numpy as np

from urban_processing.errors import TopologyError
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import FINE_GRID
from urban_processing.skeleton.contour import STRAIGHT, Contour, contour_of
from urban_processing.skeleton.cutting import cut_at_depth
from urban_processing.skeleton.faces import (
    check_faces,
    contracted,
    refined,
    rings_of_faces,
)
from urban_processing.skeleton.model import Skeleton
from urban_processing.skeleton.wavefront import Arcs, Unresolved, propagate

__all__ = ["Skeleton", "cut_at_depth", "straight_skeleton"]

TOLERANCES = (1e-9, 1e-10, 1e-8, 3e-9, 1e-11, 1e-7)
"""Distances within which events are one, as shares of the extent of a polygon, in the order in
which they are tried."""

SIMPLER = (STRAIGHT, 2.0**-18, 2.0**-12)
"""Distances in metres within which vertices are on one straight edge, in the order in which they
are tried: only contours with edges too short for the grid of all coordinates need more than
the first."""


def straight_skeleton(xy: FloatArray, offsets: IntArray) -> Skeleton:
    """Return the straight skeleton of one polygon.

    Parameters
    ----------
    xy
        (N, 2) vertices of its rings in metres: the shell counter-clockwise, then holes
        clockwise, closing points left out. The polygon must be valid.
    offsets
        (R + 1,) where rings begin.

    Returns
    -------
    Skeleton
        It depends neither on where rings begin nor on the order of holes.

    Raises
    ------
    TopologyError
        A ring is no ring, or the skeleton of a nearly degenerate polygon cannot be told.

    References
    ----------
    O. Aichholzer, F. Aurenhammer, D. Alberts and B. Gärtner (1995). A novel type of skeleton for
    polygons. Journal of Universal Computer Science 1(12).
    """
    for straight in SIMPLER:
        contour = contour_of(xy, offsets, straight)
        for tolerance in TOLERANCES:
            try:
                arcs = propagate(contour, tolerance * contour.size)
            except Unresolved:
                continue
            for group in (contracted(contour, arcs), list(range(len(arcs.x)))):
                try:
                    return _assembled(xy, contour, arcs, group)
                except Unresolved:
                    continue
    raise TopologyError(
        "The straight skeleton of a block cannot be told, as its contour touches itself, or almost "
        "does: simplify the block, or subdivide it by another strategy."
    )


def _assembled(xy: FloatArray, contour: Contour, arcs: Arcs, group: list[int]) -> Skeleton:
    """Return the skeleton that arcs make where some nodes stand for others."""
    m, n = len(contour), len(xy)
    arcs = refined(contour, arcs, group)
    rings = rings_of_faces(contour, arcs, group)
    used = sorted({node for ring in rings for node in ring[2:] if node >= m})
    number = {node: n + k for k, node in enumerate(used)}
    inner = np.array([(arcs.x[k], arcs.y[k]) for k in used]).reshape(-1, 2) + contour.origin
    xy = np.concatenate([xy, np.round(inner / FINE_GRID) * FINE_GRID])
    height = np.concatenate([np.zeros(n), [arcs.t[k] for k in used]])
    for e in range(m):
        number[e] = contour.run[e][0]
    faces = [contour.run[e] + [number[k] for k in ring[2:]] for e, ring in enumerate(rings)]
    check_faces(xy, height, faces, contour)
    edge_face = np.empty(n, dtype=np.int64)
    order = sorted(range(m), key=lambda e: min(contour.run[e][:-1]))
    for rank, e in enumerate(order):
        edge_face[contour.run[e][:-1]] = rank
    rings_of_edges = tuple(np.array(faces[e]) for e in order)
    return Skeleton(xy, height, rings_of_edges, edge_face, np.array(contour.after))
