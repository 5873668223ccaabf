"""What a finished layout does not keep of what was wanted, parcel by parcel."""

from __future__ import annotations

import numpy as np
import shapely

from urban_processing.access_rule import reached_frontage, unreached_parcels_of
from urban_processing.layout import NOT_FIXED, EdgeKind, Layout
from urban_processing.mesh.planar import FloatArray
from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
from urban_processing.rights_of_way import lay_out_rights_of_way
from urban_processing.rights_of_way.partition import SWALLOWED_SHARE
from urban_processing.site import AREA_ROUNDING, Issue

COUNT_TOLERANCE = 0.03
"""The number of parcels is reached within this share."""

SWALLOWED, CUT_OFF = "parcel_swallowed", "parcel_cut_off"
"""Codes of what rights-of-way do to parcels."""

CUT_OFF_M2 = 1.0
"""Pieces that the right-of-way cuts off parcels are listed from this area on."""

VERY_LARGE = 3.0
"""Parcels above so many smallest areas are listed."""


def findings(layout: Layout, params: CogenerateParams) -> list[Issue]:
    """List a missed number of parcels, parcels of a wrong size or without street, dead ends."""
    return [
        *_count(layout, params),
        *_sizes(layout),
        *right_of_way_findings(layout),
        *_unreached(layout),
        *(_ends(layout) if params.pattern is StreetPattern.LOOP else []),
    ]


def _count(layout: Layout, params: CogenerateParams) -> list[Issue]:
    wanted, found = params.parcels, layout.mesh.n_faces
    if wanted is None or abs(found - wanted) <= COUNT_TOLERANCE * wanted:
        return []
    if found > wanted:
        reason = f"the land has {len(np.unique(layout.face_part))} parts, each at least a parcel."
    elif layout.face_locked.any():
        reason = "parcels that are kept as they are have their share of the land."
    else:
        reason = "some parcels could not be cut any further."
    return [
        Issue(
            code="count_missed",
            message=f"{found} parcels instead of {wanted}: {reason}",
            value=float(found),
            limit=float(wanted),
        )
    ]


def parcel_issues(
    layout: Layout,
    code: str,
    message: str,
    chosen: np.ndarray,
    value: FloatArray,
    limit: FloatArray,
) -> list[Issue]:
    """One issue for each chosen parcel; `{value}` and `{limit}` are filled in."""
    faces = np.flatnonzero(chosen).tolist()
    if not faces:
        return []
    polygons = layout.mesh.face_polygons()
    return [
        Issue(
            code=code,
            message=message.format(value=float(value[f]), limit=float(limit[f])),
            part=int(layout.face_part[f]),
            parcel_id=f + 1,
            value=float(value[f]),
            limit=float(limit[f]),
            geometry=polygons[f],
        )
        for f in faces
    ]


def _sizes(layout: Layout) -> list[Issue]:
    """Parts and blocks too small for a parcel, and parcels that stayed very large."""
    area, which = layout.mesh.face_area, ""
    if layout.street_rules.net_min_area:
        area, which = lay_out_rights_of_way(layout).net_area, " net"
    least = np.full(len(area), layout.min_area)
    most = VERY_LARGE * least
    small = (area < least * (1.0 - AREA_ROUNDING)) & ~layout.face_locked
    whole = layout.face_alone
    return [
        *parcel_issues(
            layout,
            "part_below_min_area",
            f"This part of the land ({{value:.0f}} m²{which}) is smaller than the smallest parcel "
            "allowed ({limit:.0f} m²) and stays one parcel.",
            small & whole,
            area,
            least,
        ),
        *parcel_issues(
            layout,
            "block_below_min_area",
            "What given streets, locked land and the rim enclose here ({value:.0f} m²) is smaller "
            "than the smallest parcel allowed ({limit:.0f} m²) and stays one parcel.",
            small & ~whole,
            area,
            least,
        ),
        *parcel_issues(
            layout,
            "parcel_not_cut",
            f"No cut of this parcel ({{value:.0f}} m²{which}) leaves two simple halves that are "
            "large enough; it is larger than {limit:.0f} m².",
            (area > most) & ~layout.face_locked,
            area,
            most,
        ),
    ]


def right_of_way_findings(layout: Layout) -> list[Issue]:
    """List parcels of which streets leave nothing, and those of which they cut pieces off."""
    if not layout.street_rules.laid_out:
        return []
    streets, area = lay_out_rights_of_way(layout), layout.mesh.face_area
    swallowed = shapely.is_missing(streets.net)
    return parcel_issues(
        layout,
        SWALLOWED,
        "The right-of-way leaves {value:.1f} m² of this parcel, less than {limit:.1f} m²: it has "
        "no net parcel. Give narrower streets or a larger smallest area.",
        swallowed,
        streets.cut_off,
        SWALLOWED_SHARE * area,
    ) + parcel_issues(
        layout,
        CUT_OFF,
        "The right-of-way cuts {value:.1f} m² off this parcel, more than {limit:.1f} m²: they "
        "became right-of-way.",
        ~swallowed & (streets.cut_off > CUT_OFF_M2),
        streets.cut_off,
        np.full(len(area), CUT_OFF_M2),
    )


def _unreached(layout: Layout) -> list[Issue]:
    """Parcels with too little frontage, which happens where the rim is no street."""
    needed = reached_frontage(layout.mesh.face_area)
    unreached = np.zeros(len(needed), dtype=bool)
    unreached[unreached_parcels_of(layout)] = True
    whole = layout.face_alone
    return [
        *parcel_issues(
            layout,
            "part_not_reached",
            "This part of the land is one parcel and its rim is no street: no street reaches it.",
            unreached & whole,
            layout.frontage,
            needed,
        ),
        *parcel_issues(
            layout,
            "parcel_not_reached",
            "No street can reach this parcel without running along a rim that is no street: its "
            "frontage is {value:.1f} m, {limit:.1f} m are needed.",
            unreached & ~whole,
            layout.frontage,
            needed,
        ),
    ]


def _ends(layout: Layout) -> list[Issue]:
    """Dead ends of the loop pattern: where the rim is no street, at holes, of given streets."""
    mesh = layout.mesh
    at = mesh.origin[np.repeat(layout.edge_street, 2)]
    ends = (np.bincount(at, minlength=mesh.n_vertices) == 1) & ~layout.vertex_entry
    given = mesh.vertices_of(layout.edge_fixed != NOT_FIXED)
    at_hole = mesh.vertices_of(np.isin(layout.edge_kind, (EdgeKind.HOLE, EdgeKind.OBSTACLE)))
    reasons = np.select(
        [given, at_hole],
        ["is that of a given street and stays.", "could not be led on past the hole or obstacle."],
        "could not be led on without a street on the rim.",
    )
    return [
        Issue(
            code="fixed_dead_end" if given[v] else "dead_end",
            message=f"This street end {reasons[v]}",
            geometry=shapely.Point(mesh.xy[v]),
        )
        for v in np.flatnonzero(ends).tolist()
    ]
