"""Where streets may run: the graph that cuts must keep in one piece.

Streets run along cuts and along rims that are street. Where a rim is no street, a cut from rim
to rim would start a graph of its own, and no street could lead from it to the rest. So every cut
begins or ends on the graph of its part, once there is one.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from urban_processing.layout import EdgeKind, Layout, Steering
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import BoolArray, IntArray

BARE = -1
"""Label of edges that no street may run along."""


def usable_edges(layout: Layout) -> BoolArray:
    """(E,) edges that are street or may become street."""
    free = (layout.edge_kind == EdgeKind.INTERIOR) & ~layout.steered(Steering.NO_STREET)
    return np.asarray(free | layout.edge_street)


@lru_cache(maxsize=2)
def edge_networks(layout: Layout) -> IntArray:
    """(E,) connected piece of the graph of usable edges; `BARE` for the others."""
    mesh = layout.mesh
    on = usable_edges(layout)
    label = components(mesh.n_vertices, mesh.origin.reshape(-1, 2)[on])
    found = np.where(on, label[mesh.origin[0::2]], BARE)
    found.flags.writeable = False
    return found
