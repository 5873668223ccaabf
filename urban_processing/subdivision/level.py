"""One level of parcel generation (Chen 2024, section 4.1): cut, insert, remove short edges."""

from __future__ import annotations

import numpy as np

from urban_processing.layout import Layout
from urban_processing.mesh.planar import BoolArray, IntArray
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.subdivision.insert import TEE_SNAP, insert_cuts
from urban_processing.subdivision.parcels import parcel_rings
from urban_processing.subdivision.short_edges import remove_short_edges
from urban_processing.subdivision.streamline import propose_cuts


def cut_level(
    layout: Layout,
    faces: IntArray,
    *,
    min_area: float,
    params: CogenerateParams,
    quota: IntArray | None = None,
) -> tuple[Layout, BoolArray, IntArray]:
    """Cut each of the given faces in two, all in one batch.

    Parcels whose cuts all fail are tried once more, with more seeds and without snapping.

    Parameters
    ----------
    faces
        Faces to cut.
    min_area
        Smallest area in m² of either half.
    quota
        (len(faces),) number of parcels that each is to become in the end, where given.

    Returns
    -------
    layout, cut, parent
        The layout after the level, (len(faces),) which of the faces were cut, and (F,) the
        face before of each face. A cut face keeps its index for one half; new faces follow.
    """
    tee_snap = TEE_SNAP if params.rules.snap > 0 else 0.0
    cut = np.zeros(len(faces), dtype=bool)
    parent = np.arange(layout.mesh.n_faces)
    for thorough in (False, True):
        left = np.flatnonzero(~cut)
        if len(left) == 0:
            break
        parcels = parcel_rings(layout, faces[left])
        ranked = propose_cuts(
            parcels,
            min_area=min_area,
            params=params,
            quota=None if quota is None else quota[left],
            thorough=thorough,
        )
        layout, done, source = insert_cuts(
            layout, parcels, ranked, min_area=min_area, tee_snap=0.0 if thorough else tee_snap
        )
        cut[left] = done
        parent = parent[source]
    return remove_short_edges(layout, min_area=min_area), cut, parent
