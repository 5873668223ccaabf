"""What an edit brought along in streets, in words."""

from __future__ import annotations

from urban_processing.layout import Layout

LEAST_M = 0.5
"""Shorter streets are not worth a word."""


def streets_laid(before: Layout, after: Layout) -> str:
    """Return a clause about the streets that were laid and taken away; nothing for none.

    The two layouts differ in their streets alone.
    """
    new, gone = (
        float(before.mesh.edge_length[on & ~was].sum())
        for on, was in (
            (after.edge_street, before.edge_street),
            (before.edge_street, after.edge_street),
        )
    )
    said = [
        f"{length:,.0f} m of street {what}"
        for length, what in ((new, "were laid"), (gone, "were taken back"))
        if length >= LEAST_M
    ]
    return "; " + " and ".join(said) if said else ""
