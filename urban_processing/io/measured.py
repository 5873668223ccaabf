"""What measuring and comparing give, as frames."""

from __future__ import annotations

from os import PathLike
from pathlib import Path

from urban_processing.io.frames import GeoLayers
from urban_processing.metrics.comparison_tables import comparison_set
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.pipelines.measure import ComparedMeasures


class GeoFabric(GeoLayers):
    """A measured fabric: its layers as frames by their names, its metrics and its report.

    Parameters
    ----------
    measures
        The measures of a fabric.
    """

    measures: FabricMeasures

    def __init__(self, measures: FabricMeasures) -> None:
        super().__init__(fabric_layers(measures))
        object.__setattr__(self, "measures", measures)

    def metric(self, name: str) -> float:
        """Return a metric of the whole; `KeyError` if there is none of that name."""
        return self.measures.values[name]

    def report(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the report as one HTML file; see `urban_processing.report.html`."""
        from urban_processing.report.html import write_report
        from urban_processing.report.sides import report_on

        return write_report(report_on([self.measures]), Path(path), overwrite=overwrite)


class GeoComparison(GeoLayers):
    """A comparison: the table of metrics and the distances of distributions as frames.

    Parameters
    ----------
    compared
        The sides that were measured, and the statistics.
    """

    compared: ComparedMeasures

    def __init__(self, compared: ComparedMeasures) -> None:
        super().__init__(comparison_set(compared.comparison, history=compared.history))
        object.__setattr__(self, "compared", compared)

    @property
    def sides(self) -> dict[str, GeoFabric]:
        """The sides by their names."""
        return {known.fabric.name: GeoFabric(known) for known in self.compared.measured}

    def report(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the report as one HTML file; see `urban_processing.report.html`."""
        from urban_processing.report.html import write_report
        from urban_processing.report.sides import report_on

        made = report_on(self.compared.measured, self.compared.comparison)
        return write_report(made, Path(path), overwrite=overwrite)
