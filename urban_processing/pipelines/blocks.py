"""Streets to blocks."""

from __future__ import annotations

import time

from urban_processing.blocks.find import find_blocks
from urban_processing.blocks.layers import block_layers
from urban_processing.blocks.streets import StreetsOnLand
from urban_processing.params.blocks import BlocksParams
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.tables import LayerSet
from urban_processing.version import __version__


def blocks(ground: StreetsOnLand, params: BlocksParams, progress: Progress = SILENT) -> LayerSet:
    """Find the blocks between streets, net of rights-of-way.

    Parameters
    ----------
    ground
        Centrelines, and the land that blocks are cut at if any.
    params
        Widths, tolerances and radii.
    progress
        Told when the blocks are found.

    Returns
    -------
    LayerSet
        Blocks, their edges with the streets along them, right-of-way and issues.

    Raises
    ------
    BoundaryError
        If the streets enclose nothing, or leave no block.
    """
    started = time.perf_counter()
    progress.update(0.05, "Finding blocks")
    found = find_blocks(ground.streets, params, land=ground.land)
    progress.update(0.9, "Measuring blocks")
    step = Step(
        algorithm="blocks",
        parameters=params.as_dict(),
        seed=0,
        version=__version__,
        input_sha256=ground.streets.input_sha256,
        seconds=time.perf_counter() - started,
        results={"blocks": float(len(found.blocks))},
    )
    return block_layers(found, history=(step,))
