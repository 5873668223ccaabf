"""Observed parcels to bounds that subdivision makes like parcels with (Vanegas 2012, section 6)."""

from __future__ import annotations

import time

import numpy as np
import shapely

from urban_processing.blocks.model import Blocks, plain_blocks
from urban_processing.calibration.bounds import Statistics, bounds_of, statistics_of
from urban_processing.calibration.grouping import OUTSIDE, block_of_each, blocks_of
from urban_processing.calibration.layers import BOUNDS, CALIBRATION_KIND
from urban_processing.calibration.model import Observed
from urban_processing.calibration.tables import block_layer, parcel_layer
from urban_processing.errors import BoundaryError
from urban_processing.mesh.planar import BoolArray, FloatArray, IntArray
from urban_processing.metrics.parcels import box_sides
from urban_processing.params.base import option_name
from urban_processing.params.calibrate import CalibrateParams
from urban_processing.progress import SILENT, Progress
from urban_processing.provenance import Step
from urban_processing.schema import ISSUES
from urban_processing.site import Issue
from urban_processing.tables import LayerSet, issue_table, issues_in_words
from urban_processing.version import __version__


def calibrate(observed: Observed, params: CalibrateParams, progress: Progress = SILENT) -> LayerSet:
    """Work out, block by block, the bounds that subdivision makes like parcels with.

    1. Parcels that are no lots but strips, such as those of roads, are left out.
    2. Without blocks, parcels that share sides make them. Each parcel belongs to the block that
       it overlaps most.
    3. Mean and standard deviation of the areas and widths of a block's parcels give its bounds
       (`urban_processing.calibration.bounds.bounds_of`). The width of a parcel is the shorter side
       of the smallest rotated rectangle around it, as in the bounds of `subdivide`.

    Parameters
    ----------
    observed
        Parcels, and their blocks if known.
    params
        Number of standard deviations, and which parcels count.
    progress
        Told how far the work is; may cancel it.

    Returns
    -------
    LayerSet
        The layers of `urban_processing.calibration.layers.CALIBRATION`.

    Raises
    ------
    BoundaryError
        If no parcel is compact enough, or none lies in a block.

    References
    ----------
    Vanegas, C. A. et al. (2012). Procedural generation of parcels in urban modeling. Section 6.
    """
    started = time.perf_counter()
    parcels = observed.parcels
    area, boxes = np.asarray(shapely.area(parcels)), box_sides(parcels)
    lots = _are_lots(observed, params)
    progress.update(0.2, "Finding the blocks")
    blocks, block = _in_blocks(observed, lots, params)
    inside = block != OUTSIDE
    progress.update(0.9, "Measuring parcels")
    statistics = {
        name: statistics_of(values[inside], block[inside], len(blocks))
        for name, values in (("area", area), ("width", boxes[:, 0]))
    }
    pairs = [bounds_of(each, spread=params.spread) for each in statistics.values()]
    bounds = dict(zip(BOUNDS, (bound for pair in pairs for bound in pair), strict=True))
    issues = (*observed.issues, *_left_out(observed, lots, inside, params), *_empty(blocks, block))
    tables = dict(
        [
            block_layer(blocks, statistics, bounds),
            parcel_layer(observed, block, blocks, boxes),
            (ISSUES, issue_table(issues, observed.frame)),
        ]
    )
    step = Step(
        algorithm="calibrate",
        parameters=params.as_dict(),
        seed=0,
        version=__version__,
        input_sha256=observed.input_sha256,
        seconds=time.perf_counter() - started,
        results={"blocks": float(len(blocks)), "parcels": float(inside.sum())},
    )
    summary = _summary(statistics, (area[inside], boxes[inside, 0]), issues)
    return LayerSet(CALIBRATION_KIND, tables, observed.frame, (step,), tuple(summary))


def _are_lots(observed: Observed, params: CalibrateParams) -> BoolArray:
    """(n,) parcels that are compact enough to be built on."""
    compactness = _compactness(observed)
    lots = compactness >= params.least_compactness
    if not lots.any():
        raise BoundaryError(
            f"No parcel is as compact as {option_name('least_compactness')} asks "
            f"({params.least_compactness:g}); the most compact one has {compactness.max():.2g}."
        )
    return lots


def _compactness(observed: Observed) -> FloatArray:
    """(n,) 4π·area/perimeter², rounded so that two machines agree on what is left out."""
    perimeter = shapely.length(observed.parcels)
    return np.asarray(np.round(4.0 * np.pi * shapely.area(observed.parcels) / perimeter**2, 9))


def _in_blocks(
    observed: Observed, lots: BoolArray, params: CalibrateParams
) -> tuple[Blocks, IntArray]:
    """Return the blocks, and (n,) the block of each parcel or `OUTSIDE`."""
    block = np.full(len(observed), OUTSIDE)
    if observed.blocks is None:
        polygons, block[lots] = blocks_of(observed.parcels[lots], gap=params.gap)
        return plain_blocks(polygons, frame=observed.frame), block
    block[lots] = block_of_each(observed.parcels[lots], observed.blocks.polygons)
    if (block == OUTSIDE).all():
        raise BoundaryError(
            "No parcel lies in a block, at least half of it: do the layers show the same place? "
            "Check the CRS of both."
        )
    return observed.blocks, block


def _left_out(
    observed: Observed, lots: BoolArray, inside: BoolArray, params: CalibrateParams
) -> list[Issue]:
    """One issue for each parcel that does not count."""
    found = [
        (
            "parcel_thin",
            ~lots,
            _compactness(observed),
            params.least_compactness,
            "A parcel of {value:.2g} compactness, less than {limit:g}, was left out: a road or "
            "another strip.",
        ),
        (
            "parcel_outside",
            lots & ~inside,
            np.asarray(shapely.area(observed.parcels)),
            None,
            "A parcel of {value:.0f} m² was left out: less than half of it lies in blocks.",
        ),
    ]
    issues = []
    for code, chosen, values, limit, message in found:
        rows = np.flatnonzero(chosen)
        places = shapely.point_on_surface(observed.parcels[rows])
        for row, place in zip(rows.tolist(), places, strict=True):
            value = float(values[row])
            issues.append(
                Issue(
                    code,
                    message.format(value=value, limit=limit),
                    parcel_id=int(observed.parcel_id[row]),
                    value=value,
                    limit=limit,
                    geometry=place,
                )
            )
    return issues


def _empty(blocks: Blocks, block: IntArray) -> list[Issue]:
    """Say how many blocks have no parcel, and what they got."""
    n = int((np.bincount(block[block != OUTSIDE], minlength=len(blocks)) == 0).sum())
    if not n:
        return []
    message = (
        f"{n} block(s) have no observed parcel: they got the median of each bound over the others."
    )
    return [Issue("blocks_without_parcels", message, value=float(n))]


def _summary(
    statistics: dict[str, Statistics],
    measures: tuple[FloatArray, FloatArray],
    issues: tuple[Issue, ...],
) -> list[tuple[str, str]]:
    area, width = measures
    count = statistics["area"].count
    rows = [
        ("blocks", f"{len(count):,}, {int((count == 0).sum()):,} without parcels"),
        ("parcels", f"{len(area):,}"),
        ("area", f"{area.mean():,.0f} m² in the mean, standard deviation {area.std():,.0f} m²"),
        ("width", f"{width.mean():,.1f} m in the mean, standard deviation {width.std():,.1f} m"),
    ]
    if issues:
        rows.append(("issues", f"{issues_in_words(issues)} (see the layer issues)"))
    return rows
