"""The declaration of `compare`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.measure import LAYERS_OF_A_FABRIC
from urban_processing.algorithms.outputs import layer_outputs, report_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.fabric.comparison_layers import COMPARED
from urban_processing.params.compare import CompareParams
from urban_processing.progress import Progress


def _run(inputs: Mapping[str, Any], params: CompareParams, progress: Progress) -> Mapping[str, Any]:
    from urban_processing.metrics.comparison_tables import comparison_set
    from urban_processing.pipelines.measure import compare_fabrics
    from urban_processing.report.sides import report_on

    compared = compare_fabrics(inputs["layouts"], params, progress)
    return {
        "output": comparison_set(compared.comparison, history=compared.history),
        "report": report_on(compared.measured, compared.comparison),
    }


_HELPS = {
    "parcel_layer": "Polygons of parcels that are there: one more side, called real.",
    "street_layer": "Centrelines of streets that are there, for that side.",
    "land": "Polygons that what is there is cut at; by default the land of the first file.",
}

COMPARE = AlgorithmSpec(
    name="compare",
    title="Compare layouts with each other and with what is there",
    group="Measuring",
    summary="Set layouts, and the real streets and parcels in the same land, side by side.",
    description=(
        "Measures each side as measure does and lists every figure for all of them, with the "
        "difference from a reference and the better side by what is commonly wanted, such as "
        "right angles and short detours; first it says where lands or densities are not the same. "
        "Distributions of areas, widths, lengths and bearings are held against each other: by "
        "Wasserstein's and Kolmogorov and Smirnov's distance, with bootstrap intervals, and with "
        "the distance that chance alone would make.\n\n"
        "One side may be what is there: the streets of OpenStreetMap in the land of the first "
        "layout, from an extract or its server, or layers of parcels and streets. Dual "
        "carriageways, roundabouts and slip roads of OpenStreetMap become single lines and "
        "junctions. Streets are cut at the boundary of the land; those along the rim of a layout "
        "count for ways only."
    ),
    params=CompareParams,
    inputs=(
        Input(
            name="layouts",
            kind=InputKind.FABRICS,
            label="Layout files",
            help="Layout files, or other files with parcels and streets; NAME=FILE gives a side "
            "its name.",
        ),
        *(
            Input(
                name=item.name,
                kind=item.kind,
                label=f"{item.label} that are there" if item.name != "land" else item.label,
                help=_HELPS[item.name],
                required=False,
            )
            for item in LAYERS_OF_A_FABRIC
        ),
        Input(
            name="osm_file",
            kind=InputKind.OPEN_STREET_MAP,
            label="OpenStreetMap extract",
            help="An extract of OpenStreetMap (.osm, .osm.bz2, .osm.gz, .osm.pbf) with the streets "
            "that are there.",
            required=False,
        ),
    ),
    outputs=(
        *report_outputs("the comparison"),
        *layer_outputs(
            "what was compared",
            label="File of the comparison",
            help="A GeoPackage with the table of metrics and the distances of distributions.",
            layers=COMPARED,
            required=False,
        )[:1],
    ),
    run=_run,
    references=(
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller (2012). "
        "Procedural generation of parcels in urban modeling. Computer Graphics Forum 31(2). "
        "Section 6.",
        "Y.-L. Yang, J. Wang, E. Vouga and P. Wonka (2013). Urban pattern: layout design by "
        "hierarchical domain splitting. ACM Transactions on Graphics 32(6). Table 1.",
        "M. Fleischmann, A. Vybornova, J. D. Gaboardi, A. Brázdová and D. Dančejová (2026). "
        "Adaptive continuity-preserving simplification of street networks. Computers, Environment "
        "and Urban Systems 123, 102354 (neatnet, which cleans OpenStreetMap).",
    ),
    examples=(
        "layout.gpkg --osm-file town.osm.bz2 --report comparison.html",
        "loops=a.gpkg trees=b.gpkg --csv table.csv",
        "layout.gpkg --parcel-layer cadastre.gpkg --street-layer roads.gpkg --report real.html",
    ),
)
