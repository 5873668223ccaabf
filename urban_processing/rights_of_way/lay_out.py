"""The rights-of-way of a layout."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
import shapely

from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.planar import OUTSIDE, BoolArray, IntArray
from urban_processing.rights_of_way.partition import RightsOfWay, partition
from urban_processing.rights_of_way.surfaces import (
    Circles,
    Geometries,
    StreetSides,
    street_surfaces,
)
from urban_processing.street_rules import StreetClass
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork

CLASSES: tuple[StreetClass, ...] = tuple(StreetClass)
"""Classes by rank: the higher one takes a junction."""


def lay_out_rights_of_way(layout: Layout) -> RightsOfWay:
    """Cut the rights-of-way of a layout's streets out of its parcels.

    Each street is widened by half its width to both sides, by what `Layout.street_rules` says;
    a street on the rim of the land takes its inner half alone. Corners of blocks are rounded,
    dead ends inside the land get turning heads, those without one a half circle.

    Parameters
    ----------
    layout
        The layout; its `street_rules` give widths and radii.

    Returns
    -------
    RightsOfWay
        In local coordinates. It depends on nothing but parcels, streets and rules.

    Examples
    --------
    >>> import numpy as np, shapely
    >>> from urban_processing.layout import layout_from_mesh
    >>> from urban_processing.mesh.build import mesh_from_polygons
    >>> from urban_processing.site import Frame
    >>> from urban_processing.street_rules import StreetRules
    >>> mesh = mesh_from_polygons([shapely.box(0, 0, 100, 100)])
    >>> layout = layout_from_mesh(mesh, frame=Frame(), face_part=np.zeros(1), min_area=400)
    >>> rules = StreetRules(rim=20, corner_radius=0)
    >>> float(lay_out_rights_of_way(layout.replace(street_rules=rules)).net_area[0])
    6400.0
    """
    return _laid_out(_Source(layout))


class _Source:
    """What rights-of-way depend on; the same for layouts that differ in other things alone."""

    def __init__(self, layout: Layout) -> None:
        self.layout = layout

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, _Source):
            return NotImplemented
        a, b = self.layout, other.layout
        return (
            a.mesh is b.mesh
            and a.street_rules == b.street_rules
            and a.fixed_streets == b.fixed_streets
            and all(
                np.array_equal(getattr(a, name), getattr(b, name))
                for name in (
                    *("edge_street", "edge_level", "edge_kind", "edge_fixed"),
                    *("vertex_entry", "face_part"),
                )
            )
        )

    def __hash__(self) -> int:
        return hash((id(self.layout.mesh), self.layout.street_rules))


@lru_cache(maxsize=1)  # findings, tables and certificate ask for the same one
def _laid_out(source: _Source) -> RightsOfWay:
    layout = source.layout
    mesh, block = layout.mesh, layout.face_block
    parcels = mesh.face_polygons()
    network = street_network(layout)
    surfaces = street_surfaces(
        _block_polygons(parcels, block),
        _street_sides(layout, network),
        _turning_heads(layout, network),
        corner_radius=layout.street_rules.corner_radius,
    )
    edges = shapely.linestrings(mesh.xy[mesh.origin.reshape(-1, 2)])
    return partition(parcels, edges, surfaces, block=block, part=layout.face_part)


def _block_polygons(parcels: Geometries, block: IntArray) -> Geometries:
    order = np.argsort(block, kind="stable")
    groups = np.split(order, np.flatnonzero(np.diff(block[order])) + 1)
    return np.array([shapely.coverage_union_all(parcels[g]) for g in groups], dtype=object)


def _street_sides(layout: Layout, network: StreetNetwork) -> StreetSides:
    """Every street edge at the block on each of its sides, once."""
    mesh = layout.mesh
    width, rank = np.zeros(mesh.n_edges), np.zeros(mesh.n_edges, dtype=np.int64)
    along = np.repeat(np.arange(network.n_edges), np.diff(network.offsets))
    width[network.half_edges >> 1] = network.edge_width[along]
    rank[network.half_edges >> 1] = _ranks(network)[along]
    h = np.flatnonzero((mesh.face != OUTSIDE) & np.repeat(width > 0, 2))
    sides = np.unique(np.column_stack([layout.face_block[mesh.face[h]], h >> 1]), axis=0)
    edge = sides[:, 1]
    ends = mesh.xy[mesh.origin.reshape(-1, 2)[edge]]
    return StreetSides(sides[:, 0], ends, width[edge], rank[edge])


def dead_ends(layout: Layout, network: StreetNetwork) -> BoolArray:
    """(N,) nodes where a street ends inside the land; on its outer rim a street leaves it."""
    on_rim = layout.mesh.vertices_of(layout.edge_kind == EdgeKind.RIM)
    return np.asarray((network.node_kind == NodeKind.END) & ~on_rim[network.node_vertex])


def _turning_heads(layout: Layout, network: StreetNetwork) -> Circles:
    """Circles at dead ends."""
    mesh, radius = layout.mesh, layout.street_rules.turning_radius
    first = network.half_edges[network.offsets[:-1]]
    last = network.half_edges[network.offsets[1:] - 1]
    half = np.concatenate([first, last ^ 1])
    node = np.concatenate([network.start, network.end])
    edge = np.tile(np.arange(network.n_edges), 2)
    dead = dead_ends(layout, network)[node] & (radius > 0) & (network.edge_width[edge] > 0)
    half, edge = half[dead], edge[dead]
    beside = np.stack([mesh.face[half], mesh.face[half ^ 1]])
    block = layout.face_block[beside.max(axis=0)]
    return Circles(
        block, mesh.xy[mesh.origin[half]], np.full(len(half), radius), _ranks(network)[edge]
    )


def _ranks(network: StreetNetwork) -> IntArray:
    rank = {each.value: i for i, each in enumerate(CLASSES)}
    given = rank[StreetClass.FIXED]
    # classes that the user gave streets are of any name
    return np.array([rank.get(c, given) for c in network.edge_class.tolist()], dtype=np.int64)
