"""Fabrics of plain street lines, and the graphs that other libraries measure."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

import networkx as nx
import numpy as np
import pyogrio
import shapely

from urban_processing.fabric.model import Fabric, FabricBlocks
from urban_processing.layout import Layout
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.site import Frame, snap_to_grid
from urban_processing.streets.decompose import decompose_streets

SAMPLES = Path(__file__).resolve().parents[2] / "sample_data"
TOWNS = ("aleppo", "auckland", "salt_lake_city", "schaan", "wuhan")


@dataclass(frozen=True)
class Lines:
    """Noded lines as half-edges."""

    xy: FloatArray
    origin: IntArray
    target: IntArray
    edge_length: FloatArray

    @property
    def n_vertices(self) -> int:
        return len(self.xy)


def lines_of(lines: Iterable[shapely.LineString]) -> Lines:
    """Node lines and split them at their vertices."""
    noded = shapely.get_parts(shapely.union_all(list(lines)))
    xy, of = shapely.get_coordinates(noded, return_index=True)
    same = of[1:] == of[:-1]
    pairs = np.stack([xy[:-1][same], xy[1:][same]], axis=1)
    vertices, index = np.unique(pairs.reshape(-1, 2), axis=0, return_inverse=True)
    ends = index.reshape(-1, 2)
    length = np.hypot(*(vertices[ends[:, 1]] - vertices[ends[:, 0]]).T)
    return Lines(vertices, ends.ravel(), ends[:, ::-1].ravel(), length)


def fabric_of_lines(lines: Iterable[shapely.LineString]) -> Fabric:
    """A fabric of streets alone, without rim and entries, on the land around them."""
    work = lines_of(lines)
    n = len(work.edge_length)
    none = np.zeros(n, dtype=bool)
    network = decompose_streets(
        work,
        street=~none,
        rim=none,
        part=np.zeros(n, dtype=np.int64),
        entry=np.zeros(work.n_vertices, dtype=bool),
    )
    around = shapely.convex_hull(shapely.multipoints(work.xy)).buffer(10.0)
    nothing = np.empty(0, dtype=object)
    return Fabric(
        frame=Frame(),
        land=np.array([around], dtype=object),
        land_part=np.zeros(1, dtype=np.int64),
        lines=work,
        network=network,
        blocks=FabricBlocks(nothing, np.empty(0, dtype=np.int64)),
    )


@lru_cache
def town_lines(name: str) -> tuple[shapely.LineString, ...]:
    """Streets of a sample town in local metres, noded."""
    *_, wkb, _ = pyogrio.raw.read(SAMPLES / f"streets_{name}.gpkg", columns=[], force_2d=True)
    lines = shapely.from_wkb(wkb)
    origin = np.floor(shapely.total_bounds(lines)[:2])
    lines = shapely.transform(lines, lambda xy: snap_to_grid(xy - origin))
    return tuple(shapely.get_parts(shapely.union_all(lines)))


def mesh_graph(layout: Layout) -> nx.MultiGraph:
    """Streets of a layout without the rim as a graph of mesh vertices."""
    mesh, rim = layout.mesh, layout.edge_kind == 1
    on_rim = mesh.vertices_of(rim & layout.edge_street) | layout.vertex_entry
    graph = nx.MultiGraph()
    for e in np.flatnonzero(layout.edge_street & ~rim).tolist():
        graph.add_edge(*mesh.origin[[2 * e, 2 * e + 1]].tolist(), length=mesh.edge_length[e])
    for v in graph:
        graph.nodes[v].update(xy=tuple(mesh.xy[v].tolist()), on_rim=bool(on_rim[v]))
    return contracted(graph)


def line_graph(lines: Iterable[shapely.LineString]) -> nx.MultiGraph:
    """Noded lines as a graph of their ends."""
    graph = nx.MultiGraph()
    for line in lines:
        graph.add_edge(line.coords[0], line.coords[-1], length=line.length)
    for v in graph:
        graph.nodes[v].update(xy=v, on_rim=False)
    return contracted(graph)


def contracted(graph: nx.MultiGraph) -> nx.MultiGraph:
    """Take out nodes of two edges one by one, but for those on the rim."""
    for v in list(graph):
        if graph.degree(v) != 2 or graph.nodes[v]["on_rim"] or graph.has_edge(v, v):
            continue
        (_, a, one), (_, b, other) = graph.edges(v, data="length")
        graph.add_edge(a, b, length=one + other)
        graph.remove_node(v)
    return graph


def osmnx_graph(graph: nx.MultiGraph, crs: str) -> nx.MultiGraph:
    """The same with what osmnx asks for: x, y, length, bearing, street_count."""
    out = nx.MultiGraph(crs=crs)
    for v, d in graph.nodes(data=True):
        out.add_node(v, x=d["xy"][0], y=d["xy"][1])
    for a, b, length in graph.edges(data="length"):
        (x, y), (u, v) = graph.nodes[a]["xy"], graph.nodes[b]["xy"]
        bearing = math.degrees(math.atan2(u - x, v - y)) % 360
        out.add_edge(a, b, length=length, bearing=bearing if a != b else math.nan)
    return out
