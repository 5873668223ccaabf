"""What becomes of the halves of a parcel that was cut by hand."""

from __future__ import annotations

import dataclasses

import numpy as np

from urban_processing.layout import Layout, Stage, Steering
from urban_processing.mesh.planar import IntArray
from urban_processing.pipelines.levels import State


def with_kept_cuts(layout: Layout, parent: IntArray) -> Layout:
    """The layout with the boundaries between faces of one parent marked as wanted.

    Parameters
    ----------
    parent
        (F,) the face before of each face.
    """
    sides = layout.mesh.face.reshape(-1, 2)
    inner = (sides >= 0).all(axis=1) & (sides[:, 0] != sides[:, 1])
    inner[inner] = parent[sides[inner, 0]] == parent[sides[inner, 1]]
    steering = layout.edge_steering.copy()
    steering[inner] |= np.uint8(Steering.KEPT)
    return layout.replace(edge_steering=steering)


def ahead(before: State, after: State) -> State:
    """The state with halves whose parcel has its cut of the next level, or of the one it missed.

    In the first case the next level leaves them alone, in the second it goes on with them.
    """
    new = ~np.isin(after.layout.face_lineage, before.layout.face_lineage)
    inherited = after.layout.face_stage
    stage = inherited.copy()
    stage[new & (inherited == Stage.OPEN)] = Stage.AHEAD
    stage[new & (inherited == Stage.BEHIND)] = Stage.OPEN
    return dataclasses.replace(after, layout=after.layout.replace(face_stage=stage))
