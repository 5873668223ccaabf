"""The library in one call each: land to layouts, streets to blocks, blocks to parcels."""

from urban_processing.api.blocks import calibrate, find_blocks, subdivide, transfer
from urban_processing.api.layouts import cogenerate, optimize

__all__ = ["calibrate", "cogenerate", "find_blocks", "optimize", "subdivide", "transfer"]
