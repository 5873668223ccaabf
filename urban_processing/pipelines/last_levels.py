"""The last levels of co-generation by another strategy: blocks of streets to parcels."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import shapely

from urban_processing.blocks.model import UNKNOWN_STREET, BlockRings
from urban_processing.layout import Layout, Steering, layout_from_mesh
from urban_processing.mesh.build import canonical_rings, mesh_from_polygons
from urban_processing.mesh.components import components
from urban_processing.mesh.coverage import fit_together
from urban_processing.mesh.places import edges_on, vertices_at
from urban_processing.mesh.planar import OUTSIDE, IntArray
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.parcelling.divide import divide
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.rules import resolve_rules
from urban_processing.pipelines.small_pieces import Whole, join_small

TOGETHER = 1e-5
"""Metres within which vertices on both sides of a street are one."""


def divide_street_blocks(layout: Layout, params: SubdivideParams) -> Layout:
    """Divide every block of the street network into parcels, whatever it consisted of.

    A block into which streets lead that end there is divided parcel by parcel, so that these
    streets stay. So is each side of a boundary that a planner wants by itself. Locked parcels
    stay as they are. Pieces under the layout's smallest area are
    joined to a neighbour.

    Parameters
    ----------
    layout
        Parcels and streets; streets stay where they are.
    params
        Strategy and bounds.
    """
    outlines = _outlines(layout)
    if not outlines:
        return layout
    ground = _ground(layout, outlines)
    pieces = divide(ground, resolve_rules(params, len(ground)), seed=params.seed)
    return _rebuilt(layout, outlines, pieces, join_small(pieces, layout.min_area))


@dataclass(frozen=True, eq=False)
class _Outline:
    """What is to be divided: some faces, and the half-edges around them, the shell first."""

    faces: IntArray
    rings: list[IntArray]


def _outlines(layout: Layout) -> list[_Outline]:
    """Blocks as a whole where they are plain polygons, else their parcels one by one."""
    free = np.flatnonzero(~layout.face_locked)
    block = _pieces_of_blocks(layout)[free]
    order = np.argsort(block, kind="stable")
    groups = np.split(free[order], np.flatnonzero(np.diff(block[order])) + 1)
    found = []
    for group in groups if len(free) else []:
        whole = _outline(layout, group)
        single = (
            [whole] if whole else [_outline(layout, group[k : k + 1]) for k in range(len(group))]
        )
        found += [outline for outline in single if outline is not None]
    return found


def _pieces_of_blocks(layout: Layout) -> IntArray:
    """(F,) blocks, cut along the boundaries that a planner wants."""
    sides = layout.mesh.face.reshape(-1, 2)
    joined = ~layout.edge_street & ~layout.steered(Steering.KEPT) & (sides != OUTSIDE).all(axis=1)
    return components(layout.mesh.n_faces, sides[joined])


def _outline(layout: Layout, faces: IntArray) -> _Outline | None:
    """The outline of some faces together; None where streets end within, or it is no polygon."""
    mesh = layout.mesh
    inside = set(faces.tolist())
    own = np.flatnonzero(np.isin(mesh.face, faces)).tolist()
    around = [h for h in own if int(mesh.face[h ^ 1]) not in inside]
    if layout.edge_street[[h >> 1 for h in set(own).difference(around)]].any():
        return None
    left, rings = set(around), []
    for h in around:
        ring = []
        while h in left:
            left.discard(h)
            ring.append(h)
            h = int(mesh.next[h])
            while int(mesh.face[h ^ 1]) in inside:
                h = int(mesh.next[h ^ 1])
        if ring:
            rings.append(np.array(ring, dtype=np.int64))
    shapes = [shapely.Polygon(mesh.xy[mesh.origin[ring]]) for ring in rings]
    order = sorted(range(len(rings)), key=lambda k: -shapes[k].area)
    shell, *holes = [shapes[k].exterior for k in order]
    if not shapely.Polygon(shell, holes).is_valid:
        return None
    return _Outline(faces, [rings[k] for k in order])


def _ground(layout: Layout, outlines: list[_Outline]) -> Ground:
    """The outlines as ground; seeds come from the paths of their faces."""
    mesh = layout.mesh
    rings = [ring for outline in outlines for ring in outline.rings]
    half_edges = np.concatenate(rings)
    street = layout.edge_street[half_edges >> 1]
    lineage = [np.bitwise_xor.reduce(layout.face_lineage[outline.faces]) for outline in outlines]
    return Ground(
        rings=BlockRings(
            mesh.xy[mesh.origin[half_edges]],
            np.append(0, np.cumsum([len(ring) for ring in rings])),
            np.repeat(np.arange(len(outlines)), [len(outline.rings) for outline in outlines]),
        ),
        access=street,
        width=np.full(len(half_edges), np.nan),
        street=np.full(len(half_edges), UNKNOWN_STREET),
        lineage=np.array(lineage, dtype=np.uint64),
    )


def _rebuilt(layout: Layout, outlines: list[_Outline], pieces: Pieces, whole: Whole) -> Layout:
    """The layout with the joined pieces in place of the faces that they were made of."""
    mesh = layout.mesh
    divided = np.zeros(mesh.n_faces, dtype=bool)
    divided[np.concatenate([outline.faces for outline in outlines])] = True
    kept = np.flatnonzero(~divided)
    first = np.array([outline.faces[0] for outline in outlines])
    level = np.array([layout.face_level[outline.faces].max() for outline in outlines])
    block = pieces.block[whole.piece]
    before = np.append(kept, first[block])
    levels = np.append(layout.face_level[kept], level[block] + pieces.level[whole.piece])
    lineage = np.append(layout.face_lineage[kept], pieces.lineage[whole.piece])
    # across a street the pieces know nothing of each other: each gets the other's vertices
    polygons = np.append(mesh.face_polygons()[kept], whole.polygons)
    coverage = fit_together(polygons, TOGETHER, places=mesh.xy)
    after = mesh_from_polygons(list(canonical_rings(coverage.polygons)))
    source = before[coverage.source]
    rebuilt = layout_from_mesh(
        after,
        frame=layout.frame,
        face_part=layout.face_part[source],
        min_area=layout.min_area,
        vertex_corner=vertices_at(after.xy, mesh.xy[layout.vertex_corner]),
        rim_is_street=False,
        obstacles=layout.obstacles,
    )
    edge, street = edges_on(after, mesh, layout.edge_street, 2 * TOGETHER)
    edge_level, edge_fixed = rebuilt.edge_level.copy(), rebuilt.edge_fixed.copy()
    edge_level[edge], edge_fixed[edge] = layout.edge_level[street], layout.edge_fixed[street]
    edge_steering = rebuilt.edge_steering.copy()
    edge, steered = edges_on(after, mesh, layout.edge_steering != Steering.NONE, 2 * TOGETHER)
    edge_steering[edge] = layout.edge_steering[steered]
    return rebuilt.replace(
        vertex_entry=vertices_at(after.xy, mesh.xy[layout.vertex_entry]),
        edge_street=edge_level >= 0,
        edge_level=edge_level,
        edge_fixed=edge_fixed,
        edge_steering=edge_steering,
        face_level=levels[coverage.source],
        face_lineage=lineage[coverage.source],
        face_locked=layout.face_locked[source],
        face_use=layout.face_use[source],
        street_rules=layout.street_rules,
        corners_given=layout.corners_given,
        issues=layout.issues,
        history=layout.history,
        input_parts=layout.input_parts,
        fixed_streets=layout.fixed_streets,
        land_uses=layout.land_uses,
    )
