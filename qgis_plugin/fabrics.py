"""Files and layers of QGIS to the fabrics that are measured and compared."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

from qgis.core import QgsCoordinateReferenceSystem

from qgis_plugin.crs import QgisCrs
from qgis_plugin.geopackage import OGR
from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import Fabric
from urban_processing.intake.fabrics import PARCEL_COLUMNS, build_fabric
from urban_processing.intake.features import Features
from urban_processing.layout_file.files import read_layout
from urban_processing.layout_file.geopackage import LAYERS_STATE, LAYOUT_STATE, read_state
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.params.measure import MeasureParams
from urban_processing.schema import BOUNDARY, PARCELS, STREETS

_COLUMNS = {PARCELS.name: PARCEL_COLUMNS, STREETS.name: STREETS.column_names, BOUNDARY.name: ()}
"""Layers that a fabric is read from, and the columns of each."""


def read_file(path: Path, params: MeasureParams, library: QgisCrs) -> Fabric:
    """Read a file that this software made: a layout, or another one with parcels or streets.

    Raises
    ------
    BoundaryError
        If it is none.
    """
    if not path.exists():
        raise BoundaryError(f"The file {path} does not exist.")
    if read_state(path, LAYOUT_STATE) is not None:
        layout = read_layout(path, library=OGR)
        return replace(LayoutMeasures(layout).of_fabric.fabric, name=path.stem)
    text = read_state(path, LAYERS_STATE)
    if text is None:
        raise BoundaryError(
            f"{path} was not made by this software: give its parcels and streets as layers instead."
        )
    state = json.loads(text)
    crs = library.from_text(state["crs"]) if state["crs"] else None
    names = OGR.layer_names(path)
    found = {name: _features(path, name, crs) for name in _COLUMNS if name in names}
    if not found.keys() & {PARCELS.name, STREETS.name}:
        raise BoundaryError(
            f"{path}, which holds {state['kind']}, has neither parcels nor streets: its layers are "
            f"{', '.join(names)}."
        )
    layers = (found.get(name) for name in _COLUMNS)
    return replace(build_fabric(*layers, library=library, params=params), name=path.stem)


def _features(
    path: Path, layer: str, crs: QgsCoordinateReferenceSystem | None
) -> Features[QgsCoordinateReferenceSystem]:
    geometry, columns = OGR.read_layer(path, layer, _present(path, layer))
    return Features(geometry, crs, f"{path.name}, {layer}", bare=crs is None, columns=columns)


def _present(path: Path, layer: str) -> list[str]:
    """Columns that a layer has of those that are looked for."""
    known = OGR.column_names(path, layer)
    return [name for name in _COLUMNS[layer] if name in known]
