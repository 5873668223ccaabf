"""Files and layers of QGIS to the fabrics that are measured and compared."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from qgis.core import QgsCoordinateReferenceSystem

from qgis_plugin.crs import QgisCrs
from qgis_plugin.geopackage import OGR
from urban_processing.algorithms import InputKind
from urban_processing.errors import BoundaryError, ParameterError
from urban_processing.fabric.model import REAL, ComparedFabrics, Fabric
from urban_processing.intake.fabrics import PARCEL_COLUMNS, build_fabric
from urban_processing.intake.features import Features
from urban_processing.intake.street_lines import STREET_COLUMNS
from urban_processing.layout_file.files import read_layout
from urban_processing.layout_file.geopackage import LAYERS_STATE, LAYOUT_STATE, read_state
from urban_processing.metrics.measures import LayoutMeasures
from urban_processing.params.compare import CompareParams
from urban_processing.params.measure import MeasureParams
from urban_processing.pipelines.measure import side_problems
from urban_processing.schema import BOUNDARY, PARCELS, STREETS
from urban_processing.tables import to_map

COLUMNS = {
    InputKind.PARCEL_LAYER: PARCEL_COLUMNS,
    InputKind.STREET_LAYER: STREET_COLUMNS,
    InputKind.LAND: (),
}
"""Layers that a fabric is made of, and the columns that are wanted of each."""

_LAYERS = {
    PARCELS.name: PARCEL_COLUMNS,
    STREETS.name: STREET_COLUMNS,
    BOUNDARY.name: (),
}
"""The same in a file of ours."""


@dataclass(frozen=True, eq=False)
class FabricLayers:
    """Layers that were given; None for those that were not."""

    parcels: Features[QgsCoordinateReferenceSystem] | None = None
    streets: Features[QgsCoordinateReferenceSystem] | None = None
    land: Features[QgsCoordinateReferenceSystem] | None = None

    @property
    def can_be_measured(self) -> bool:
        """Whether there are parcels or streets."""
        return self.parcels is not None or self.streets is not None

    @property
    def name(self) -> str:
        """Name of the first of parcels and streets."""
        return next((each.name for each in (self.parcels, self.streets) if each is not None), "")


@dataclass(frozen=True, eq=False)
class FabricReader:
    """Reads what is measured or compared in one run.

    Parameters
    ----------
    params
        Widths and tolerances.
    library
        What knows the CRSs.
    asked
        CRS to work in with layers, if one was chosen.
    """

    params: MeasureParams
    library: QgisCrs
    asked: QgsCoordinateReferenceSystem | None = None

    def measured(self, path: Path | None, layers: FabricLayers, label: str) -> Fabric:
        """Read what is measured: a file of ours, or layers.

        Parameters
        ----------
        path, layers
            The file, or the layers.
        label
            What the file is called in the dialog.

        Raises
        ------
        BoundaryError
            With everything that is wrong.
        """
        if path is None and not layers.can_be_measured:
            raise BoundaryError(f"Give “{label}”, or layers of parcels, streets, or both.")
        if path is None:
            return replace(self._of_layers(layers), name=layers.name)
        if layers.can_be_measured or layers.land is not None:
            raise BoundaryError(f"Give “{label}”, or layers, not both.")
        fabric = self.of_file(path)
        if self.asked is not None and fabric.layout is not None:
            raise BoundaryError("A layout is ready as it is: leave out “CRS to work in”.")
        return fabric

    def compared(self, paths: Sequence[Path], layers: FabricLayers, label: str) -> ComparedFabrics:
        """Read what is compared: files of ours, and layers of what is there.

        Parameters
        ----------
        paths, layers
            The files, and the layers.
        label
            What the files are called in the dialog.

        Raises
        ------
        BoundaryError, ParameterError
            With everything that is wrong.
        """
        if not paths:
            raise BoundaryError(f"Give “{label}”: one file, or more.")
        problems: list[str] = []
        if layers.land is not None and not layers.can_be_measured:
            problems.append(
                "Land is for what is there, of which nothing was given: leave it out, or give "
                "parcels or streets besides."
            )
        made: list[Fabric] = []
        for path in paths:
            try:
                made.append(self.of_file(path))
            except BoundaryError as error:
                problems += error.problems
        if problems:
            raise BoundaryError(problems)
        reference = self.params.reference if isinstance(self.params, CompareParams) else None
        real = REAL if layers.can_be_measured else ""
        wrong = side_problems([path.stem for path in paths], real, reference)
        if wrong:
            raise ParameterError(wrong)
        if not real:
            return ComparedFabrics(tuple(made))
        land = layers.land or self._land_of(made[0])
        found = replace(self._of_layers(replace(layers, land=land)), name=real)
        return ComparedFabrics(tuple(made), found)

    def of_file(self, path: Path) -> Fabric:
        """Read a file that this software made: a layout, or another with parcels or streets.

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
                f"{path} was not made by this software: give its parcels and streets as layers "
                "instead."
            )
        state = json.loads(text)
        crs = self.library.from_text(state["crs"]) if state["crs"] else None
        names = OGR.layer_names(path)
        found = {name: _features(path, name, crs) for name in _LAYERS if name in names}
        if not found.keys() & {PARCELS.name, STREETS.name}:
            raise BoundaryError(
                f"There are neither parcels nor streets in {path}, which holds {state['kind']}, "
                f"but {', '.join(names)}."
            )
        layers = FabricLayers(*(found.get(name) for name in _LAYERS))
        return replace(self._of_layers(layers), name=path.stem)

    def _of_layers(self, layers: FabricLayers) -> Fabric:
        return build_fabric(
            layers.parcels,
            layers.streets,
            layers.land,
            library=self.library,
            asked=self.asked,
            params=self.params,
        )

    def _land_of(self, fabric: Fabric) -> Features[QgsCoordinateReferenceSystem]:
        """The land of a fabric as a layer."""
        frame = fabric.frame
        crs = self.library.from_text(frame.crs) if frame.crs else None
        land = to_map(fabric.land, frame)
        return Features(land, crs, f"the land of {fabric.name}", bare=crs is None)


def _features(
    path: Path, layer: str, crs: QgsCoordinateReferenceSystem | None
) -> Features[QgsCoordinateReferenceSystem]:
    known = OGR.column_names(path, layer)
    wanted = [name for name in _LAYERS[layer] if name in known]
    geometry, columns = OGR.read_layer(path, layer, wanted)
    return Features(geometry, crs, f"{path.name}, {layer}", bare=crs is None, columns=columns)
