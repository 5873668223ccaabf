"""The layers of fabrics that were compared."""

from __future__ import annotations

from urban_processing.schema import PROVENANCE, Column, ColumnType, GeometryType, Layer


def _text(name: str, alias: str, description: str, *, nullable: bool = False) -> Column:
    return Column(name, ColumnType.TEXT, "", description, alias, nullable)


def _number(name: str, alias: str, description: str) -> Column:
    return Column(name, ColumnType.REAL, "", description, alias, nullable=True)


def _count(name: str, alias: str, description: str) -> Column:
    return Column(name, ColumnType.INTEGER, "", description, alias)


_SIDE = _text("side", "Layout", "Name of the layout that is compared.")
_REFERENCE = _text("reference", "Reference", "Name of the layout that it is compared with.")

COMPARISON = Layer(
    "comparison",
    GeometryType.NONE,
    (
        _text("metric", "Metric", "Name of the metric."),
        _text("unit", "Unit", "Unit of the values; nothing for numbers and ratios."),
        _SIDE,
        _number("value", "Value", "Value of the layout; empty where it is not defined."),
        _REFERENCE,
        _number("reference_value", "Reference value", "Value of the reference."),
        _number("difference", "Difference", "Value of the layout less that of the reference."),
        _text(
            "better",
            "Better",
            "Name of the layout whose value is better than that of all others; empty if nobody's "
            "is, or if it cannot be said which values are better.",
            nullable=True,
        ),
    ),
    "Comparison of metrics",
    shown=True,
)
"""One row for each metric and each layout but the reference."""

DISTANCES = Layer(
    "distances",
    GeometryType.NONE,
    (
        _text("distribution", "Distribution", "Name of the distribution."),
        _text(
            "unit",
            "Unit",
            "Unit of medians and Wasserstein distances; nothing for numbers and ratios.",
        ),
        _SIDE,
        _REFERENCE,
        _count("n_side", "Values", "Number of values of the layout."),
        _count("n_reference", "Reference values", "Number of values of the reference."),
        _number("median_side", "Median", "Median of the layout; empty for bearings."),
        _number("median_reference", "Reference median", "Median of the reference."),
        _number(
            "wasserstein",
            "Wasserstein distance",
            "Wasserstein distance of order 1, on a circle for bearings: how far values are to be "
            "moved in the mean to make one distribution the other.",
        ),
        _number(
            "wasserstein_low",
            "Wasserstein, from",
            "Lower end of its confidence interval (bootstrap).",
        ),
        _number(
            "wasserstein_high",
            "Wasserstein, to",
            "Upper end of its confidence interval (bootstrap).",
        ),
        _number(
            "wasserstein_noise",
            "Wasserstein, by chance",
            "Wasserstein distance that two samples of these sizes have by chance, both drawn from "
            "all values together; exceeded in half of (1 - confidence) of cases.",
        ),
        _number(
            "ks",
            "Kolmogorov-Smirnov",
            "Largest difference of the distribution functions, between 0 and 1; for bearings "
            "Kuiper's statistic, the largest difference above plus the largest below.",
        ),
        _number(
            "ks_low",
            "Kolmogorov-Smirnov, from",
            "Lower end of its confidence interval (bootstrap).",
        ),
        _number(
            "ks_high", "Kolmogorov-Smirnov, to", "Upper end of its confidence interval (bootstrap)."
        ),
        _number(
            "ks_noise",
            "Kolmogorov-Smirnov, by chance",
            "The same statistic that two such samples have by chance.",
        ),
        Column(
            "more_than_noise",
            ColumnType.BOOLEAN,
            "",
            "Whether one of both distances is larger than chance alone makes it.",
            "More than chance",
        ),
    ),
    "Distances of distributions",
    shown=True,
)
"""One row for each distribution and each layout but the reference."""

COMPARED: tuple[Layer, ...] = (COMPARISON, DISTANCES, PROVENANCE)
"""Layers that a comparison has."""

COMPARISON_KIND = "comparison"
