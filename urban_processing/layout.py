"""`Layout`: the mesh with everything the planning logic knows about its edges and faces."""

from __future__ import annotations

import dataclasses
import enum
import hashlib
import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.hashing import splitmix64
from urban_processing.mesh.components import components
from urban_processing.mesh.corner_graph import CornerGraph, build_corner_graph
from urban_processing.mesh.edit import Remap
from urban_processing.mesh.places import are_near
from urban_processing.mesh.planar import OUTSIDE, BoolArray, FloatArray, IntArray, PlanarMesh
from urban_processing.provenance import Step
from urban_processing.site import Frame, Issue
from urban_processing.street_rules import StreetRules


class EdgeKind(enum.IntEnum):
    """Where a mesh edge lies."""

    INTERIOR = 0
    RIM = 1
    HOLE = 2
    OBSTACLE = 3
    """On the rim of an obstacle that the user gave, also where it touches the outer rim."""


class Stage(enum.IntEnum):
    """Whether co-generation goes on with a parcel."""

    DONE = 0
    """It is not cut any more, unless somebody cuts it."""
    OPEN = 1
    """The next level cuts it, if it is large enough."""
    AHEAD = 2
    """It has its cut of the next level already; the level after that goes on with it."""
    BEHIND = 3
    """Its cut of a level before was undone: the next level cuts it, unless somebody does."""


class Steering(enum.IntFlag):
    """What a planner decided of a mesh edge."""

    NONE = 0
    NO_STREET = 1
    """No street is laid here, unless a parcel cannot be reached otherwise."""
    KEPT = 2
    """A boundary that was chosen or drawn: the parcels beside it are not joined across it."""


ON_OBSTACLE = 1e-5
"""An edge of the rim within this many metres of an obstacle is on it: vertices are rounded."""


@dataclass(frozen=True)
class GivenStreet:
    """What the user said of a street: `street_class` is empty and `width` NaN for nothing."""

    street_class: str = ""
    width: float = math.nan


PARCEL_USE = "parcel"
"""Land use of a parcel that nobody gave another use."""

REMNANT_USE = "remnant"
"""Land use of what is left over between streets and too small for a parcel."""

NOT_FIXED = -1
"""`Layout.edge_fixed` of edges that are no street of the user's."""


SHAPING = ("mesh", "vertex_", "edge_")
"""What the names of fields that parcels and streets are made of begin with."""

DERIVED = frozenset(
    {"corner_graph", "chain_street", "chain_kind", "chain_fixed", "frontage", "face_block"}
    | {"rim_parcel", "digest"}
)
"""What is worked out of those fields alone, and stays known when others change."""


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
    vertex_entry
        (V,) places on the rim where the network meets the outside: nodes as well.
    edge_street
        (E,) whether an edge is a street centreline.
    edge_kind
        (E,) `EdgeKind` of an edge.
    edge_level
        (E,) level at which an edge became street; -1 where it is none.
    edge_fixed
        (E,) entry of `fixed_streets` that an edge is on; -1 for all other edges. Such edges
        stay streets, and stay where they are.
    edge_steering
        (E,) `Steering` of an edge.
    face_part
        (F,) part of the land that a face belongs to.
    face_level
        (F,) number of cuts that made a face.
    face_lineage
        (F,) path of a face in the tree of cuts, hashed to 64 bits: it seeds the face's
        random generator, so that a parcel's cut depends on its own path alone.
    face_locked
        (F,) faces that are not to be cut.
    face_use
        (F,) entry of `land_uses`.
    face_stage
        (F,) `Stage` of a face.
    face_quota
        (F,) number of parcels that a face is still to become; 0 where no number was given.
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
    obstacles
        Polygons in the land as given that are no land, in local coordinates.
    fixed_streets
        What the user said of each street that was given.
    land_uses
        Names of land uses.
    """

    mesh: PlanarMesh
    frame: Frame
    vertex_corner: BoolArray
    vertex_entry: BoolArray
    edge_street: BoolArray
    edge_kind: npt.NDArray[np.int8]
    edge_level: npt.NDArray[np.int16]
    edge_fixed: IntArray
    edge_steering: npt.NDArray[np.uint8]
    face_part: IntArray
    face_level: IntArray
    face_lineage: npt.NDArray[np.uint64]
    face_locked: BoolArray
    face_use: IntArray
    face_stage: npt.NDArray[np.int8]
    face_quota: IntArray
    min_area: float
    street_rules: StreetRules = field(default_factory=StreetRules)
    corners_given: bool = False
    issues: tuple[Issue, ...] = ()
    history: tuple[Step, ...] = ()
    input_parts: tuple[shapely.Polygon, ...] = ()
    obstacles: tuple[shapely.Polygon, ...] = ()
    fixed_streets: tuple[GivenStreet, ...] = ()
    land_uses: tuple[str, ...] = (PARCEL_USE,)

    def __repr__(self) -> str:
        return (
            f"Layout({self.mesh.n_faces} parcels, {int(self.edge_street.sum())} street edges, "
            f"{len(np.unique(self.face_part))} part(s))"
        )

    def replace(self, **changes: Any) -> Layout:
        """Return a copy with some fields changed."""
        other = dataclasses.replace(self, **changes)
        if not any(name.startswith(SHAPING) for name in changes):
            known = vars(self).keys() & DERIVED
            vars(other).update({name: vars(self)[name] for name in known})
        return other

    def with_mesh(self, mesh: PlanarMesh, remap: Remap) -> Layout:
        """Return the layout on an edited mesh; everything known follows the `Remap`."""
        old_vertex = remap.vertex >= 0
        new_edge = remap.edge < 0
        face_split = np.bincount(remap.face, minlength=self.mesh.n_faces)[remap.face] > 1
        lineage = self.face_lineage[remap.face]
        return self.replace(
            mesh=mesh,
            vertex_corner=old_vertex & self.vertex_corner[remap.vertex],
            vertex_entry=old_vertex & self.vertex_entry[remap.vertex],
            edge_street=~new_edge & self.edge_street[remap.edge],
            edge_kind=np.where(new_edge, EdgeKind.INTERIOR, self.edge_kind[remap.edge]),
            edge_level=np.where(new_edge, -1, self.edge_level[remap.edge]).astype(np.int16),
            edge_fixed=np.where(new_edge, NOT_FIXED, self.edge_fixed[remap.edge]),
            edge_steering=np.where(new_edge, Steering.NONE, self.edge_steering[remap.edge]).astype(
                np.uint8
            ),
            face_part=self.face_part[remap.face],
            face_level=self.face_level[remap.face] + face_split,
            face_lineage=np.where(face_split, _child_lineage(lineage, remap.face), lineage),
            face_locked=self.face_locked[remap.face],
            face_use=self.face_use[remap.face],
            face_stage=self.face_stage[remap.face],
            face_quota=self.face_quota[remap.face],
        )

    @cached_property
    def corner_graph(self) -> CornerGraph:
        """The parcel corner graph (Chen 2024, section 3)."""
        return build_corner_graph(self.mesh, self._graph_nodes)

    @property
    def _graph_nodes(self) -> BoolArray:
        nodes = self.vertex_corner | self.vertex_entry
        nodes |= _changes(self.mesh, self.edge_street)
        # the chains of the graph are of one kind, and fixed or steered as a whole or not at all
        for some in (
            self.edge_kind == EdgeKind.OBSTACLE,
            self.edge_fixed != NOT_FIXED,
            self.steered(Steering.NO_STREET),
            self.steered(Steering.KEPT),
        ):
            if some.any():
                nodes |= _changes(self.mesh, some)
        return nodes

    @cached_property
    def chain_street(self) -> BoolArray:
        """(M,) whether a chain of the corner graph is street."""
        return self.edge_street[self.corner_graph.first_edge()]

    @cached_property
    def chain_kind(self) -> npt.NDArray[np.int8]:
        """(M,) `EdgeKind` of a chain of the corner graph."""
        return self.edge_kind[self.corner_graph.first_edge()]

    @cached_property
    def chain_fixed(self) -> BoolArray:
        """(M,) whether a chain of the corner graph is a street that the user gave."""
        return np.asarray(self.edge_fixed[self.corner_graph.first_edge()] != NOT_FIXED)

    def steered(self, what: Steering) -> BoolArray:
        """(E,) whether a planner decided this of an edge."""
        return np.asarray((self.edge_steering & what) != 0)

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
        return components(self.mesh.n_faces, np.column_stack([a, b]))

    @cached_property
    def face_alone(self) -> BoolArray:
        """(F,) parcels that are a whole part of the land each."""
        return np.asarray(np.bincount(self.face_part)[self.face_part] == 1)

    @cached_property
    def rim_parcel(self) -> BoolArray:
        """(F,) parcels with an edge on the land's rim or on a hole."""
        mesh = self.mesh
        out = np.zeros(mesh.n_faces, dtype=bool)
        at_rim = mesh.face[np.repeat(mesh.edge_is_boundary, 2)]
        out[at_rim[at_rim != OUTSIDE]] = True
        return out

    @cached_property
    def digest(self) -> str:
        """SHA-256 of the parcels and streets, for provenance."""
        mesh = self.mesh
        arrays = (mesh.xy, mesh.origin, mesh.next, mesh.face, self.edge_street)
        return hashlib.sha256(b"".join(array.tobytes() for array in arrays)).hexdigest()


def layout_from_mesh(
    mesh: PlanarMesh,
    *,
    frame: Frame,
    face_part: IntArray,
    min_area: float,
    vertex_corner: BoolArray | None = None,
    rim_is_street: bool = True,
    obstacles: Sequence[shapely.Polygon] = (),
) -> Layout:
    """Wrap a mesh as a layout without history: streets on the rim alone, or none."""
    n_faces = mesh.n_faces
    kind = edge_kinds(mesh, obstacles)
    street = (kind == EdgeKind.RIM) & rim_is_street
    corner = np.zeros(mesh.n_vertices, dtype=bool) if vertex_corner is None else vertex_corner
    return Layout(
        mesh=mesh,
        frame=frame,
        vertex_corner=corner,
        vertex_entry=np.zeros(mesh.n_vertices, dtype=bool),
        edge_street=street,
        edge_kind=kind,
        edge_level=np.where(street, 0, -1).astype(np.int16),
        edge_fixed=np.full(mesh.n_edges, NOT_FIXED),
        edge_steering=np.full(mesh.n_edges, Steering.NONE, dtype=np.uint8),
        face_part=np.asarray(face_part, dtype=np.int64),
        face_level=np.zeros(n_faces, dtype=np.int64),
        # far from the ranks that children are told apart by
        face_lineage=splitmix64(np.arange(n_faces).astype(np.uint64) + np.uint64(2**32)),
        face_locked=np.zeros(n_faces, dtype=bool),
        face_use=np.zeros(n_faces, dtype=np.int64),
        face_stage=np.full(n_faces, Stage.DONE, dtype=np.int8),
        face_quota=np.zeros(n_faces, dtype=np.int64),
        min_area=min_area,
        obstacles=tuple(obstacles),
    )


def edge_kinds(mesh: PlanarMesh, obstacles: Sequence[shapely.Polygon] = ()) -> npt.NDArray[np.int8]:
    """(E,) `EdgeKind` by geometry: edges on obstacles, then rims, then holes.

    An outside loop that runs clockwise is a rim, the others are holes.
    """
    loops = mesh.loops
    kind_of_loop = np.where(mesh.loop_area < 0, EdgeKind.RIM, EdgeKind.HOLE)
    kind_of_loop[loops.face != OUTSIDE] = EdgeKind.INTERIOR
    sides = kind_of_loop[loops.of_half_edge].reshape(-1, 2)
    kind = np.asarray(sides.max(axis=1), dtype=np.int8)
    if len(obstacles):
        outer = np.flatnonzero(kind != EdgeKind.INTERIOR)
        ends = mesh.xy[mesh.origin.reshape(-1, 2)[outer]]
        places = np.stack([ends[:, 0], ends.mean(axis=1), ends[:, 1]], axis=1)
        near = are_near(places.reshape(-1, 2), obstacles, ON_OBSTACLE).reshape(-1, 3)
        kind[outer[near.all(axis=1)]] = EdgeKind.OBSTACLE
    return kind


def _child_lineage(parent: npt.NDArray[np.uint64], parent_face: IntArray) -> npt.NDArray[np.uint64]:
    """Path of the halves of cut faces: the parent's path and which half it is, hashed."""
    order = np.argsort(parent_face, kind="stable")
    first = np.searchsorted(parent_face[order], parent_face)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return splitmix64(parent ^ splitmix64((rank - first + 1).astype(np.uint64)))


def _changes(mesh: PlanarMesh, chosen: BoolArray) -> BoolArray:
    """(V,) vertices where a chosen edge meets one that is not."""
    n_chosen = np.bincount(mesh.origin, weights=np.repeat(chosen, 2), minlength=mesh.n_vertices)
    return np.asarray((n_chosen > 0) & (n_chosen < mesh.valence))
