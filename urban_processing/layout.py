"""`Layout`: the mesh with everything the planning logic knows about its edges and faces."""

from __future__ import annotations

import dataclasses
import enum
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from urban_processing.hashing import splitmix64
from urban_processing.mesh.corner_graph import CornerGraph, build_corner_graph
from urban_processing.mesh.edit import Remap
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.site import Frame, Issue
from urban_processing.street_rules import StreetRules


class EdgeKind(enum.IntEnum):
    """Where a mesh edge lies."""

    INTERIOR = 0
    RIM = 1
    HOLE = 2


@dataclass(frozen=True)
class Step:
    """One entry of a layout's provenance; `results` are figures that the step has to tell."""

    algorithm: str
    parameters: Mapping[str, Any]
    seed: int
    version: str
    input_sha256: str
    seconds: float
    results: Mapping[str, float] = dataclasses.field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Layout:
    """Parcels and streets on one planar mesh; immutable.

    V vertices, E edges, F faces; every face is a parcel.

    Parameters
    ----------
    mesh
        The parcel mesh, in local coordinates of `frame`.
    frame
        Where the local coordinates lie on the map.
    vertex_corner
        (V,) corners of the land, found or given: they are nodes of the corner graph.
    edge_street
        (E,) whether an edge is a street centreline.
    edge_kind
        (E,) `EdgeKind` of an edge.
    edge_level
        (E,) level at which an edge became street; -1 where it is none.
    face_part
        (F,) part of the land that a face belongs to.
    face_level
        (F,) number of cuts that made a face.
    face_lineage
        (F,) path of a face in the tree of cuts, hashed to 64 bits: it seeds the face's
        random generator, so that a parcel's cut depends on its own path alone.
    face_locked
        (F,) faces that are not to be cut.
    min_area
        The smallest parcel allowed, m².
    street_rules
        How wide streets are, and whether rights-of-way are laid out.
    corners_given
        Whether the user gave the corners of a freeform land (Chen 2024, section 3).
    issues
        What could not be done, and what the user should know.
    history
        Provenance, oldest step first.
    input_parts
        The polygons as given, in local coordinates.
    """

    mesh: PlanarMesh
    frame: Frame
    vertex_corner: BoolArray
    edge_street: BoolArray
    edge_kind: npt.NDArray[np.int8]
    edge_level: npt.NDArray[np.int16]
    face_part: IntArray
    face_level: IntArray
    face_lineage: npt.NDArray[np.uint64]
    face_locked: BoolArray
    min_area: float
    street_rules: StreetRules = field(default_factory=StreetRules)
    corners_given: bool = False
    issues: tuple[Issue, ...] = ()
    history: tuple[Step, ...] = ()
    input_parts: tuple[shapely.Polygon, ...] = ()

    def __repr__(self) -> str:
        return (
            f"Layout({self.mesh.n_faces} parcels, {int(self.edge_street.sum())} street edges, "
            f"{len(np.unique(self.face_part))} part(s))"
        )

    def replace(self, **changes: Any) -> Layout:
        """Return a copy with some fields changed."""
        return dataclasses.replace(self, **changes)

    def with_mesh(self, mesh: PlanarMesh, remap: Remap) -> Layout:
        """Return the layout on an edited mesh; everything known follows the `Remap`."""
        vertex_corner = np.where(remap.vertex >= 0, self.vertex_corner[remap.vertex], False)
        new_edge = remap.edge < 0
        face_split = np.bincount(remap.face, minlength=self.mesh.n_faces)[remap.face] > 1
        lineage = self.face_lineage[remap.face]
        return self.replace(
            mesh=mesh,
            vertex_corner=vertex_corner,
            edge_street=~new_edge & self.edge_street[remap.edge],
            edge_kind=np.where(new_edge, EdgeKind.INTERIOR, self.edge_kind[remap.edge]),
            edge_level=np.where(new_edge, -1, self.edge_level[remap.edge]).astype(np.int16),
            face_part=self.face_part[remap.face],
            face_level=self.face_level[remap.face] + face_split,
            face_lineage=np.where(face_split, _child_lineage(lineage, remap.face), lineage),
            face_locked=self.face_locked[remap.face],
        )

    @cached_property
    def corner_graph(self) -> CornerGraph:
        """The parcel corner graph (Chen 2024, section 3)."""
        return build_corner_graph(self.mesh, self._graph_nodes)

    @property
    def _graph_nodes(self) -> BoolArray:
        return self.vertex_corner | _street_changes(self.mesh, self.edge_street)

    @cached_property
    def chain_street(self) -> BoolArray:
        """(M,) whether a chain of the corner graph is street."""
        return self.edge_street[self.corner_graph.first_edge()]

    @cached_property
    def chain_kind(self) -> npt.NDArray[np.int8]:
        """(M,) `EdgeKind` of a chain of the corner graph."""
        return self.edge_kind[self.corner_graph.first_edge()]

    @cached_property
    def frontage(self) -> FloatArray:
        """(F,) length in metres of each parcel's boundary on street edges."""
        mesh = self.mesh
        used = (mesh.face != OUTSIDE) & np.repeat(self.edge_street, 2)
        h = np.flatnonzero(used)
        out = np.zeros(mesh.n_faces)
        np.add.at(out, mesh.face[h], mesh.edge_length[h >> 1])
        return out

    @cached_property
    def face_block(self) -> IntArray:
        """(F,) block of each parcel: parcels joined across edges that are not street."""
        sides = self.mesh.face.reshape(-1, 2)
        joined = ~self.edge_street & (sides != OUTSIDE).all(axis=1)
        a, b = sides[joined].T
        n = self.mesh.n_faces
        graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(n, n))
        return np.asarray(connected_components(graph, directed=False)[1], dtype=np.int64)

    @cached_property
    def rim_parcel(self) -> BoolArray:
        """(F,) parcels with an edge on the land's rim or on a hole."""
        mesh = self.mesh
        out = np.zeros(mesh.n_faces, dtype=bool)
        at_rim = mesh.face[np.repeat(mesh.edge_is_boundary, 2)]
        out[at_rim[at_rim != OUTSIDE]] = True
        return out


def layout_from_mesh(
    mesh: PlanarMesh,
    *,
    frame: Frame,
    face_part: IntArray,
    min_area: float,
    vertex_corner: BoolArray | None = None,
    rim_is_street: bool = True,
) -> Layout:
    """Wrap a mesh as a layout without history: streets on the rim alone, or none."""
    n_faces = mesh.n_faces
    kind = edge_kinds(mesh)
    street = (kind == EdgeKind.RIM) & rim_is_street
    corner = np.zeros(mesh.n_vertices, dtype=bool) if vertex_corner is None else vertex_corner
    return Layout(
        mesh=mesh,
        frame=frame,
        vertex_corner=corner,
        edge_street=street,
        edge_kind=kind,
        edge_level=np.where(street, 0, -1).astype(np.int16),
        face_part=np.asarray(face_part, dtype=np.int64),
        face_level=np.zeros(n_faces, dtype=np.int64),
        # far from the ranks that children are told apart by
        face_lineage=splitmix64(np.arange(n_faces).astype(np.uint64) + np.uint64(2**32)),
        face_locked=np.zeros(n_faces, dtype=bool),
        min_area=min_area,
    )


def edge_kinds(mesh: PlanarMesh) -> npt.NDArray[np.int8]:
    """(E,) `EdgeKind`: an outside loop that runs clockwise is a rim, the others are holes."""
    loops = mesh.loops
    kind_of_loop = np.where(mesh.loop_area < 0, EdgeKind.RIM, EdgeKind.HOLE)
    kind_of_loop[loops.face != OUTSIDE] = EdgeKind.INTERIOR
    sides = kind_of_loop[loops.of_half_edge].reshape(-1, 2)
    return np.asarray(sides.max(axis=1), dtype=np.int8)


def _child_lineage(parent: npt.NDArray[np.uint64], parent_face: IntArray) -> npt.NDArray[np.uint64]:
    """Path of the halves of cut faces: the parent's path and which half it is, hashed."""
    order = np.argsort(parent_face, kind="stable")
    first = np.searchsorted(parent_face[order], parent_face)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return splitmix64(parent ^ splitmix64((rank - first + 1).astype(np.uint64)))


def _street_changes(mesh: PlanarMesh, edge_street: BoolArray) -> BoolArray:
    """(V,) vertices where a street edge meets one that is none, or a street ends."""
    n_street = np.bincount(
        mesh.origin, weights=np.repeat(edge_street, 2), minlength=mesh.n_vertices
    )
    return np.asarray((n_street > 0) & (n_street < mesh.valence))
