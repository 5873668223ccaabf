"""The working state of one level of street generation: the corner graph as plain lists."""

from __future__ import annotations

import copy
import math

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components, dijkstra

from urban_processing.access_rule import required_frontage
from urban_processing.layout import EdgeKind, Layout, Steering
from urban_processing.mesh.corner_graph import CornerGraph
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray
from urban_processing.params import CogenerateParams
from urban_processing.streets.facing import facing_cost

STRAIGHT = math.radians(45.0)
"""Two chains are collinear while the turn between them is less, that is, while their included
angle is more than 135° (Chen 2024, section 4.2)."""

QUANTUM = 2.0**-30
"""Costs are multiples of this, about 1e-9 parcel sides: their sums are exact, so that what costs
the same compares equal, and a rounding error never decides which street is laid."""

FAR = 1e9
"""Distance of nodes from which no street can be reached."""

UNCLOSED_COST = 1e4
"""Cost of an end that cannot be led on though dead ends are not wanted, in parcel sides or turns,
whichever cost more."""


class StreetState:
    """Streets being added to one layout, with an undo journal.

    Everything is indexed by the directed chains, nodes and faces of the layout's corner
    graph; lists instead of arrays, because the searches touch a few elements at a time.
    Lengths called `size` are in parcel sides (the square root of the mean parcel area). What a
    street of one parcel side costs is the unit of all costs: the size of a chain is the cost of
    its length, and `turn_cost` the ratio of the weights of junctions and length.
    """

    def __init__(self, layout: Layout, params: CogenerateParams) -> None:
        graph = layout.corner_graph
        mesh = layout.mesh
        self.layout = layout
        self.graph = graph
        self.rules = params.rules
        self.turn_cost = quantised(params.junction_weight / params.length_weight)
        self.unclosed_cost = UNCLOSED_COST * max(1.0, self.turn_cost)
        self.side = math.sqrt(float(mesh.face_area.mean()))
        interior = layout.chain_kind == EdgeKind.INTERIOR
        barred = layout.steered(Steering.NO_STREET)[graph.first_edge()]
        usable = (interior & ~barred) | layout.chain_street
        # streets that the user gave stay
        self.removable: list[bool] = (interior & ~layout.chain_fixed).tolist()
        self.fixed: list[bool] = layout.chain_fixed.tolist()
        self.entry: list[bool] = layout.vertex_entry[graph.node_vertex].tolist()
        self.usable: list[bool] = usable.tolist()
        self.street: list[bool] = layout.chain_street.tolist()
        self.start: list[int] = graph.start.tolist()
        self.end: list[int] = graph.end.tolist()
        self.face: list[int] = graph.face.tolist()
        self.length: list[float] = graph.length.tolist()
        size = np.round(graph.length / (self.side * QUANTUM)) * QUANTUM
        self.size: list[float] = size.tolist()
        self.out = _Ragged(graph.out, graph.out_offsets)
        self.around = _Ragged(graph.around, graph.around_offsets)
        self.ahead, self.aside, self.follow = _successors(graph, usable)
        streets = np.flatnonzero(layout.chain_street)
        self.degree: list[int] = np.bincount(graph.start[streets], minlength=graph.n_nodes).tolist()
        self.frontage: list[float] = layout.frontage.tolist()
        self.least_frontage = params.frontage_limit
        self.need: list[float] = _needs(layout, usable, self.least_frontage).tolist()
        self.part: list[int] = layout.face_part.tolist()
        self.journal: list[int] = []
        self.part_has_streets: list[bool] = _parts_with_streets(layout)
        self.part_has_street_rim: list[bool] = _parts_with_street_rim(layout)
        z = mesh.xy[graph.node_vertex] @ np.array([1.0, 1.0j]) / self.side
        a, b = z[graph.start], z[graph.end]
        chord = np.where(a == b, graph.leaving, b - a)
        self.chord: list[complex] = (chord / np.abs(chord)).tolist()
        self.middle: list[complex] = (0.5 * (a + b)).tolist()
        facing = facing_cost(layout, params, side=self.side)
        self.facing: list[float] | None = (
            None if facing is None else (np.round(facing / QUANTUM) * QUANTUM).tolist()
        )

    def add(self, chain: int) -> None:
        """Make a chain street."""
        if self.street[chain]:
            return
        self._set(chain, True)
        self.journal.append(chain)

    def remove(self, chain: int) -> None:
        """Make a street chain none."""
        self._set(chain, False)
        self.journal.append(~chain)

    def undo(self, mark: int) -> None:
        """Take back everything since the journal had `mark` entries."""
        journal = self.journal
        while len(journal) > mark:
            entry = journal.pop()
            if entry >= 0:
                self._set(entry, False)
            else:
                self._set(~entry, True)

    def _set(self, chain: int, on: bool) -> None:
        sign = 1 if on else -1
        self.street[chain] = self.street[chain ^ 1] = on
        self.degree[self.start[chain]] += sign
        self.degree[self.end[chain]] += sign
        length = sign * self.length[chain]
        for face in (self.face[chain], self.face[chain ^ 1]):
            if face != OUTSIDE:
                self.frontage[face] += length

    def part_of(self, chain: int) -> int:
        """Part of the land that a chain lies in."""
        # OUTSIDE is less than every face
        return self.part[max(self.face[chain], self.face[chain ^ 1])]

    def with_lake_sides(self) -> StreetState:
        """Return a view of this state in which streets may also run along holes.

        It shares the streets, so that what is laid in the view is laid here.
        """
        return self._with(self.layout.chain_kind == EdgeKind.HOLE)

    def with_rims(self) -> StreetState:
        """Return the same view with streets that may run along every rim."""
        return self._with(np.ones(self.graph.n_chains, dtype=bool))

    def _with(self, chains: BoolArray) -> StreetState:
        view = copy.copy(self)
        usable = np.array(self.usable) | chains
        view.usable = usable.tolist()
        view.need = _needs(self.layout, usable, self.least_frontage).tolist()
        view.ahead, view.aside, view.follow = _successors(self.graph, usable)
        return view

    def is_reached(self, face: int) -> bool:
        """Whether a parcel has the frontage it needs, or all that it can have."""
        return self.frontage[face] >= self.need[face]

    def street_mask(self) -> BoolArray:
        """(M,) which chains are street now."""
        return np.array(self.street, dtype=bool)

    def network_distance(self) -> list[float]:
        """Distance in parcel sides of every node from the nearest street node."""
        graph = self.graph
        sources = np.flatnonzero(np.array(self.degree) > 0)
        if not len(sources):
            return [0.0] * graph.n_nodes
        ok = np.flatnonzero(np.array(self.usable))
        # a link of weight zero would be none
        weights = np.maximum(np.array(self.size)[ok], QUANTUM)
        links = coo_matrix(
            (weights, (graph.start[ok], graph.end[ok])), shape=(graph.n_nodes, graph.n_nodes)
        )
        distance = dijkstra(links.tocsr(), indices=sources, min_only=True)
        near: list[float] = np.where(np.isfinite(distance), distance, FAR).tolist()
        return near

    def network_components(self) -> tuple[int, IntArray]:
        """Return the number of components of the streets and (N,) the component of each node.

        Nodes without a street get -1.
        """
        graph = self.graph
        on = np.flatnonzero(self.street_mask())
        n = graph.n_nodes
        links = coo_matrix((np.ones(len(on)), (graph.start[on], graph.end[on])), shape=(n, n))
        _, label = connected_components(links, directed=False)
        used = np.array(self.degree) > 0
        names, compact = np.unique(label[used], return_inverse=True)
        out = np.full(n, -1)
        out[used] = compact
        return len(names), out

    def blocks(self) -> IntArray:
        """(F,) block of each parcel: what the streets enclose together."""
        graph = self.graph
        n = self.layout.mesh.n_faces
        left, right = graph.face[0::2], graph.face[1::2]
        open_ = ~self.street_mask()[0::2] & (left != OUTSIDE) & (right != OUTSIDE)
        links = coo_matrix((np.ones(int(open_.sum())), (left[open_], right[open_])), shape=(n, n))
        _, label = connected_components(links, directed=False)
        return np.asarray(label, dtype=np.int64)

    def regions(self) -> IntArray:
        """(F,) what the streets enclose together, if one could cross rims that are no street.

        The faces of the street network as a planar graph: a street with the same region on
        both sides is a bridge of the network. Blocks are the same where all rims are streets.
        """
        graph, mesh = self.graph, self.layout.mesh
        loop = mesh.loops.of_half_edge[graph.half_edges[graph.offsets[:-1]]]
        n = mesh.n_faces + len(mesh.loops.face)
        side = np.where(graph.face == OUTSIDE, mesh.n_faces + loop, graph.face)
        open_ = ~self.street_mask()[0::2]
        left, right = side[0::2][open_], side[1::2][open_]
        links = coo_matrix((np.ones(len(left)), (left, right)), shape=(n, n))
        _, label = connected_components(links, directed=False)
        return np.asarray(label[: mesh.n_faces], dtype=np.int64)

    def finish(self, *, level: int) -> Layout:
        """Return the layout with the streets as they are now."""
        layout = self.layout
        before, now = layout.chain_street, self.street_mask()
        added, removed = np.flatnonzero(now & ~before), np.flatnonzero(before & ~now)
        if not len(added) and not len(removed):
            return layout
        edge_street, edge_level = layout.edge_street.copy(), layout.edge_level.copy()
        new, old = self.graph.edges_of(added), self.graph.edges_of(removed)
        edge_street[new], edge_level[new] = True, level
        edge_street[old], edge_level[old] = False, -1
        return layout.replace(edge_street=edge_street, edge_level=edge_level)


def quantised(cost: float) -> float:
    """Round a cost to a multiple of `QUANTUM`."""
    return round(cost / QUANTUM) * QUANTUM


class _Ragged(dict[int, list[int]]):
    """Lists by their place in ragged arrays; each is made when it is first asked for."""

    def __init__(self, values: IntArray, offsets: IntArray) -> None:
        super().__init__()
        self._values: list[int] = values.tolist()
        self._offsets: list[int] = offsets.tolist()

    def __missing__(self, place: int) -> list[int]:
        found = self[place] = self._values[self._offsets[place] : self._offsets[place + 1]]
        return found


def _successors(graph: CornerGraph, usable: BoolArray) -> tuple[_Ragged, _Ragged, list[int]]:
    """Usable chains that continue each chain straight on and with a turn; the straightest."""
    n = graph.n_chains
    counts = np.diff(graph.out_offsets)[graph.end]
    before = np.repeat(np.arange(n), counts)
    first = np.repeat(graph.out_offsets[graph.end] - (np.cumsum(counts) - counts), counts)
    after = graph.out[first + np.arange(len(before))]
    keep = (after != before ^ 1) & usable[after] & usable[before]
    before, after = before[keep], after[keep]
    # rounded, so that the chain's index decides between equal turns
    cosine = np.round((graph.leaving[after] * graph.arriving[before].conj()).real, 9)
    straight = cosine > round(math.cos(STRAIGHT), 9)
    follow = np.full(n, -1)
    order = np.lexsort((cosine, before))
    order = order[straight[order]]
    follow[before[order]] = after[order]
    bounds = np.arange(n + 1)
    ahead = _Ragged(after[straight], np.searchsorted(before[straight], bounds))
    aside = _Ragged(after[~straight], np.searchsorted(before[~straight], bounds))
    return ahead, aside, follow.tolist()


def _parts_with_streets(layout: Layout) -> list[bool]:
    """Whether each part of the land has a street that its parcels can be connected with."""
    has = np.zeros(int(layout.face_part.max()) + 1, dtype=bool)
    face = layout.mesh.face[np.repeat(layout.edge_street, 2)]
    has[layout.face_part[face[face != OUTSIDE]]] = True
    return has.tolist()


def _parts_with_street_rim(layout: Layout) -> list[bool]:
    """Whether the whole outer rim of each part of the land is street."""
    has = np.ones(int(layout.face_part.max()) + 1, dtype=bool)
    bare = (layout.edge_kind == EdgeKind.RIM) & ~layout.edge_street
    face = layout.mesh.face[np.repeat(bare, 2)]
    has[layout.face_part[face[face != OUTSIDE]]] = False
    return has.tolist()


def _needs(layout: Layout, usable: BoolArray, least: float) -> FloatArray:
    """(F,) frontage each parcel needs: by the rule, but no more than it can have."""
    graph = layout.corner_graph
    inside = usable & (graph.face != OUTSIDE)
    possible = np.bincount(
        graph.face[inside], weights=graph.length[inside], minlength=layout.mesh.n_faces
    )
    # the sum of a parcel's chains may miss the sum of its edges by a rounding error
    need = np.minimum(
        required_frontage(layout.mesh.face_area, least=least) * (1.0 + 1e-9),
        possible * (1.0 - 1e-9),
    )
    return np.asarray(need)
