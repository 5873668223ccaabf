"""What a report is made of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from urban_processing.metrics.certificate import Certificate
from urban_processing.metrics.comparison import Comparison, Side
from urban_processing.metrics.distributions import DISTRIBUTIONS, DistributionSpec, Sample
from urban_processing.metrics.fabric_layers import fabric_layers
from urban_processing.metrics.histograms import Histogram, histogram
from urban_processing.metrics.measures import FabricMeasures
from urban_processing.metrics.registry import INTERIOR, METRICS, MetricSpec
from urban_processing.provenance import Step, timeless
from urban_processing.report.html.text import listed
from urban_processing.tables import LayerSet, Table


@dataclass(frozen=True, eq=False)
class ReportSide:
    """One layout, or one town, as a report shows it.

    Parameters
    ----------
    name
        Its name: any text.
    layers
        Its layers, as `fabric_layers` gives them: maps are drawn of parcels, streets, blocks,
        boundary and right-of-way, as far as they are there; its history is the provenance.
    values
        Metrics of the whole by name; NaN or left out where undefined.
    samples
        Samples by name of the distribution; left out where there is none.
    certificate
        Its certificate; None where nothing was promised.
    """

    name: str
    layers: LayerSet
    values: Mapping[str, float]
    samples: Mapping[str, Sample]
    certificate: Certificate | None = None

    @property
    def history(self) -> tuple[Step, ...]:
        """Steps that made it, oldest first, without how long they took, which differs each time."""
        return timeless(self.layers.history)

    @property
    def issues(self) -> Table | None:
        """What could not be done, or should be known; None where the layers do not say."""
        return self.table("issues")

    def table(self, name: str) -> Table | None:
        """Return the rows of a layer; None where there are none."""
        table = self.layers.table(name) if name in self.layers.names else None
        return table if table is not None and len(table) else None

    def sample(self, distribution: DistributionSpec) -> Sample:
        """Return the sample of a distribution, without weights if it has none; maybe empty."""
        return Side(self.name, self.values, self.samples).sample(distribution)

    def parts(self) -> dict[int, dict[str, float]]:
        """Return the metrics of each piece of the land; nothing where it is one piece."""
        table = self.table("metrics")
        out: dict[int, dict[str, float]] = {}
        if table is None:
            return out
        of_part = ~np.isnan(table["part"])
        rows = zip(*(table[c][of_part].tolist() for c in ("part", "metric", "value")), strict=True)
        for part, metric, value in rows:
            out.setdefault(int(part), {})[metric] = value
        return out


@dataclass(frozen=True, eq=False)
class Report:
    """One side that was measured, or several that were compared.

    Parameters
    ----------
    sides
        The sides; at least one.
    comparison
        How several sides differ, in the order of `sides`. Its names are those that are shown.
    title
        Heading; by default made of the names of the sides.

    Raises
    ------
    ValueError
        If there is no side, or if the comparison is not of these sides.
    """

    sides: tuple[ReportSide, ...]
    comparison: Comparison | None = None
    title: str = ""

    def __post_init__(self) -> None:
        """Check that sides and comparison belong together."""
        if not self.sides:
            raise ValueError("A report needs a side.")
        if (self.comparison is None) != (len(self.sides) == 1):
            raise ValueError("Several sides need a comparison, and a single one has none.")
        if self.comparison is not None:
            given = [side.name for side in self.sides]
            known = self.comparison.names
            if len(known) != len(given) or not all(map(str.startswith, known, given)):
                raise ValueError(f"The comparison is of {known}, not of {given}.")

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the sides, no two of them alike."""
        if self.comparison is None:
            return (self.sides[0].name,)
        return self.comparison.names

    @property
    def heading(self) -> str:
        """The title, or one made of the names."""
        return self.title or listed(self.names)

    @property
    def reference(self) -> int | None:
        """Number of the side that the others are held against; None of a single one."""
        return None if self.comparison is None else self.comparison.reference_number

    def metric_specs(self) -> dict[str, MetricSpec]:
        """Return what a side has a value of, by name, in the order of the registry."""
        names: dict[str, MetricSpec] = {}
        for spec in METRICS:
            names[spec.name] = spec
            if spec.of_parcels:
                names[spec.name + INTERIOR] = spec
        return names

    def histograms(self) -> tuple[Histogram, ...]:
        """Return each distribution that a side has values of, on bins common to all."""
        out = []
        for spec in DISTRIBUTIONS:
            samples = [side.sample(spec) for side in self.sides]
            if any(len(sample) for sample in samples):
                out.append(histogram(spec, samples))
        return tuple(out)


def report_side(
    known: FabricMeasures,
    *,
    name: str,
    samples: Mapping[str, Sample],
    certificate: Certificate | None = None,
) -> ReportSide:
    """Return a fabric that was measured as a side of a report."""
    return ReportSide(name, fabric_layers(known), known.values, samples, certificate)
