"""The one declaration of every metric of a layout."""

from __future__ import annotations

import enum
from dataclasses import dataclass

INTERIOR = "_interior"
"""Suffix of a metric that is taken over interior parcels alone."""


class Better(enum.StrEnum):
    """Which values of a metric are better by what is commonly wanted of a plan."""

    LOW = "low"
    HIGH = "high"
    NEITHER = ""


@dataclass(frozen=True)
class MetricSpec:
    """What a metric is.

    Parameters
    ----------
    name
        Name in tables; `INTERIOR` is added where it is taken over interior parcels alone.
    unit
        ``m``, ``m²``, ``°``, ``%``, ``s`` or nothing for numbers and ratios.
    source
        Paper and place where the metric comes from, or nothing.
    definition
        What is measured, in one sentence.
    of_parcels
        Whether it is taken over a set of parcels, and so for interior parcels alone too.
    by_part
        Whether it is given for each part of a land of several parts.
    better
        Which values are better.
    """

    name: str
    unit: str
    source: str
    definition: str
    of_parcels: bool = False
    by_part: bool = True
    better: Better = Better.NEITHER


_CHEN, _YANG = "Chen 2024, Table 1", "Yang 2013, section 7"
_BOEING = "Boeing 2019, Urban spatial order"
_LOW, _HIGH = Better.LOW, Better.HIGH


def _parcels(
    name: str, unit: str, source: str, definition: str, better: Better = Better.NEITHER
) -> MetricSpec:
    return MetricSpec(name, unit, source, definition, of_parcels=True, better=better)


METRICS: tuple[MetricSpec, ...] = (
    MetricSpec("perimeter_m", "m", _CHEN, "Length of the land's boundary, holes included."),
    MetricSpec("area_m2", "m²", _CHEN, "Area of the land."),
    MetricSpec("min_area_m2", "m²", _CHEN, "Smallest parcel allowed."),
    _parcels("parcels", "", _CHEN, "Number of parcels."),
    _parcels("triangles", "", _CHEN, "Parcels whose approximate polygon has three sides."),
    _parcels("quads", "", _CHEN, "Parcels whose approximate polygon has four sides."),
    _parcels("pentagons", "", _CHEN, "Parcels whose approximate polygon has five sides."),
    _parcels("hexagons", "", _CHEN, "Parcels whose approximate polygon has six sides."),
    _parcels("more_sides", "", _CHEN, "Parcels whose approximate polygon has seven or more sides."),
    _parcels("quads_pct", "%", "", "Share of parcels with four sides.", _HIGH),
    _parcels("irregularity_min", "", _CHEN, "Smallest irregularity (Eq. 1) of a parcel."),
    _parcels("irregularity_mean", "", _CHEN, "Mean irregularity (Eq. 1) of the parcels.", _LOW),
    _parcels("irregularity_max", "", _CHEN, "Largest irregularity (Eq. 1) of a parcel.", _LOW),
    _parcels("irregular_pct", "%", "", "Share of parcels with an irregularity above 0.1.", _LOW),
    MetricSpec("streets", "", _CHEN, "Number of streets, those of the rim left out."),
    MetricSpec(
        "junctions", "", _CHEN, "Nodes where streets meet, at least one of them not of the rim."
    ),
    MetricSpec("street_ends", "", _CHEN, "Nodes with a single street edge that is not rim."),
    MetricSpec("street_length_m", "m", _CHEN, "Total length of streets without the rim."),
    MetricSpec("street_length_mean_m", "m", _CHEN, "Mean length of a street without the rim."),
    MetricSpec(
        "junction_deviation_deg",
        "°",
        _CHEN,
        "Mean over all pairs of streets at junctions, not both of the rim, of 90° less the acute "
        "angle between them.",
        better=_LOW,
    ),
    MetricSpec(
        "junction_deviation_deg" + INTERIOR,
        "°",
        "",
        "The same over pairs of streets that are both interior.",
        better=_LOW,
    ),
    MetricSpec(
        "junction_deviation_max_deg",
        "°",
        "",
        "Largest deviation from 90° of a pair of streets.",
        better=_LOW,
    ),
    MetricSpec("deepest_level", "", _CHEN, "Largest number of cuts that made a parcel."),
    MetricSpec("seconds", "s", _CHEN, "Time that all steps of the layout took.", by_part=False),
    _parcels("unreached", "", "", "Parcels with less frontage than min(3 m, 0.25 √area).", _LOW),
    _parcels("frontage_mean_m", "m", "", "Mean length of a parcel's boundary on streets."),
    _parcels("frontage_min_m", "m", "", "Smallest length of a parcel's boundary on streets."),
    _parcels(
        "width_depth_median", "", "", "Median of width along the street over depth of a parcel."
    ),
    _parcels("width_depth_p10", "", "", "Width over depth that a tenth of the parcels is below."),
    _parcels("width_depth_p90", "", "", "Width over depth that a tenth of the parcels is above."),
    _parcels(
        "thinness_mean", "", "", "Mean diameter of the largest inscribed circle over √area.", _HIGH
    ),
    _parcels("thinness_min", "", "", "Smallest such ratio of a parcel: slivers show here.", _HIGH),
    _parcels(
        "p_angle_deg", "°", _YANG, "Mean over all corners of all parcels of abs(angle - 90°).", _LOW
    ),
    _parcels(
        "p_area", "", _YANG, "Mean of the minimum rotated rectangle's area over the parcel's.", _LOW
    ),
    _parcels(
        "undesirable_pct",
        "%",
        _YANG,
        "Share of parcels with p_angle above 15° or p_area above 1.2.",
        _LOW,
    ),
    _parcels("undesirable", "", _YANG, "Parcels with p_angle above 15° or p_area above 1.2."),
    _parcels(
        "neighbours_mean",
        "",
        "Vanegas 2012, section 6",
        "Mean number of parcels beside a parcel, with no street between.",
    ),
    _parcels("through_lots", "", "", "Parcels with frontage on two opposite sides."),
    _parcels(
        "through_lots_pct", "%", "", "Share of parcels with frontage on two opposite sides.", _LOW
    ),
    _parcels("area_mean_m2", "m²", "", "Mean area of the parcels."),
    _parcels("area_cv", "", "", "Standard deviation of the parcels' areas over their mean.", _LOW),
    _parcels("area_min_over_mean", "", "", "Smallest area of a parcel over the mean.", _HIGH),
    _parcels(
        "area_max_over_min_area",
        "",
        "",
        "Largest area of a parcel, net where that counts, over the smallest allowed.",
    ),
    _parcels(
        "above_2_min_area_pct", "%", "", "Share of parcels above twice the smallest area allowed."
    ),
    _parcels("above_3_min_area", "", "", "Parcels above three times the smallest area allowed."),
    _parcels("net_area_mean_m2", "m²", "", "Mean area of the parcels less right-of-way."),
    _parcels("net_area_min_m2", "m²", "", "Smallest area of a parcel less right-of-way."),
    MetricSpec("right_of_way_m2", "m²", "", "Area of the right-of-way of all streets."),
    MetricSpec("right_of_way_pct", "%", "", "Share of the land that is right-of-way."),
    MetricSpec(
        "street_share_pct", "%", "", "Length of interior street edges over all interior edges."
    ),
    MetricSpec(
        "parcels_per_street", "", _CHEN, "Parcels over streets without the rim.", better=_HIGH
    ),
    MetricSpec(
        "street_length_relative",
        "",
        "",
        "L*: street length without the rim for each parcel, over the root of the mean area.",
        better=_LOW,
    ),
    MetricSpec("blocks", "", "", "Faces of the street network, rim included."),
    MetricSpec("block_parcels_median", "", "", "Median number of parcels of a block."),
    MetricSpec("block_parcels_max", "", "", "Largest number of parcels of a block."),
    MetricSpec("block_length_median_m", "m", "", "Median length of a block: of its longest side."),
    MetricSpec(
        "block_length_max_m",
        "m",
        "",
        "Largest length of a block: of its longest side, from corner to corner along the boundary.",
    ),
    MetricSpec(
        "small_blocks_pct", "%", "", "Share of blocks of three parcels or fewer.", better=_LOW
    ),
    MetricSpec(
        "block_area_mean_m2", "m²", "", "Mean area of the blocks, to the centreline of streets."
    ),
    MetricSpec("block_area_median_m2", "m²", "", "Median area of the blocks."),
    MetricSpec("blocks_per_km2", "/km²", _YANG, "b_n: blocks for each square kilometre of land."),
    MetricSpec("block_perimeter_max_m", "m", _YANG, "b_max: longest boundary of a block."),
    MetricSpec("block_perimeter_mean_m", "m", _YANG, "b_avg: mean boundary of the blocks."),
    MetricSpec("block_perimeter_min_m", "m", _YANG, "b_min: shortest boundary of a block."),
    MetricSpec(
        "land_use_streets_pct",
        "%",
        _YANG,
        "l_s: share of the land that is right-of-way and no parcel.",
    ),
    MetricSpec(
        "land_use_parcels_pct",
        "%",
        _YANG,
        "l_r: share of the land in parcels that are neither parks nor of another use, such as "
        "commercial, school or remnant; less right-of-way.",
    ),
    MetricSpec("land_use_parks_pct", "%", _YANG, "l_p: share of the land in parks and gardens."),
    MetricSpec("land_use_other_pct", "%", _YANG, "l_o: share of the land that is none of these."),
    _parcels("parcels_per_km2", "/km²", _YANG, "p_n: parcels for each square kilometre of land."),
    MetricSpec(
        "street_km_per_km2",
        "km/km²",
        _YANG,
        "s_l: length of streets without the rim for each square kilometre of land.",
    ),
    MetricSpec(
        "intersections",
        "",
        "",
        "Places where three or more segments end, those on rim streets and at entries left out.",
    ),
    MetricSpec(
        "intersections_per_km2",
        "/km²",
        _YANG,
        "s_i: intersections for each square kilometre of land.",
    ),
    MetricSpec("intersections_3_pct", "%", "", "Share of intersections where three segments end."),
    MetricSpec("intersections_4_pct", "%", "", "Share of intersections where four segments end."),
    MetricSpec(
        "intersections_5_pct", "%", "", "Share of intersections where five or more segments end."
    ),
    MetricSpec(
        "dead_ends",
        "",
        "",
        "Places where a single segment ends, those on rim streets and at entries, where streets go "
        "on outside, left out.",
    ),
    MetricSpec(
        "dead_ends_per_km2", "/km²", _YANG, "s_d: dead ends for each square kilometre of land."
    ),
    MetricSpec(
        "segment_length_mean_m",
        "m",
        "",
        "Mean length of a segment: a street without the rim from one intersection, dead end, "
        "entry or place on the rim to the next.",
    ),
    MetricSpec(
        "circuity",
        "",
        _BOEING,
        "Length of all segments over that of the straight lines between their ends, segments that "
        "end where they begin left out.",
        better=_LOW,
    ),
    MetricSpec(
        "orientation_entropy",
        "nat",
        _BOEING,
        "Entropy of the bearings of segments, weighted by length, in 36 bins: 1.386 for a grid, "
        "3.584 for streets in all directions alike.",
    ),
    MetricSpec(
        "orientation_order",
        "",
        _BOEING,
        "φ: 1 for a grid, 0 for streets in all directions alike, from the entropy.",
    ),
    MetricSpec(
        "meshedness",
        "",
        "Buhl et al. 2006",
        "Loops of streets without the rim (segments less their ends plus connected pieces) over "
        "twice the ends less 5: 0 for a tree, 0.5 for an endless square grid.",
        better=_HIGH,
    ),
    MetricSpec(
        "network_pieces",
        "",
        "",
        "Connected pieces of the street network, rim streets included: 1 where every street leads "
        "to every other.",
    ),
    MetricSpec(
        "network_detour",
        "",
        "",
        "Mean over pairs of intersections, dead ends, entries and junctions with the rim of the "
        "shortest way along streets, rim streets included, over the straight line.",
        better=_LOW,
    ),
    _parcels(
        "rim_distance_m",
        "m",
        "",
        "Mean over parcels of the shortest way along streets from their frontage, every metre of "
        "it counted alike, to the nearest rim street or entry.",
    ),
    _parcels(
        "parcel_distance_m",
        "m",
        "",
        "Mean over pairs of parcels that streets connect (of thousands, over a sample that is "
        "spread evenly) of the shortest way along streets, rim streets included, from frontage to "
        "frontage, every metre of it counted alike.",
        _LOW,
    ),
    _parcels(
        "parcel_detour",
        "",
        "",
        "Mean over the same pairs of the way along streets over the straight line, frontages "
        "within a metre of each other left out.",
        _LOW,
    ),
)
"""All metrics, in the order in which tables list them."""
