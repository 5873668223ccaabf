"""Cutting irregular parcels again, together with a neighbour.

Cuts are chosen parcel by parcel, from the large to the small; near a notched rim the last ones
leave parcels that a look at two of them together would have avoided. In the end each irregular
parcel is joined with a neighbour and the two are cut anew; what is better is kept.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from urban_processing.access_rule import is_reached
from urban_processing.layout import Layout, Steering
from urban_processing.mesh.corners import polygon_irregularity, reported_corners
from urban_processing.mesh.edit import MeshEditor
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.progress import SILENT, Progress
from urban_processing.subdivision.insert import insert_cuts
from urban_processing.subdivision.parcels import parcel_rings
from urban_processing.subdivision.streamline import propose_cuts

SIDES_COST = 0.05
"""Cost, in irregularity, of a parcel that has not four sides; parcels of at least this cost are
cut again."""

SHORT_COST = 0.5
"""Cost, in irregularity, of a parcel without any of the least frontage; in proportion below."""

LEAST_GAIN = 0.01
"""Two parcels are changed only if they gain this much together."""

SPREAD_COST = 0.1
"""Cost, in irregularity, of the larger of two new parcels being twice the smaller one."""

ROUNDS = 3
"""Rounds over all irregular parcels, each with another neighbour."""


@dataclass(frozen=True)
class Pair:
    """Two neighbours, and the chain of half-edges between them with the first on its left."""

    keeps: int
    goes: int
    chain: tuple[int, ...]


def recut_irregular(
    layout: Layout,
    *,
    min_area: float,
    params: CogenerateParams,
    progress: Progress = SILENT,
) -> Layout:
    """Join irregular parcels with a neighbour each and cut the two anew where that is better.

    So are parcels with less than the least frontage, where one is given.
    The parcels on both sides of a street are never joined, and both new parcels must be
    reached by the streets that there are. The number of parcels stays the same.
    """
    tried: set[frozenset[int]] = set()
    for i in range(ROUNDS):
        pairs = _choose_pairs(layout, tried, params)
        if not pairs:
            break
        progress.update(i / ROUNDS, f"Cutting {len(pairs)} irregular parcels again")
        layout = _recut(layout, pairs, min_area, params)
    return layout


def _costs(layout: Layout, params: CogenerateParams) -> FloatArray:
    """(F,) irregularity of each parcel, and what sides and frontage cost that are not wanted."""
    corners, offsets = reported_corners(layout.mesh)
    irregularity = polygon_irregularity(layout.mesh.xy[corners], offsets)
    cost = irregularity + SIDES_COST * (np.diff(offsets) != 4)
    if params.least_frontage is not None:
        short = np.maximum(1.0 - layout.frontage / params.least_frontage, 0.0)
        cost = cost + SHORT_COST * short
    return np.asarray(cost)


def joinable_pairs(layout: Layout) -> list[Pair]:
    """Neighbours that can become one parcel, those with the longest common side first.

    They are not locked, no street and no boundary that a planner wants lies between them, and
    they have one side in common.
    """
    graph = layout.corner_graph
    left, right = graph.face[0::2], graph.face[1::2]
    inner = (left != OUTSIDE) & (right != OUTSIDE) & (left != right)
    inner &= ~layout.chain_street[0::2]
    inner &= ~layout.steered(Steering.KEPT)[graph.first_edge()[0::2]]
    barred = layout.face_locked | (layout.mesh.face_n_loops > 1)
    inner[inner] &= ~(barred[left[inner]] | barred[right[inner]])
    usable = np.flatnonzero(inner & _only_contact(left, right))
    return [
        Pair(
            int(left[i]),
            int(right[i]),
            tuple(graph.half_edges[graph.offsets[2 * i] : graph.offsets[2 * i + 1]].tolist()),
        )
        for i in usable[np.argsort(-graph.length[2 * usable], kind="stable")].tolist()
    ]


def _choose_pairs(
    layout: Layout, tried: set[frozenset[int]], params: CogenerateParams
) -> list[Pair]:
    """Pair each offender, the worst first, with the neighbour along its longest side."""
    cost = _costs(layout, params)
    lineage = layout.face_lineage.tolist()
    by_face: dict[int, list[Pair]] = {}
    for pair in joinable_pairs(layout):
        by_face.setdefault(pair.keeps, []).append(pair)
        by_face.setdefault(pair.goes, []).append(pair)
    taken: set[int] = set()
    pairs = []
    for face in np.argsort(-np.round(cost, 9), kind="stable").tolist():
        if cost[face] < SIDES_COST:
            break
        for pair in by_face.get(face, []) if face not in taken else []:
            other = pair.goes if pair.keeps == face else pair.keeps
            key = frozenset((lineage[face], lineage[other]))
            if other in taken or key in tried:
                continue
            tried.add(key)
            taken |= {face, other}
            pairs.append(pair)
            break
    return pairs


def _only_contact(left: IntArray, right: IntArray) -> BoolArray:
    """Which chains are all that their two faces share."""
    low, high = np.minimum(left, right), np.maximum(left, right)
    key = low * (int(high.max()) + 1) + high
    _, inverse, count = np.unique(key, return_inverse=True, return_counts=True)
    return np.asarray(count[inverse.ravel()] == 1)


def _recut(layout: Layout, pairs: list[Pair], min_area: float, params: CogenerateParams) -> Layout:
    """Cut all pairs anew; those that do not gain are left out and the rest is done again."""
    before = _costs(layout, params)
    area = layout.mesh.face_area
    while pairs:
        joined, parent = join_pairs(layout, pairs)
        faces = np.searchsorted(parent, [p.keeps for p in pairs])
        parcels = parcel_rings(joined, faces)
        ranked = propose_cuts(
            parcels,
            min_area=min_area,
            params=params,
            quota=np.full(len(faces), 2),
            thorough=True,
        )
        cut, done, source = insert_cuts(joined, parcels, ranked, min_area=min_area)
        costs = np.array([_pair_cost(p, before, area) for p in pairs])
        gains = _gains(cut, source, faces, done, costs, params)
        if (gains >= LEAST_GAIN).all():
            return cut
        pairs = [p for p, gain in zip(pairs, gains, strict=True) if gain >= LEAST_GAIN]
    return layout


def _pair_cost(pair: Pair, cost: FloatArray, area: FloatArray) -> float:
    two = [pair.keeps, pair.goes]
    return float(cost[two].sum() + _spread_cost(area[two]))


def _spread_cost(areas: FloatArray) -> float:
    return float(SPREAD_COST * (areas.max() / areas.min() - 1.0))


def _gains(
    cut: Layout,
    source: IntArray,
    faces: IntArray,
    done: BoolArray,
    before: FloatArray,
    params: CogenerateParams,
) -> FloatArray:
    """How much each pair is better than it was; -inf where it was not cut or is not reached."""
    cost = _costs(cut, params)
    area = cut.mesh.face_area
    reached = is_reached(cut.frontage, area, least=params.frontage_limit)
    out = np.full(len(faces), -np.inf)
    for i in np.flatnonzero(done).tolist():
        pieces = np.flatnonzero(source == faces[i])
        if reached[pieces].all():
            out[i] = before[i] - cost[pieces].sum() - _spread_cost(area[pieces])
    return out


def join_pairs(layout: Layout, pairs: list[Pair]) -> tuple[Layout, npt.NDArray[np.int64]]:
    """The layout with the chains between pairs taken away, and the face before of each face."""
    editor = MeshEditor(layout.mesh)
    level = layout.face_level.copy()
    for pair in pairs:
        ends = [editor.origin[pair.chain[0]], editor.origin[pair.chain[-1] ^ 1]]
        editor.remove_chain(list(pair.chain))
        level[pair.keeps] = min(level[pair.keeps], level[pair.goes]) - 1
        for vertex in ends:
            given = layout.vertex_corner[vertex] or layout.vertex_entry[vertex]
            if editor.valence[vertex] == 2 and not given:
                a, b = (editor.edge_parent[h >> 1] for h in editor.outgoing(vertex))
                edge_tables = (
                    *(layout.edge_street, layout.edge_fixed, layout.edge_kind),
                    layout.edge_steering,
                )
                if all(values[a] == values[b] for values in edge_tables):
                    _straighten(editor, vertex)
    mesh, remap = editor.commit()
    return layout.replace(face_level=level).with_mesh(mesh, remap), remap.face


def _straighten(editor: MeshEditor, vertex: int) -> None:
    """Take away a vertex that lies on a straight line between its neighbours."""
    h = editor.half_edge_of[vertex]
    a, b = editor.origin[h ^ 1], editor.origin[editor.prev[h]]
    ux, uy = editor.x[a] - editor.x[vertex], editor.y[a] - editor.y[vertex]
    vx, vy = editor.x[b] - editor.x[vertex], editor.y[b] - editor.y[vertex]
    bend = abs(ux * vy - uy * vx)
    if ux * vx + uy * vy < 0 and bend <= 1e-6 * (ux * ux + uy * uy + vx * vx + vy * vy):
        editor.dissolve_vertex(vertex)
