"""Values of single blocks, parcels and streets, for the distributions of a fabric."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import shapely

from urban_processing.metrics.distributions import Sample
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.metrics.parcels import box_sides


def samples(known: FabricMeasures) -> Mapping[str, Sample]:
    """Return a sample for each of `DISTRIBUTIONS` by name; empty where nothing is known.

    Blocks and segments are those of the whole land; streets of the rim are left out, as in the
    metrics.
    """
    fabric, segments = known.fabric, known.segments
    net = fabric.network
    sides = known.block_sides
    return {
        "block_area_m2": Sample(shapely.area(fabric.blocks.polygons)),
        "block_length_m": Sample(np.empty(0) if sides is None else sides.length),
        **_of_parcels(known),
        "segment_length_m": Sample(segments.length),
        "segment_bearing_deg": Sample(segments.bearing, segments.length),
        "street_length_m": Sample(net.street_length[~net.street_rim]),
    }


def _of_parcels(known: FabricMeasures) -> Mapping[str, Sample]:
    parcels, p = known.fabric.parcels, known.parcels
    if parcels is None or p is None:
        return {}
    shorter, longer = np.sort(box_sides(parcels.rings.polygons), axis=1).T
    return {
        "parcel_area_m2": Sample(np.where(np.isnan(parcels.net_area), p.area, parcels.net_area)),
        "parcel_width_m": Sample(p.width),
        "parcel_depth_m": Sample(p.depth),
        "parcel_aspect": Sample(longer / shorter),
        "parcel_neighbours": Sample(parcels.neighbours.astype(np.float64)),
        "parcel_frontage_m": Sample(p.frontage),
        "parcel_irregularity": Sample(p.irregularity),
    }
