"""The declaration of `blocks`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.outputs import layer_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.blocks import BlocksParams
from urban_processing.progress import Progress
from urban_processing.schema import BLOCK_EDGES, ISSUES, PROVENANCE, RIGHT_OF_WAY
from urban_processing.schema import BLOCKS as BLOCK_LAYER
from urban_processing.street_rules import OSM_KEYS


def _run(inputs: Mapping[str, Any], params: BlocksParams, progress: Progress) -> Mapping[str, Any]:
    from urban_processing.pipelines.blocks import blocks

    return {"output": blocks(inputs["streets"], params, progress)}


BLOCKS = AlgorithmSpec(
    name="blocks",
    title="Blocks from streets",
    group="Subdivision",
    summary="Find the blocks between streets, less the land that the streets take.",
    description=(
        "Lines of streets are cut where they cross, whether there is a node or not: bridges and "
        "tunnels, too. Lines that lie on others count once, ends that miss another street by less "
        "than a tolerance are joined to it, and all that is said in the layer of issues. What the "
        "lines enclose gives up half the width of each street around it; dead ends make notches. "
        "What is left is a block if it is neither too small nor too narrow, such as the strip "
        "between two carriageways; tails and necks that are too narrow are cut off.\n\n"
        "Widths are those of the whole right-of-way. They come from a column width_m or width, "
        "else from the class of the street in a column class or highway. In data of OpenStreetMap "
        "(with a column highway), width is that of the carriageway and 6 m are added for "
        "pavements and verges; lanes say how wide a street is at least. Tags that a file of "
        "OpenStreetMap keeps together in a column other_tags are read like columns. A layer that "
        "has, besides "
        f"highway, a column {', '.join(OSM_KEYS[:-1])} or {OSM_KEYS[-1]} holds lines of all kinds: "
        "those without a highway are no streets there and are left out, unless they have a width_m "
        "or class. In other layers they are streets of unknown class. Streets of one name (a "
        "column name) are one street, others go on straight at junctions.\n\n"
        "With land, blocks are cut at its rim, which is a street side only where a street runs "
        "along it. The layers of blocks and of their edges are what subdivision into parcels takes."
    ),
    params=BlocksParams,
    inputs=(
        Input(
            name="streets",
            kind=InputKind.CENTRELINES,
            label="Streets",
            help="Centrelines of streets; columns may say their width, class and name.",
        ),
        Input(
            name="land",
            kind=InputKind.LAND,
            label="Land",
            help="Polygons that blocks are cut at; without, blocks are what streets enclose.",
            required=False,
        ),
    ),
    outputs=layer_outputs(
        "the blocks",
        label="File of blocks",
        help="A GeoPackage with the blocks, their edges with the streets along them, and the "
        "right-of-way.",
        layers=(BLOCK_LAYER, BLOCK_EDGES, RIGHT_OF_WAY, ISSUES, PROVENANCE),
    ),
    run=_run,
    references=(
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller (2012). "
        "Procedural generation of parcels in urban modeling. Computer Graphics Forum 31(2). "
        "Section 3.",
        "R. C. Thomson and D. E. Richardson (1999). The “good continuation” principle of "
        "perceptual organization applied to the generalization of road networks. Proceedings of "
        "the 19th International Cartographic Conference.",
    ),
    examples=(
        "roads.gpkg -o blocks.gpkg --plot blocks.png",
        "roads.shp -o blocks.gpkg --land district.gpkg",
        'osm.gpkg --layer edges -o blocks.gpkg --class-widths "residential=14, service=6"',
    ),
)
