"""Keeping net areas above a floor, by joining parcels that are too small with a neighbour."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.access_rule import unreached_parcels_of
from urban_processing.layout import NOT_FIXED, REMNANT_USE, EdgeKind, Layout
from urban_processing.mesh.components import components
from urban_processing.mesh.corners import polygon_irregularity, reported_polygons
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray
from urban_processing.rights_of_way.lay_out import lay_out_rights_of_way
from urban_processing.site import AREA_ROUNDING, Issue
from urban_processing.street_rules import StreetRules
from urban_processing.subdivision.recut import SIDES_COST, Pair, join_pairs, joinable_pairs

CORNERS = 1.1
"""Gross over net floor besides one street: more leaves fewer parcels, less joins more of them."""

SIZE_COST = 0.1
"""Cost, in irregularity, of each smallest area allowed that a joined parcel is large."""


def gross_floor(net_area: float, rules: StreetRules) -> float:
    """Gross area in m² from which most parcels have `net_area`.

    That of a square which has `net_area` beside a local street, and a little for corners.
    """
    half = rules.local / 2
    return CORNERS * ((half + math.sqrt(half * half + 4.0 * net_area)) / 2.0) ** 2


def keep_net_areas(layout: Layout, min_area: float) -> Layout:
    """Join parcels until none has a net area under `min_area`, in m².

    Each is joined with the neighbour with which it makes the best shape. A parcel that is a
    block of its own first loses one of the streets around it, one that leaves no new street
    end if there is one, and takes up those that had no other street. A part that ends as one
    parcel keeps it, however small. What streets enclose that must stay is set aside by
    `set_remnants_aside`.
    """
    while True:
        net = lay_out_rights_of_way(layout).net_area
        small = _too_small(layout, net, min_area)
        if not small.any():
            return layout
        before = layout
        layout = _joined(layout, net, min_area)
        if layout is before:
            layout = _opened(layout, net, small)
        if layout is before:
            return layout


def set_remnants_aside(layout: Layout, min_area: float) -> Layout:
    """Take parcels whose net area stays under `min_area` (m²) out of the building land.

    They lie between streets that cannot be taken away. Each is locked, its land use is
    `REMNANT_USE`, and it is listed.
    """
    net = lay_out_rights_of_way(layout).net_area
    small = _too_small(layout, net, min_area)
    if not small.any():
        return layout
    polygons = layout.mesh.face_polygons()
    issues = [
        Issue(
            code="remnant",
            message=f"This land ({net[f]:.0f} m² net) between streets that stay is smaller than "
            f"the smallest parcel allowed ({min_area:.0f} m²): it is no building land.",
            part=int(layout.face_part[f]),
            parcel_id=f + 1,
            value=float(net[f]),
            limit=min_area,
            geometry=polygons[f],
        )
        for f in np.flatnonzero(small).tolist()
    ]
    return layout.replace(
        face_locked=layout.face_locked | small,
        face_use=np.where(small, len(layout.land_uses), layout.face_use),
        land_uses=(*layout.land_uses, REMNANT_USE),
        issues=(*layout.issues, *issues),
    )


def _too_small(layout: Layout, net: FloatArray, min_area: float) -> BoolArray:
    """(F,) parcels under the floor that are not alone in their part."""
    small = net < min_area * (1.0 - AREA_ROUNDING)
    return np.asarray(small & ~layout.face_alone & ~layout.face_locked)


def _joined(layout: Layout, net: FloatArray, min_area: float) -> Layout:
    """Join parcels that are too small until no neighbour is left for any.

    Streets stay, so net areas add up.
    """
    while True:
        small = _too_small(layout, net, min_area)
        pairs = _best_pairs(layout, net, small, min_area)
        if not pairs:
            return layout
        area = net.copy()
        area[[p.keeps for p in pairs]] += net[[p.goes for p in pairs]]
        layout, parent = join_pairs(layout, pairs)
        net = area[parent]


def _best_pairs(layout: Layout, net: FloatArray, small: BoolArray, min_area: float) -> list[Pair]:
    """Pair each parcel that is too small, the smallest first, with its best neighbour."""
    pairs = [p for p in joinable_pairs(layout) if small[p.keeps] or small[p.goes]]
    if not pairs:
        return []
    cost = _costs(layout, pairs) + SIZE_COST * np.array(
        [(net[p.keeps] + net[p.goes]) / min_area for p in pairs]
    )
    by_face: dict[int, list[int]] = {}
    for i in np.argsort(np.round(cost, 9), kind="stable").tolist():
        for face in (pairs[i].keeps, pairs[i].goes):
            by_face.setdefault(face, []).append(i)
    taken: set[int] = set()
    chosen = []
    for face in sorted(np.flatnonzero(small).tolist(), key=lambda f: (net[f], f)):
        if face in taken or face not in by_face:
            continue
        pair = pairs[by_face[face][0]]
        if not {pair.keeps, pair.goes} & taken:
            taken |= {pair.keeps, pair.goes}
            chosen.append(pair)
    return chosen


def _costs(layout: Layout, pairs: list[Pair]) -> FloatArray:
    """Irregularity of the parcels that pairs would make, and what it costs not to be quads."""
    polygons = layout.mesh.face_polygons()
    two = np.array([(p.keeps, p.goes) for p in pairs])
    made = shapely.coverage_union_all(polygons[two], axis=1)
    rings = shapely.get_exterior_ring(shapely.get_geometry(made, 0))
    out = np.full(len(pairs), np.inf)
    simple = np.flatnonzero(~shapely.is_missing(rings))
    xy, ring = shapely.get_coordinates(rings[simple], return_index=True)
    last = np.flatnonzero(np.diff(ring, append=-1))
    xy, ring = np.delete(xy, last, axis=0), np.delete(ring, last)
    offsets = np.searchsorted(ring, np.arange(len(simple) + 1))
    corners, corner_offsets = reported_polygons(xy, offsets)
    irregularity = polygon_irregularity(xy[corners], corner_offsets)
    out[simple] = irregularity + SIDES_COST * (np.diff(corner_offsets) != 4)
    return out


def _opened(layout: Layout, net: FloatArray, small: BoolArray) -> Layout:
    """Take away one street beside the smallest parcel for which that can be done."""
    faces = sorted(np.flatnonzero(small).tolist(), key=lambda f: (net[f], f))
    for most_ends in (_ends(layout), math.inf):
        for face in faces:
            for run in _runs_beside(layout, face):
                opened = _connected(_without_street(layout, run))
                if _keeps_given(layout, opened) and _ends(opened) <= most_ends:
                    whole = _absorbing(opened, face, _reached(layout))
                    if whole is not None:
                        return whole
    return layout


def _keeps_given(before: Layout, after: Layout) -> bool:
    """Whether all given streets are streets still, and lead to the entries as before."""
    given = after.edge_fixed != NOT_FIXED
    led = before.mesh.vertices_of(before.edge_street) & before.vertex_entry
    still_led = after.mesh.vertices_of(after.edge_street)[led].all()
    return bool(after.edge_street[given].all() and still_led)


def _absorbing(layout: Layout, face: int, reached: BoolArray) -> Layout | None:
    """Join a parcel with the neighbours that lost their street; None where one stays without."""
    while True:
        lost = reached & ~_reached(layout)
        if not lost.any():
            return layout
        pair = next(
            (
                p
                for p in joinable_pairs(layout)
                if face in (p.keeps, p.goes) and (lost[p.keeps] or lost[p.goes])
            ),
            None,
        )
        if pair is None:
            return None
        layout, parent = join_pairs(layout, [pair])
        face, reached = int(np.searchsorted(parent, pair.keeps)), reached[parent]


def _reached(layout: Layout) -> BoolArray:
    out = np.ones(layout.mesh.n_faces, dtype=bool)
    out[unreached_parcels_of(layout)] = False
    return out


def _runs_beside(layout: Layout, face: int) -> list[IntArray]:
    """Edges of each street between a parcel and one other block, the shortest street first."""
    mesh = layout.mesh
    sides = mesh.face.reshape(-1, 2)
    beside = layout.edge_street & (sides == face).any(axis=1) & (sides != OUTSIDE).all(axis=1)
    beside &= (sides != face).any(axis=1) & (layout.edge_kind == EdgeKind.INTERIOR)
    beside &= layout.edge_fixed == NOT_FIXED
    edges = np.flatnonzero(beside)
    if not len(edges):
        return []
    other = sides[edges].sum(axis=1) - face
    block = layout.face_block[other]
    ends = mesh.origin.reshape(-1, 2)[edges]
    # edges of one block follow one another where they share a vertex
    key, node = np.unique(
        np.column_stack([np.tile(block, 2), ends.T.ravel()]), axis=0, return_inverse=True
    )
    node = node.reshape(2, -1)
    label = components(len(key), node.T)[node[0]]
    runs = [edges[label == k] for k in np.unique(label)]
    return sorted(runs, key=lambda run: (float(mesh.edge_length[run].sum()), int(run[0])))


def _without_street(layout: Layout, edges: IntArray) -> Layout:
    street, level = layout.edge_street.copy(), layout.edge_level.copy()
    street[edges], level[edges] = False, -1
    return layout.replace(edge_street=street, edge_level=level)


def _ends(layout: Layout) -> int:
    at = layout.mesh.origin[np.repeat(layout.edge_street, 2)]
    return int((np.bincount(at) == 1).sum())


def _connected(layout: Layout) -> Layout:
    """The layout with the longest connected network of each part alone."""
    mesh = layout.mesh
    edges = np.flatnonzero(layout.edge_street)
    ends = mesh.origin.reshape(-1, 2)[edges]
    label = components(mesh.n_vertices, ends)[ends[:, 0]]
    part = layout.face_part[mesh.face.reshape(-1, 2)[edges].max(axis=1)]
    length = np.bincount(label, weights=mesh.edge_length[edges])[label]
    order = np.lexsort((label, -np.round(length, 6), part))
    first = order[np.unique(part[order], return_index=True)[1]]
    kept = np.isin(label, label[first])
    return layout if kept.all() else _without_street(layout, edges[~kept])
