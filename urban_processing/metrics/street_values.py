"""Metrics of streets: Chen 2024's, Yang 2013's and those of the network's shape."""

from __future__ import annotations

import math

import numpy as np

from urban_processing.fabric.model import Fabric
from urban_processing.mesh.components import components
from urban_processing.mesh.planar import FloatArray
from urban_processing.metrics.averages import highest, in_part, mean
from urban_processing.metrics.land_values import land_area
from urban_processing.metrics.registry import INTERIOR
from urban_processing.metrics.segments import Segments
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network_model import StreetNetwork

BINS = 36
"""Bins of the compass for the entropy of bearings (Boeing 2019)."""

GRID_ENTROPY = math.log(4.0)
"""Entropy in nats of the bearings of a grid: four directions."""


def street_values(fabric: Fabric, segments: Segments, part: int | None) -> dict[str, float]:
    """Metrics of the streets without the rim, of the whole or of one part."""
    return {
        **_chen(fabric, part),
        **_shares(fabric, part),
        **_shape(segments, part, land_area(fabric, part)),
    }


def _chen(fabric: Fabric, part: int | None) -> dict[str, float]:
    """Figures of Chen 2024, Table 1, and the connected pieces."""
    net = fabric.network
    street = ~net.street_rim & in_part(net.street_part, part)
    node = net.node_interior & in_part(net.node_part, part)
    junction = (net.node_kind == NodeKind.JUNCTION) | (
        (net.node_kind == NodeKind.ENTRY) & (net.node_degree > 2)
    )
    here = node[net.pair_node]
    deviation = net.pair_deviation[here & (net.pair_rim < 2)]
    n_streets = int(street.sum())
    length = float(net.street_length[street].sum())
    return {
        "streets": n_streets,
        "junctions": int((node & junction).sum()),
        "street_ends": int((node & (net.node_kind == NodeKind.END)).sum()),
        "street_length_m": length,
        "street_length_mean_m": length / n_streets if n_streets else math.nan,
        "junction_deviation_deg": mean(deviation),
        "junction_deviation_deg" + INTERIOR: mean(net.pair_deviation[here & (net.pair_rim == 0)]),
        "junction_deviation_max_deg": highest(deviation),
        "network_pieces": _pieces(net, part),
    }


def _pieces(net: StreetNetwork, part: int | None) -> int:
    """Connected pieces of the network, the rim included."""
    piece = components(net.n_nodes, np.column_stack([net.start, net.end]))
    return len(np.unique(piece[in_part(net.node_part, part)]))


def _shares(fabric: Fabric, part: int | None) -> dict[str, float]:
    """Streets set against parcels."""
    net, parcels, values = fabric.network, fabric.parcels, {}
    street = ~net.street_rim & in_part(net.street_part, part)
    n_streets, length = int(street.sum()), float(net.street_length[street].sum())
    inside = None if parcels is None else in_part(parcels.part, part)
    if parcels is not None and inside is not None and inside.any():
        side = math.sqrt(mean(parcels.rings.area[inside]))
        n_parcels = int(inside.sum())
        values["parcels_per_street"] = n_parcels / n_streets if n_streets else math.nan
        if parcels.frontage_known:
            values["street_length_relative"] = length / n_parcels / side
    if fabric.inner_edges is not None:
        chosen = slice(None) if part is None else part
        inner = float(fabric.inner_edges.length[chosen].sum())
        on_street = float(fabric.inner_edges.on_street[chosen].sum())
        values["street_share_pct"] = 100.0 * on_street / inner if inner else math.nan
    return values


def _shape(segments: Segments, part: int | None, land: float) -> dict[str, float]:
    """Figures of the segments, which are those of street patterns."""
    here = in_part(segments.part, part)
    length, straight = segments.length[here], segments.straight[here]
    degree = segments.degree[segments.node_inside & in_part(segments.node_part, part)]
    arms = degree[degree >= 3]
    n, ends = len(arms), int((degree == 1).sum())
    crossing = {
        "intersections_3_pct": 100.0 * mean(arms == 3),
        "intersections_4_pct": 100.0 * mean(arms == 4),
        "intersections_5_pct": 100.0 * mean(arms >= 5),
    }
    closed = float(straight.sum())
    entropy = orientation_entropy(segments.bearing[here], length)
    return {
        "street_km_per_km2": 1e3 * float(length.sum()) / land,
        "intersections": n,
        "intersections_per_km2": 1e6 * n / land,
        **crossing,
        "dead_ends": ends,
        "dead_ends_per_km2": 1e6 * ends / land,
        "segment_length_mean_m": mean(length),
        "circuity": float(length[straight > 0].sum()) / closed if closed else math.nan,
        "orientation_entropy": entropy,
        "orientation_order": orientation_order(entropy),
        "meshedness": segments.meshedness(part),
    }


def orientation_entropy(bearing: FloatArray, length: FloatArray) -> float:
    """Shannon entropy in nats of the bearings of streets (Boeing 2019, Eq. 1).

    Every street counts in both its directions, by its length. Bins are centred on the compass
    points, so that small errors around them do not scatter.

    Parameters
    ----------
    bearing
        (n,) degrees clockwise from grid north, in [0, 180); NaN for rings, which count not.
    length
        (n,) metres.
    """
    known = ~np.isnan(bearing)
    if not known.any():
        return math.nan
    both = np.concatenate([bearing[known], bearing[known] + 180.0])
    width = 360.0 / BINS
    # rounded, so that streets on the border of two bins fall alike on every machine
    number = np.floor(np.round((both + width / 2) / width, 9)).astype(np.int64) % BINS
    share = np.bincount(number, weights=np.tile(length[known], 2), minlength=BINS)
    share = share[share > 0] / share.sum()
    return float(-(share * np.log(share)).sum())


def orientation_order(entropy: float) -> float:
    """Return φ = 1 - ((H - H_grid) / (H_max - H_grid))² (Boeing 2019, Eq. 2)."""
    return 1.0 - ((entropy - GRID_ENTROPY) / (math.log(BINS) - GRID_ENTROPY)) ** 2
