"""What measuring and comparing give, as frames."""

from __future__ import annotations

from collections.abc import Sequence
from os import PathLike
from pathlib import Path
from typing import Any

from urban_processing.io.frames import GeoLayers
from urban_processing.metrics.comparison import Comparison
from urban_processing.metrics.comparison_layers import comparison_layers
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.measures import FabricMeasures


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
    measured
        Measures of the sides.
    statistics
        The comparison.
    """

    measured: Sequence[FabricMeasures]
    statistics: Comparison

    def __init__(self, measured: Sequence[FabricMeasures], statistics: Comparison) -> None:
        super().__init__(comparison_layers(statistics, measured))
        object.__setattr__(self, "measured", measured)
        object.__setattr__(self, "statistics", statistics)

    @property
    def sides(self) -> dict[str, GeoFabric]:
        """The sides by their names."""
        return {known.fabric.name: GeoFabric(known) for known in self.measured}

    def report(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the report as one HTML file; see `urban_processing.report.html`."""
        from urban_processing.report.html import write_report
        from urban_processing.report.sides import report_on

        made: Any = report_on(self.measured, self.statistics)
        return write_report(made, Path(path), overwrite=overwrite)
