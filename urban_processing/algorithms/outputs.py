"""Outputs that several algorithms have."""

from __future__ import annotations

from urban_processing.algorithms.spec import Output, OutputKind

LAYOUT_OUTPUTS = (
    Output(
        name="output",
        kind=OutputKind.LAYOUT,
        label="Layout file",
        help="The layout: a GeoPackage with parcels, streets, junctions, metrics and styles.",
        required=True,
    ),
    Output(name="plot", kind=OutputKind.MAP, label="Map", help="A map of the layout.", of="output"),
    Output(
        name="export",
        kind=OutputKind.EXPORT,
        label="Plain files",
        help="A folder for one plain file of each layer.",
        of="output",
    ),
)
"""A layout and the views of it."""
