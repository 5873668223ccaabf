"""The layers of a fabric that was measured: parcels, streets, junctions, blocks, metrics."""

from __future__ import annotations

import math

import numpy as np
import shapely

from urban_processing.fabric.layers import (
    MEASURED_BLOCKS,
    MEASURED_KIND,
    MEASURED_PARCELS,
    MEASURED_STREETS,
    STREET_LAND,
)
from urban_processing.fabric.model import NO_BLOCK, UNKNOWN_LEVEL, Fabric, Geometries
from urban_processing.mesh.planar import IntArray
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.metrics.tables import (
    junctions_of,
    metric_table,
    parcel_columns,
    street_columns,
)
from urban_processing.schema import BOUNDARY, ISSUES, JUNCTIONS, METRICS, Layer
from urban_processing.tables import (
    LayerSet,
    Table,
    issue_table,
    issues_in_words,
    make_table,
    to_map,
)


def fabric_layers(known: FabricMeasures) -> LayerSet:
    """Return a fabric as layers; those of which nothing is known are left out."""
    fabric = known.fabric
    frame = fabric.frame
    tables: dict[Layer, Table] = {}
    if fabric.parcels is not None:
        tables[MEASURED_PARCELS] = _parcel_table(known)
    tables[MEASURED_STREETS] = make_table(
        MEASURED_STREETS,
        street_columns(fabric.network),
        fabric.network.lines(fabric.lines, frame.origin),
    )
    tables[JUNCTIONS] = junctions_of(fabric.network, fabric.lines, frame)
    tables[MEASURED_BLOCKS] = _block_table(known)
    tables[BOUNDARY] = _areas(BOUNDARY, fabric, fabric.land, fabric.land_part)
    if fabric.right_of_way is not None and fabric.right_of_way_part is not None:
        tables[STREET_LAND] = _areas(
            STREET_LAND, fabric, fabric.right_of_way, fabric.right_of_way_part
        )
    tables[ISSUES] = issue_table(fabric.all_issues, frame)
    tables[METRICS] = metric_table(known.metrics)
    return LayerSet(
        kind=MEASURED_KIND,
        tables=tables,
        frame=frame,
        history=fabric.history,
        summary=tuple(_summary(known)),
    )


def _parcel_table(known: FabricMeasures) -> Table:
    parcels, p = known.fabric.parcels, known.parcels
    if parcels is None or p is None:
        raise ValueError("This fabric has no parcels.")
    return make_table(
        MEASURED_PARCELS,
        {
            "parcel_id": parcels.parcel_id,
            "part": parcels.part,
            "net_area_m2": parcels.net_area,
            **parcel_columns(p),
            "land_use": parcels.land_use,
            "block_id": np.where(parcels.block == NO_BLOCK, np.nan, parcels.block + 1.0),
            "level": np.where(parcels.level == UNKNOWN_LEVEL, np.nan, parcels.level),
            "undesirable": p.undesirable,
            "neighbours": parcels.neighbours,
        },
        to_map(parcels.rings.polygons, known.fabric.frame),
    )


def _block_table(known: FabricMeasures) -> Table:
    blocks, sides, parcels = known.fabric.blocks, known.block_sides, known.fabric.parcels
    n = len(blocks)
    of = np.empty(0, dtype=np.int64) if parcels is None else parcels.block
    return make_table(
        MEASURED_BLOCKS,
        {
            "block_id": np.arange(1, n + 1),
            "part": blocks.part,
            "area_m2": shapely.area(blocks.polygons),
            "perimeter_m": shapely.length(blocks.polygons),
            "length_m": np.empty(0) if sides is None else sides.length,
            "parcels": np.bincount(of[of != NO_BLOCK], minlength=n),
        },
        to_map(blocks.polygons, known.fabric.frame),
    )


def _areas(layer: Layer, fabric: Fabric, polygons: Geometries, part: IntArray) -> Table:
    geometry = to_map(polygons, fabric.frame)
    return make_table(layer, {"part": part, "area_m2": shapely.area(geometry)}, geometry)


def _summary(known: FabricMeasures) -> list[tuple[str, str]]:
    """The few figures that a run ends with."""
    v, fabric = known.values, known.fabric
    area = v["area_m2"]
    rows = [("land", f"{area / 1e6:,.2f} km²" if area >= 1e6 else f"{area / 1e4:,.2f} ha")]
    if fabric.parcels is not None:
        rows.append(
            (
                "parcels",
                f"{v['parcels']:,.0f} of {v['area_mean_m2']:,.0f} m² in the mean, "
                f"{v['quads_pct']:.1f} % with four sides, mean irregularity "
                f"{v['irregularity_mean']:.3f}{_unreached(v['unreached'])}",
            )
        )
    rows.append(("blocks", f"{v['blocks']:,.0f}"))
    rows.append(
        (
            "streets",
            f"{v['street_length_m'] / 1000:,.1f} km, {_count(v['intersections'], 'intersection')}, "
            f"{_count(v['dead_ends'], 'dead end')} (besides the rim)",
        )
    )
    if fabric.all_issues:
        rows.append(("issues", f"{issues_in_words(fabric.all_issues)} (see the layer issues)"))
    return rows


def _unreached(parcels: float) -> str:
    return "" if math.isnan(parcels) else f", {parcels:,.0f} with too little frontage for access"


def _count(number: float, what: str) -> str:
    return f"{number:,.0f} {what}" + ("" if number == 1 else "s")
