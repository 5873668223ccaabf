"""Blocks to parcels (Vanegas 2012, sections 3 and 4)."""

from __future__ import annotations

import dataclasses
import time
from concurrent.futures import Executor
from functools import partial

import numpy as np

from urban_processing.blocks.model import Blocks
from urban_processing.hashing import splitmix64
from urban_processing.mesh.planar import IntArray
from urban_processing.metrics.subdivisions import MeasuredSubdivision
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.parcelling.divide import divide
from urban_processing.parcelling.ground import Ground, Pieces, join_parts
from urban_processing.parcelling.reuse import Previous
from urban_processing.parcelling.rules import BlockRules, resolve_rules, rule_values
from urban_processing.parcelling.subdivision import Subdivision
from urban_processing.persistence.keys import block_keys
from urban_processing.pipelines.inheritance import inherit, unchanged, with_numbers
from urban_processing.pipelines.parcel_bounds import bound_findings
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.version import __version__

AT_ONCE = 256
"""Number of blocks that are divided in one batch; processes take a batch at a time."""


def subdivide(
    blocks: Blocks,
    params: SubdivideParams,
    progress: Progress = SILENT,
    *,
    previous: Previous | None = None,
    executor: Executor | None = None,
) -> Subdivision:
    """Divide each block into parcels.

    Parameters
    ----------
    blocks
        The blocks, with columns that override parameters where they have them.
    params
        Strategy, bounds and shape of parcels.
    progress
        Told of every batch of blocks; may cancel between them.
    previous
        A subdivision made before: blocks whose contour, streets and parameters are as they were
        keep its parcels, and the others keep the numbers of parcels as far as they are the same
        (Vanegas 2012, section 5). What was set for single blocks holds on for what became of them.
    executor
        Runs batches side by side, such as a process pool; the result is the same without.

    Raises
    ------
    BoundaryError
        If `previous` is in another CRS.
    """
    started = time.perf_counter()
    if previous is not None:
        blocks = inherit(previous.blocks, blocks)
    wanted = resolve_rules(params, len(blocks), blocks.columns)
    key = block_keys(blocks, rule_values(wanted))
    ground = ground_of_blocks(blocks)
    rows, parts = np.arange(len(blocks)), []
    if previous is not None:
        kept, pieces = unchanged(previous, key, ground, blocks.frame)
        rows, parts = np.setdiff1d(rows, kept), [(kept, pieces)] if len(kept) else []
    parts += _divided(ground, wanted, rows, params, progress, executor)
    pieces = join_parts(parts, ground)
    made = Subdivision(
        blocks=blocks,
        wanted=wanted,
        block_key=key,
        pieces=pieces,
        parcel_id=np.arange(1, pieces.n_faces + 1),
        issues=blocks.issues,
        changes=None,
        history=(),
    )
    if previous is not None:
        made = with_numbers(previous, made)
    step = Step(
        algorithm="subdivide",
        parameters=params.as_dict(),
        seed=params.seed,
        version=__version__,
        input_sha256=blocks.input_sha256,
        seconds=time.perf_counter() - started,
    )
    found = bound_findings(MeasuredSubdivision(made))
    return dataclasses.replace(made, issues=(*made.issues, *found), history=(step,))


def ground_of_blocks(blocks: Blocks) -> Ground:
    """Return blocks as ground; the seed of each comes from its number alone."""
    return Ground(
        rings=blocks.rings,
        access=blocks.edge_access,
        width=blocks.edge_width,
        street=blocks.edge_street,
        # far from the ranks that children are told apart by
        lineage=splitmix64(blocks.block_id.astype(np.uint64) + np.uint64(2**32)),
    )


def _divided(
    ground: Ground,
    wanted: BlockRules,
    rows: IntArray,
    params: SubdivideParams,
    progress: Progress,
    executor: Executor | None,
) -> list[tuple[IntArray, Pieces]]:
    """Blocks batch by batch, and the pieces of each batch."""
    if not len(rows):
        return []
    batches = np.array_split(rows, -(-len(rows) // AT_ONCE))
    run = partial(divide, seed=params.seed)
    grounds = map(ground.of, batches)
    rules = map(wanted.of, batches)
    work = map(run, grounds, rules) if executor is None else executor.map(run, grounds, rules)
    parts: list[tuple[IntArray, Pieces]] = []
    done = 0
    for batch, pieces in zip(batches, work, strict=True):
        parts.append((batch, pieces))
        done += len(batch)
        progress.update(done / len(rows), f"{done:,} of {len(rows):,} blocks")
    return parts
