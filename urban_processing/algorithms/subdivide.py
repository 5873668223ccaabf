"""The declaration of `subdivide`."""

from __future__ import annotations

from collections.abc import Mapping
from concurrent.futures import Executor
from typing import Any

from urban_processing.algorithms.outputs import layer_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.subdivide import SubdivideParams, per_block_parameters
from urban_processing.parcelling.layers import SUBDIVISION
from urban_processing.persistence.layers import CHANGES
from urban_processing.progress import Progress


def _run(
    inputs: Mapping[str, Any],
    params: SubdivideParams,
    progress: Progress,
    *,
    executor: Executor | None = None,
) -> Mapping[str, Any]:
    from urban_processing.metrics.subdivisions import MeasuredSubdivision
    from urban_processing.pipelines.subdivide import subdivide

    made = subdivide(
        inputs["blocks"],
        params,
        progress,
        previous=inputs.get("previous"),
        executor=executor,
    )
    return {"output": MeasuredSubdivision(made).layers()}


SUBDIVIDE = AlgorithmSpec(
    name="subdivide",
    title="Subdivide blocks into parcels",
    group="Subdivision",
    summary="Divide blocks that are there already into parcels, each block for itself.",
    description=(
        "Skeleton: rows of parcels along the streets of a block, back to back, their sides square "
        "to the street; with a depth of the rows, an inside is left, which stays open or is "
        "divided in its turn. Oriented boxes: a block is halved across its longer side again and "
        "again, turned where a half would have no street. Hybrid: rows along the streets, boxes "
        "within. Streamlines: cuts along a cross field, as in co-generation.\n\n"
        f"Columns of the blocks with the names of parameters ({', '.join(per_block_parameters())}) "
        "hold for single blocks. The width of the street along an edge, which says to whom corner "
        "parcels belong, comes from a layer of streets; a file of blocks has one.\n\n"
        "Every block is divided exactly. Bounds that it does not allow are listed parcel by parcel "
        "in the issues. With a subdivision made before, blocks in which nothing has changed keep "
        "their parcels, and all parcels their numbers as far as they are the same."
    ),
    params=SubdivideParams,
    inputs=(
        Input(
            name="blocks",
            kind=InputKind.BLOCK_LAYER,
            label="Blocks",
            help="Polygons of blocks, less the streets; columns may set parameters for each.",
        ),
        Input(
            name="streets",
            kind=InputKind.BLOCK_STREETS,
            label="Streets",
            help="Lines along the blocks with their widths: edges of blocks, or centrelines.",
            required=False,
        ),
        Input(
            name="previous",
            kind=InputKind.SUBDIVISION,
            label="Subdivision before",
            help="A file that this algorithm made before the blocks were edited.",
            required=False,
        ),
    ),
    outputs=layer_outputs(
        "the parcels",
        label="File of parcels",
        help="A GeoPackage with the parcels, the blocks with their parameters, and issues.",
        layers=(*SUBDIVISION, CHANGES),
    ),
    run=_run,
    parallel=True,
    references=(
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller (2012). "
        "Procedural generation of parcels in urban modeling. Computer Graphics Forum 31(2). "
        "Sections 4 and 5.",
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Section 4.1 (streamlines).",
    ),
    examples=(
        "blocks.gpkg -o parcels.gpkg --min-area 400 --plot parcels.png",
        "blocks.gpkg -o parcels.gpkg --strategy hybrid --offset 30",
        "blocks.shp -o parcels.gpkg --streets roads.gpkg --strategy obb --street-access 0.5",
        "edited.gpkg -o parcels2.gpkg --previous parcels.gpkg",
    ),
)
