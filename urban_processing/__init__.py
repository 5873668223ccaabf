"""Parcels and streets, generated together on real land boundaries.

>>> import urban_processing as up
>>> layout = up.cogenerate("sample_data/wandsworth.gpkg", parcels=500)  # doctest: +SKIP
>>> layout.save("layout.gpkg")  # doctest: +SKIP

Names are loaded when they are first used, so that importing the package is quick.
"""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

from urban_processing.version import __version__

if TYPE_CHECKING:
    from urban_processing import errors
    from urban_processing.api import (
        calibrate,
        cogenerate,
        compare,
        find_blocks,
        measure,
        optimize,
        resume,
        steer,
        subdivide,
        transfer,
    )
    from urban_processing.io.edits import read_edited
    from urban_processing.io.files import read_layout
    from urban_processing.io.frames import GeoLayers, GeoLayout
    from urban_processing.io.measured import GeoComparison, GeoFabric
    from urban_processing.io.sessions import GeoSession
    from urban_processing.params.blocks import BlocksParams
    from urban_processing.params.calibrate import CalibrateParams
    from urban_processing.params.cogenerate import CogenerateParams, StreetPattern
    from urban_processing.params.compare import CompareParams
    from urban_processing.params.measure import MeasureParams
    from urban_processing.params.optimize import OptimizeParams
    from urban_processing.params.resume import ResumeParams
    from urban_processing.params.rules import Preset
    from urban_processing.params.subdivide import Strategy, SubdivideParams
    from urban_processing.params.transfer import TransferParams

_HOME = {
    "BlocksParams": "urban_processing.params.blocks",
    "CalibrateParams": "urban_processing.params.calibrate",
    "CogenerateParams": "urban_processing.params.cogenerate",
    "CompareParams": "urban_processing.params.compare",
    "GeoComparison": "urban_processing.io.measured",
    "GeoFabric": "urban_processing.io.measured",
    "GeoLayers": "urban_processing.io.frames",
    "GeoLayout": "urban_processing.io.frames",
    "GeoSession": "urban_processing.io.sessions",
    "MeasureParams": "urban_processing.params.measure",
    "OptimizeParams": "urban_processing.params.optimize",
    "Preset": "urban_processing.params.rules",
    "ResumeParams": "urban_processing.params.resume",
    "Strategy": "urban_processing.params.subdivide",
    "StreetPattern": "urban_processing.params.cogenerate",
    "SubdivideParams": "urban_processing.params.subdivide",
    "TransferParams": "urban_processing.params.transfer",
    "calibrate": "urban_processing.api",
    "cogenerate": "urban_processing.api",
    "compare": "urban_processing.api",
    "find_blocks": "urban_processing.api",
    "measure": "urban_processing.api",
    "optimize": "urban_processing.api",
    "read_edited": "urban_processing.io.edits",
    "read_layout": "urban_processing.io.files",
    "resume": "urban_processing.api",
    "steer": "urban_processing.api",
    "subdivide": "urban_processing.api",
    "transfer": "urban_processing.api",
}

__all__ = [
    "BlocksParams",
    "CalibrateParams",
    "CogenerateParams",
    "CompareParams",
    "GeoComparison",
    "GeoFabric",
    "GeoLayers",
    "GeoLayout",
    "GeoSession",
    "MeasureParams",
    "OptimizeParams",
    "Preset",
    "ResumeParams",
    "Strategy",
    "StreetPattern",
    "SubdivideParams",
    "TransferParams",
    "__version__",
    "calibrate",
    "cogenerate",
    "compare",
    "errors",
    "find_blocks",
    "measure",
    "optimize",
    "read_edited",
    "read_layout",
    "resume",
    "steer",
    "subdivide",
    "transfer",
]


def __getattr__(name: str) -> Any:
    """Load a public name from its home on first use."""
    if name == "errors":
        return importlib.import_module("urban_processing.errors")
    if name not in _HOME:
        raise AttributeError(f"module 'urban_processing' has no attribute {name!r}")
    value = getattr(importlib.import_module(_HOME[name]), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    """List the public names."""
    return sorted(__all__)
