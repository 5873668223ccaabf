"""What metrics are called in a report, and which of them stand together."""

from __future__ import annotations

import re

from urban_processing.metrics.registry import INTERIOR, METRICS, MetricSpec

GROUPS = ("Land and use", "Parcels", "Streets", "Blocks", "Ways", "Making")
"""Headings of the table of metrics, in order."""

_LABELS = {
    "above_2_min_area_pct": "Share above twice the smallest area",
    "above_3_min_area": "Parcels above three times the smallest area",
    "area_cv": "Spread of areas",
    "area_m2": "Area of the land",
    "area_max_over_min_area": "Largest area over the smallest allowed",
    "area_mean_m2": "Mean area",
    "area_min_over_mean": "Smallest area over the mean",
    "block_parcels_max": "Most parcels of a block",
    "block_parcels_median": "Median parcels of a block",
    "deepest_level": "Most cuts for a parcel",
    "intersections_3_pct": "Intersections with three arms",
    "intersections_4_pct": "Intersections with four arms",
    "intersections_5_pct": "Intersections with five or more arms",
    "irregular_pct": "Share of irregular parcels",
    "junction_deviation_deg": "Deviation of junctions from 90°",
    "junction_deviation_deg_interior": "Deviation of junctions from 90°, rim left out",
    "junction_deviation_max_deg": "Largest deviation of a junction from 90°",
    "land_use_other_pct": "Other land",
    "land_use_parcels_pct": "Land in parcels",
    "land_use_parks_pct": "Land in parks",
    "land_use_streets_pct": "Land in streets",
    "min_area_m2": "Smallest parcel allowed",
    "more_sides": "Seven or more sides",
    "neighbours_mean": "Mean number of neighbours",
    "network_detour": "Detour between intersections",
    "p_angle_deg": "Deviation of corners from 90° (p_angle)",
    "p_area": "Rectangle over parcel (p_area)",
    "parcel_detour": "Detour between parcels",
    "parcel_distance_m": "Mean way from parcel to parcel",
    "perimeter_m": "Boundary of the land",
    "quads": "Quadrilaterals",
    "quads_pct": "Share of quadrilaterals",
    "right_of_way_m2": "Right-of-way",
    "right_of_way_pct": "Share of right-of-way",
    "rim_distance_m": "Mean way from parcel to rim",
    "seconds": "Time taken",
    "small_blocks_pct": "Blocks of three parcels or fewer",
    "street_km_per_km2": "Street length per km²",
    "street_length_mean_m": "Mean length of streets",
    "street_length_m": "Length of streets",
    "street_length_relative": "Street length for each parcel (L*)",
    "street_share_pct": "Street share of inner edges",
    "through_lots_pct": "Share of through lots",
    "undesirable": "Undesirable parcels",
    "undesirable_pct": "Share of undesirable parcels",
    "unreached": "Parcels with too little frontage for access",
    "width_depth_median": "Median width over depth",
    "width_depth_p10": "Width over depth, lowest tenth below",
    "width_depth_p90": "Width over depth, highest tenth above",
}
"""Names that their words do not tell."""

_GROUP_OF = {
    "Land and use": r"perimeter_m|area_m2|land_use_.*|right_of_way_.*",
    "Blocks": r"blocks.*|block_.*|small_blocks_pct",
    "Ways": r"circuity|meshedness|.*_detour|.*_distance_.*",
    "Streets": r"streets?(_.*)?|junction.*|intersections.*|dead_ends.*|segment.*|orientation_.*|"
    r"network_pieces",
    "Making": r"seconds|deepest_level|min_area_m2",
}
"""Names of the metrics of each group; the rest is of parcels."""

_UNITS = re.compile(r"_(m2|m|deg|pct)$")
_FIRST = ("mean", "median", "min", "max")
_FIRST_WORDS = {"min": "Smallest", "max": "Largest", "mean": "Mean", "median": "Median"}


def label(name: str) -> str:
    """Return what to call a metric.

    >>> label("irregularity_mean"), label("dead_ends_per_km2"), label("blocks_per_km2")
    ('Mean irregularity', 'Dead ends per km²', 'Blocks per km²')
    >>> label("irregularity_mean_interior")
    'Mean irregularity'
    """
    own = name if name in _DECLARED else name.removesuffix(INTERIOR)
    if own in _LABELS:
        return _LABELS[own]
    words = _UNITS.sub("", own)
    parts = words.replace("km2", "km²").split("_")
    if parts[-1] in _FIRST:
        return " ".join([_FIRST_WORDS[parts[-1]], *parts[:-1]])
    text = " ".join(parts)
    return text[:1].upper() + text[1:]


def group(name: str) -> str:
    """Return the group of a metric.

    >>> group("block_area_mean_m2"), group("parcel_detour"), group("thinness_min")
    ('Blocks', 'Ways', 'Parcels')
    """
    return next((g for g, names in _GROUP_OF.items() if re.fullmatch(names, name)), "Parcels")


def is_interior(name: str, spec: MetricSpec) -> bool:
    """Whether a value is that of a metric taken over interior parcels alone."""
    return name == spec.name + INTERIOR


_DECLARED = frozenset(spec.name for spec in METRICS)
