"""Faces divided further: as ground, and back among the other pieces."""

from __future__ import annotations

import numpy as np

from urban_processing.blocks.model import UNKNOWN_STREET, BlockRings
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.parcelling.ground import Ground, Pieces
from urban_processing.parcelling.noding import Segments, node_rings
from urban_processing.parcelling.rings import Rings, starts


def ground_of_faces(
    pieces: Pieces,
    faces: IntArray,
    *,
    width: FloatArray | None = None,
    street: IntArray | None = None,
) -> Ground:
    """Return faces as ground to be divided further.

    Parameters
    ----------
    pieces, faces
        The faces, by number.
    width, street
        Width and number of the street along each edge of the pieces, as long as
        `Pieces.vertex`; by default none is known.
    """
    at = _rings_of_pieces(pieces).take(faces)
    n = len(pieces.vertex)
    width = np.full(n, np.nan) if width is None else width
    street = np.full(n, UNKNOWN_STREET) if street is None else street
    node = at.segment
    return Ground(
        rings=BlockRings(pieces.xy[at.vertex], at.offsets, at.face),
        access=pieces.access[node],
        width=width[node],
        street=street[node],
        lineage=pieces.lineage[faces],
    )


def replace_faces(pieces: Pieces, faces: IntArray, sub: Pieces) -> Pieces:
    """Put what faces were divided into in their places.

    Neighbours, divided or not, get the vertices that were added on their outlines; such as lie at
    the same place but for rounding become one.

    Parameters
    ----------
    pieces
        Noded pieces.
    faces
        Faces of them that were divided, each once.
    sub
        Pieces of the ground of these faces (`ground_of_faces`), in the same order.
    """
    rings = _rings_of_pieces(pieces)
    n_old, n_ground = len(pieces.xy), int(np.diff(rings.face_nodes)[faces].sum())
    at = rings.take(faces)
    xy = np.concatenate([pieces.xy, sub.xy[n_ground:]])
    number = np.append(at.vertex, n_old + np.arange(len(sub.xy) - n_ground))
    outline = _outline_edges(sub, at)
    kept = np.setdiff1d(np.arange(pieces.n_faces), faces)
    left = rings.take(kept)
    head = sub.vertex[_rings_of_pieces(sub).following]
    pair, segment = _pairs(
        np.concatenate([rings.vertex, number[sub.vertex]]),
        np.concatenate([rings.vertex[rings.following], number[head]]),
    )
    n_nodes = len(rings.vertex)
    along = segment[n_nodes:].copy()
    on_outline = outline >= 0
    along[on_outline] = segment[at.segment[outline[on_outline]]]
    together = Rings(
        vertex=np.concatenate([left.vertex, number[sub.vertex]]),
        segment=np.concatenate([segment[left.segment], along]),
        offsets=starts(np.concatenate([left.size, np.diff(sub.offsets)])),
        face=np.concatenate([left.face, len(kept) + sub.face]),
    )
    origin = np.concatenate([kept, faces[sub.block]])
    order = np.argsort(origin, kind="stable")
    access = np.concatenate([pieces.access[left.segment], sub.access])
    edges = Rings(together.vertex, np.arange(len(access)), together.offsets, together.face)
    edge = edges.take(order).segment
    noded, source = node_rings(together.take(order), xy, _segments(pair, xy), n_fixed=n_old)
    return Pieces(
        xy=xy,
        vertex=noded.vertex,
        offsets=noded.offsets,
        face=noded.face,
        access=access[edge[source]],
        block=pieces.block[origin[order]],
        lineage=np.concatenate([pieces.lineage[kept], sub.lineage])[order],
        level=np.append(pieces.level[kept], pieces.level[faces[sub.block]] + sub.level)[order],
        patio=np.append(pieces.patio[kept], sub.patio)[order],
    )


def _rings_of_pieces(pieces: Pieces) -> Rings:
    """Rings whose segments are the numbers of the edges."""
    return Rings(pieces.vertex, np.arange(len(pieces.vertex)), pieces.offsets, pieces.face)


def _outline_edges(sub: Pieces, ground: Rings) -> IntArray:
    """(N,) edge of the ground that each edge of its pieces is a part of; -1 where of none."""
    head = sub.vertex[_rings_of_pieces(sub).following]
    n = len(sub.xy)
    forth, back = sub.vertex * n + head, head * n + sub.vertex
    outer = np.flatnonzero(~np.isin(forth, back))
    place = _places(ground)
    at = np.full(n, -1)
    at[sub.vertex[outer]] = outer
    out = np.full(len(sub.vertex), -1)
    edge = np.arange(len(ground.vertex))
    along = at[place]
    touch = np.bincount(sub.vertex[outer], minlength=n)[place] > 1
    for k in np.flatnonzero(touch).tolist():
        ahead = outer[sub.vertex[outer] == place[k]]
        way = _unit(sub.xy[ground.following[k]] - sub.xy[k])
        along[k] = ahead[np.argmax(_unit(sub.xy[head[ahead]] - sub.xy[k]) @ way)]
    while len(edge):
        out[along] = edge
        here = head[along]
        going = here != place[ground.following[edge]]
        # a vertex added lies on one edge alone
        edge, along = edge[going], at[here[going]]
    return out


def _places(ground: Rings) -> IntArray:
    """(N,) first of the nodes of a face that are the same vertex."""
    key = ground.edge_face * (ground.vertex.max() + 1) + ground.vertex
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    return np.asarray(first[inverse.ravel()])


def _unit(vectors: FloatArray) -> FloatArray:
    return np.asarray(vectors / np.hypot(vectors[..., 0], vectors[..., 1])[..., None])


def _pairs(tail: IntArray, head: IntArray) -> tuple[IntArray, IntArray]:
    """(S, 2) pairs of vertices that edges join, either way, and (N,) the pair of each edge."""
    n = int(max(tail.max(), head.max())) + 1
    key, pair = np.unique(np.minimum(tail, head) * n + np.maximum(tail, head), return_inverse=True)
    return np.column_stack([key // n, key % n]), pair.ravel()


def _segments(pair: IntArray, xy: FloatArray) -> Segments:
    origin = xy[pair[:, 0]]
    edge = xy[pair[:, 1]] - origin
    length = np.sqrt((edge**2).sum(axis=1))
    return Segments(origin, edge / np.where(length > 0, length, 1.0)[:, None], length)
