"""Faces between centrelines, and what the right-of-way leaves of each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.necks import neck_lines
from urban_processing.blocks.noding import Centrelines
from urban_processing.mesh.build import canonical_rings
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.mesh.polygons import by_place, united_by_owner
from urban_processing.params.blocks import BlocksParams
from urban_processing.rights_of_way.centrelines import BESIDE, turning_heads
from urban_processing.rights_of_way.partition import Cut, cut_out
from urban_processing.rights_of_way.surfaces import StreetSides, Surfaces, street_surfaces
from urban_processing.site import GRID, Issue

Geometries = npt.NDArray[np.object_]


@dataclass(frozen=True, eq=False)
class Faces:
    """F faces between the centrelines and the rim of the land.

    Parameters
    ----------
    polygons
        (F,) faces, to the centreline.
    part
        (F,) piece of land that each is in, the largest first.
    rims
        Outlines of the land; none where only streets bound the faces.
    edges
        Lines of all their boundaries.
    """

    polygons: Geometries
    part: IntArray
    rims: Geometries
    edges: Geometries


@dataclass(frozen=True, eq=False)
class Sides:
    """Streets as the faces see them: T pairs of a face and a segment."""

    face: IntArray
    segment: IntArray


@dataclass(frozen=True, eq=False)
class NetBlocks:
    """What is left of the faces, and what the streets take.

    Parameters
    ----------
    polygons
        (B,) blocks, by part and place, with canonical rings.
    face
        (B,) face of each.
    right_of_way
        (W,) polygons of the right-of-way, one for each connected piece of one class.
    rank, part
        (W,) rank of the class and piece of land of each.
    """

    polygons: Geometries
    face: IntArray
    right_of_way: Geometries
    rank: IntArray
    part: IntArray


def find_faces(
    work: Centrelines, land: Sequence[shapely.Polygon] | None
) -> tuple[Centrelines, Faces]:
    """Find the faces between streets, within the land if one is given.

    Without land, all that streets enclose is found; pieces of it that share no street are parts.

    Returns
    -------
    work
        The segments, cut where they meet the rims too.
    faces
        By place.
    """
    lines = np.asarray(shapely.linestrings(work.segments), dtype=object)
    rims = shapely.boundary(np.array([] if land is None else list(land), dtype=object))
    edges = lines
    if len(rims):
        edges = shapely.get_parts(shapely.union_all(np.append(lines, rims), grid_size=GRID))
        work = work.cut_at(edges)
    cells = shapely.get_parts(shapely.polygonize(edges))
    cells = canonical_rings(cells[by_place(cells)])
    if land is None:
        return work, Faces(cells, _connected(cells, lines), rims, edges)
    tree = shapely.STRtree(np.array(list(land), dtype=object))
    cell, part = tree.query(shapely.point_on_surface(cells), predicate="intersects")
    return work, Faces(cells[cell], part, rims, edges)


def _connected(cells: Geometries, lines: Geometries) -> IntArray:
    """(F,) connected piece of each face, the largest first."""
    if not len(cells):
        return np.empty(0, dtype=np.int64)
    line, cell = shapely.STRtree(cells).query(
        shapely.line_interpolate_point(lines, 0.5, normalized=True),
        predicate="dwithin",
        distance=BESIDE,
    )
    order = np.lexsort((cell, line))
    line, cell = line[order], cell[order]
    both = line[1:] == line[:-1]
    group = components(len(cells), np.column_stack([cell[:-1], cell[1:]])[both])
    size = np.bincount(group, weights=shapely.area(cells))
    rank = np.empty(len(size), dtype=np.int64)
    rank[np.lexsort((np.arange(len(size)), -np.round(size, 3)))] = np.arange(len(size))
    return rank[group]


def street_sides(work: Centrelines, width: FloatArray, faces: Faces, *, snap: float) -> Sides:
    """Pairs of a face and a segment on its boundary or within it.

    A street beside the land, whose right-of-way comes within `snap` metres of it, belongs to the
    faces on the rim that it reaches.
    """
    middle = shapely.points(work.segments.mean(axis=1))
    segment, face = shapely.STRtree(faces.polygons).query(
        middle, predicate="dwithin", distance=BESIDE
    )
    if len(faces.rims):
        beside = np.setdiff1d(np.arange(len(middle)), segment)
        lines = shapely.linestrings(work.segments[beside])
        near, reached = shapely.STRtree(faces.polygons).query(
            lines, predicate="dwithin", distance=width[beside] / 2 + snap
        )
        segment = np.append(segment, beside[near])
        face = np.append(face, reached)
    order = np.lexsort((segment, face))
    return Sides(face[order], segment[order])


def net_blocks(
    work: Centrelines,
    faces: Faces,
    sides: Sides,
    params: BlocksParams,
    *,
    width: FloatArray,
    rank: IntArray,
) -> tuple[NetBlocks, list[Issue]]:
    """Take the right-of-way out of the faces; each piece left that is large enough is a block.

    Parameters
    ----------
    work, faces, sides
        Streets and what they enclose.
    params
        Radii, and how large a block is at least.
    width, rank
        (S,) width and rank of the class of each segment.

    Returns
    -------
    blocks
        Blocks and right-of-way, which tile the faces.
    issues
        What became of faces that are not one block.
    """
    segment = sides.segment
    surfaces = street_surfaces(
        faces.polygons,
        StreetSides(sides.face, work.segments[segment], width[segment], rank[segment]),
        turning_heads(faces.polygons, faces.rims, work.segments, rank, params.turning_radius),
        corner_radius=params.corner_radius,
    )
    necks = neck_lines(_roughly_net(faces.polygons, surfaces), params.min_width)
    surfaces = replace(surfaces, outlines=np.append(surfaces.outlines, necks))
    each = np.arange(len(faces.polygons))
    cut = cut_out(faces.polygons, faces.edges, surfaces, block=each)
    loose = np.zeros(len(cut.faces), dtype=bool)
    left = np.flatnonzero(cut.net)
    small = shapely.area(cut.faces[left]) < max(params.min_area, GRID)
    narrow = shapely.is_empty(shapely.buffer(cut.faces[left], -params.min_width / 2))
    loose[left] = small | narrow
    issues = _issues(cut, faces, loose, params)
    cut = cut.joined(loose)
    blocks, face = canonical_rings(cut.faces[cut.net]), cut.owner[cut.net]
    order = by_place(blocks)
    order = order[np.argsort(faces.part[face[order]], kind="stable")]
    return NetBlocks(blocks[order], face[order], *cut.rights_of_way(faces.part)), issues


def _roughly_net(faces: Geometries, surfaces: Surfaces) -> Geometries:
    """Polygons that street surfaces leave of faces, whose vertices may lie a hair beside theirs."""
    taken = united_by_owner(surfaces.regions, surfaces.block, len(faces))
    parts = shapely.get_parts(shapely.difference(faces, taken))
    return np.asarray(parts[shapely.get_dimensions(parts) == 2])


def _issues(
    cut: Cut, faces: Faces, loose: npt.NDArray[np.bool_], params: BlocksParams
) -> list[Issue]:
    """Say what vanished, what was too small, and what fell apart."""
    issues = []
    n = len(faces.polygons)
    pieces = np.bincount(cut.owner[cut.net], minlength=n)
    blocks = np.bincount(cut.owner[cut.net & ~loose], minlength=n)
    gone = int((pieces == 0).sum())
    if gone:
        message = f"{gone} face(s) between streets are right-of-way altogether."
        places = shapely.points(
            shapely.get_coordinates(shapely.point_on_surface(faces.polygons[pieces == 0]))
        )
        issues.append(
            Issue(
                "blocks_swallowed",
                message,
                value=float(gone),
                geometry=shapely.MultiPoint(list(places)),
            )
        )
    n_loose = int(loose.sum())
    if n_loose:
        message = (
            f"{n_loose} piece(s) of land between streets are below {params.min_area:g} m² or "
            f"narrower than {params.min_width:g} m and count as right-of-way "
            f"({shapely.area(cut.faces[loose]).sum():.0f} m²)."
        )
        issues.append(
            Issue(
                "blocks_too_small",
                message,
                value=float(n_loose),
                limit=params.min_area,
                geometry=shapely.MultiPolygon(list(cut.faces[loose])),
            )
        )
    apart = int((blocks > 1).sum())
    if apart:
        message = f"{apart} face(s) between streets fall into several blocks, cut by right-of-way."
        issues.append(Issue("blocks_fall_apart", message, value=float(apart)))
    return issues
