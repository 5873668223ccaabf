"""Inputs that several algorithms have."""

from __future__ import annotations

from urban_processing.algorithms.spec import Input, InputKind
from urban_processing.params.resume import PARCEL_LAYER

GROUND = (
    Input(
        name="corners",
        kind=InputKind.CORNER_POINTS,
        label="Corners of the land",
        help="Points near the boundary that are to count as corners of a freeform land; "
        "by default corners are found by angle.",
        required=False,
    ),
    Input(
        name="streets",
        kind=InputKind.FIXED_STREETS,
        label="Given streets",
        help="Lines of streets that are part of the network from the start and stay where they "
        "are; their class and width are kept (columns class, width_m).",
        required=False,
    ),
    Input(
        name="obstacles",
        kind=InputKind.OBSTACLES,
        label="Obstacles",
        help="Polygons that no cut and no street crosses: lakes, parks, protected land.",
        required=False,
    ),
    Input(
        name="locked",
        kind=InputKind.LOCKED_LAND,
        label="Locked land",
        help="Polygons that stay one parcel each and are reached by street, such as an "
        "estate that is there already; their use is kept (column land_use).",
        required=False,
    ),
    Input(
        name="rim_lines",
        kind=InputKind.RIM_LINES,
        label="Rim lines",
        help="Lines along the boundary that say which part of the rim is street, or is not; "
        "see the parameter for streets on the rim.",
        required=False,
    ),
    Input(
        name="entries",
        kind=InputKind.ENTRY_POINTS,
        label="Entries",
        help="Points near the boundary where the network meets the outside; where the rim is "
        "no street and there is none, the best place is chosen.",
        required=False,
    ),
)
"""What may be given besides land, and becomes a part of its `Site`."""

LAYERS_OF_LAYOUT = (
    Input(
        name=PARCEL_LAYER,
        kind=InputKind.PARCEL_LAYER,
        label="Parcels",
        help="Instead of a layout file: polygons of parcels.",
        required=False,
    ),
    Input(
        name="street_layer",
        kind=InputKind.STREET_LAYER,
        label="Streets",
        help="With the parcels: centrelines of streets, along parcel boundaries.",
        required=False,
    ),
)
"""Two layers that may be given in place of a layout file."""
