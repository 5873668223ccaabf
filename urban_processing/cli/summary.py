"""The few figures that a run ends with."""

from __future__ import annotations

from collections import Counter
from typing import TYPE_CHECKING, Any

from urban_processing.algorithms.spec import OutputKind

if TYPE_CHECKING:
    from urban_processing.io.frames import GeoLayout


def summary(kind: OutputKind, made: Any) -> list[tuple[str, str]]:
    """Return names and values that sum up an output."""
    if kind is not OutputKind.LAYOUT:
        return []
    from urban_processing.io.frames import GeoLayout

    layout = GeoLayout(made)
    rows = [
        ("land", _land(layout)),
        ("parcels", _parcels(layout)),
        ("streets", _streets(layout)),
        ("certificate", _certificate(layout)),
    ]
    codes = Counter(issue.code for issue in layout.layout.issues)
    if codes:
        counted = ", ".join(f"{n} {code}" for code, n in sorted(codes.items()))
        rows.append(("issues", f"{counted} (see the layer issues)"))
    return rows


def promises_broken(kind: OutputKind, made: Any) -> list[str]:
    """Return what an output promises and does not hold, one sentence each."""
    if kind is not OutputKind.LAYOUT:
        return []
    from urban_processing.metrics import certificate

    return [check.message for check in certificate(made).failures]


def duration(seconds: float) -> str:
    """Return a time as one would say it.

    >>> [duration(s) for s in (0.2, 3.21, 75, 8000)]
    ['0.2 s', '3.2 s', '1 min 15 s', '2 h 13 min']
    """
    if seconds < 10:
        return f"{max(seconds, 0.1):.1f} s"
    if seconds < 60:
        return f"{seconds:.0f} s"
    whole = round(seconds)
    if whole < 3600:
        return f"{whole // 60} min {whole % 60} s"
    return f"{whole // 3600} h {whole % 3600 // 60} min"


def _land(layout: GeoLayout) -> str:
    area = layout.metric("area_m2")
    size = f"{area / 1e6:,.2f} km²" if area >= 1e6 else f"{area / 1e4:,.2f} ha"
    parts = len(layout.tables["boundary"])
    return size + (f" in {parts} parts" if parts > 1 else "")


def _parcels(layout: GeoLayout) -> str:
    return (
        f"{layout.metric('parcels'):,.0f} of {layout.metric('min_area_m2'):,.0f} m² or more, "
        f"{layout.metric('quads_pct'):.1f} % with four sides, "
        f"mean irregularity {layout.metric('irregularity_mean'):.3f}"
    )


def _streets(layout: GeoLayout) -> str:
    return (
        f"{layout.metric('streets'):,.0f}, {layout.metric('street_length_m') / 1000:,.1f} km, "
        f"{layout.metric('junctions'):,.0f} junctions, {layout.metric('street_ends'):,.0f} ends "
        "(besides the rim)"
    )


def _certificate(layout: GeoLayout) -> str:
    if layout.certificate.holds:
        return "holds: exact partition, every parcel reached, one network in each part"
    failed = "; ".join(check.message for check in layout.certificate.failures)
    return f"does NOT hold: {failed}"
