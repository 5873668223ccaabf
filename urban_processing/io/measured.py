"""What measuring and comparing give, as frames."""

from __future__ import annotations

import difflib
from dataclasses import dataclass
from os import PathLike
from pathlib import Path

from urban_processing.io.frames import GeoLayers
from urban_processing.metrics.comparison_tables import comparison_set
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.pipelines.measure import ComparedMeasures


@dataclass(frozen=True, eq=False, repr=False)
class GeoFabric(GeoLayers):
    """A measured fabric: its layers as frames by their names, its metrics and its report.

    Parameters
    ----------
    made
        The layers as plain tables.
    measures
        The measures of the fabric.

    Examples
    --------
    >>> import shapely
    >>> import urban_processing as up
    >>> found = up.measure(parcels=[shapely.box(0, 0, 30, 40), shapely.box(30, 0, 60, 40)])
    >>> found.metric("area_mean_m2")
    1200.0
    >>> found.parcels.area_m2.tolist()
    [1200.0, 1200.0]
    """

    measures: FabricMeasures

    @classmethod
    def of(cls, measures: FabricMeasures) -> GeoFabric:
        """Return the frames of what was measured."""
        return cls(fabric_layers(measures), measures)

    def metric(self, name: str, *, part: int | None = None) -> float:
        """Return one metric of the whole, or of a part; NaN where it is not defined.

        `metrics` is the table of all of them.

        Raises
        ------
        KeyError
            If there is none of that name.
        """
        found = {m.metric: m.value for m in self.measures.metrics if m.part == part}
        if name not in found:
            scope = "" if part is None else f" of part {part}"
            near = difflib.get_close_matches(name, found, n=3)
            hint = f" Did you mean {' or '.join(near)}?" if near else ""
            raise KeyError(f"There is no metric {name!r}{scope}.{hint}")
        return found[name]

    def report(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the report; see `urban_processing.report.html.write`."""
        from urban_processing.report.html import write
        from urban_processing.report.sides import report_on

        return write(report_on([self.measures]), Path(path), overwrite=overwrite)


@dataclass(frozen=True, eq=False, repr=False)
class GeoComparison(GeoLayers):
    """A comparison: the table of metrics and the distances of distributions as frames.

    Parameters
    ----------
    made
        The layers as plain tables.
    compared
        The sides that were measured, and the statistics.
    """

    compared: ComparedMeasures

    @classmethod
    def of(cls, compared: ComparedMeasures) -> GeoComparison:
        """Return the frames of what was compared."""
        return cls(comparison_set(compared.comparison, history=compared.history), compared)

    @property
    def sides(self) -> dict[str, GeoFabric]:
        """The sides by their names."""
        return {known.fabric.name: GeoFabric.of(known) for known in self.compared.measured}

    def report(self, path: str | PathLike[str], *, overwrite: bool = False) -> Path:
        """Write the report; see `urban_processing.report.html.write`."""
        from urban_processing.report.html import write
        from urban_processing.report.sides import report_on

        made = report_on(self.compared.measured, self.compared.comparison)
        return write(made, Path(path), overwrite=overwrite)
