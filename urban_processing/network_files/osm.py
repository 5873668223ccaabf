"""Streets and parcels of a layout as an XML file of OpenStreetMap.

Streets and parcels share nodes, as they share vertices. Numbers of nodes, ways and relations begin
with 1: GDAL, and so QGIS, refuses negative ones of nodes, as editors give them. The file says that
it is never to be uploaded.
"""

from __future__ import annotations

import xml.etree.ElementTree as ET  # nosec B405: written here, never parsed
from collections.abc import Iterable

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray
from urban_processing.network_files.markup import document
from urban_processing.network_files.streets import streets_of, vertices_along
from urban_processing.network_files.tags import (
    DEAD_END_TAGS,
    PARCEL_TAGS,
    STREET_TAGS,
    DeadEnd,
    Parcel,
    tags_of,
)
from urban_processing.rights_of_way.lay_out import dead_ends
from urban_processing.site import DEGREE_DIGITS
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork
from urban_processing.version import __version__

Tags = Iterable[tuple[str, str]]


def osm_document(layout: Layout, lon_lat: FloatArray, *, parcels: bool = True) -> bytes:
    """Return a layout as an XML file of OpenStreetMap.

    Parameters
    ----------
    layout
        The layout.
    lon_lat
        (V, 2) longitude and latitude in WGS 84 of the vertices of its mesh.
    parcels
        Whether parcels are written besides streets; the streets are the same objects either way.

    Returns
    -------
    bytes
        The same for the same layout. Node ``i`` is vertex ``i - 1`` of the mesh; the way of a
        street has the number of its network edge; ways of parcels follow, one for each ring.
    """
    mesh, network = layout.mesh, street_network(layout)
    ways = [
        _way(street.edge_id, along.tolist(), tags_of(street, STREET_TAGS))
        for street, along in zip(streets_of(network), vertices_along(network, mesh), strict=True)
    ]
    relations: list[ET.Element] = []
    if parcels:
        used = np.ones(mesh.n_vertices, dtype=bool)
        _add_parcels(layout, ways, relations)
    else:
        used = mesh.vertices_of(layout.edge_street)
    root = ET.Element(
        "osm", version="0.6", generator=f"urban_processing {__version__}", upload="never"
    )
    if used.any():
        root.append(_bounds(lon_lat[used]))
    root.extend(_nodes(lon_lat, used, _dead_end_tags(layout, network)))
    root.extend(ways)
    root.extend(relations)
    return document(root)


def _dead_end_tags(layout: Layout, network: StreetNetwork) -> dict[int, Tags]:
    """Tags of the vertices where streets end."""
    rules = layout.street_rules
    has_head = rules.laid_out and rules.turning_radius > 0
    tags = tags_of(DeadEnd(2.0 * rules.turning_radius if has_head else None), DEAD_END_TAGS)
    return dict.fromkeys(network.node_vertex[dead_ends(layout, network)].tolist(), tags)


def _add_parcels(layout: Layout, ways: list[ET.Element], relations: list[ET.Element]) -> None:
    """Add parcels: a closed way each, or a relation of several where there are holes."""
    mesh, uses = layout.mesh, layout.face_use.tolist()
    loops, outer = mesh.loops, mesh.face_loop.tolist()
    own: list[list[int]] = [[ring] for ring in outer]
    for ring in np.flatnonzero(loops.face != OUTSIDE).tolist():
        face = int(loops.face[ring])
        if ring != outer[face]:
            own[face].append(ring)
    for face in range(mesh.n_faces):
        tags = tags_of(Parcel(face + 1, layout.land_uses[uses[face]]), PARCEL_TAGS)
        plain = len(own[face]) == 1
        members = []
        for ring in own[face]:
            vertices = mesh.origin[loops.ring(ring)].tolist()
            way = _way(len(ways) + 1, [*vertices, vertices[0]], tags if plain else ())
            ways.append(way)
            members.append((way, "outer" if ring == outer[face] else "inner"))
        if not plain:
            relations.append(_multipolygon(len(relations) + 1, members, tags))


def _bounds(lon_lat: FloatArray) -> ET.Element:
    (west, south), (east, north) = lon_lat.min(axis=0), lon_lat.max(axis=0)
    return ET.Element(
        "bounds",
        minlat=_degrees(south),
        minlon=_degrees(west),
        maxlat=_degrees(north),
        maxlon=_degrees(east),
    )


def _nodes(lon_lat: FloatArray, used: BoolArray, tags: dict[int, Tags]) -> list[ET.Element]:
    places = lon_lat.tolist()
    nodes = []
    for vertex in np.flatnonzero(used).tolist():
        lon, lat = places[vertex]
        node = ET.Element(
            "node", id=str(vertex + 1), version="1", lat=_degrees(lat), lon=_degrees(lon)
        )
        _tag(node, tags.get(vertex, ()))
        nodes.append(node)
    return nodes


def _way(number: int, vertices: Iterable[int], tags: Tags) -> ET.Element:
    way = ET.Element("way", id=str(number), version="1")
    for vertex in vertices:
        ET.SubElement(way, "nd", ref=str(vertex + 1))
    _tag(way, tags)
    return way


def _multipolygon(number: int, members: Iterable[tuple[ET.Element, str]], tags: Tags) -> ET.Element:
    relation = ET.Element("relation", id=str(number), version="1")
    for way, role in members:
        ET.SubElement(relation, "member", type="way", ref=way.attrib["id"], role=role)
    _tag(relation, [("type", "multipolygon"), *tags])
    return relation


def _tag(element: ET.Element, tags: Tags) -> None:
    for key, value in tags:
        ET.SubElement(element, "tag", k=key, v=value)


def _degrees(value: float) -> str:
    return f"{value:.{DEGREE_DIGITS}f}"
