"""Streets cut at the land: their network, and the blocks that they and its rim enclose."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.net import Faces, find_faces
from urban_processing.blocks.noding import NODE_GRID, Centrelines, pieces_on
from urban_processing.blocks.streets import StreetLines
from urban_processing.fabric.rim_streets import RimStreets, rim_streets
from urban_processing.mesh.components import components
from urban_processing.mesh.overlap import Segments
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.rights_of_way.centrelines import BESIDE
from urban_processing.streets.decompose import decompose_streets
from urban_processing.streets.network_model import StreetNetwork

Geometries = npt.NDArray[np.object_]

OUTER, HOLE, INNER = 2, 1, 0
"""`NodedStreets.rim` of an edge on an outer rim of the land, on a hole, and of another."""


@dataclass(frozen=True, eq=False)
class NodedStreets:
    """E street segments that meet at their ends alone, as half-edges.

    Parameters
    ----------
    xy
        (V, 2) vertices.
    ends
        (E, 2) vertices at the ends of each segment.
    line
        (E,) street line that each comes from.
    part
        (E,) piece of the land.
    rim
        (E,) `OUTER`, `HOLE` or `INNER`.
    """

    xy: FloatArray
    ends: IntArray
    line: IntArray
    part: IntArray
    rim: IntArray

    @property
    def n_vertices(self) -> int:
        """Number of vertices."""
        return len(self.xy)

    @cached_property
    def origin(self) -> IntArray:
        """(2E,) vertex that a half-edge leaves."""
        return np.ascontiguousarray(self.ends).ravel()

    @cached_property
    def target(self) -> IntArray:
        """(2E,) vertex that a half-edge leads to."""
        return np.ascontiguousarray(self.ends[:, ::-1]).ravel()

    @cached_property
    def edge_length(self) -> FloatArray:
        """(E,) lengths in metres."""
        return np.asarray(np.hypot(*(self.xy[self.ends[:, 1]] - self.xy[self.ends[:, 0]]).T))

    @cached_property
    def segments(self) -> Segments:
        """The segments; `line` is the number of each."""
        return Segments(
            self.xy[self.ends[:, 0]], self.xy[self.ends[:, 1]], np.arange(len(self.ends))
        )


@dataclass(frozen=True, eq=False)
class StreetsInLand:
    """What streets make of land.

    Parameters
    ----------
    land
        (L,) the land.
    lines, network
        Noded streets in it and on its rim, and their network.
    faces
        Blocks, to the centreline; none where there is no street.
    width, rank
        (E,) width of the right-of-way of each noded segment, and rank of its class.
    outside
        Metres of streets that are outside the land.
    """

    land: Geometries
    lines: NodedStreets
    network: StreetNetwork
    faces: Faces
    width: FloatArray
    outside: float

    @cached_property
    def edge_of(self) -> IntArray:
        """(E,) network edge of each segment."""
        out = np.empty(len(self.lines.line), dtype=np.int64)
        size = np.diff(self.network.offsets)
        out[self.network.half_edges >> 1] = np.repeat(np.arange(self.network.n_edges), size)
        return out

    def along(self, segment: IntArray, share: FloatArray) -> FloatArray:
        """(n,) metres from the start of the network edge to a share of some of its segments."""
        net = self.network
        half = net.half_edges
        length = self.lines.edge_length
        step = length[half >> 1]
        before = np.append(0.0, np.cumsum(step))
        begin = np.repeat(before[net.offsets[:-1]], np.diff(net.offsets))
        at, backward = np.empty(len(length)), np.empty(len(length), dtype=bool)
        at[half >> 1] = before[:-1] - begin
        backward[half >> 1] = half & 1 == 1
        way = np.where(backward[segment], 1.0 - share, share)
        return np.asarray(at[segment] + way * length[segment])


def streets_in_land(
    work: Centrelines, streets: StreetLines, land: Sequence[shapely.Polygon], *, snap: float
) -> StreetsInLand:
    """Cut streets at the rim of the land, and find their network and the blocks.

    Streets along the rim are laid on it (`rim_streets`). Where a street goes on beyond the rim,
    or is cut there, its node is an entry.

    Parameters
    ----------
    work
        Segments of streets, cleaned.
    streets
        Their lines, of known widths.
    land
        Polygons that meet at points at most, the largest first.
    snap
        Metres.
    """
    polygons = np.array(list(land), dtype=object)
    laid = rim_streets(work, streets.width[work.line], polygons, snap=snap)
    _, found = find_faces(Centrelines(laid.inner, laid.inner_line), list(laid.land))
    # between the rim and a street on it there may be faces as thin as rounding
    real = shapely.area(found.polygons) > 2 * NODE_GRID * shapely.length(found.polygons)
    faces = replace(found, polygons=found.polygons[real], part=found.part[real])
    lines, entry, outside = _noded(laid, faces, snap)
    network = decompose_streets(
        lines,
        street=np.ones(len(lines.line), dtype=bool),
        rim=lines.rim == OUTER,
        part=lines.part,
        entry=entry,
    )
    network = _described(network, lines, streets)
    return StreetsInLand(
        land=laid.land,
        lines=lines,
        network=network,
        faces=faces,
        width=streets.width[lines.line],
        outside=outside,
    )


def _noded(laid: RimStreets, faces: Faces, snap: float) -> tuple[NodedStreets, BoolArray, float]:
    """Street segments between all nodes, (V,) entries, and metres of street outside the land."""
    sources = np.concatenate([laid.inner, laid.rim])
    on_rim = np.arange(len(sources)) >= len(laid.inner)
    # of several that a piece lies on, the rim counts
    pieces, source = pieces_on(
        faces.edges, np.asarray(shapely.linestrings(sources), dtype=object), on_rim.astype(float)
    )
    pieces, source, vertex, xy = _without_hairs(pieces, source)
    part, rim = _place(pieces, on_rim[source], laid.land)
    line = np.append(laid.inner_line, laid.rim_line)[source]
    street = (line >= 0) & (part >= 0)
    beyond = part < 0
    goes_on = _goes_on(vertex, pieces, beyond, len(xy), 2 * max(snap, NODE_GRID))
    rims = np.zeros(len(xy), dtype=bool)
    rims[vertex[on_rim[source]]] = True
    outer = np.zeros(len(xy), dtype=bool)
    outer[vertex[rim == OUTER]] = True
    alone = np.bincount(vertex[street].ravel(), minlength=len(xy)) == 1
    entry = rims & (goes_on | (outer & alone))
    used, new = np.unique(vertex[street], return_inverse=True)
    noded = NodedStreets(xy[used], new.reshape(-1, 2), line[street], part[street], rim[street])
    lengths = np.hypot(*(pieces[:, 1] - pieces[:, 0]).T)
    return noded, entry[used], float(lengths[beyond].sum())


def _without_hairs(
    pieces: FloatArray, source: IntArray
) -> tuple[FloatArray, IntArray, IntArray, FloatArray]:
    """Pieces that are longer than rounding, with their sources, end vertices, and all places.

    Where others were, such as between the place where a street meets the rim and the rim, their
    ends are one.
    """
    places, vertex = np.unique(pieces.reshape(-1, 2) + 0.0, axis=0, return_inverse=True)
    vertex = vertex.reshape(-1, 2)
    short = np.hypot(*(pieces[:, 1] - pieces[:, 0]).T) < 2 * NODE_GRID
    group = components(len(places), vertex[short])
    _, first = np.unique(group, return_index=True)
    vertex = group[vertex]
    kept = ~short & (vertex[:, 0] != vertex[:, 1])
    return pieces[kept], source[kept], vertex[kept], places[first]


def _place(pieces: FloatArray, on_rim: BoolArray, land: Geometries) -> tuple[IntArray, IntArray]:
    """Piece of the land that each segment is in, -1 for none, and whether it is on a rim."""
    middle = shapely.points(pieces.mean(axis=1))
    part = np.full(len(pieces), -1)
    at, of = shapely.STRtree(land).query(middle, predicate="intersects")
    part[at[::-1]] = of[::-1]
    rim = np.full(len(pieces), INNER)
    outlines, owner = shapely.get_rings(land, return_index=True)
    is_shell = np.diff(owner, prepend=-1) != 0
    at, ring = shapely.STRtree(outlines).query(middle[on_rim], predicate="dwithin", distance=BESIDE)
    at = np.flatnonzero(on_rim)[at]
    part[at[::-1]] = owner[ring[::-1]]
    np.maximum.at(rim, at, np.where(is_shell[ring], OUTER, HOLE))
    return part, rim


def _goes_on(
    vertex: IntArray, pieces: FloatArray, beyond: BoolArray, n: int, least: float
) -> BoolArray:
    """(n,) vertices from which streets outside the land go on for a length."""
    rows = np.flatnonzero(beyond)
    out = np.zeros(n, dtype=bool)
    if not len(rows):
        return out
    group = components(n, vertex[rows])[vertex[rows, 0]]
    length = np.hypot(*(pieces[rows, 1] - pieces[rows, 0]).T)
    total = np.bincount(group, weights=length, minlength=n)
    out[vertex[rows[total[group] > least]]] = True
    return out


def _described(network: StreetNetwork, lines: NodedStreets, streets: StreetLines) -> StreetNetwork:
    """The network with the class and width of the longest stretch of each edge."""
    edge = np.repeat(np.arange(network.n_edges), np.diff(network.offsets))
    segment = network.half_edges >> 1
    line = lines.line[segment]
    names, name = np.unique(streets.street_class, return_inverse=True)
    kinds, kind = np.unique(
        np.column_stack([name.ravel(), streets.width]), axis=0, return_inverse=True
    )
    of = edge * np.int64(len(kinds)) + kind.ravel()[line]
    found, index = np.unique(of, return_inverse=True)
    length = np.round(np.bincount(index.ravel(), weights=lines.edge_length[segment]), 3)
    order = np.lexsort((found, -length, found // max(len(kinds), 1)))
    _, first = np.unique(found[order] // max(len(kinds), 1), return_index=True)
    chosen = kinds[found[order[first]] % max(len(kinds), 1)]
    return replace(
        network,
        edge_class=names[chosen[:, 0].astype(np.int64)],
        edge_width=chosen[:, 1],
    )
