"""Patios: what lies deeper in a perimeter block than its rows of parcels."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np

from urban_processing.hashing import child
from urban_processing.mesh.corners import ring_areas
from urban_processing.parcelling.rows.divided import Face
from urban_processing.parcelling.rows.plots import edges_of
from urban_processing.parcelling.rows.sheet import Sheet
from urban_processing.parcelling.rows.spacing import Bounds
from urban_processing.skeleton.straight import Skeleton, cut_at_depth

Ring = list[int]


def rows_and_patios(
    skeleton: Skeleton, *, offset: float, area: float, bounds: Bounds
) -> tuple[Skeleton, list[list[Ring]]]:
    """Cut the faces of a skeleton off at the depth of rows; return the rings of each patio too.

    Rows meet back to back where no patio would be as large as a parcel and as wide, or nothing
    would be left for one.
    """
    if skeleton.height.max() - offset < 0.5 * bounds.min_width:
        return skeleton, []
    lower, patios = cut_at_depth(skeleton, offset)
    inner = [
        float(ring_areas(lower.xy[np.concatenate(p)], np.cumsum([0, *map(len, p)])).sum())
        for p in patios
    ]
    if max(inner, default=0.0) < bounds.min_area or area - sum(inner) < bounds.min_area:
        return skeleton, []
    return lower, [[ring.tolist() for ring in patio] for patio in patios]


def joined(sheet: Sheet, patios: Sequence[list[Ring]], others: Sequence[Ring]) -> list[list[Ring]]:
    """Unite patios with other pieces of a block that touch them along edges, or each other.

    Parameters
    ----------
    sheet
        The vertices.
    patios
        Rings of each patio.
    others
        Ring of each of the other pieces.
    """
    edges = {edge for patio in patios for ring in patio for edge in edges_of(ring)}
    edges |= {edge for ring in others for edge in edges_of(ring)}
    after: dict[int, list[int]] = {}
    for u, v in sorted(edges):
        if (v, u) not in edges:
            after.setdefault(u, []).append(v)
    rings = list(_chained(sheet, after))
    shells = [ring for ring in rings if sheet.area(ring) > 0.0]
    holes = [ring for ring in rings if sheet.area(ring) < 0.0]
    groups = [[shell] for shell in shells]
    for hole in holes:
        around = [g for g in groups if sheet.contains(g[0], hole)]
        min(around, key=lambda g: sheet.area(g[0])).append(hole)
    return groups


def _chained(sheet: Sheet, after: dict[int, list[int]]) -> Iterable[Ring]:
    """Chain directed edges to rings; where rings touch, each turns left the most."""
    while after:
        u = start = min(after)
        ring: Ring = []
        before = -1
        while True:
            ring.append(u)
            ends = after[u]
            v = ends[0] if len(ends) == 1 or before < 0 else sheet.leftmost(before, u, ends)
            ends.remove(v)
            if not ends:
                del after[u]
            before, u = u, v
            if u == start:
                break
        yield ring


def parted(
    sheet: Sheet, patios: Sequence[list[Ring]], least: float
) -> tuple[list[list[Ring]], list[list[Ring]]]:
    """Part patios into those smaller than a parcel, which go to their neighbours, and others."""
    small: list[list[Ring]] = []
    large: list[list[Ring]] = []
    for patio in patios:
        (small if sum(map(sheet.area, patio)) < least else large).append(patio)
    return small, large


def noded(sheet: Sheet, patio: Sequence[Ring]) -> list[Ring]:
    """Return the rings of a patio with all points that were added on their edges."""
    return [[w for u, v in edges_of(ring) for w in (u, *sheet.within(u, v))] for ring in patio]


def patio_faces(sheet: Sheet, patios: Sequence[list[Ring]], lineage: int) -> list[Face]:
    """Return patios as faces, the largest first, with all points that were added on their edges."""
    found = []
    for patio in patios:
        rings = noded(sheet, patio)
        found.append((sum(sheet.area(ring) for ring in rings), rings))
    found.sort(key=lambda f: (-round(f[0], 4), min((sheet.y[v], sheet.x[v]) for v in f[1][0])))
    return [Face(rings, child(lineage, k), 1, patio=True) for k, (_, rings) in enumerate(found)]
