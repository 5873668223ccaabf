"""Small things that several tests inside QGIS use."""

from __future__ import annotations

from typing import Any

import shapely

ID = "urban_processing:cogenerate"
TEMPORARY = "TEMPORARY_OUTPUT"


def rows(made: Any) -> list[list[Any]]:
    """Attributes of all features; NULL as None."""
    return [[None if str(v) == "NULL" else v for v in f.attributes()] for f in made.getFeatures()]


def shapes(made: Any) -> list[shapely.Geometry | None]:
    """Geometries of all features."""
    return [
        None if f.geometry().isNull() else shapely.from_wkb(bytes(f.geometry().asWkb()))
        for f in made.getFeatures()
    ]


def square(side: float, x: float = 690_000.0, y: float = 5_700_000.0) -> str:
    """Text of a square of land."""
    corners = [(x, y), (x + side, y), (x + side, y + side), (x, y + side), (x, y)]
    return f"POLYGON (({', '.join(f'{a} {b}' for a, b in corners)}))"
