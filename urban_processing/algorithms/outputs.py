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
    what: str, *, label: str, help: str, layers: tuple[Layer, ...], required: bool = True
) -> tuple[Output, ...]:
    """Return a set of layers and the views of it; `what` names it in a sentence."""
    whole = Output(
        name="output",
        kind=OutputKind.LAYERS,
        label=label,
        help=help,
        required=required,
        layers=layers,
    )
    return _with_views(whole, what)


def report_outputs(what: str) -> tuple[Output, ...]:
    """Return a report and its figures for machines; `what` says in a sentence what it is on."""
    return (
        Output(
            name="report",
            kind=OutputKind.REPORT,
            label="Report",
            help=f"A page of HTML on {what}: maps, tables, distributions, glossary.",
        ),
        Output(
            name="json",
            kind=OutputKind.JSON,
            label="Figures as JSON",
            help="All figures of the report, for programs.",
            of="report",
        ),
        Output(
            name="csv",
            kind=OutputKind.CSV,
            label="Metrics as CSV",
            help="The table of metrics, for spreadsheets.",
            of="report",
        ),
    )
