"""Reports on what was measured or compared."""

from __future__ import annotations

from collections.abc import Sequence

from urban_processing.metrics.certificate import certificate
from urban_processing.metrics.comparison import Comparison
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.metrics.samples import samples
from urban_processing.report.html.model import Report, ReportSide, report_side


def report_on(
    measured: Sequence[FabricMeasures], comparison: Comparison | None = None, *, title: str = ""
) -> Report:
    """Return the report on fabrics, with the certificates of those that are layouts.

    Parameters
    ----------
    measured
        Measures of one fabric, or of those that were compared, under different names.
    comparison
        How several differ.
    title
        Heading; by default made of the names of the fabrics.
    """
    return Report(tuple(_side(known) for known in measured), comparison, title)


def _side(known: FabricMeasures) -> ReportSide:
    layout = known.fabric.layout
    return report_side(
        known,
        name=known.fabric.name or "layout",
        samples=samples(known),
        certificate=None if layout is None else certificate(layout),
    )
