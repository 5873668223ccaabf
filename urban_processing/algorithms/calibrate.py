"""The declaration of `calibrate`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.outputs import layer_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.calibration.layers import BOUNDS, CALIBRATION
from urban_processing.params.calibrate import CalibrateParams
from urban_processing.progress import Progress


def _run(
    inputs: Mapping[str, Any], params: CalibrateParams, progress: Progress
) -> Mapping[str, Any]:
    from urban_processing.pipelines.calibrate import calibrate

    return {"output": calibrate(inputs["parcels"], params, progress)}


CALIBRATE = AlgorithmSpec(
    name="calibrate",
    title="Calibrate subdivision from parcels",
    group="Subdivision",
    summary="Measure the parcels of each block, to subdivide blocks into parcels like them.",
    description=(
        "Mean and standard deviation of the areas and widths of the observed parcels of a block "
        f"give its columns {', '.join(BOUNDS)}: the mean less and plus k standard deviations. "
        "The layer of blocks is what subdivide takes, with whatever strategy; columns of the "
        "blocks that set other parameters, such as strategy, are carried along.\n\n"
        "The width of a parcel is the shorter side of the smallest rotated rectangle around it, "
        "which is what the bounds of subdivide hold for. Standard deviations are those of the "
        "block's parcels as a whole population. Both bounds are at least a tenth of the mean away "
        "from it, as subdivide aims to stay so far within them; lower bounds are no less than a "
        "quarter of the mean, where the paper leaves open what is to be done. So a block with a "
        "single parcel stays whole. Blocks without parcels get the median of each bound over the "
        "blocks with several parcels; what was measured is empty for them.\n\n"
        "Parcels belong to the block that they overlap most; those of which less than half lies "
        "in blocks do not count. Where no blocks are given, parcels that share sides make them. "
        "Strips such as parcels of roads are left out. All that is listed in the issues."
    ),
    params=CalibrateParams,
    inputs=(
        Input(
            name="parcels",
            kind=InputKind.OBSERVED_PARCELS,
            label="Parcels",
            help="Polygons of parcels as they are.",
        ),
        Input(
            name="blocks",
            kind=InputKind.OBSERVED_BLOCKS,
            label="Blocks",
            help="Polygons of the blocks of these parcels; by default those in the same "
            "file, else parcels that share sides are one block.",
            required=False,
        ),
    ),
    outputs=layer_outputs(
        "the parcels and their blocks",
        label="File of blocks",
        help="A GeoPackage with the blocks and their bounds, for subdivide, the parcels as they "
        "were measured, and issues.",
        layers=CALIBRATION,
    ),
    run=_run,
    references=(
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller (2012). "
        "Procedural generation of parcels in urban modeling. Computer Graphics Forum 31(2). "
        "Section 6.",
    ),
    examples=(
        "cadastre.gpkg -o blocks.gpkg --plot observed.png",
        "cadastre.shp -o measured.gpkg --blocks blocks.gpkg --where \"use <> 'road'\"",
    ),
)
