"""Outputs that several algorithms have."""

from __future__ import annotations

from urban_processing.algorithms.spec import Output, OutputKind
from urban_processing.schema import LAID_OUT, Layer


def _with_views(whole: Output, what: str) -> tuple[Output, ...]:
    return (
        whole,
        Output(
            name="plot", kind=OutputKind.MAP, label="Map", help=f"A map of {what}.", of=whole.name
        ),
        Output(
            name="export",
            kind=OutputKind.EXPORT,
            label="Plain files",
            help="A folder for plain files.",
            of=whole.name,
        ),
    )


LAYOUT_OUTPUTS = _with_views(
    Output(
        name="output",
        kind=OutputKind.LAYOUT,
        label="Layout file",
        help="The layout: a GeoPackage with parcels, streets, junctions, metrics and styles.",
        required=True,
        layers=LAID_OUT,
    ),
    "the layout",
)
"""A layout and the views of it."""


def layer_outputs(
    what: str, *, label: str, help: str, layers: tuple[Layer, ...]
) -> tuple[Output, ...]:
    """Return a set of layers and the views of it; `what` names it in a sentence."""
    whole = Output(
        name="output",
        kind=OutputKind.LAYERS,
        label=label,
        help=help,
        required=True,
        layers=layers,
    )
    return _with_views(whole, what)
