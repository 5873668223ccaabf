"""`MeasuredLayout`: a layout with all that is worked out of it, each thing once."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from urban_processing.layout import Layout
from urban_processing.metrics.certificate import Certificate, certificate
from urban_processing.metrics.tables import layout_tables
from urban_processing.tables import Table, issues_in_words

MOVED_MEAN = "moved_mean_m"
"""Result of every optimization: how far vertices moved."""


@dataclass(frozen=True, eq=False)
class MeasuredLayout:
    """A layout, its tables and its certificate, each worked out when it is first asked for.

    Parameters
    ----------
    layout
        The layout on its mesh, as the engine made it.
    """

    layout: Layout

    @cached_property
    def tables(self) -> dict[str, Table]:
        """All layers as plain arrays, as they are written to files."""
        return layout_tables(self.layout)

    @cached_property
    def certificate(self) -> Certificate:
        """Checks on the geometry that every promise of a layout holds."""
        return certificate(self.layout)

    def metric(self, name: str, *, part: int | None = None) -> float:
        """Return one metric of the whole, or of a part; `KeyError` if there is none."""
        table = self.tables["metrics"]
        of_part = np.isnan(table["part"]) if part is None else table["part"] == part
        found = np.flatnonzero(of_part & (table["metric"] == name))
        if not len(found):
            scope = "" if part is None else f" of part {part}"
            raise KeyError(f"There is no metric {name!r}{scope}.")
        return float(table["value"][found[0]])

    def summary(self) -> list[tuple[str, str]]:
        """Return the few figures that a run ends with: names, and values as text."""
        rows = [
            ("land", self._land()),
            ("parcels", self._parcels()),
            ("streets", self._streets()),
            *([("right-of-way", self._right_of_way())] if "net_parcels" in self.tables else []),
            ("certificate", self._certified()),
        ]
        gained = self.layout.history[-1].results if self.layout.history else {}
        if MOVED_MEAN in gained:  # other steps have other results, or none
            rows.append(("energies", _gains(gained)))
        if self.layout.issues:
            counted = issues_in_words(self.layout.issues)
            rows.append(("issues", f"{counted} (see the layer issues)"))
        return rows

    def _land(self) -> str:
        area = self.metric("area_m2")
        size = f"{area / 1e6:,.2f} km²" if area >= 1e6 else f"{area / 1e4:,.2f} ha"
        parts = len(self.tables["boundary"])
        return size + (f" in {parts} parts" if parts > 1 else "")

    def _parcels(self) -> str:
        net = " net" if self.layout.street_rules.net_min_area else ""
        return (
            f"{self.metric('parcels'):,.0f} of {self.metric('min_area_m2'):,.0f} m²{net} or more, "
            f"{self.metric('quads_pct'):.1f} % with four sides, "
            f"mean irregularity {self.metric('irregularity_mean'):.3f}"
        )

    def _streets(self) -> str:
        return (
            f"{self.metric('streets'):,.0f}, {self.metric('street_length_m') / 1000:,.1f} km, "
            f"{self.metric('junctions'):,.0f} junctions, {self.metric('street_ends'):,.0f} ends "
            "(besides the rim)"
        )

    def _right_of_way(self) -> str:
        return (
            f"{self.metric('right_of_way_pct'):.1f} % of the land, net parcels of "
            f"{self.metric('net_area_mean_m2'):,.0f} m² in the mean, "
            f"{self.metric('net_area_min_m2'):,.0f} m² at least"
        )

    def _certified(self) -> str:
        if self.certificate.holds:
            return "holds: exact partition, every parcel reached, one network in each part"
        return f"does NOT hold: {'; '.join(check.message for check in self.certificate.failures)}"


def _gains(results: Mapping[str, float]) -> str:
    """What an optimization gained: ``regularity 8.71 to 7.04, …; moved 3.1 m on average``."""
    energies = []
    for name, value in results.items():
        energy = name.removeprefix("energy_").removesuffix("_before")
        if name == f"energy_{energy}_before":
            energies.append(f"{energy} {value:.3g} to {results[f'energy_{energy}_after']:.3g}")
    moved = f"moved {results[MOVED_MEAN]:.3g} m on average, {results['moved_max_m']:.3g} m at most"
    return f"{', '.join(energies)}; {moved}"
