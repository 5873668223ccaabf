"""The declaration of `resume`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.inputs import LAYERS_OF_LAYOUT
from urban_processing.algorithms.outputs import LAYOUT_OUTPUTS
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.resume import ResumeParams
from urban_processing.progress import Progress


def _run(inputs: Mapping[str, Any], params: ResumeParams, progress: Progress) -> Mapping[str, Any]:
    from urban_processing.pipelines.resume import resume

    return {"output": resume(inputs["layout"], params, progress)}


RESUME = AlgorithmSpec(
    name="resume",
    title="Go on with parcels and streets",
    group="Layout",
    summary="Go on with a layout that stopped at a level, as it is or after it was edited by hand.",
    description=(
        "Co-generation that was told to stop at a level gives a layout to look at and to edit: in "
        "QGIS, parcels may be split and merged, vertices moved, streets drawn and deleted, and the "
        "columns of parcels filled in. This goes on from there, with the parameters of the "
        "beginning: it cuts every parcel that is large enough, level by level, connects all by "
        "streets, and optimizes the geometry in the end, or stops at another level. Stopping and "
        "going on gives the same layout as one run.\n\n"
        "What the columns of parcels say counts: parcels are not cut that are locked or, in a "
        "layout file, have a land use of their own, nor those whose stage is done; where the "
        "number of parcels was given, a parcel becomes as many as its quota "
        "says. Pieces of a parcel that was split share its quota; where parcels were merged, give "
        "the sum of theirs. Parcels that were drawn, and say nothing, are cut if they are at least "
        "twice the smallest area.\n\n"
        "Takes a layout file, or the parcels and streets of any other source as two layers; then "
        "the smallest area is needed. Columns of parcels with these names count there, too: "
        "level, land_use, locked, lineage, stage, quota."
    ),
    params=ResumeParams,
    inputs=(
        Input(
            name="layout",
            kind=InputKind.LAYOUT,
            label="Layout file",
            help="A layout file that stopped at a level; its parcels and streets may have been "
            "edited.",
            required=False,
        ),
        *LAYERS_OF_LAYOUT,
    ),
    outputs=LAYOUT_OUTPUTS,
    run=_run,
    references=(
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Sections 4 and 6.",
    ),
    examples=(
        "stage.gpkg -o final.gpkg --plot final.png",
        "stage.gpkg -o next.gpkg --stop-at-level 6",
        "--parcel-layer parcels.gpkg --street-layer streets.shp -o final.gpkg --min-area 400",
    ),
)
