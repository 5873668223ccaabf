"""First cuts from entries, and between separate streets, so that all can become one network."""

from __future__ import annotations

import dataclasses

import numpy as np
import shapely

from urban_processing.fields.rings import ComplexArray
from urban_processing.layout import Layout
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.subdivision.attach import BARE, edge_networks
from urban_processing.subdivision.cuts import CLEARANCE, Cuts
from urban_processing.subdivision.insert import insert_cuts
from urban_processing.subdivision.parcels import Boundary, boundaries, parcel_rings
from urban_processing.subdivision.score import rank_cuts, score_cuts
from urban_processing.subdivision.streamline import as_cuts

POINTS = 64
"""Number of points, spread over a parcel's boundary, that first cuts may lead to."""

INSET = 1e-3
"""Share of a cut, at both ends, that is not asked to lie within the parcel."""

SAMPLES = 7
"""Number of points of a cut at which its distance from the boundary is measured."""


def tie_together(
    layout: Layout, *, min_area: float, params: CogenerateParams
) -> tuple[Layout, IntArray]:
    """Cut parcels until every entry is on the graph and each parcel's boundary on one graph.

    Straight cuts, chosen by the score of all cuts: from an entry to where streets may run, or
    anywhere while there is no such place; between separate streets on one boundary. Where no
    straight line leads from one to the other, a cut from one of them to elsewhere comes first.

    Returns
    -------
    layout, parent
        The cut layout and (F,) the face before of each face.
    """
    parent = np.arange(layout.mesh.n_faces)
    given_up: set[int] = set()
    while True:
        found = _next_face(layout, min_area, given_up)
        if found is None:
            return layout, parent
        face, sources, targets = found
        cut = _cut(layout, face, sources, targets, min_area=min_area, params=params)
        if cut is None:
            anywhere = np.ones_like(targets)
            cut = _cut(layout, face, sources, anywhere, min_area=min_area, params=params)
        if cut is None:
            given_up.add(int(layout.face_lineage[face]))
            continue
        layout, source = cut
        parent = parent[source]


def _next_face(
    layout: Layout, min_area: float, given_up: set[int]
) -> tuple[int, BoolArray, BoolArray] | None:
    """A parcel to be cut, the vertices of its ring to cut from, and the edges to cut to."""
    mesh = layout.mesh
    label = edge_networks(layout)
    if (label != BARE).all():
        return None
    large = (mesh.face_area >= 2 * min_area) & (mesh.face_n_loops == 1) & ~layout.face_locked
    for face in np.flatnonzero(large).tolist():
        if int(layout.face_lineage[face]) in given_up:
            continue
        ring = mesh.face_half_edges(face)
        on = label[ring >> 1]
        # the edge before a vertex counts as well
        here = np.maximum(on, np.roll(on, 1))
        loose = layout.vertex_entry[mesh.origin[ring]] & (here == BARE)
        names = np.unique(on[on != BARE])
        if loose.any():
            return face, loose, on != BARE if len(names) else np.ones(len(on), dtype=bool)
        if len(names) > 1:
            length = [mesh.edge_length[ring[on == name] >> 1].sum() for name in names.tolist()]
            least = names[int(np.argmin(length))]
            return face, here == least, (on != BARE) & (on != least)
    return None


def _cut(
    layout: Layout,
    face: int,
    sources: BoolArray,
    targets: BoolArray,
    *,
    min_area: float,
    params: CogenerateParams,
) -> tuple[Layout, IntArray] | None:
    """Make the best straight cut from some vertices to some edges; None if there is none."""
    parcels = parcel_rings(layout, np.array([face]))
    # which cuts are wanted is said here
    parcels = dataclasses.replace(parcels, network=np.zeros_like(parcels.network))
    boundary = boundaries(parcels, np.array([0]))
    chords = _chords(boundary, np.flatnonzero(sources), targets)
    if len(chords.parcel) == 0:
        return None
    scored = score_cuts(
        boundary,
        chords,
        min_share=np.array([min_area]) / boundary.rings.scale**2,
        quota=np.zeros(1, dtype=np.int64),
        lineage=parcels.lineage,
        params=params,
        snap=0.0,
    )
    chosen, rank = rank_cuts(boundary, scored)
    order = np.argsort(rank, kind="stable")
    ranked = [cut for _, cut in as_cuts(boundary, scored, chosen[order])]
    cut, done, parent = insert_cuts(
        layout, parcels, [ranked], min_area=min_area, tee_snap=0.0, attached=False
    )
    return (cut, parent) if done.all() else None


def _chords(boundary: Boundary, sources: IntArray, targets: BoolArray) -> Cuts:
    """Straight lines within one parcel, from vertices of its ring to points of its edges."""
    n = int(boundary.rings.count[0])
    z, t = boundary.rings.z[0, :n], boundary.t[0, : n + 1]
    polygon = shapely.Polygon(np.column_stack([z.real, z.imag]))
    along = (np.arange(POINTS) + 0.5) / POINTS
    length = np.where(targets, np.diff(t), 0.0)
    reach = np.append(0.0, np.cumsum(length))
    edge = np.clip(np.searchsorted(reach, along * reach[-1], side="right") - 1, 0, n - 1)
    to = np.concatenate([t[edge] + along * reach[-1] - reach[edge], t[:-1][targets]])
    t_a = np.repeat(t[sources], len(to))
    t_b = np.tile(to, len(sources))
    rows = np.zeros(len(t_a), dtype=np.int64)
    a, b = boundary.position(rows, t_a), boundary.position(rows, t_b)
    apart = np.abs(b - a) > INSET
    a, b, t_a, t_b = a[apart], b[apart], t_a[apart], t_b[apart]
    inner = np.stack([a + INSET * (b - a), b - INSET * (b - a)], axis=1)
    lines = shapely.linestrings(np.stack([inner.real, inner.imag], axis=-1))
    shapely.prepare(polygon)
    inside = shapely.contains_properly(polygon, lines)
    a, b, t_a, t_b = a[inside], b[inside], t_a[inside], t_b[inside]
    direction = (b - a) / np.abs(b - a)
    return Cuts(
        parcel=np.zeros(len(a), dtype=np.int64),
        t_a=t_a,
        t_b=t_b,
        leaving=direction,
        arriving=direction,
        bulge=np.zeros(len(a)),
        clearance=_clearance(polygon, a, b),
        paths=lambda chosen: [np.array([a[i], b[i]]) for i in chosen],
    )


def _clearance(polygon: shapely.Polygon, a: ComplexArray, b: ComplexArray) -> FloatArray:
    """Least distance of lines from the boundary, away from their ends."""
    length = np.abs(b - a)
    inset = np.minimum(CLEARANCE, 0.45 * length)[:, None]
    along = np.linspace(0, 1, SAMPLES)[None]
    w = a[:, None] + (inset + along * (length[:, None] - 2 * inset)) * ((b - a) / length)[:, None]
    distance = shapely.distance(polygon.exterior, shapely.points(w.real, w.imag))
    return np.asarray(distance.min(axis=1)) if len(a) else np.empty(0)
