"""The declaration of `cogenerate`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.inputs import GROUND
from urban_processing.algorithms.outputs import LAYOUT_OUTPUTS
from urban_processing.algorithms.spec import AlgorithmSpec, Estimate, Input, InputKind
from urban_processing.params.cogenerate import CogenerateParams
from urban_processing.progress import Progress


def _run(
    inputs: Mapping[str, Any], params: CogenerateParams, progress: Progress
) -> Mapping[str, Any]:
    from urban_processing.pipelines.cogenerate import cogenerate

    return {"output": cogenerate(inputs["boundary"], params, progress)}


def _estimate(inputs: Mapping[str, Any], params: CogenerateParams) -> Estimate:
    from urban_processing.pipelines.cogenerate import estimate

    return estimate(inputs["boundary"], params)


COGENERATE = AlgorithmSpec(
    name="cogenerate",
    title="Co-generate parcels and streets",
    group="Layout",
    summary="Divide land into well-shaped parcels, all reached by one connected street network.",
    description=(
        "The land is cut in two again and again, along streamlines of a cross field that follows "
        "its boundary, until a parcel cannot be cut without going below the smallest area. After "
        "each level of cuts, streets are added along parcel boundaries so that every parcel is "
        "reached and the network stays connected. In the end the geometry is optimized: streets "
        "and parcel sides become smoother, parcels and junctions more regular.\n\n"
        "Each connected part of the land gets a layout and a network of its own. Holes stay "
        "empty. The rim of the land is street, as a whole unless told otherwise. Streets that are "
        "given belong to the network from the start; no cut and no street crosses obstacles or "
        "locked land. In the end the rights-of-way of all streets are cut out of the parcels."
    ),
    params=CogenerateParams,
    inputs=(
        Input(
            name="boundary",
            kind=InputKind.BOUNDARY,
            label="Land",
            help="The land: polygons, in a vector layer or file of any format.",
        ),
        *GROUND,
    ),
    outputs=LAYOUT_OUTPUTS,
    run=_run,
    estimate=_estimate,
    references=(
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Sections 3 to 6.",
        "Y.-L. Yang, J. Wang, E. Vouga and P. Wonka (2013). Urban pattern: layout design by "
        "hierarchical domain splitting. ACM Transactions on Graphics 32(6). Section 5.",
    ),
    examples=(
        "sample_data/wandsworth.gpkg -o layout.gpkg --parcels 500 --plot layout.png",
        "land.shp -o layout.gpkg --min-area 800 --pattern cul-de-sac",
        "land.shp -o layout.gpkg --min-area 800 --streets roads.gpkg --obstacles lakes.gpkg",
        "land.shp -o layout.gpkg --min-area 800 --rim none --entries gate.geojson --pattern tree",
        '--place "Schaan, Liechtenstein" -o schaan.gpkg --min-area 600',
    ),
)
