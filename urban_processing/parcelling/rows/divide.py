"""Blocks into rows of parcels along their streets, by the straight skeleton."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import shapely

from urban_processing.errors import TopologyError
from urban_processing.hashing import child, uniform
from urban_processing.mesh.corners import ring_areas
from urban_processing.mesh.planar import IntArray
from urban_processing.parcelling.ground import Ground, Pieces, Rules
from urban_processing.parcelling.rows.divided import (
    Divided,
    Face,
    Polygon,
    assembled,
    polygons_of,
    straightened,
    whole,
)
from urban_processing.parcelling.rows.mending import beta_strips
from urban_processing.parcelling.rows.patios import (
    joined,
    noded,
    parted,
    patio_faces,
    rows_and_patios,
)
from urban_processing.parcelling.rows.plots import Plots, edges_of
from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.slices import Lot, Slicer, rings_of_lots
from urban_processing.parcelling.rows.spacing import Bounds
from urban_processing.parcelling.rows.streets import logical_streets, sides_of_rings
from urban_processing.parcelling.rows.strips import Strip, alpha_strips
from urban_processing.parcelling.rows.tidy import divide_large, tidy
from urban_processing.parcelling.rows.uniting import Needs
from urban_processing.skeleton.straight import Skeleton, straight_skeleton

LEAST_FRONT = 0.75
"""Shortest front of a strip, over the smallest width."""

TURN = 0.8
"""Length over which turns of a street count as one, over the depth of the deepest row."""

TILED = 1e-9
"""Share of a polygon's area that its faces may miss or hold twice."""

_PATIOS, _SMALL_PATIOS = 2**32, 2**32 + 1
"""Rank of all patios among the strips of a block."""


def divide_in_rows(ground: Ground, rules: Rules, *, seed: int) -> Pieces:
    """Divide polygons into rows of parcels along their streets (Vanegas 2012, section 4.2).

    The straight skeleton parts a polygon into what lies nearest to each logical street; diagonal
    ends of these strips are mended; lines from the street divide strips into parcels; what comes
    out too small or too large is united or divided. Each parcel has frontage. With a finite
    ``rules.offset`` rows are that deep, and what lies within is a patio.

    A polygon stays whole where it is too small for two parcels, has no street side, or is so
    nearly degenerate that its skeleton cannot be told.

    Parameters
    ----------
    ground
        The polygons.
    rules
        Bounds and style for each. ``street_access`` has no say: all parcels have access.
    seed
        Seed of the random displacement of lines.

    Returns
    -------
    Pieces
        Parcels, and patios of perimeter blocks.

    Notes
    -----
    Where this departs from the paper: the standard deviation of widths is ω/3 of their mean;
    fronts are shared out so that areas, too, keep their bounds where they can; lines are straight
    from the street to the rear and fanned beside bends, where the paper's follow arcs of the
    skeleton; strips at a sharp corner are one row only as far as two would be too shallow; a
    small parcel goes to the neighbour with which it is compact, not by the border alone.
    Triangles that are large enough and have their frontage stay.

    References
    ----------
    C. A. Vanegas et al. (2012). Procedural generation of parcels in urban modeling. Computer
    Graphics Forum 31(2), section 4.2 and algorithm 1.
    """
    polygons = list(polygons_of(ground))
    parts = [_divide(polygon, rules, k, seed=seed) for k, polygon in enumerate(polygons)]
    pieces = assembled(ground, parts)
    for last in (False, True):
        for k in (unsound := _unsound(ground, pieces).tolist()):
            polygon = polygons[k]
            parts[k] = whole(polygon) if last else _divide(polygon, rules, k, seed=seed, wary=True)
        if unsound:
            pieces = assembled(ground, parts)
    return pieces


def _unsound(ground: Ground, pieces: Pieces) -> IntArray:
    """Polygons whose faces are not valid or do not tile them."""
    polygons = pieces.polygons()
    valid = (
        np.bincount(pieces.block, weights=~shapely.is_valid(polygons), minlength=len(ground)) == 0
    )
    tiled = np.bincount(pieces.block, weights=shapely.area(polygons), minlength=len(ground))
    rings = ground.rings
    area = np.bincount(
        rings.block, weights=ring_areas(rings.xy, rings.offsets), minlength=len(ground)
    )
    return np.flatnonzero(~valid | (np.abs(tiled - area) > TILED * area))


def _bounds(rules: Rules, k: int) -> Bounds:
    return Bounds(
        min_area=float(rules.min_area[k]),
        max_area=float(rules.max_area[k]),
        min_width=float(rules.min_width[k]),
        max_width=float(rules.max_width[k]),
        irregularity=float(rules.irregularity[k]),
        snap=float(rules.snap[k]),
    )


def _divide(polygon: Polygon, rules: Rules, k: int, *, seed: int, wary: bool = False) -> Divided:
    """Divide one polygon; if `wary`, without the lines that make parcels cross themselves."""
    bounds = _bounds(rules, k)
    area = float(ring_areas(polygon.xy, polygon.offsets).sum())
    if area < 2.0 * bounds.min_area or not any(polygon.access):
        return whole(polygon)
    try:
        skeleton = straight_skeleton(polygon.xy, polygon.offsets)
    except TopologyError:
        return whole(polygon)
    skeleton, patios = rows_and_patios(
        skeleton, offset=float(rules.offset[k]), area=area, bounds=bounds
    )
    following = skeleton.following.tolist()
    sheet = Sheet(skeleton.xy, skeleton.height, following, place=polygon.place)
    needs = Needs(
        area=bounds.min_area,
        depth=bounds.min_area / bounds.max_width,
        mean_depth=bounds.min_area / bounds.mean_width,
        front=LEAST_FRONT * bounds.min_width,
        by_length=bool(rules.by_length[k]),
        reach=bounds.min_width,
        snap=bounds.snap,
    )
    strips = _alpha_strips(sheet, polygon, skeleton, corner=float(rules.corner[k]), needs=needs)
    inside = {edge for patio in patios for ring in patio for edge in edges_of(ring)}
    strips, left = beta_strips(sheet, strips, needs=needs, patio=inside)
    if left:
        patios = joined(sheet, patios, [strip.ring for strip in left])
    parts = [_lots(sheet, polygon, strip, bounds, seed=seed, wary=wary) for strip in strips]
    small, patios = parted(sheet, patios, bounds.min_area)
    plots = _plots(sheet, polygon, parts, small)
    tidy(plots, bounds)
    if not wary:
        divide_large(plots, bounds)
    faces = [
        Face(
            [plots.rings[n], *plots.holes[n]],
            plots.lineage[n],
            plots.level[n],
            patio=plots.front(n) <= 0.0,
        )
        for n in sorted(plots.rings)
    ]
    faces += patio_faces(sheet, patios, child(polygon.lineage, _PATIOS))
    straightened(sheet, faces)
    faces = [replace(face, rings=sheet.parted(face.rings)) for face in faces]
    return Divided(polygon, sheet, faces)


def _alpha_strips(
    sheet: Sheet, polygon: Polygon, skeleton: Skeleton, *, corner: float, needs: Needs
) -> list[Strip]:
    """Return the α-strips, ranked by what does not depend on where rings begin."""
    x, y = polygon.xy.mean(axis=0).tolist()
    depth = TURN * float(skeleton.height.max())
    streets = [
        street
        for ring in sides_of_rings(sheet, polygon, skeleton.edge_face.tolist())
        for street in logical_streets(ring, (x, y), corner=corner, reach=needs.reach, depth=depth)
    ]
    strips = alpha_strips(sheet, [face.tolist() for face in skeleton.faces], streets)
    strips.sort(
        key=lambda s: (
            s.street.rim,
            -round(s.street.length, 4),
            *((round(sheet.y[v], 4), round(sheet.x[v], 4)) for v in s.front[:2]),
        )
    )
    for rank, strip in enumerate(strips):
        strip.rank = rank
    return strips


def _lots(
    sheet: Sheet, polygon: Polygon, strip: Strip, bounds: Bounds, *, seed: int, wary: bool
) -> tuple[Strip, list[Lot], int]:
    """Divide a strip into parcels; return its seed too."""
    slicer = Slicer(sheet, strip, bounds)
    lineage = child(polygon.lineage, strip.rank)
    count = int(slicer.length / bounds.min_width) + 2
    cuts = slicer.cuts(uniform(seed, np.array([lineage], dtype=np.uint64), count)[0].tolist())
    lots = slicer.lots(cuts)
    while wary and cuts:
        parts = rings_of_lots(sheet, strip, lots)
        crossed = {k for k, part in enumerate(parts) if not all(map(sheet.is_sound, part))}
        if not crossed:
            break
        cuts = [cut for k, cut in enumerate(cuts) if not {k, k + 1} & crossed]
        lots = slicer.lots(cuts)
    return strip, lots, lineage


def _plots(
    sheet: Sheet,
    polygon: Polygon,
    parts: Sequence[tuple[Strip, list[Lot], int]],
    patios: Sequence[list[list[int]]],
) -> Plots:
    """Lots of all strips, and patios that are too small to stay, as plots."""
    polygons: list[list[list[int]]] = []
    seeds: list[int] = []
    for strip, lots, lineage in parts:
        for k, shapes in enumerate(rings_of_lots(sheet, strip, lots)):
            polygons += shapes
            own = child(lineage, k)
            seeds += [own] + [child(own, j) for j in range(1, len(shapes))]
    polygons += [noded(sheet, patio) for patio in patios]
    seeds += [child(child(polygon.lineage, _SMALL_PATIOS), k) for k in range(len(patios))]
    return Plots(sheet, polygons, seeds, access=polygon.access)
