"""Subdivisions in again from the files that they were written to."""

from __future__ import annotations

import json
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any, TypeAlias

import numpy as np
import numpy.typing as npt
import shapely

from urban_processing.blocks.model import plain_blocks
from urban_processing.errors import BoundaryError, UrbanError
from urban_processing.layout_file.geopackage import (
    LAYERS_STATE,
    LAYOUT_STATE,
    LayerLibrary,
    read_state,
)
from urban_processing.layout_file.writing import FILE_FORMAT
from urban_processing.metrics.subdivisions import PATIO_USE, SUBDIVISION_KIND
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.parcelling.layers import SUBDIVIDED_BLOCKS, SUBDIVIDED_PARCELS
from urban_processing.parcelling.reuse import Parcels, Previous
from urban_processing.parcelling.rules import resolve_rules, rule_values
from urban_processing.schema import PROVENANCE
from urban_processing.site import Frame
from urban_processing.tables import LayerSet

_PARCELS = ("parcel_id", "block_id", "level", "lineage", "land_use")


def read_subdivision(path: str | PathLike[str], *, library: LayerLibrary) -> Previous:
    """Read the parcels and blocks of a file that `subdivide` wrote.

    Parameters
    ----------
    path
        The file. Parcels may have been edited, but each must still be a valid polygon.
    library
        What reads the layers.

    Raises
    ------
    BoundaryError
        If there is no such file, or it holds no subdivision.
    """
    source = Path(path)
    frame = _frame(source)
    try:
        return _read(source, frame, library)
    except UrbanError:
        raise
    except (OSError, KeyError, TypeError, ValueError) as error:
        raise BoundaryError(f"{source} is damaged or was changed: {error}") from error


def _frame(path: Path) -> Frame:
    if not path.exists():
        raise BoundaryError(f"The file {path} does not exist.")
    text = read_state(path, LAYERS_STATE)
    state: dict[str, Any] = {} if text is None else json.loads(text)
    if state.get("kind") != SUBDIVISION_KIND:
        raise BoundaryError(
            f"{path} holds no subdivision{_what_else(path, state)}: give a GeoPackage that "
            "subdivide wrote."
        )
    if state["format"] > FILE_FORMAT:
        raise BoundaryError(
            f"{path} was written by a newer version of this software: update to read it."
        )
    x, y = state["origin"]
    return Frame(state["crs"], (float(x), float(y)))


def _what_else(path: Path, state: Mapping[str, Any]) -> str:
    """What a file of ours holds instead, to be said after what it does not."""
    if read_state(path, LAYOUT_STATE) is not None:
        return " but a layout"
    return f" but {state['kind']}" if state else ""


def previous_of(made: LayerSet) -> Previous:
    """Return a subdivision as one to go on from, as if it had been written and read again.

    Raises
    ------
    BoundaryError
        If these layers are no subdivision.
    """
    if made.kind != SUBDIVISION_KIND:
        raise BoundaryError(f"Layers of {made.kind} are no subdivision: give what subdivide made.")
    blocks, parcels = made.table(SUBDIVIDED_BLOCKS.name), made.table(SUBDIVIDED_PARCELS.name)
    return _previous(
        made.frame,
        (blocks.shapes, blocks.columns),
        (parcels.shapes, parcels.columns),
        made.history[-1].parameters,
    )


def _read(path: Path, frame: Frame, library: LayerLibrary) -> Previous:
    names = [c.name for c in SUBDIVIDED_BLOCKS.columns if c.name not in ("part", "area_m2")]
    _, provenance = library.read_layer(path, PROVENANCE.name, ("parameters",))
    return _previous(
        frame,
        library.read_layer(path, SUBDIVIDED_BLOCKS.name, names),
        library.read_layer(path, SUBDIVIDED_PARCELS.name, _PARCELS),
        json.loads(provenance["parameters"][-1]),
    )


_Rows: TypeAlias = "tuple[npt.NDArray[np.object_], Mapping[str, npt.NDArray[Any]]]"
"""Geometries in map coordinates, and columns."""


def _previous(
    frame: Frame, blocks: _Rows, parcels: _Rows, parameters: Mapping[str, Any]
) -> Previous:
    (outlines, block), (shapes, parcel) = blocks, parcels
    broken = ~shapely.is_valid(shapes)
    if broken.any():
        named = ", ".join(str(v) for v in parcel["parcel_id"][broken][:5].tolist())
        raise BoundaryError(f"Parcels of the subdivision are no valid polygons any more: {named}.")

    def local(geometry: npt.NDArray[np.object_]) -> npt.NDArray[np.object_]:
        return np.asarray(shapely.transform(geometry, lambda xy: xy - np.asarray(frame.origin)))

    order = np.argsort(block["block_id"], kind="stable")
    own = _own_values(block, parameters)
    return Previous(
        blocks=plain_blocks(
            local(outlines)[order],
            frame=frame,
            block_id=block["block_id"][order],
            columns={name: values[order] for name, values in own.items()},
        ),
        block_key=block["block_key"][order],
        parcels=Parcels(
            polygons=local(shapes),
            block=np.searchsorted(block["block_id"][order], parcel["block_id"]),
            lineage=np.array([int(text, 16) for text in parcel["lineage"]], dtype=np.uint64),
            level=np.asarray(parcel["level"], dtype=np.int64),
            patio=parcel["land_use"] == PATIO_USE,
        ),
        parcel_id=np.asarray(parcel["parcel_id"], dtype=np.int64),
    )


def _own_values(
    block: Mapping[str, npt.NDArray[Any]], parameters: Mapping[str, Any]
) -> dict[str, npt.NDArray[np.object_]]:
    """Values of parameters that were set for single blocks, None where the general one held."""
    n = len(block["block_id"])
    general = rule_values(resolve_rules(SubdivideParams(**parameters), n))
    own = {}
    for name, values in general.items():
        given = np.array([None if v != v else v for v in block[name].tolist()], dtype=object)
        given[given == values] = None
        if any(value is not None for value in given):
            own[name] = given
    return own
