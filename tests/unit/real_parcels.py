"""Parcels of real towns, where they are at hand."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import numpy.typing as npt
import pyogrio
import pytest
import shapely

from urban_processing.site import GRID

_BESIDE = Path(__file__).resolve().parents[3] / "shared/data"
_DATA = Path(os.environ.get("URBAN_DATA", _BESIDE))

BUBENEC = _DATA / "redistributable/parcels/bubenec.gpkg"


def real_parcels(name: str) -> npt.NDArray[np.object_]:
    """Single valid polygons in local metres; skips the test where they are not there."""
    path = _DATA / f"test_only/parcels/{name}.gpkg"
    if not path.exists():
        pytest.skip(f"{path} is not there")
    _, _, wkb, _ = pyogrio.raw.read(path, layer="parcels" if "santa" in name else None, columns=[])
    shapes = shapely.make_valid(shapely.force_2d(shapely.from_wkb(wkb)))
    origin = np.floor(shapely.total_bounds(shapes)[:2])
    local = shapely.set_precision(shapely.transform(shapes, lambda xy: xy - origin), GRID)
    parts = shapely.get_parts(local)
    return np.asarray(parts[(shapely.get_type_id(parts) == 3) & (shapely.area(parts) > 1)])


def bubenec() -> Path:
    """The file of Bubeneč, with layers `plots` and `streets`."""
    if not BUBENEC.exists():
        pytest.skip(f"{BUBENEC} is not there")
    return BUBENEC
