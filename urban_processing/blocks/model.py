"""`Blocks`: polygons between streets, and what is known of the street along each edge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.corners import ring_neighbours
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.mesh.touches import turns_at_touches
from urban_processing.site import Frame, Issue

UNKNOWN_STREET = -1
"""`Blocks.edge_street` of an edge along which no street is known."""


@dataclass(frozen=True, eq=False)
class Blocks:
    """B blocks in local metres.

    What runs over edges, K in all, is in the order of the coordinates of the polygons: block by
    block, the shell before the holes, closing points left out. Edge ``k`` of a ring goes from
    its vertex ``k`` to the next.

    Parameters
    ----------
    polygons
        (B,) valid polygons, net of rights-of-way: shells counter-clockwise, holes clockwise,
        each ring from its lowest vertex on (`canonical_rings`). They may touch, not overlap.
    frame
        Where the local coordinates lie on the map.
    block_id
        (B,) numbers of the blocks, unique.
    edge_access
        (K,) whether an edge lies on a street, so that a parcel there is reached. By default all
        shells do, and no holes.
    edge_width
        (K,) width in metres of the right-of-way of the street along an edge; NaN where it is not
        known.
    edge_street
        (K,) number of the street along an edge; `UNKNOWN_STREET` where none is known.
    columns
        (B,) values of columns that set parameters block by block, and of others to be carried
        along.
    issues
        What reading, repairing or finding the blocks has to say.
    input_sha256
        Hash of the input, for provenance.
    """

    polygons: npt.NDArray[np.object_]
    frame: Frame
    block_id: IntArray
    edge_access: BoolArray
    edge_width: FloatArray
    edge_street: IntArray
    columns: Mapping[str, npt.NDArray[Any]] = field(default_factory=dict)
    issues: tuple[Issue, ...] = ()
    input_sha256: str = ""

    def __len__(self) -> int:
        """Return the number of blocks."""
        return len(self.polygons)

    @cached_property
    def rings(self) -> BlockRings:
        """The rings of the polygons as arrays."""
        return rings_of(self.polygons)


@dataclass(frozen=True, eq=False)
class BlockRings:
    """Rings of B polygons as arrays; N vertices, as many edges, R rings.

    Parameters
    ----------
    xy
        (N, 2) vertices, closing points left out.
    offsets
        (R + 1,) where rings begin.
    block
        (R,) polygon of each ring; the shell comes first.
    """

    xy: FloatArray
    offsets: IntArray
    block: IntArray

    @property
    def edge_ring(self) -> IntArray:
        """(N,) ring of each edge."""
        return np.repeat(np.arange(len(self.block)), np.diff(self.offsets))

    @property
    def edge_block(self) -> IntArray:
        """(N,) block of each edge."""
        return self.block[self.edge_ring]

    @cached_property
    def following(self) -> IntArray:
        """(N,) next vertex in the ring of each vertex."""
        return ring_neighbours(self.offsets)[1]

    @cached_property
    def place(self) -> IntArray:
        """(N,) first vertex of the same block at the place of each: several where rings touch."""
        out = np.arange(len(self.xy))
        holed = np.bincount(self.block)[self.edge_block] > 1
        there = np.flatnonzero(holed)
        if len(there):
            places = np.column_stack([self.edge_block, self.xy])[there] + 0.0
            _, first, inverse = np.unique(places, axis=0, return_index=True, return_inverse=True)
            out[there] = there[first[inverse.ravel()]]
        return out

    @cached_property
    def along_land(self) -> IntArray:
        """(N,) next vertex along the land, as `turns_at_touches` says; else as `following`."""
        after = self.following.copy()
        block = self.edge_block
        for k in np.unique(block[self.place != np.arange(len(block))]).tolist():
            low, high = np.searchsorted(self.block, [k, k + 1]).tolist()
            offsets = self.offsets[low : high + 1]
            first, stop = int(offsets[0]), int(offsets[-1])
            points = [(x, y) for x, y in self.xy[first:stop].tolist()]
            after[first:stop] = turns_at_touches(points, (offsets - first).tolist())
            after[first:stop] += first
        return after

    def of(self, rows: IntArray) -> tuple[BlockRings, IntArray]:
        """Return the rings of some polygons, in that order, and their edges in this one."""
        rings = ragged_rows(np.searchsorted(self.block, np.arange(self.block[-1] + 2)), rows)
        edges = ragged_rows(self.offsets, rings)
        size = np.diff(self.offsets)[rings]
        block = np.repeat(np.arange(len(rows)), np.bincount(self.block)[rows])
        return BlockRings(self.xy[edges], np.append(0, np.cumsum(size)), block), edges

    @property
    def is_shell(self) -> BoolArray:
        """(R,) rings that are shells."""
        return np.asarray(np.diff(self.block, prepend=-1) != 0)


def ragged_rows(offsets: IntArray, rows: IntArray) -> IntArray:
    """Return the places of the elements of some rows of a ragged array, row by row."""
    size = np.diff(offsets)[rows]
    begin = np.append(0, np.cumsum(size))
    return np.asarray(np.arange(begin[-1]) + np.repeat(offsets[rows] - begin[:-1], size))


def rings_of(polygons: npt.NDArray[np.object_]) -> BlockRings:
    """Return the rings of polygons as arrays."""
    rings, block = shapely.get_rings(polygons, return_index=True)
    xy, ring = shapely.get_coordinates(rings, return_index=True)
    last = np.append(np.diff(ring) > 0, True)[: len(ring)]
    count = np.bincount(ring[~last], minlength=len(rings))
    return BlockRings(xy[~last], np.append(0, np.cumsum(count)), block)


def plain_blocks(
    polygons: npt.NDArray[np.object_],
    *,
    frame: Frame | None = None,
    block_id: IntArray | None = None,
    columns: Mapping[str, npt.NDArray[Any]] | None = None,
    issues: tuple[Issue, ...] = (),
    input_sha256: str = "",
) -> Blocks:
    """Wrap polygons as blocks of which nothing is known but their shape: all shells are street."""
    rings = rings_of(polygons)
    n = len(rings.xy)
    return Blocks(
        polygons=polygons,
        frame=Frame() if frame is None else frame,
        block_id=np.arange(1, len(polygons) + 1) if block_id is None else block_id,
        edge_access=np.asarray(rings.is_shell[rings.edge_ring]),
        edge_width=np.full(n, np.nan),
        edge_street=np.full(n, UNKNOWN_STREET),
        columns={} if columns is None else columns,
        issues=issues,
        input_sha256=input_sha256,
    )
