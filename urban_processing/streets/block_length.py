"""Length of blocks: that of their longest side, from corner to corner."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.mesh.corners import reported_polygons, ring_neighbours
from urban_processing.mesh.planar import FloatArray, IntArray


@dataclass(frozen=True, eq=False)
class BlockSides:
    """Longest sides of B blocks.

    Parameters
    ----------
    length
        (B,) length in metres of each block's longest side, measured along its boundary.
    line
        (B,) the side itself.
    outline
        (B,) polygon of the block.
    """

    length: FloatArray
    outline: npt.NDArray[np.object_]
    line: npt.NDArray[np.object_]


def longest_sides(polygons: npt.NDArray[np.object_], block: IntArray) -> BlockSides:
    """Measure blocks: what subdivision codes limit as the length of a block.

    The outline of a block is that of its parcels together. Its corners are those of the
    approximate polygon, bends of 45° and more, in which a long curve may end up as well; a
    street that ends at the block from outside makes no corner. Streets that end inside a block
    (cul-de-sacs) do not divide it.

    Parameters
    ----------
    polygons
        (F,) parcels, which share their vertices.
    block
        (F,) block of each parcel, numbers from 0 to B - 1.
    """
    outlines = _outlines(polygons, block)
    rings = [_ring(outline) for outline in outlines]
    count = np.array([len(ring) for ring in rings])
    offsets = np.append(0, np.cumsum(count))
    xy = np.concatenate(rings)
    _, after = ring_neighbours(offsets)
    step = np.hypot(*(xy[after] - xy).T)
    walked = np.append(0.0, np.cumsum(step))
    corners, corner_offsets = reported_polygons(xy, offsets)
    _, following = ring_neighbours(corner_offsets)
    length = walked[corners[following]] - walked[corners]
    perimeter = np.add.reduceat(step, offsets[:-1])
    owner = np.repeat(np.arange(len(rings)), np.diff(corner_offsets))
    length = np.where(length <= 0, length + perimeter[owner], length)
    # rounded, so that the first of equally long sides is taken on every machine
    order = np.lexsort((-np.round(length, 6), owner))
    first = order[np.flatnonzero(np.diff(owner[order], prepend=-1))]
    lines = [
        _part_of_ring(ring, int(start - offset), int(stop - offset))
        for ring, offset, start, stop in zip(
            rings, offsets, corners[first], corners[following[first]], strict=False
        )
    ]
    return BlockSides(
        length[first], np.array(outlines, dtype=object), np.array(lines, dtype=object)
    )


def _outlines(polygons: npt.NDArray[np.object_], block: IntArray) -> list[shapely.Polygon]:
    """The parcels of each block as one polygon."""
    order = np.argsort(block, kind="stable")
    starts = np.flatnonzero(np.diff(block[order], prepend=-1))
    outlines = []
    for faces in np.split(order, starts[1:]):
        outline = polygons[faces[0]]
        if len(faces) > 1:
            outline = shapely.coverage_union_all(polygons[faces])
        # parcels that touch in single points of the outline make several polygons
        outlines.append(max(shapely.get_parts(outline), key=lambda polygon: polygon.area))
    return outlines


def _ring(polygon: shapely.Polygon) -> FloatArray:
    """Outer ring, counter-clockwise and not closed."""
    xy = shapely.get_coordinates(polygon.exterior)[:-1]
    return np.asarray(xy if polygon.exterior.is_ccw else xy[::-1])


def _part_of_ring(ring: FloatArray, start: int, stop: int) -> shapely.LineString:
    """The ring from one vertex forward to another."""
    index = np.arange(start, stop + 1 if stop > start else stop + len(ring) + 1) % len(ring)
    return shapely.LineString(ring[index])
