"""Keys of blocks: the same while neither the contour nor what applies to a block changes."""

from __future__ import annotations

import hashlib
import math
import numbers
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import UNKNOWN_STREET, BlockRings, Blocks, rings_of
from urban_processing.hashing import splitmix64
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.persistence.contours import corners_of, ring_neighbours

UintArray = npt.NDArray[np.uint64]

KEY_TOLERANCE = 2.0**-10
"""Contours that differ by less than this many metres may have one key: about a millimetre."""


def block_key(contour: shapely.Polygon, attributes: Mapping[str, Any]) -> str:
    """Return the key of one block.

    Parameters
    ----------
    contour
        Its polygon, in map coordinates.
    attributes
        The parameters that apply to it, by name.

    Examples
    --------
    >>> square = shapely.box(0, 0, 100, 80)
    >>> more = shapely.Polygon([(100, 0), (100, 40), (100, 80), (0, 80), (0, 0)])
    >>> block_key(square, {"min_area": 400}) == block_key(more, {"min_area": 400.0})
    True
    >>> block_key(square, {"min_area": 400}) == block_key(square, {"min_area": 500})
    False
    """
    columns = {name: np.array([value], dtype=object) for name, value in attributes.items()}
    return str(_joined(fingerprints(np.array([contour], dtype=object)), columns)[0])


def block_keys(
    blocks: Blocks, attributes: Mapping[str, npt.NDArray[Any]] | None = None
) -> npt.NDArray[np.str_]:
    """Return a key for each block: of its contour, its streets and its parameters.

    Blocks of two runs with the same key become the same parcels: only the others are to be
    divided again. The key does not depend on where a ring starts, nor on collinear vertices
    where the street does not change, nor on how streets are numbered.

    Parameters
    ----------
    blocks
        B blocks.
    attributes
        (B,) values of all parameters that apply, by name; by default the columns of the blocks.

    Returns
    -------
    (B,) array of str
        32 hexadecimal digits each.
    """
    rings = rings_of(shapely.transform(blocks.polygons, lambda xy: xy + blocks.frame.origin))
    edges = {"access": blocks.edge_access, "width": blocks.edge_width}
    street = _streets_by_place(rings, blocks.edge_street)
    marks = _ring_marks(rings, edges={**edges, "street": street})
    columns = blocks.columns if attributes is None else attributes
    return _joined(_per_polygon(marks, rings, len(blocks)), columns)


def fingerprints(polygons: npt.NDArray[np.object_]) -> UintArray:
    """(n,) 64-bit numbers of polygons: the same for the same shape in the same place.

    They do not depend on where a ring starts, on its direction, nor on collinear vertices.
    """
    rings = rings_of(shapely.orient_polygons(polygons))
    return _per_polygon(_ring_marks(rings, edges={}), rings, len(polygons))


def _ring_marks(rings: BlockRings, *, edges: Mapping[str, npt.NDArray[Any]]) -> UintArray:
    """(R,) a number for each ring: of its corners, in order from the lowest on, and its edges."""
    ring = rings.edge_ring
    before, _ = ring_neighbours(ring)
    bits = {name: _bits(values) for name, values in edges.items()}
    kept = np.zeros(len(rings.xy), dtype=bool)
    for values in bits.values():
        kept |= values != values[before]
    corner = corners_of(rings, KEY_TOLERANCE, kept=kept)
    xy, of_ring = np.round(rings.xy[corner] / KEY_TOLERANCE) + 0.0, ring[corner]
    mark = splitmix64(_bits(xy[:, 0])) ^ _bits(xy[:, 1])
    for values in bits.values():
        mark = splitmix64(mark) ^ values[corner]
    rank = _rank_from_lowest(xy, of_ring)
    mark = splitmix64(splitmix64(mark) ^ rank.astype(np.uint64))
    total = np.zeros(len(rings.block), dtype=np.uint64)
    np.add.at(total, of_ring, mark)
    return total


def _rank_from_lowest(xy: FloatArray, ring: IntArray) -> IntArray:
    """(n,) number of each vertex in its ring, counted from the one lowest in x, then y."""
    order = np.lexsort((xy[:, 1], xy[:, 0], ring))
    first = np.flatnonzero(np.diff(ring, prepend=-1) != 0)
    start = np.zeros(ring[-1] + 1 if len(ring) else 0, dtype=np.int64)
    start[ring[first]] = order[first]
    count = np.bincount(ring)
    return np.asarray((np.arange(len(ring)) - start[ring]) % count[ring])


def _per_polygon(marks: UintArray, rings: BlockRings, n: int) -> UintArray:
    """Sum what rings say by polygon: holes count the same in any order, the shell apart."""
    mixed = splitmix64(marks ^ rings.is_shell.astype(np.uint64))
    total = np.zeros(n, dtype=np.uint64)
    np.add.at(total, rings.block, mixed)
    return total


def _streets_by_place(rings: BlockRings, street: IntArray) -> UintArray:
    """(N,) a number for each street that stays when streets are numbered anew.

    It is the lowest vertex of the street's edges along the block.
    """
    xy = np.round(rings.xy / KEY_TOLERANCE) + 0.0
    block = rings.edge_block
    order = np.lexsort((xy[:, 1], xy[:, 0], street, block))
    fresh = np.diff(block[order], prepend=-1) != 0
    fresh |= np.diff(street[order], prepend=UNKNOWN_STREET - 1) != 0
    leader = order[fresh][np.cumsum(fresh) - 1]
    out = np.zeros(len(street), dtype=np.uint64)
    out[order] = splitmix64(_bits(xy[leader, 0])) ^ _bits(xy[leader, 1])
    out[street == UNKNOWN_STREET] = 0
    return out


def _bits(values: npt.NDArray[Any]) -> UintArray:
    """(n,) values as 64 bits; all NaN are one, and so are both zeros."""
    if values.dtype == np.uint64:
        return values
    numbers = np.ascontiguousarray(values, dtype=np.float64) + 0.0
    return np.where(np.isnan(numbers), np.nan, numbers).view(np.uint64)


def _joined(contours: UintArray, columns: Mapping[str, npt.NDArray[Any]]) -> npt.NDArray[np.str_]:
    texts = [[f"{number:016x}" for number in contours.tolist()]]
    texts += [[f"{name}={_text(v)}" for v in columns[name].tolist()] for name in sorted(columns)]
    keys = [
        hashlib.blake2b("\n".join(row).encode(), digest_size=16).hexdigest()
        for row in zip(*texts, strict=True)
    ]
    return np.array(keys, dtype="U32")


def _text(value: Any) -> str:
    """Write a value so that equal ones have the same text, and what is missing has one."""
    if isinstance(value, bool | np.bool_):
        return str(bool(value))
    if value is None or (isinstance(value, numbers.Real) and math.isnan(value)):
        return ""
    return repr(float(value) + 0.0 if isinstance(value, numbers.Real) else str(value))
