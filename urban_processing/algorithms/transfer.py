"""The declaration of `transfer`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.outputs import layer_outputs
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.transfer import TransferParams
from urban_processing.persistence.layers import TRANSFER
from urban_processing.progress import Progress


def _run(
    inputs: Mapping[str, Any], params: TransferParams, progress: Progress
) -> Mapping[str, Any]:
    from urban_processing.pipelines.transfer import transfer

    return {"output": transfer(inputs["before"], params, progress)}


_BLOCKS = (
    "Polygons of the blocks of these parcels, or lines such as streets that bound them; by default "
    "parcels with the same block_id, else those that touch, are one block."
)

TRANSFER_SPEC = AlgorithmSpec(
    name="transfer",
    title="Carry parcel numbers through an edit",
    group="Layout",
    summary="Give the parcels after an edit the numbers and columns of the same parcels before it.",
    description=(
        "After a street is moved, widened, bent or added, or parcels are made in another way, the "
        "blocks are divided anew. This finds for each parcel the one before that lies in the same "
        "place relative to the corners of its block. It takes over number and columns. All other "
        "parcels get numbers above all old ones, which are never used again. What did not change "
        "at all keeps its number in any case.\n\n"
        "Blocks are matched first, also where the layout as a whole was moved, turned or scaled, "
        "and where a block was split by a new street or merged with another. The layer of changes "
        "says of each parcel what became of it: kept (same shape, same place), moved (the same "
        "number in another shape or place), split (a new parcel, more than half of which was an "
        "old one), merged (an old parcel, more than half of which went into a new one), gone and "
        "new, with the shares of the areas in common.\n\n"
        "Takes any two layers of parcels, in any CRS; of a layout file its parcels, and its "
        "streets for the blocks."
    ),
    params=TransferParams,
    inputs=(
        Input(
            name="before",
            kind=InputKind.PARCELS_BEFORE,
            label="Parcels before",
            help="Parcels before the edit, with their numbers: a file, or a layout file.",
        ),
        Input(
            name="after",
            kind=InputKind.PARCELS_AFTER,
            label="Parcels after",
            help="Parcels after the edit: a file, or a layout file.",
        ),
        Input(
            name="blocks_before",
            kind=InputKind.BLOCKS_BEFORE,
            label="Blocks before",
            help=f"Before the edit. {_BLOCKS}",
            required=False,
        ),
        Input(
            name="blocks_after",
            kind=InputKind.BLOCKS_AFTER,
            label="Blocks after",
            help=f"After the edit. {_BLOCKS}",
            required=False,
        ),
    ),
    outputs=layer_outputs(
        "the parcels",
        label="Parcels and changes",
        help="A GeoPackage with the parcels after the edit, their numbers, and what became of "
        "each parcel.",
        layers=TRANSFER,
    ),
    run=_run,
    references=(
        "C. A. Vanegas, T. Kelly, B. Weber, J. Halatsch, D. G. Aliaga and P. Müller (2012). "
        "Procedural generation of parcels in urban modeling. Computer Graphics Forum 31(2). "
        "Section 5.",
    ),
    examples=(
        "before.gpkg after.gpkg -o parcels.gpkg",
        "old.shp new.shp -o parcels.gpkg --id-column number --columns owner,use",
        "old.shp new.shp -o parcels.gpkg --blocks-before old_blocks.shp "
        "--blocks-after new_blocks.shp",
    ),
)
