"""What a subdivision does not keep of what was wanted, parcel by parcel."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.access_rule import reached_frontage
from urban_processing.mesh.planar import BoolArray, FloatArray
from urban_processing.metrics.parcels import box_sides
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.subdivide import Strategy
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.site import AREA_ROUNDING, Issue

LENGTH_ROUNDING = 1e-6
"""Metres by which rounding may take a width beyond its bound."""


def bound_findings(measured: MeasuredSubdivision) -> list[Issue]:
    """List the parcels that break a bound, and those that no street reaches.

    A block smaller than the smallest parcel is listed as such, and one that is nowhere as long as
    parcels are to be wide, in place of its parcels. The width of a parcel is the shorter side of
    the smallest rotated rectangle around it (Vanegas 2012, section 4.1).
    """
    made = measured.made
    pieces, rules = made.pieces, made.wanted.rules
    block = pieces.block
    area = np.asarray(shapely.area(made.polygons))
    least, most = rules.min_area[block], rules.max_area[block]
    parcel = ~pieces.patio
    whole = np.bincount(block)[block] == 1
    small = parcel & (area < least * (1.0 - AREA_ROUNDING))
    large = parcel & (area > most * (1.0 + AREA_ROUNDING))
    width = measured.boxes[:, 0]
    length = box_sides(made.blocks.polygons)[:, 1]
    short = length < rules.min_width - LENGTH_ROUNDING
    narrow = parcel & ~small & (width < rules.min_width[block] - LENGTH_ROUNDING)
    wide = parcel & ~large & (width > rules.max_width[block] + LENGTH_ROUNDING)
    found = [
        ("block_small", small & whole, area, least, "A block of {value:.0f} m² is smaller than the "
         "smallest parcel, {limit:.0f} m²: it stays whole."),
        ("parcel_small", small & ~whole, area, least, "A parcel of {value:.0f} m² is smaller than "
         "{limit:.0f} m²: the block leaves no room."),
        ("parcel_large", large, area, most, "A parcel of {value:.0f} m² is larger than "
         "{limit:.0f} m²: no cut keeps the other bounds."),
        ("parcel_narrow", narrow & ~short[block], width, rules.min_width[block], "A parcel is "
         "{value:.1f} m wide, less than {limit:.1f} m."),
        ("parcel_wide", wide, width, rules.max_width[block], "A parcel is {value:.1f} m wide, more "
         "than {limit:.1f} m."),
    ]  # fmt: skip
    issues = _short_blocks(made, length, short & np.isin(np.arange(len(short)), block[narrow]))
    for code, chosen, value, limit, message in found:
        issues += _each(measured, code, chosen, (value, limit), message)
    return [*issues, *_unreached(measured)]


def _short_blocks(made: Subdivision, length: FloatArray, chosen: BoolArray) -> list[Issue]:
    """Blocks that no parcel of the smallest width has room in."""
    rows = np.flatnonzero(chosen)
    least = made.wanted.rules.min_width
    return [
        Issue(
            code="block_narrow",
            message=f"A block is {length[row]:.1f} m long, less than the smallest width of a "
            f"parcel, {least[row]:.1f} m: what it is divided into is narrower.",
            part=row,
            value=float(length[row]),
            limit=float(least[row]),
            geometry=shapely.point_on_surface(made.blocks.polygons[row]),
        )
        for row in rows.tolist()
    ]


def _unreached(measured: MeasuredSubdivision) -> list[Issue]:
    """Parcels without street: one by one where all were to have one, else their number."""
    made = measured.made
    block = made.pieces.block
    reached = made.frontage >= reached_frontage(shapely.area(made.polygons))
    unreached = ~reached & ~made.pieces.patio
    always = made.wanted.rules.street_access >= 1.0
    always &= made.wanted.strategy != Strategy.HYBRID
    meant = unreached & ~always[block]
    issues = _each(
        measured,
        "parcel_unreached",
        unreached & always[block],
        (made.frontage, np.zeros(len(block))),
        "No street reaches a parcel: it has {value:.1f} m of street.",
    )
    if meant.any():
        issues.append(
            Issue(
                "parcels_inside",
                f"{int(meant.sum())} parcels lie inside blocks without street, as the strategy or "
                "the street access that was asked for allow.",
                value=float(meant.sum()),
            )
        )
    return issues


def _each(
    measured: MeasuredSubdivision,
    code: str,
    chosen: BoolArray,
    figures: tuple[FloatArray, FloatArray],
    message: str,
) -> list[Issue]:
    """One issue for each chosen parcel; `figures` are its value and the limit."""
    made = measured.made
    value, limit = figures
    faces = np.flatnonzero(chosen)
    places = shapely.point_on_surface(made.polygons[faces])
    return [
        Issue(
            code=code,
            message=message.format(value=float(value[f]), limit=float(limit[f])),
            part=int(made.pieces.block[f]),
            parcel_id=int(made.parcel_id[f]),
            value=float(value[f]),
            limit=float(limit[f]),
            geometry=place,
        )
        for f, place in zip(faces.tolist(), places, strict=True)
    ]
