"""Blocks from streets."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.centrelines import clean_centrelines
from urban_processing.blocks.edges import streets_along
from urban_processing.blocks.model import UNKNOWN_STREET, Blocks, rings_of
from urban_processing.blocks.net import find_faces, net_blocks, street_sides
from urban_processing.blocks.numbering import street_numbers
from urban_processing.blocks.streets import StrArray, StreetLines, chosen_streets
from urban_processing.errors import BoundaryError
from urban_processing.mesh.planar import IntArray
from urban_processing.params.blocks import BlocksParams


@dataclass(frozen=True, eq=False)
class FoundBlocks:
    """Blocks and the right-of-way between them.

    Parameters
    ----------
    blocks
        B blocks, with the streets along their K edges; its issues say what was mended.
    part
        (B,) connected piece of the land that each is in, the largest first.
    edge_class
        (K,) class of the street along each edge; empty where there is none.
    right_of_way
        (W,) polygons that share their vertices with the blocks; with these they are the land.
    right_of_way_class, right_of_way_part
        (W,) class and piece of the land of each.
    """

    blocks: Blocks
    part: IntArray
    edge_class: StrArray
    right_of_way: npt.NDArray[np.object_]
    right_of_way_class: StrArray
    right_of_way_part: IntArray


def find_blocks(
    streets: StreetLines,
    params: BlocksParams,
    *,
    land: Sequence[shapely.Polygon] | None = None,
) -> FoundBlocks:
    """Find the blocks between streets, net of the rights-of-way.

    Centrelines are cut at their crossings and mended (`clean_centrelines`); each face that they
    enclose gives up half the width of every street around it, and the whole width of
    those that end within it. What is left is a block, or several; what is too small is none.

    Parameters
    ----------
    streets
        Centrelines in local metres.
    params
        Widths, tolerances and radii.
    land
        Polygons that meet at points at most, the largest first. Blocks end at their rims, which are
        streets only where one runs along them. By default blocks are what streets enclose.

    Raises
    ------
    BoundaryError
        If the streets enclose nothing, or leave no block.

    Examples
    --------
    >>> import shapely
    >>> from urban_processing.blocks.streets import street_lines
    >>> ring = shapely.LineString([(0, 0), (100, 0), (100, 80), (0, 80), (0, 0)])
    >>> found = find_blocks(street_lines([ring], width=10), BlocksParams())
    >>> shapely.area(found.blocks.polygons).tolist()
    [6300.0]
    """
    usable, issues = chosen_streets(streets, params)
    snap = params.snap_tolerance
    if land is not None:
        usable = _near(usable, land, snap)
    work, mended = clean_centrelines(usable, snap=snap, dead_ends=params.dead_ends, land=land)
    work, faces = find_faces(work, land)
    if not len(faces.polygons):
        raise BoundaryError(
            "The streets enclose nothing: blocks need streets that meet, or a land boundary "
            f"beside them. Ends that miss each other by more than {snap:g} m are not joined: "
            "see snap-tolerance."
        )
    width = usable.width[work.line]
    classes, rank = _ranks(usable.street_class[work.line], params)
    sides = street_sides(work, width, faces, snap=snap)
    net, lost = net_blocks(work, faces, sides, params, width=width, rank=rank)
    if not len(net.polygons):
        raise BoundaryError(
            "No block is left between the streets: their widths take all the land. Check the "
            "widths, and that the CRS counts in metres."
        )
    rings = rings_of(net.polygons)
    along = streets_along(
        rings,
        net.face,
        work,
        faces,
        sides,
        width=width,
        margin=max(params.corner_radius, params.turning_radius, params.min_width),
        snap=snap,
    )
    number = street_numbers(work, usable.name, usable.number)
    at = along.segment
    blocks = Blocks(
        polygons=net.polygons,
        frame=streets.frame,
        block_id=np.arange(1, len(net.polygons) + 1),
        edge_access=along.access,
        edge_width=np.where(along.access, np.append(width, np.nan)[at], np.nan),
        edge_street=np.where(along.access, np.append(number, UNKNOWN_STREET)[at], UNKNOWN_STREET),
        issues=(*streets.issues, *issues, *mended, *lost),
        input_sha256=streets.input_sha256,
    )
    of_segment = np.append(usable.street_class[work.line], "")
    return FoundBlocks(
        blocks=blocks,
        part=faces.part[net.face],
        edge_class=np.where(along.access, of_segment[at], ""),
        right_of_way=net.right_of_way,
        right_of_way_class=classes[net.rank],
        right_of_way_part=net.part,
    )


def _near(streets: StreetLines, land: Sequence[shapely.Polygon], snap: float) -> StreetLines:
    """Lines whose right-of-way comes within a tolerance of the land."""
    ground = shapely.union_all(list(land))
    shapely.prepare(ground)
    return streets.take(shapely.dwithin(ground, streets.lines, streets.width / 2 + snap))


def _ranks(street_class: StrArray, params: BlocksParams) -> tuple[StrArray, IntArray]:
    """The classes from the highest to the lowest, and (S,) the rank of each segment's."""
    present = np.unique(street_class)
    known = {name: i for i, name in enumerate(params.width_m)}
    order = sorted(present.tolist(), key=lambda name: (known.get(name, len(known)), name))
    classes = np.array(order, dtype=np.str_)
    rank = {name: i for i, name in enumerate(order)}
    return classes, np.array([rank[name] for name in street_class.tolist()], dtype=np.int64)
