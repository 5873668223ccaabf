"""The declaration of `optimize`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.inputs import LAYERS_OF_LAYOUT
from urban_processing.algorithms.outputs import LAYOUT_OUTPUTS
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.optimize import OptimizeParams
from urban_processing.progress import Progress


def _run(
    inputs: Mapping[str, Any], params: OptimizeParams, progress: Progress
) -> Mapping[str, Any]:
    from urban_processing.pipelines.optimize import optimize

    return {"output": optimize(inputs["layout"], params, progress)}


OPTIMIZE = AlgorithmSpec(
    name="optimize",
    title="Optimize parcels and streets",
    group="Layout",
    summary="Smooth the streets and parcel sides of a layout and make its parcels more regular.",
    description=(
        "Vertices move so that parcels become more regular, parcel sides and streets smoother, "
        "and streets meet at right angles, without going far from where they were. Which parcels "
        "and streets there are stays as it is. The shape of the land is kept: vertices slide along "
        "straight runs of its rim, or stay. Locked parcels stay. No parcel becomes smaller than "
        "the smallest area, loses its street or becomes irregular.\n\n"
        "Takes a layout file, also one whose parcels and streets were edited by hand, or the "
        "parcels and streets of any other source as two layers. Co-generation does the same at "
        "its end."
    ),
    params=OptimizeParams,
    inputs=(
        Input(
            name="layout",
            kind=InputKind.LAYOUT,
            label="Layout file",
            help="A layout file; its parcels and streets may have been edited.",
            required=False,
        ),
        *LAYERS_OF_LAYOUT,
    ),
    outputs=LAYOUT_OUTPUTS,
    run=_run,
    references=(
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Section 5.",
    ),
    examples=(
        "layout.gpkg -o smooth.gpkg --plot smooth.png",
        "layout.gpkg -o smooth.gpkg --weight-streets 20",
        "--parcel-layer parcels.gpkg --street-layer streets.shp -o smooth.gpkg",
    ),
)
