"""`Fabric`: what is measured and compared, made by this software or found in a town."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from urban_processing.layout import Layout
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.provenance import Step
from urban_processing.site import Frame, Issue
from urban_processing.streets.block_length import BlockSides
from urban_processing.streets.network_model import Linework, StreetNetwork

NO_BLOCK = -1
"""`FabricParcels.block` of a parcel that lies in no block."""

REAL = "real"
"""What the side of a comparison is called that is there."""

UNKNOWN_LEVEL = -1
"""`FabricParcels.level` of a parcel that was not made by cuts."""

Geometries = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class ParcelRings:
    """What F parcels are measured by, wherever they come from.

    Parameters
    ----------
    xy, offsets
        Ragged outer rings of the parcels, counter-clockwise, closing points left out.
    on_street
        (N,) length in metres of street along the edge from each vertex of the rings to the next.
    frontage
        (F,) length in metres of each parcel's boundary, holes and all, on streets.
    polygons
        (F,) the parcels as polygons.
    area
        (F,) their areas, m².
    rim
        (F,) whether an edge lies on the land's rim, a hole or an obstacle.
    """

    xy: FloatArray
    offsets: IntArray
    on_street: FloatArray
    frontage: FloatArray
    polygons: Geometries
    area: FloatArray
    rim: BoolArray


@dataclass(frozen=True, eq=False)
class Fronts:
    """A pieces of frontage: where parcels meet the street network.

    Parameters
    ----------
    parcel
        (A,) row of the parcel.
    edge
        (A,) network edge that the piece lies along.
    at
        (A,) metres from the start of that edge to the place opposite the middle of the piece.
    length
        (A,) metres.
    """

    parcel: IntArray
    edge: IntArray
    at: FloatArray
    length: FloatArray


@dataclass(frozen=True, eq=False)
class FabricParcels:
    """F parcels, at least one.

    Parameters
    ----------
    rings
        Their shapes and what of them is on streets.
    parcel_id
        (F,) numbers, unique.
    part
        (F,) piece of the land that each lies in.
    block
        (F,) row of the block that each lies in, `NO_BLOCK` for none.
    level
        (F,) number of cuts that made it, `UNKNOWN_LEVEL` where it was not made so.
    land_use
        (F,) text, `layout.PARCEL_USE` where nothing else is known.
    net_area
        (F,) area in m² less right-of-way, NaN where no right-of-way is known.
    neighbours
        (F,) number of other parcels with which it shares a line of its boundary that is no street.
    fronts
        Its frontage, piece by piece.
    """

    rings: ParcelRings
    parcel_id: IntArray
    part: IntArray
    block: IntArray
    level: IntArray
    land_use: npt.NDArray[np.object_]
    net_area: FloatArray
    neighbours: IntArray
    fronts: Fronts

    @property
    def frontage_known(self) -> bool:
        """Whether streets are known: else frontage, and what depends on it, is not."""
        return not bool(np.isnan(self.rings.frontage).any())

    def __len__(self) -> int:
        """Return the number of parcels."""
        return len(self.parcel_id)


@dataclass(frozen=True, eq=False)
class FabricBlocks:
    """B blocks: faces of the street network and the rim of the land, to the centreline.

    Parameters
    ----------
    polygons
        (B,) their outlines.
    part
        (B,) piece of the land that each lies in.
    sides
        Their longest sides, where they are known already.
    """

    polygons: Geometries
    part: IntArray
    sides: BlockSides | None = None

    def __len__(self) -> int:
        """Return the number of blocks."""
        return len(self.polygons)


@dataclass(frozen=True, eq=False)
class InnerEdges:
    """Boundaries of parcels inside the land, where parcels share them exactly.

    Parameters
    ----------
    length, on_street
        (P,) length in metres in each piece of the land, and that of it which is street.
    """

    length: FloatArray
    on_street: FloatArray


@dataclass(frozen=True, eq=False)
class Fabric:
    """Land with its streets and blocks, and its parcels as far as they are known.

    Parameters
    ----------
    frame
        Where the local coordinates lie on the map.
    land, land_part
        (L,) polygons of the land and the connected piece that each belongs to, the largest first.
    lines, network
        The streets: noded lines, and their network edges, nodes and streets. Where the network
        meets the outside of the land its nodes are entries.
    blocks
        The blocks.
    parcels
        The parcels; None where only streets are known.
    right_of_way, right_of_way_part
        (W,) polygons of the land that streets take, less parcels, and the piece of land of
        each; None where it is not known.
    inner_edges
        Boundaries of parcels inside the land; None where parcels do not share theirs exactly.
    min_area
        The smallest parcel allowed, m²; NaN where none was promised.
    net_min_area
        Whether that is a promise about net parcels.
    issues
        What reading has to say; nothing of a layout, which has issues of its own.
    history
        Steps that made it, oldest first; none for what was found.
    input_sha256
        Hash of the input, for provenance.
    name
        What it is called, such as the stem of its file.
    layout
        The layout that it is; None where it was found.
    """

    frame: Frame
    land: Geometries
    land_part: IntArray
    lines: Linework
    network: StreetNetwork
    blocks: FabricBlocks
    parcels: FabricParcels | None = None
    right_of_way: Geometries | None = None
    right_of_way_part: IntArray | None = None
    inner_edges: InnerEdges | None = None
    min_area: float = math.nan
    net_min_area: bool = False
    issues: tuple[Issue, ...] = ()
    history: tuple[Step, ...] = ()
    input_sha256: str = ""
    name: str = ""
    layout: Layout | None = None

    @cached_property
    def street_lines(self) -> Geometries:
        """(K,) the network edges as lines in local metres."""
        return self.network.lines(self.lines)

    @property
    def all_issues(self) -> tuple[Issue, ...]:
        """Issues of the layout, and what reading has to say."""
        return self.issues if self.layout is None else (*self.layout.issues, *self.issues)


@dataclass(frozen=True, eq=False)
class ComparedFabrics:
    """What is compared with each other.

    Parameters
    ----------
    made
        Fabrics in the order in which they were given.
    real
        What is there, if it is one of those compared.
    """

    made: tuple[Fabric, ...]
    real: Fabric | None = None

    @property
    def all(self) -> tuple[Fabric, ...]:
        """All fabrics, what is there last."""
        return self.made if self.real is None else (*self.made, self.real)

    @property
    def frame(self) -> Frame:
        """Where the first one lies on the map."""
        return self.made[0].frame

    @property
    def issues(self) -> tuple[Issue, ...]:
        """What reading has to say, each with the name of what it is about."""
        return tuple(
            replace(issue, message=f"{fabric.name or 'layout'}: {issue.message}")
            for fabric in self.all
            for issue in fabric.issues
        )
