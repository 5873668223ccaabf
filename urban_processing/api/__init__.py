"""The library in one call each: land to layouts, streets to blocks, blocks to parcels, figures."""

from urban_processing.api.blocks import calibrate, find_blocks, subdivide, transfer
from urban_processing.api.layouts import cogenerate, optimize, resume
from urban_processing.api.measuring import compare, measure
from urban_processing.api.steering import steer

__all__ = [
    "calibrate",
    "cogenerate",
    "compare",
    "find_blocks",
    "measure",
    "optimize",
    "resume",
    "steer",
    "subdivide",
    "transfer",
]
