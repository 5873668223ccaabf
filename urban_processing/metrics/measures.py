"""Metrics of a whole layout: Chen 2024, Yang 2013, and those that planners ask for besides."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from urban_processing.fabric.model import Fabric
from urban_processing.fabric.of_layout import fabric_of_layout
from urban_processing.layout import Layout
from urban_processing.mesh.planar import FloatArray, IntArray
from urban_processing.metrics.averages import in_part
from urban_processing.metrics.block_values import block_values
from urban_processing.metrics.land_values import land_area, land_values
from urban_processing.metrics.parcel_values import parcel_values
from urban_processing.metrics.parcels import ParcelMeasures, measure_parcels, measure_rings
from urban_processing.metrics.registry import INTERIOR, METRICS
from urban_processing.metrics.routes import Routes
from urban_processing.metrics.segments import Segments, segments
from urban_processing.metrics.street_values import street_values
from urban_processing.provenance import Step
from urban_processing.rights_of_way import RightsOfWay, lay_out_rights_of_way
from urban_processing.streets.block_length import BlockSides, longest_sides
from urban_processing.streets.network import street_network
from urban_processing.streets.network_model import StreetNetwork


@dataclass(frozen=True)
class Metric:
    """One figure of a layout; `part` is None for the whole, `value` NaN where undefined."""

    part: int | None
    metric: str
    value: float
    unit: str


@dataclass(frozen=True, eq=False)
class FabricMeasures:
    """What metrics, tables and distributions of a fabric have in common, each worked out once."""

    fabric: Fabric

    @cached_property
    def parcels(self) -> ParcelMeasures | None:
        """Measures of the parcels, None where there are none."""
        known = self.fabric.parcels
        return None if known is None else measure_rings(known.rings)

    @cached_property
    def block_sides(self) -> BlockSides | None:
        """The blocks' outlines, lengths and longest sides; None where there are no blocks."""
        blocks = self.fabric.blocks
        if blocks.sides is not None or not len(blocks):
            return blocks.sides
        return longest_sides(blocks.polygons, np.arange(len(blocks)))

    @cached_property
    def segments(self) -> Segments:
        """Streets without the rim from one intersection, end or place on the rim to the next."""
        return segments(self.fabric)

    @cached_property
    def routes(self) -> Routes:
        """Ways along the streets."""
        return Routes(self.fabric)

    @cached_property
    def counted_area(self) -> FloatArray:
        """(F,) area that the smallest area allowed is held against, gross or net."""
        parcels = self.fabric.parcels
        if parcels is None:
            return np.empty(0)
        return parcels.net_area if self.fabric.net_min_area else parcels.rings.area

    @cached_property
    def parts(self) -> IntArray:
        """Pieces of the land."""
        return np.unique(self.fabric.land_part)

    @cached_property
    def metrics(self) -> tuple[Metric, ...]:
        """Every metric of the registry; see `measure_fabric`."""
        return measure_fabric(self)

    def with_history(self, history: tuple[Step, ...]) -> FabricMeasures:
        """Return these measures under another history of the fabric; none is worked out again."""
        told = FabricMeasures(replace(self.fabric, history=history))
        told.__dict__.update({k: v for k, v in self.__dict__.items() if k != "fabric"})
        return told

    @property
    def values(self) -> Mapping[str, float]:
        """Value of each metric of the whole by name."""
        return {m.metric: m.value for m in self.metrics if m.part is None}


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
    def block_sides(self) -> BlockSides:
        """The blocks' outlines, lengths and longest sides."""
        return longest_sides(self.layout.mesh.face_polygons(), self.layout.face_block)

    @cached_property
    def of_fabric(self) -> FabricMeasures:
        """The layout as a fabric, with what is known here already."""
        fabric = fabric_of_layout(
            self.layout,
            network=self.network,
            rights_of_way=self.rights_of_way,
            sides=self.block_sides,
        )
        known = FabricMeasures(fabric)
        if "parcels" in self.__dict__:  # what is cached needs not be worked out again
            known.__dict__["parcels"] = self.parcels
        return known


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
    return known.of_fabric.metrics


def measure_fabric(known: FabricMeasures) -> tuple[Metric, ...]:
    """Measure a fabric: every metric of the registry, in its order.

    Those that a fabric does not allow, such as metrics of parcels where only streets are known,
    are NaN.

    Returns
    -------
    tuple of Metric
        For the whole (part None) and, if the land has several parts, for each of them.
    """
    parts = known.parts.tolist()
    scopes: list[int | None] = [None, *(parts if len(parts) > 1 else [])]
    out: list[Metric] = []
    for part in scopes:
        values = _values(known, part)
        for spec in METRICS:
            if part is not None and not spec.by_part:
                continue
            out.append(Metric(part, spec.name, float(values.get(spec.name, math.nan)), spec.unit))
            if spec.of_parcels:
                name = spec.name + INTERIOR
                out.append(Metric(part, name, float(values.get(name, math.nan)), spec.unit))
    return tuple(out)


def _values(known: FabricMeasures, part: int | None) -> dict[str, float]:
    """Metrics of the whole or of one part by name, without some that are undefined."""
    history = known.fabric.history
    return {
        **_of_parcels(known, part),
        **land_values(known.fabric, part),
        **street_values(known.fabric, known.segments, part),
        **known.routes.network_values(part),
        **block_values(known.fabric, known.block_sides, part),
        **({"seconds": math.fsum(step.seconds for step in history)} if history else {}),
    }


def _of_parcels(known: FabricMeasures, part: int | None) -> dict[str, float]:
    """Metrics of all parcels and of those in the interior."""
    parcels, measures = known.fabric.parcels, known.parcels
    if parcels is None or measures is None:
        return {"parcels": math.nan}
    inside = in_part(parcels.part, part)
    land = land_area(known.fabric, part)
    values: dict[str, float] = {}
    for suffix, chosen in (("", inside), (INTERIOR, inside & ~measures.rim)):
        found = {
            **parcel_values(known.fabric, measures, chosen, counted_area=known.counted_area),
            **known.routes.parcel_values(part, interior=suffix == INTERIOR),
            "parcels_per_km2": 1e6 * int(chosen.sum()) / land,
        }
        values |= {name + suffix: value for name, value in found.items()}
    return values
