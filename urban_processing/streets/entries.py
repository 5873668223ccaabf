"""Where the network of a part meets the outside if the user does not say so."""

from __future__ import annotations

import numpy as np
import shapely
from scipy.sparse import coo_matrix, csr_matrix
from scipy.sparse.csgraph import dijkstra

from urban_processing.access_rule import reached_frontage
from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params import CogenerateParams
from urban_processing.site import Issue
from urban_processing.streets.connect import join_components, join_entries
from urban_processing.streets.groups import group_parcels
from urban_processing.streets.reach import reach_group
from urban_processing.streets.state import StreetState

SAMPLED = 64
"""Number of parcels of a part to which the way from an entry is measured."""


def choose_entries(layout: Layout, params: CogenerateParams) -> Layout:
    """Give each part an entry that has neither a street on its rim nor an entry.

    Of all places where a street can reach the rim, the one is taken from which the way along
    streets to the parcels is shortest in the mean, the way from the rim to the network
    included. The street there is laid, and the choice is told of.
    """
    mesh = layout.mesh
    state = StreetState(layout, params)
    entry = layout.vertex_entry.copy()
    issues = []
    for part in _parts_without_way_out(layout):
        nodes = _rim_nodes(state, part)
        distance = _mean_way(state, part)[nodes]
        if not len(nodes) or not np.isfinite(distance).any():
            issues.append(
                Issue(
                    code="no_entry",
                    message="The street network of this part meets the outside nowhere: obstacles "
                    "lie all around it, or it is one parcel.",
                    part=part,
                )
            )
            continue
        best = int(nodes[np.argmin(np.round(distance, 6))])
        vertex = int(state.graph.node_vertex[best])
        entry[vertex] = True
        issues.append(
            Issue(
                code="entry_chosen",
                message="No entry was given and the rim is no street here: the network meets "
                "the outside at this place, from where the way to its parcels is shortest "
                f"({distance.min():.0f} m in the mean).",
                part=part,
                value=float(distance.min()),
                geometry=shapely.Point(mesh.xy[vertex]),
            )
        )
    if not issues:
        return layout
    layout = layout.replace(vertex_entry=entry, issues=(*layout.issues, *issues))
    state = StreetState(layout, params)
    join_entries(state)
    return state.finish(level=int(layout.edge_level.max(initial=0)))


def _parts_without_way_out(layout: Layout) -> list[int]:
    mesh = layout.mesh
    part = layout.face_part[mesh.face.reshape(-1, 2).max(axis=1)]
    open_ = np.zeros(int(layout.face_part.max()) + 1, dtype=bool)
    open_[part[(layout.edge_kind == EdgeKind.RIM) & layout.edge_street]] = True
    at_entry = layout.vertex_entry[mesh.origin].reshape(-1, 2).any(axis=1)
    open_[part[at_entry]] = True
    return np.flatnonzero(~open_).tolist()


def _rim_nodes(state: StreetState, part: int) -> IntArray:
    """Nodes on the outer rim of a part that a street can lead to, by their coordinates."""
    graph, layout = state.graph, state.layout
    on_rim, usable = (
        _at_nodes(state, layout.chain_kind == EdgeKind.RIM),
        _at_nodes(state, np.array(state.usable)),
    )
    own = np.array([state.part_of(i) == part for i in graph.out[graph.out_offsets[:-1]].tolist()])
    nodes = np.flatnonzero(on_rim & usable & own)
    xy = layout.mesh.xy[graph.node_vertex[nodes]]
    return nodes[np.lexsort((xy[:, 1], xy[:, 0]))]


def _at_nodes(state: StreetState, chain: BoolArray) -> BoolArray:
    """(N,) nodes that one of the chosen chains leaves."""
    return np.asarray(np.bincount(state.graph.start[chain], minlength=state.graph.n_nodes) > 0)


def _links(state: StreetState, chain: BoolArray, extra: FloatArray | None = None) -> csr_matrix:
    """Lengths between nodes along chains, with ways from a node of its own if given."""
    graph, n = state.graph, state.graph.n_nodes
    start, end, length = graph.start[chain], graph.end[chain], graph.length[chain]
    if extra is not None:
        some = np.flatnonzero(np.isfinite(extra))
        start = np.append(start, np.full(len(some), n))
        end, length = np.append(end, some), np.append(length, extra[some])
    order = np.lexsort((length, end, start))  # of several chains between two nodes the shortest
    first = np.append(True, (np.diff(start[order]) != 0) | (np.diff(end[order]) != 0))
    keep = order[first[: len(order)]]
    size = n + 1
    weight = np.maximum(length[keep], 1e-9)  # a link of weight zero would be none
    return coo_matrix((weight, (start[keep], end[keep])), shape=(size, size)).tocsr()


def _mean_way(state: StreetState, part: int) -> FloatArray:
    """(N,) mean way from a node to the parcels of a part along streets, infinite where none."""
    graph, street = state.graph, state.street_mask()
    mine = np.flatnonzero(street & (graph.face >= 0))
    mine = mine[state.layout.face_part[graph.face[mine]] == part]
    if not len(mine):
        return np.full(graph.n_nodes, np.inf)
    _, first = np.unique(graph.face[mine], return_index=True)
    at = graph.start[mine[first]]
    some = at[np.unique(np.linspace(0, len(at) - 1, SAMPLED).astype(np.int64))]
    way = dijkstra(_links(state, street), indices=some)[:, :-1].mean(axis=0)
    beyond = dijkstra(_links(state, ~street & np.array(state.usable), way), indices=[graph.n_nodes])
    return np.asarray(beyond[0, :-1])


def join_along_rims(layout: Layout, params: CogenerateParams) -> Layout:
    """Reach, and join, what is left by streets along rims that are no street: the last resort.

    Happens where parcels that would have to be cut for it are too small, and is told of.
    Parts of one parcel stay without a street.
    """
    state = StreetState(layout, params)
    view = state.with_rims()
    short = layout.frontage < reached_frontage(layout.mesh.face_area)
    left = np.flatnonzero(short & ~layout.face_alone).tolist()
    if left:
        distance = view.network_distance()
        for group in group_parcels(view, left):
            reach_group(view, group, distance, keep_ends=True)
    join_entries(view)
    join_components(view)
    if not view.journal:
        return layout
    joined = state.finish(level=int(layout.edge_level.max(initial=0)))
    bare = np.flatnonzero(
        joined.edge_street & ~layout.edge_street & (layout.edge_kind != EdgeKind.INTERIOR)
    )
    if not len(bare):
        return joined
    length = float(layout.mesh.edge_length[bare].sum())
    ends = layout.mesh.xy[layout.mesh.origin.reshape(-1, 2)[bare]]
    issue = Issue(
        code="street_on_rim",
        message=f"{length:.0f} m of street run along a rim or shore that is no street "
        "otherwise: without them parcels would have no street, or the network would not be one.",
        value=length,
        limit=0.0,
        geometry=shapely.point_on_surface(shapely.MultiLineString(list(ends))),
    )
    return joined.replace(issues=(*layout.issues, issue))
