"""The declaration of `measure`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.outputs import layer_outputs, report_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.fabric.layers import MEASURED
from urban_processing.params.measure import MeasureParams
from urban_processing.progress import Progress


def _run(inputs: Mapping[str, Any], params: MeasureParams, progress: Progress) -> Mapping[str, Any]:
    from urban_processing.metrics.fabric_layers import fabric_layers
    from urban_processing.pipelines.measure import measure
    from urban_processing.report.sides import report_on

    known = measure(inputs["layout"], params, progress)
    return {"output": fabric_layers(known), "report": report_on([known])}


LAYERS_OF_A_FABRIC = (
    Input(
        name="parcel_layer",
        kind=InputKind.PARCEL_LAYER,
        label="Parcels",
        help="Instead of a file with both: polygons of parcels; a column land_use says their use.",
        required=False,
    ),
    Input(
        name="street_layer",
        kind=InputKind.STREET_LAYER,
        label="Streets",
        help="Instead of a file with both: centrelines of streets; columns may say their width, "
        "class and name.",
        required=False,
    ),
    Input(
        name="land",
        kind=InputKind.LAND,
        label="Land",
        help="Polygons that parcels and streets are cut at; by default what they cover.",
        required=False,
    ),
)

MEASURE = AlgorithmSpec(
    name="measure",
    title="Measure parcels and streets",
    group="Measuring",
    summary="Measure a layout, or any parcels and streets: some hundred figures, and a report.",
    description=(
        "Takes a layout file, another file that this software made, or layers of parcels and "
        "streets of any origin, and measures parcels, blocks, streets, the use of the land and the "
        "ways along streets. The figures are those of Chen 2024 and Yang 2013 and those that "
        "planners ask for besides; what each means stands in the glossary of the report.\n\n"
        "Real parcels end where the street begins. An edge of a parcel is frontage where no other "
        "parcel lies along it and a street runs beside it, no further off than half its width and "
        "some metres."
    ),
    params=MeasureParams,
    inputs=(
        Input(
            name="layout",
            kind=InputKind.FABRIC,
            label="Layout file",
            help="A layout file, or another file with one layer of parcels and one of streets.",
            required=False,
        ),
        *LAYERS_OF_A_FABRIC,
    ),
    outputs=(
        *report_outputs("the layout"),
        *layer_outputs(
            "what was measured",
            label="File of measures",
            help="A GeoPackage with parcels, streets, junctions, blocks and their measures.",
            layers=MEASURED,
            required=False,
        ),
    ),
    run=_run,
    references=(
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Table 1.",
        "Y.-L. Yang, J. Wang, E. Vouga and P. Wonka (2013). Urban pattern: layout design by "
        "hierarchical domain splitting. ACM Transactions on Graphics 32(6). Section 7.",
        "G. Boeing (2019). Urban spatial order: street network orientation, configuration, and "
        "entropy. Applied Network Science 4, 67.",
        "J. Buhl, J. Gautrais, N. Reeves, R. V. Solé, S. Valverde, P. Kuntz and G. Theraulaz "
        "(2006). Topological patterns in street networks of self-organized urban settlements. The "
        "European Physical Journal B 49, 513-522.",
    ),
    examples=(
        "layout.gpkg --report report.html",
        "layout.gpkg -o measured.gpkg --csv metrics.csv",
        "--parcel-layer parcels.shp --street-layer roads.gpkg --land town.gpkg --report town.html",
    ),
)
