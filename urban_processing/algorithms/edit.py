"""The declaration of `edit`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from urban_processing.algorithms.inputs import GROUND
from urban_processing.algorithms.outputs import LAYOUT_OUTPUTS
from urban_processing.algorithms.spec import AlgorithmSpec, Input, InputKind
from urban_processing.params.edit import EditParams
from urban_processing.progress import Progress


def _run(inputs: Mapping[str, Any], params: EditParams, progress: Progress) -> Mapping[str, Any]:
    from urban_processing.session.session import Session

    del params  # the tolerance is for who reads the layout
    steered = inputs["start"]
    return {"output": Session.replayed(steered.saved, steered.start, progress).layout}


EDIT = AlgorithmSpec(
    name="edit",
    title="Do the edits of a session",
    group="Layout",
    summary="Do edits of parcels and streets that stand in a file, on a layout or on land.",
    description=(
        "A session in which a layout was steered level by level is saved as a small file of "
        "edits: levels, cuts chosen, drawn and undone, parks, merged parcels, streets added and "
        "removed. This does them again, in the same order, and gives the same layout. Each is "
        "checked: where a parcel would lose its street, the network fall apart or a parcel become "
        "too small, the run ends with a sentence that says so, and nothing is written.\n\n"
        'The file may also be written by hand, as a list such as [{"edit": "step"}, '
        '{"edit": "lock", "parcel": [605100, 5228400], "land_use": "park"}]: parcels are given by '
        "a place in them, or by the number that they have in the session. Such a list needs a "
        "layout to be done on: cogenerate --stop-at-level 0 gives one of any land.\n\n"
        + "Edits, and what they take: step; choose: parcel, candidate (its rank); cut: parcel, "
        "line, snap; undo_cut: parcel; lock: parcel, land_use; unlock: parcel; merge: parcels, "
        "land_use; add_street: line, follow (along boundaries), street_class, width, snap; "
        "remove_street: place, reach; adopt: parcels, streets, snap; finish."
    ),
    params=EditParams,
    inputs=(
        Input(
            name="start",
            kind=InputKind.STEERED,
            label="Layout or land",
            help="What the edits are done on: a layout file, or the land that a session began "
            "with.",
        ),
        Input(
            name="edits",
            kind=InputKind.EDITS,
            label="Edits",
            help="A saved session, or a list of edits: JSON.",
        ),
        *GROUND,
    ),
    outputs=LAYOUT_OUTPUTS,
    run=_run,
    references=(
        "Z. Chen, P. Song and F. P. Ortner (2024). Hierarchical co-generation of parcels and "
        "streets in urban modeling. Computer Graphics Forum 43(2). Section 6, Fig. 15.",
    ),
    examples=(
        "land.gpkg session.json -o layout.gpkg --plot layout.png",
        "stage.gpkg edits.json -o edited.gpkg",
    ),
)
