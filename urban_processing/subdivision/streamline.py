"""Streamline cuts (Chen 2024, section 4.1; Yang 2013, section 5) for a level in one batch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from urban_processing.fields.cross import sample_field
from urban_processing.fields.rings import ComplexArray, RingBatch
from urban_processing.mesh.corners import simplified_vertices
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.subdivision.chords import chord_cuts
from urban_processing.subdivision.cuts import (
    Cuts,
    halving_cuts,
    join_cuts,
    place_seeds,
    streamline_cuts,
)
from urban_processing.subdivision.parcels import Boundary, ParcelRings, boundaries
from urban_processing.subdivision.score import ALTERNATIVES, ScoredCuts, rank_cuts, score_cuts

FIELD_TOLERANCE = 0.004
"""The field sees rings simplified by this share of √area: collinear vertices cost time."""

GRID_SIZES = (18, 26, 48)
"""Grid of the field for rings of at most 8, at most 16, and of more vertices."""

HALVED_BELOW = 3.2
"""Parcels below this many smallest areas also get straight cuts that halve them exactly."""

HALVED_QUOTA = 5
"""So do parcels that are to become this many or fewer; the shares then follow the number."""

ALIGNED_SEEDS = 5
"""Seeds of a parcel that the aligned ones replace."""


@dataclass(frozen=True)
class Cut:
    """A cut of one parcel.

    Parameters
    ----------
    edge_a, along_a, edge_b, along_b
        Ends: place in the parcel's ring of half-edges, and place (0 to 1) on that half-edge.
    path
        (n, 2) map positions from near a to near b: snapping has moved the ends alone.
    quality
        Score, the larger the better.
    terms
        What each of `score.TERMS` adds to it.
    """

    edge_a: int
    along_a: float
    edge_b: int
    along_b: float
    path: FloatArray
    quality: float
    terms: tuple[float, ...] = ()


def propose_cuts(
    parcels: ParcelRings,
    *,
    min_area: float,
    params: CogenerateParams,
    quota: IntArray | None = None,
    thorough: bool = False,
    alternatives: int = ALTERNATIVES,
) -> list[list[Cut]]:
    """Ranked cuts of each parcel, best first; an empty list where no cut is legal.

    Parameters
    ----------
    min_area
        Smallest area in m² that either half may have.
    quota
        (P,) number of parcels that each is to become in the end, where that is given.
    thorough
        More seeds, a finer field and no snapping, for parcels whose first cuts failed.
    alternatives
        Most cuts of one parcel.
    """
    out: list[list[Cut]] = [[] for _ in range(len(parcels.face))]
    field_vertices = simplified_vertices(parcels.xy, parcels.offsets, FIELD_TOLERANCE)
    quotas = np.zeros(len(parcels.face), dtype=np.int64) if quota is None else quota
    sizes = _grid_sizes(parcels, field_vertices, thorough=thorough)
    groups = [
        (rows, int(size))
        for size in np.unique(sizes)
        for rows in parcels.chunks(16 * 64, np.flatnonzero(sizes == size))
    ]
    for rows, size in groups:
        boundary = boundaries(parcels, rows)
        cuts = _candidates(
            parcels,
            boundary,
            rows,
            field_vertices,
            size,
            _halved_shares(boundary, quotas[rows], min_area),
            params,
            thorough=thorough,
        )
        scored = score_cuts(
            boundary,
            cuts,
            min_share=min_area / boundary.rings.scale**2,
            quota=quotas[rows],
            lineage=parcels.lineage[rows],
            params=params,
            snap=0.0 if thorough else params.rules.snap,
        )
        chosen, rank = rank_cuts(boundary, scored, alternatives)
        order = np.lexsort((rank, cuts.parcel[chosen]))
        for row, cut in as_cuts(boundary, scored, chosen[order]):
            out[rows[row]].append(cut)
    return out


def _grid_sizes(parcels: ParcelRings, kept: IntArray, *, thorough: bool) -> IntArray:
    """(P,) grid of the field: a parcel's own, so that its cut does not depend on the others."""
    count = np.diff(np.searchsorted(kept, parcels.offsets))
    by_shape = np.select([count <= 8, count <= 16], GRID_SIZES[:2], GRID_SIZES[2])
    return np.where(thorough, GRID_SIZES[2], by_shape)


def _candidates(
    parcels: ParcelRings,
    boundary: Boundary,
    rows: IntArray,
    field_vertices: IntArray,
    size: int,
    halved: FloatArray,
    params: CogenerateParams,
    *,
    thorough: bool,
) -> Cuts:
    """Streamlines, straight halvings where the parcel is small, and chords if thorough."""
    rings, field_t = _field_rings(parcels, boundary, rows, field_vertices)
    field = sample_field(rings, size)
    wanted = params.candidates // 2 * (3 if thorough else 1)
    aligned = params.rules.aligned_seeds or thorough
    seeds = place_seeds(
        boundary,
        field,
        parcels.lineage[rows],
        seed=params.seed,
        wanted=max(wanted - (ALIGNED_SEEDS if aligned else 0), 3),
        aligned=aligned,
    )
    sets = [streamline_cuts(boundary, rings, field, field_t, seeds)]
    if thorough:
        sets.append(chord_cuts(boundary, np.arange(len(rows))))
    small = np.flatnonzero(halved > 0)
    if len(small):
        sets.append(halving_cuts(boundary, field, small, halved[small]))
        uneven = small[halved[small] != 0.5]
        if len(uneven):
            sets.append(halving_cuts(boundary, field, uneven, 1.0 - halved[uneven]))
    return join_cuts(sets)


def _halved_shares(boundary: Boundary, quota: IntArray, min_area: float) -> FloatArray:
    """Share of the area that straight cuts are to leave on one side; 0 for no such cuts."""
    small = boundary.rings.scale**2 < HALVED_BELOW * min_area
    by_quota = np.where(quota <= HALVED_QUOTA, (quota // 2) / np.maximum(quota, 1), 0.0)
    return np.asarray(np.where(quota > 0, by_quota, np.where(small, 0.5, 0.0)))


def _field_rings(
    parcels: ParcelRings, boundary: Boundary, rows: IntArray, kept: IntArray
) -> tuple[RingBatch, FloatArray]:
    """Simplified rings of a batch, and the length along the full ring at their vertices."""
    cuts = np.searchsorted(kept, parcels.offsets)
    start, count = cuts[rows], np.diff(cuts)[rows]
    width = int(count.max())
    column = np.minimum(np.arange(width)[None], count[:, None] - 1)
    place = kept[start[:, None] + column] - parcels.offsets[rows][:, None]
    index = np.arange(len(rows))[:, None]
    full = boundary.rings
    z: ComplexArray = full.z[index, place]
    t = boundary.t[index, place]
    close = t[:, :1] + boundary.perimeter[:, None]
    rings = RingBatch(z, count, full.centre, full.scale, full.axis)
    return rings, np.concatenate([t, close], axis=1)


def as_cuts(boundary: Boundary, scored: ScoredCuts, chosen: IntArray) -> Iterator[tuple[int, Cut]]:
    """Chosen cuts in terms of the mesh: half-edges of the ring and map positions."""
    parcel = scored.cuts.parcel[chosen]
    last = boundary.rings.count[parcel] - 1
    edge_a, along_a = boundary.locate(parcel, scored.t_a[chosen])
    edge_b, along_b = boundary.locate(parcel, scored.t_b[chosen])
    paths = scored.cuts.paths(chosen)
    if not paths:
        return
    count = np.array([len(path) for path in paths])
    xy = boundary.rings.to_map(np.repeat(parcel, count), np.concatenate(paths))
    for row, e_a, s_a, e_b, s_b, path, quality, terms in zip(
        parcel.tolist(),
        np.minimum(edge_a, last).tolist(),
        along_a.tolist(),
        np.minimum(edge_b, last).tolist(),
        along_b.tolist(),
        np.split(xy, np.cumsum(count)[:-1]),
        scored.quality[chosen].tolist(),
        map(tuple, scored.terms[chosen].tolist()),
        strict=True,
    ):
        yield row, Cut(e_a, s_a, e_b, s_b, path, quality, terms)
