"""Streets of a layout as plain nodes and edges of SUMO, from which netconvert builds a network."""

from __future__ import annotations

import xml.etree.ElementTree as ET  # nosec B405: written here, never parsed
from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.planar import FloatArray, IntArray, PlanarMesh
from urban_processing.network_files.markup import document
from urban_processing.network_files.streets import Street, streets_of, vertices_along
from urban_processing.site import DEGREE_DIGITS
from urban_processing.street_rules import LANE_WIDTH
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork

NO_PROJECTION = "!"
"""What stands in a file of SUMO for coordinates without a CRS."""

DIGITS = 3
"""Digits after the point of metres."""

_KMH = 1 / 3.6


@dataclass(frozen=True)
class _Piece:
    """A street between two nodes of SUMO, with its vertices from end to end."""

    number: str
    start: str
    end: str
    vertices: IntArray
    street: Street


def sumo_documents(
    layout: Layout, *, projection: str = NO_PROJECTION, lon_lat: FloatArray | None = None
) -> tuple[bytes, bytes]:
    """Return the nodes and the edges of a layout as plain XML of SUMO.

    Coordinates are metres from the layout's origin. Every street is two edges: that from its start
    to its end has the number of the network edge, the other one the same with a minus. A ring
    is divided into three, since an edge of SUMO does not end where it begins.

    Parameters
    ----------
    layout
        The layout.
    projection
        Its CRS as a code or a text of PROJ.
    lon_lat
        (V, 2) longitude and latitude of the vertices of its mesh, where there is a CRS.

    Returns
    -------
    nodes, edges
        The same bytes for the same layout.
    """
    mesh, network = layout.mesh, street_network(layout)
    places, fringe = _network_nodes(network)
    pieces: list[_Piece] = []
    for street, along in zip(streets_of(network), vertices_along(network, mesh), strict=True):
        pieces += _pieces(street, along, mesh, places)
    nodes = ET.Element("nodes")
    nodes.append(_location(layout, projection, lon_lat))
    for vertex, name in places.items():
        node = ET.SubElement(nodes, "node", id=name, x=_metres(mesh, vertex, 0))
        node.set("y", _metres(mesh, vertex, 1))
        if vertex in fringe:
            node.set("fringe", "outer")
    edges = ET.Element("edges")
    for piece in pieces:
        edges.extend(_both_directions(piece, mesh))
    return document(nodes), document(edges)


def _network_nodes(network: StreetNetwork) -> tuple[dict[int, str], set[int]]:
    """Names of nodes by vertex, and the vertices where the network meets the outside.

    Junctions and ends have their numbers in the layer of junctions; the starts of rings, which
    are not in it, are named later.
    """
    vertex = network.node_vertex
    counted = np.flatnonzero(network.node_number)
    numbers = network.node_number[counted].tolist()
    names = {v: str(n) for v, n in zip(vertex[counted].tolist(), numbers, strict=True)}
    return names, set(vertex[network.node_kind == NodeKind.ENTRY].tolist())


def _pieces(
    street: Street, along: IntArray, mesh: PlanarMesh, names: dict[int, str]
) -> Iterator[_Piece]:
    """Yield a street, a ring in three pieces; names the nodes between them."""
    if along[0] != along[-1]:
        start, end = names[int(along[0])], names[int(along[-1])]
        yield _Piece(str(street.edge_id), start, end, along, street)
        return
    step = np.diff(mesh.xy[along], axis=0)
    run = np.cumsum(np.hypot(step[:, 0], step[:, 1]))
    last = len(run) - 1
    # vertex i + 1 lies at run[i]; each piece has at least one step
    one = int(np.clip(np.searchsorted(run, run[-1] / 3), 0, last - 2)) + 1
    two = int(np.clip(np.searchsorted(run, run[-1] * 2 / 3), one, last - 1)) + 1
    cuts = [0, one, two, len(along) - 1]
    for i, (a, b) in enumerate(pairwise(cuts)):
        ends = [
            names.setdefault(int(along[cut]), f"{street.edge_id}#{j % 3}")
            for j, cut in ((i, a), (i + 1, b))
        ]
        yield _Piece(f"{street.edge_id}#{i}", ends[0], ends[1], along[a : b + 1], street)


def _location(layout: Layout, projection: str, lon_lat: FloatArray | None) -> ET.Element:
    """How coordinates lie on the map: those of the CRS, plus an offset, are those of the file."""
    local = _bounds(layout.mesh.xy, DIGITS)
    return ET.Element(
        "location",
        netOffset=",".join(f"{0.0 - value:.{DIGITS}f}" for value in layout.frame.origin),
        convBoundary=local,
        origBoundary=local if lon_lat is None else _bounds(lon_lat, DEGREE_DIGITS),
        projParameter=projection,
    )


def _bounds(xy: FloatArray, digits: int) -> str:
    return ",".join(f"{v:.{digits}f}" for v in (*xy.min(axis=0), *xy.max(axis=0)))


def _both_directions(piece: _Piece, mesh: PlanarMesh) -> Iterator[ET.Element]:
    street = piece.street
    lanes = max(1, (street.lanes or 1) // 2)
    shared = {
        "name": f"Street {street.street_id}",
        "type": f"highway.{street.highway}",
        "priority": str(street.traffic.priority),
        "numLanes": str(lanes),
        "speed": f"{street.traffic.speed * _KMH:.2f}",
        "spreadType": "right",
    }
    if street.carriageway is not None:
        shared["width"] = f"{min(LANE_WIDTH, street.carriageway / (2 * lanes)):.10g}"
    if street.traffic.users:
        shared["allow"] = street.traffic.users
    for number, start, end, vertices in (
        (piece.number, piece.start, piece.end, piece.vertices),
        (f"-{piece.number}", piece.end, piece.start, piece.vertices[::-1]),
    ):
        edge = ET.Element("edge", {"id": number, "from": start, "to": end, **shared})
        if len(vertices) > 2:
            places = [f"{_metres(mesh, v, 0)},{_metres(mesh, v, 1)}" for v in vertices.tolist()]
            edge.set("shape", " ".join(places))
        yield edge


def _metres(mesh: PlanarMesh, vertex: int, axis: int) -> str:
    return f"{mesh.xy[vertex, axis]:.{DIGITS}f}"
