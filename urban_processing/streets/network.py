"""The street network of a layout."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from urban_processing.layout import EdgeKind, Layout
from urban_processing.streets.classes import edge_classes, edge_widths, given_classes
from urban_processing.streets.decompose import decompose_streets
from urban_processing.streets.network_model import StreetNetwork


def street_network(layout: Layout) -> StreetNetwork:
    """Decompose the street edges of a layout (Chen 2024, section 3).

    Linear in the number of mesh edges, without a Python loop over them.
    """
    mesh = layout.mesh
    rim = np.asarray(layout.edge_kind == EdgeKind.RIM)
    part = layout.face_part[mesh.face.reshape(-1, 2).max(axis=1)]
    net = decompose_streets(
        mesh,
        street=layout.edge_street,
        rim=rim,
        part=part,
        entry=layout.vertex_entry,
        sort=layout.edge_fixed,
    )
    first = net.half_edges[net.offsets[:-1]] >> 1
    fixed = layout.edge_fixed[first]
    level = np.asarray(layout.edge_level[net.half_edges >> 1], dtype=np.int64)
    edge_level = np.minimum.reduceat(level, net.offsets[:-1]) if net.n_edges else level
    classes = edge_classes(
        net.start,
        net.end,
        net.node_kind,
        net.node_degree,
        net.edge_rim,
        edge_level,
        fixed >= 0,
    )
    classes = given_classes(classes, layout.fixed_streets, fixed)
    return replace(
        net,
        edge_fixed=fixed,
        edge_level=edge_level,
        edge_class=classes,
        edge_width=edge_widths(layout, classes, fixed),
    )
