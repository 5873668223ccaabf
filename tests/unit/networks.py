"""Street networks of five real cities, where the data lies beside the checkout."""

from __future__ import annotations

import os
from functools import lru_cache
from pathlib import Path

import numpy as np
import pyogrio
import pytest
import shapely

from urban_processing.blocks.streets import StreetLines, street_lines
from urban_processing.site import snap_to_grid

REACH = {"aleppo": 900, "auckland": 1200, "slc": 1200, "wuhan": 1800, "liechtenstein": 5000}
"""Metres around the middle that tests look at."""

CITIES = tuple(REACH)

_BESIDE = Path(__file__).resolve().parents[3] / "shared/data"
FOLDER = Path(os.environ.get("URBAN_DATA", _BESIDE)) / "redistributable/networks"


def network_file(city: str) -> Path:
    """File of a city's streets; the test is skipped where it is not there."""
    path = FOLDER / f"{city}.gpkg"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    return path


@lru_cache
def network(city: str) -> StreetLines:
    """Streets around the middle of a city, in local metres: 2 × 2 km, of Liechtenstein more."""
    meta, _, wkb, values = pyogrio.raw.read(network_file(city), layer="edges", force_2d=True)
    lines = shapely.from_wkb(wkb)
    west, south, east, north = shapely.total_bounds(lines)
    middle = shapely.Point((west + east) / 2, (south + north) / 2)
    near = shapely.dwithin(lines, middle, REACH[city])
    lines, origin = lines[near], np.floor([west, south])
    lines = shapely.transform(lines, lambda xy: snap_to_grid(xy - origin))
    classes = dict(zip(meta["fields"].tolist(), values, strict=True))["highway"]
    return street_lines(lines, street_class=[str(c or "") for c in classes[near]])
