"""The fabric that a layout is."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.fabric.model import (
    Fabric,
    FabricBlocks,
    FabricParcels,
    Fronts,
    Geometries,
    InnerEdges,
    ParcelRings,
)
from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.planar import OUTSIDE, FloatArray, IntArray
from urban_processing.rights_of_way import RightsOfWay
from urban_processing.streets.block_length import BlockSides
from urban_processing.streets.network_model import StreetNetwork


def fabric_of_layout(
    layout: Layout,
    *,
    network: StreetNetwork,
    rights_of_way: RightsOfWay | None,
    sides: BlockSides,
) -> Fabric:
    """Return a layout as a fabric.

    Parameters
    ----------
    layout
        The layout.
    network
        Its street network.
    rights_of_way
        Its rights-of-way, where they are laid out.
    sides
        Longest sides and outlines of its blocks, in the order of `Layout.face_block`.
    """
    mesh = layout.mesh
    _, first = np.unique(layout.face_block, return_index=True)
    taken = rights_of_way
    land, land_part = land_of_layout(layout)
    return Fabric(
        frame=layout.frame,
        land=land,
        land_part=land_part,
        lines=mesh,
        network=network,
        blocks=FabricBlocks(sides.outline, layout.face_part[first], sides),
        parcels=FabricParcels(
            rings=layout_rings(layout),
            parcel_id=np.arange(1, mesh.n_faces + 1),
            part=layout.face_part,
            block=layout.face_block,
            level=layout.face_level,
            land_use=np.array(layout.land_uses, dtype=object)[layout.face_use],
            net_area=np.full(mesh.n_faces, np.nan) if taken is None else taken.net_area,
            neighbours=_neighbours(layout),
            fronts=_fronts(layout, network),
        ),
        right_of_way=None if taken is None else taken.polygons,
        right_of_way_part=None if taken is None else taken.part,
        inner_edges=_inner_edges(layout),
        min_area=layout.min_area,
        net_min_area=layout.street_rules.net_min_area,
        history=layout.history,
        input_sha256=layout.digest,
        layout=layout,
    )


def layout_rings(layout: Layout) -> ParcelRings:
    """Return the parcels of a layout by what they are measured by."""
    xy, offsets, on_street = street_rings(layout)
    return ParcelRings(
        xy=xy,
        offsets=offsets,
        on_street=on_street,
        frontage=layout.frontage,
        polygons=layout.mesh.face_polygons(),
        area=layout.mesh.face_area,
        rim=layout.rim_parcel,
    )


def street_rings(layout: Layout) -> tuple[FloatArray, IntArray, FloatArray]:
    """Ragged rings of the parcels, and the length of street along each of their edges."""
    mesh = layout.mesh
    half_edges, offsets = mesh.face_rings()
    on_street = np.where(layout.edge_street, mesh.edge_length, 0.0)[half_edges >> 1]
    return mesh.xy[mesh.origin[half_edges]], offsets, on_street


def land_of_layout(layout: Layout) -> tuple[Geometries, IntArray]:
    """Return the polygons of the land, holes taken off, and the part that each belongs to.

    They are put together from the rims of the mesh, not from the parcels.
    """
    mesh, loops = layout.mesh, layout.mesh.loops
    shells: list[tuple[int, shapely.Polygon]] = []
    holes: list[tuple[int, shapely.Polygon]] = []
    for i in np.flatnonzero(loops.face == OUTSIDE).tolist():
        h = loops.ring(i)[::-1]
        part = int(layout.face_part[mesh.face[h[0] ^ 1]])
        ring = shapely.Polygon(mesh.xy[mesh.target[h]])
        (shells if mesh.loop_area[i] < 0 else holes).append((part, ring))
    shells.sort(key=lambda s: (s[0], -s[1].area))
    out = np.empty(len(shells), dtype=object)
    out[:] = [_with_holes(shell, [h for q, h in holes if q == part]) for part, shell in shells]
    return out, np.array([part for part, _ in shells], dtype=np.int64)


def _inner_edges(layout: Layout) -> InnerEdges:
    mesh = layout.mesh
    part = layout.face_part[mesh.face.reshape(-1, 2).max(axis=1)]
    inner = layout.edge_kind == EdgeKind.INTERIOR
    n = int(part.max()) + 1
    length = np.where(inner, mesh.edge_length, 0.0)
    both = (
        np.bincount(part, weights=w, minlength=n) for w in (length, length * layout.edge_street)
    )
    return InnerEdges(*(np.asarray(total, dtype=np.float64) for total in both))


def _neighbours(layout: Layout) -> IntArray:
    # across a street parcels are no neighbours, as those that stop at the right-of-way are not
    sides = np.sort(layout.mesh.face.reshape(-1, 2)[~layout.edge_street], axis=1)
    pairs = np.unique(sides[(sides[:, 0] != OUTSIDE) & (sides[:, 0] != sides[:, 1])], axis=0)
    return np.bincount(pairs.ravel(), minlength=layout.mesh.n_faces)


def _fronts(layout: Layout, network: StreetNetwork) -> Fronts:
    """Street edges of the mesh as the parcels on both their sides see them."""
    mesh = layout.mesh
    edge = network.half_edges >> 1
    step = mesh.edge_length[edge]
    walked = np.cumsum(step) - step / 2
    size = np.diff(network.offsets)
    begin = np.append(0.0, np.cumsum(step))[network.offsets[:-1]]
    at = walked - np.repeat(begin, size)
    of = np.repeat(np.arange(network.n_edges), size)
    face = mesh.face.reshape(-1, 2)[edge]
    both = np.tile(np.arange(len(edge)), 2)
    parcel = face.T.ravel()
    here = parcel != OUTSIDE
    both, parcel = both[here], parcel[here]
    order = np.lexsort((both, parcel))
    both = both[order]
    return Fronts(parcel[order], of[both], at[both], step[both])


def _with_holes(shell: shapely.Polygon, holes: list[shapely.Polygon]) -> shapely.Polygon:
    inside = [h for h in holes if shell.covers(h)]
    polygon = shapely.Polygon(shell.exterior, [h.exterior for h in inside])
    # a hole that touches the rim at a point is one loop with it
    return polygon if polygon.is_valid else shapely.make_valid(polygon, method="structure")
