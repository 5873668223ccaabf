"""Metrics of a whole layout: Chen 2024, Table 1, and those that planners ask for besides."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.layout import EdgeKind, Layout
from urban_processing.mesh.corners import IRREGULAR
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.parcels import ParcelMeasures, measure_parcels
from urban_processing.metrics.registry import INTERIOR, METRICS
from urban_processing.rights_of_way import RightsOfWay, lay_out_rights_of_way
from urban_processing.streets.block_length import BlockSides, longest_sides
from urban_processing.streets.classes import NodeKind
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork

SMALL_BLOCK = 3
"""Blocks of at most this many parcels count as small."""


@dataclass(frozen=True)
class Metric:
    """One figure of a layout; `part` is None for the whole, `value` NaN where undefined."""

    part: int | None
    metric: str
    value: float
    unit: str


@dataclass(frozen=True, eq=False)
class LayoutMeasures:
    """What tables and metrics of one layout have in common, each worked out when asked for."""

    layout: Layout

    @cached_property
    def parcels(self) -> ParcelMeasures:
        """Measures of the parcels."""
        return measure_parcels(self.layout)

    @cached_property
    def network(self) -> StreetNetwork:
        """The street network."""
        return street_network(self.layout)

    @cached_property
    def rights_of_way(self) -> RightsOfWay | None:
        """Right-of-way and net parcels, None where none are laid out."""
        laid_out = self.layout.street_rules.laid_out
        return lay_out_rights_of_way(self.layout) if laid_out else None

    @cached_property
    def net_area(self) -> FloatArray:
        """(F,) area of the net parcels in m², NaN where no right-of-way is laid out."""
        streets = self.rights_of_way
        return np.full(self.layout.mesh.n_faces, np.nan) if streets is None else streets.net_area

    @cached_property
    def counted_area(self) -> FloatArray:
        """(F,) area that the smallest area allowed is held against, gross or net."""
        net = self.layout.street_rules.net_min_area
        return self.net_area if net else self.layout.mesh.face_area

    @cached_property
    def parts(self) -> IntArray:
        """Parts of the land that have parcels."""
        return np.unique(self.layout.face_part)

    @cached_property
    def block_sides(self) -> BlockSides:
        """The blocks' outlines, lengths and longest sides."""
        return longest_sides(self.layout.mesh.face_polygons(), self.layout.face_block)


def measure(layout: Layout, *, measures: LayoutMeasures | None = None) -> tuple[Metric, ...]:
    """Measure a layout: every metric of the registry, in its order.

    Parameters
    ----------
    layout
        The layout.
    measures
        Measures of the same layout, where they are at hand.

    Returns
    -------
    tuple of Metric
        For the whole (part None) and, if the land has several parts, for each of them.

    Examples
    --------
    >>> import numpy as np, shapely
    >>> from urban_processing.layout import layout_from_mesh
    >>> from urban_processing.mesh.build import mesh_from_polygons
    >>> from urban_processing.site import Frame
    >>> mesh = mesh_from_polygons([shapely.box(0, 0, 20, 20)])
    >>> layout = layout_from_mesh(mesh, frame=Frame(), face_part=np.zeros(1), min_area=400)
    >>> {m.metric: m.value for m in measure(layout)}["perimeter_m"]
    80.0
    """
    known = LayoutMeasures(layout) if measures is None else measures
    parts = known.parts.tolist()
    scopes: list[int | None] = [None, *(parts if len(parts) > 1 else [])]
    out: list[Metric] = []
    for part in scopes:
        values = _values(known, part)
        for spec in METRICS:
            if part is not None and not spec.by_part:
                continue
            out.append(Metric(part, spec.name, float(values[spec.name]), spec.unit))
            if spec.of_parcels:
                name = spec.name + INTERIOR
                out.append(Metric(part, name, float(values[name]), spec.unit))
    return tuple(out)


def _values(known: LayoutMeasures, part: int | None) -> dict[str, float]:
    """Every metric of the whole or of one part by name."""
    layout = known.layout
    inside = np.ones(layout.mesh.n_faces, dtype=bool)
    if part is not None:
        inside = layout.face_part == part
    interior = inside & ~known.parcels.rim
    of_parcels = _parcel_values(known, inside)
    return {
        **of_parcels,
        **{k + INTERIOR: v for k, v in _parcel_values(known, interior).items()},
        **_land_values(layout, inside),
        **_street_values(known, part, inside),
        **_right_of_way_values(known, part),
        **_block_values(known, inside),
        "seconds": math.fsum(step.seconds for step in layout.history),
    }


def _parcel_values(known: LayoutMeasures, chosen: BoolArray) -> dict[str, float]:
    p, smallest = known.parcels, known.layout.min_area
    n = int(chosen.sum())
    area, irregularity, sides = p.area[chosen], p.irregularity[chosen], p.sides[chosen]
    frontage, thinness = p.frontage[chosen], p.thinness[chosen]
    net, counted = known.net_area[chosen], known.counted_area[chosen]
    corner_chosen = np.repeat(chosen, p.sides)
    mean_area = _mean(area)
    return {
        "parcels": n,
        "triangles": int((sides == 3).sum()),
        "quads": int((sides == 4).sum()),
        "pentagons": int((sides == 5).sum()),
        "hexagons": int((sides == 6).sum()),
        "more_sides": int((sides > 6).sum()),
        "quads_pct": _percent(sides == 4),
        "irregularity_min": _lowest(irregularity),
        "irregularity_mean": _mean(irregularity),
        "irregularity_max": _highest(irregularity),
        "irregular_pct": _percent(irregularity > IRREGULAR),
        "unreached": int((~p.reached[chosen]).sum()),
        "frontage_mean_m": _mean(frontage),
        "frontage_min_m": _lowest(frontage),
        **_proportions(p, chosen),
        "thinness_mean": _mean(thinness),
        "thinness_min": _lowest(thinness),
        "p_angle_deg": _mean(np.abs(p.corner_angle[corner_chosen] - 90.0)),
        "p_area": _mean(p.area_ratio[chosen]),
        "undesirable_pct": _percent(p.undesirable[chosen]),
        "through_lots": int(p.through[chosen].sum()),
        "through_lots_pct": _percent(p.through[chosen]),
        "area_mean_m2": mean_area,
        "area_cv": float(area.std() / mean_area) if n else math.nan,
        "area_min_over_mean": _lowest(area) / mean_area,
        "area_max_over_min_area": _highest(counted) / smallest,
        "above_2_min_area_pct": _percent(counted > 2.0 * smallest),
        "above_3_min_area": int((counted > 3.0 * smallest).sum()),
        "net_area_mean_m2": _mean(net),
        "net_area_min_m2": _lowest(net),
    }


def _proportions(p: ParcelMeasures, chosen: BoolArray) -> dict[str, float]:
    """Width over depth of the parcels that have frontage."""
    ratio = (p.width / p.depth)[chosen]
    ratio = ratio[np.isfinite(ratio)]
    low, middle, high = np.quantile(ratio, (0.1, 0.5, 0.9)) if len(ratio) else [math.nan] * 3
    return {
        "width_depth_median": float(middle),
        "width_depth_p10": float(low),
        "width_depth_p90": float(high),
    }


def _land_values(layout: Layout, inside: BoolArray) -> dict[str, float]:
    mesh = layout.mesh
    boundary = mesh.edge_is_boundary & _edges_of(layout, inside)
    return {
        "perimeter_m": float(mesh.edge_length[boundary].sum()),
        "area_m2": float(mesh.face_area[inside].sum()),
        "min_area_m2": layout.min_area,
        "deepest_level": int(layout.face_level[inside].max()),
    }


def _street_values(known: LayoutMeasures, part: int | None, inside: BoolArray) -> dict[str, float]:
    """Figures of the streets without the rim (Chen 2024, Table 1)."""
    layout, net = known.layout, known.network
    mesh = layout.mesh
    street = ~net.street_rim & _in_part(net.street_part, part)
    node = net.node_interior & _in_part(net.node_part, part)
    junction = (net.node_kind == NodeKind.JUNCTION) | (
        (net.node_kind == NodeKind.ENTRY) & (net.node_degree > 2)
    )
    here = node[net.pair_node]
    deviation = net.pair_deviation[here & (net.pair_rim < 2)]
    deviation_interior = net.pair_deviation[here & (net.pair_rim == 0)]
    n_streets, n_parcels = int(street.sum()), int(inside.sum())
    length = float(net.street_length[street].sum())
    interior = (layout.edge_kind == EdgeKind.INTERIOR) & _edges_of(layout, inside)
    interior_length = float(mesh.edge_length[interior].sum())
    interior_street = float(mesh.edge_length[interior & layout.edge_street].sum())
    side = math.sqrt(float(mesh.face_area[inside].mean()))
    return {
        "streets": n_streets,
        "junctions": int((node & junction).sum()),
        "street_ends": int((node & (net.node_kind == NodeKind.END)).sum()),
        "street_length_m": length,
        "street_length_mean_m": length / n_streets if n_streets else math.nan,
        "junction_deviation_deg": _mean(deviation),
        "junction_deviation_deg" + INTERIOR: _mean(deviation_interior),
        "junction_deviation_max_deg": _highest(deviation),
        "street_share_pct": (
            100.0 * interior_street / interior_length if interior_length else math.nan
        ),
        "parcels_per_street": n_parcels / n_streets if n_streets else math.nan,
        "street_length_relative": length / n_parcels / side,
    }


def _right_of_way_values(known: LayoutMeasures, part: int | None) -> dict[str, float]:
    streets = known.rights_of_way
    if streets is None:
        return {"right_of_way_m2": math.nan, "right_of_way_pct": math.nan}
    taken = float(shapely.area(streets.polygons[_in_part(streets.part, part)]).sum())
    land = known.layout.mesh.face_area[_in_part(known.layout.face_part, part)].sum()
    return {"right_of_way_m2": taken, "right_of_way_pct": 100.0 * taken / float(land)}


def _block_values(known: LayoutMeasures, inside: BoolArray) -> dict[str, float]:
    block, size = np.unique(known.layout.face_block[inside], return_counts=True)
    length = known.block_sides.length[block]
    return {
        "blocks": len(size),
        "block_parcels_median": float(np.median(size)),
        "block_parcels_max": int(size.max()),
        "block_length_median_m": float(np.median(length)),
        "block_length_max_m": _highest(length),
        "small_blocks_pct": _percent(size <= SMALL_BLOCK),
    }


def _edges_of(layout: Layout, inside: BoolArray) -> BoolArray:
    """(E,) edges that bound one of the chosen parcels."""
    return np.asarray(inside[layout.mesh.face.reshape(-1, 2).max(axis=1)])


def _in_part(of: IntArray, part: int | None) -> BoolArray:
    return np.ones(len(of), dtype=bool) if part is None else np.asarray(of == part)


def _mean(values: FloatArray) -> float:
    return float(values.mean()) if len(values) else math.nan


def _lowest(values: FloatArray) -> float:
    return float(values.min()) if len(values) else math.nan


def _highest(values: FloatArray) -> float:
    return float(values.max()) if len(values) else math.nan


def _percent(true: npt.NDArray[np.bool_]) -> float:
    return 100.0 * float(true.mean()) if len(true) else math.nan
