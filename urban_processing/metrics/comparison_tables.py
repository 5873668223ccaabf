"""A comparison as tables."""

from __future__ import annotations

from urban_processing.fabric.comparison_layers import COMPARISON, COMPARISON_KIND, DISTANCES
from urban_processing.metrics.comparison import Comparison
from urban_processing.metrics.comparison_words import words
from urban_processing.provenance import Step
from urban_processing.schema import Layer
from urban_processing.site import Frame
from urban_processing.tables import LayerSet, Table, make_table, objects


def comparison_set(comparison: Comparison, *, history: tuple[Step, ...] = ()) -> LayerSet:
    """Return a comparison as layers, none of which has geometries, with a summary."""
    return LayerSet(
        kind=COMPARISON_KIND,
        tables=comparison_layers(comparison),
        frame=Frame(),
        history=history,
        summary=words(comparison),
    )


def comparison_layers(comparison: Comparison) -> dict[Layer, Table]:
    """Return the layers of a comparison, in the order in which a file lists them."""
    return {COMPARISON: _comparison_table(comparison), DISTANCES: _distance_table(comparison)}


def _comparison_table(comparison: Comparison) -> Table:
    reference, names = comparison.reference_number, comparison.names
    pairs = [(r, k) for r in comparison.rows for k in range(len(names)) if k != reference]
    return make_table(
        COMPARISON,
        {
            "metric": [r.name for r, _ in pairs],
            "unit": [r.unit for r, _ in pairs],
            "side": [names[k] for _, k in pairs],
            "value": [r.values[k] for r, k in pairs],
            "reference": [comparison.reference] * len(pairs),
            "reference_value": [r.values[reference] for r, _ in pairs],
            "difference": [r.differences[k] for r, k in pairs],
            "better": objects([None if r.better is None else names[r.better] for r, _ in pairs]),
        },
    )


def _distance_table(comparison: Comparison) -> Table:
    found = comparison.distances
    values = {
        name: [getattr(d, name) for d in found]
        for name in DISTANCES.column_names
        if name not in ("distribution", "unit")
    }
    return make_table(
        DISTANCES,
        {
            "distribution": [d.distribution.name for d in found],
            "unit": [d.distribution.unit for d in found],
            **values,
        },
    )
