"""Layers of QGIS to what the engine reads."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely
from qgis.core import (
    NULL,
    QgsCoordinateReferenceSystem,
    QgsFeatureRequest,
    QgsGeometry,
    QgsProcessingContext,
    QgsProcessingException,
    QgsProcessingFeatureSource,
    QgsProcessingFeatureSourceDefinition,
    QgsProcessingFeedback,
    QgsWkbTypes,
)
from qgis.PyQt.QtCore import QDate, QDateTime, Qt, QTime

from qgis_plugin.crs import QgisCrs
from qgis_plugin.definitions import CRS, input_of, is_given, parameter_name
from qgis_plugin.fabrics import COLUMNS, FabricLayers, FabricReader
from qgis_plugin.feedback import stop_if_cancelled
from qgis_plugin.geopackage import OGR
from urban_processing.algorithms import AlgorithmSpec, Input, InputKind
from urban_processing.algorithms.choices import layout_problems
from urban_processing.blocks.model import Blocks
from urban_processing.blocks.streets import StreetsOnLand
from urban_processing.calibration.model import Observed
from urban_processing.errors import BoundaryError
from urban_processing.fabric.model import ComparedFabrics, Fabric
from urban_processing.intake.block_values import block_columns
from urban_processing.intake.blocks import build_blocks
from urban_processing.intake.editions import EditionLayers, build_editions
from urban_processing.intake.features import Features
from urban_processing.intake.given import GIVEN_COLUMNS, GivenLayers
from urban_processing.intake.layouts import build_layout
from urban_processing.intake.observed import build_observed
from urban_processing.intake.sites import build_site
from urban_processing.intake.street_lines import STREET_COLUMNS as CENTRELINE_COLUMNS
from urban_processing.intake.street_lines import build_streets
from urban_processing.layer_rows import PARCEL_COLUMNS, STREET_COLUMNS
from urban_processing.layout import Layout
from urban_processing.layout_file.files import read_layout
from urban_processing.layout_file.subdivisions import read_subdivision
from urban_processing.params import Params
from urban_processing.params.measure import MeasureParams
from urban_processing.params.subdivide import SubdivideParams
from urban_processing.parcelling.reuse import Previous
from urban_processing.persistence.editions import Editions
from urban_processing.site import Site

if TYPE_CHECKING:
    from qgis_plugin.algorithm import SpecAlgorithm


_TIMES = (QDate, QDateTime, QTime)

_SNAP = "snap"
"""The parameter that edited layers are read with."""


class Sources:
    """The inputs of one run.

    Parameters
    ----------
    algorithm, parameters, context, feedback
        As QGIS gives them.
    params
        The parameters as the engine takes them.
    """

    def __init__(
        self,
        algorithm: SpecAlgorithm,
        parameters: Mapping[str, Any],
        context: QgsProcessingContext,
        feedback: QgsProcessingFeedback,
        params: Params,
    ) -> None:
        self.params = params
        self.algorithm = algorithm
        self.parameters = dict(parameters)
        self.context = context
        self.feedback = feedback
        self.name = ""
        """What the first input is called, to name results after."""

    def read(self) -> dict[str, Any]:
        """Return the inputs as the engine takes them, by name.

        Raises
        ------
        UrbanError
            With everything that is wrong with them.
        """
        readers: Mapping[InputKind, Callable[[Input], Any]] = {
            InputKind.BOUNDARY: self._site,
            InputKind.LAYOUT: self._layout,
            InputKind.CENTRELINES: self._streets,
            InputKind.BLOCK_LAYER: self._blocks,
            InputKind.OBSERVED_PARCELS: self._observed,
            InputKind.SUBDIVISION: self._subdivision,
            InputKind.PARCELS_BEFORE: self._editions,
            InputKind.FABRIC: self._fabric,
            InputKind.FABRICS: self._fabrics,
        }
        inputs: dict[str, Any] = {}
        for item in self.algorithm.spec.inputs:
            if item.kind in readers:
                inputs[item.name] = readers[item.kind](item)
        return inputs

    def _site(self, item: Input) -> Site | None:
        features = self._features(item)
        if features is None:
            return None
        self.name = self.name or features.name
        layers = {
            kind: None if layer is None else self._features(layer)
            for kind in InputKind
            if kind.of_site
            for layer in (input_of(self.algorithm.spec, kind),)
        }
        return build_site(
            features,
            library=QgisCrs(self.context.transformContext()),
            asked=self._asked_crs(),
            corners=layers[InputKind.CORNER_POINTS],
            given=GivenLayers(
                fixed_streets=layers[InputKind.FIXED_STREETS],
                obstacles=layers[InputKind.OBSTACLES],
                locked=layers[InputKind.LOCKED_LAND],
                rim_lines=layers[InputKind.RIM_LINES],
                entries=layers[InputKind.ENTRY_POINTS],
            ),
        )

    def _streets(self, item: Input) -> StreetsOnLand | None:
        """Read centrelines, and the land they are on."""
        features = self._features(item, CENTRELINE_COLUMNS)
        if features is None:
            return None
        self.name = self.name or features.name
        land = input_of(self.algorithm.spec, InputKind.LAND)
        return build_streets(
            features,
            library=QgisCrs(self.context.transformContext()),
            asked=self._asked_crs(),
            land=None if land is None else self._features(land),
        )

    def _blocks(self, item: Input) -> Blocks | None:
        """Read blocks, and the streets along them."""
        features = self._features(item, block_columns())
        if features is None:
            return None
        self.name = self.name or features.name
        streets = input_of(self.algorithm.spec, InputKind.BLOCK_STREETS)
        params = self.params if isinstance(self.params, SubdivideParams) else None
        return build_blocks(
            features,
            library=QgisCrs(self.context.transformContext()),
            asked=self._asked_crs(),
            streets=None if streets is None else self._features(streets, CENTRELINE_COLUMNS),
            params=params,
        )

    def _observed(self, item: Input) -> Observed | None:
        """Read observed parcels, and the blocks that they are in."""
        features = self._features(item, None)
        if features is None:
            return None
        self.name = self.name or features.name
        blocks = input_of(self.algorithm.spec, InputKind.OBSERVED_BLOCKS)
        return build_observed(
            features,
            library=QgisCrs(self.context.transformContext()),
            asked=self._asked_crs(),
            blocks=None if blocks is None else self._features(blocks, None),
        )

    def _subdivision(self, item: Input) -> Previous | None:
        """Read a subdivision made before, if one was given."""
        name = parameter_name(item.name)
        if not is_given(self.parameters, name):
            return None
        path = self.algorithm.parameterAsFile(self.parameters, name, self.context)
        return read_subdivision(path, library=OGR)

    def _asked_crs(self) -> QgsCoordinateReferenceSystem | None:
        """Return the CRS to work in, if one was given."""
        asked = self.algorithm.parameterAsCrs(self.parameters, CRS, self.context)
        return asked if asked.isValid() else None

    def _layout(self, item: Input) -> Layout | None:
        """Read a layout, from its file or from two layers."""
        spec = self.algorithm.spec
        names = [i.name for i in spec.inputs if is_given(self.parameters, parameter_name(i.name))]
        problems = layout_problems(spec, names, lambda name: f"“{_label(spec, name)}”")
        if problems:
            raise BoundaryError(problems)
        snap = None
        if any(field.name == _SNAP for field in spec.params.fields()):
            snap = self.algorithm.parameterAsDouble(
                self.parameters, parameter_name(_SNAP), self.context
            )
        if item.name in names:
            path = self.algorithm.parameterAsFile(
                self.parameters, parameter_name(item.name), self.context
            )
            self.name = self.name or Path(path).stem
            return read_layout(path, library=OGR, snap=snap)
        found = []
        for kind, columns in (
            (InputKind.PARCEL_LAYER, PARCEL_COLUMNS),
            (InputKind.STREET_LAYER, STREET_COLUMNS),
        ):
            layer = input_of(spec, kind)
            features = None if layer is None else self._features(layer, columns)
            if features is None:
                return None
            found.append(features)
        self.name = self.name or found[0].name
        crs = QgisCrs(self.context.transformContext())
        min_area = self.params.as_dict().get("min_area")
        return build_layout(*found, library=crs, snap=snap or 0.0, min_area=min_area)

    def _editions(self, item: Input) -> Editions | None:
        """Read two states of a layout."""
        before, after, *blocks = (
            None
            if (layer := input_of(self.algorithm.spec, kind)) is None
            # the numbers of blocks and all other columns belong to parcels
            else self._features(layer, None if layer.required else ())
            for kind in (
                item.kind,
                InputKind.PARCELS_AFTER,
                InputKind.BLOCKS_BEFORE,
                InputKind.BLOCKS_AFTER,
            )
        )
        if before is None or after is None:
            return None
        self.name = self.name or after.name
        return build_editions(
            EditionLayers(before, blocks[0]),
            EditionLayers(after, blocks[1]),
            library=QgisCrs(self.context.transformContext()),
        )

    def _fabric(self, item: Input) -> Fabric:
        """Read what is measured, from its file or from layers."""
        name = parameter_name(item.name)
        path = None
        if is_given(self.parameters, name):
            path = Path(self.algorithm.parameterAsFile(self.parameters, name, self.context))
        fabric = self._fabrics_reader().measured(path, self._layers_of_fabric(), item.label)
        self.name = self.name or fabric.name
        return fabric

    def _fabrics(self, item: Input) -> ComparedFabrics:
        """Read what is compared: files, and what is there."""
        paths = self.algorithm.parameterAsFileList(
            self.parameters, parameter_name(item.name), self.context
        )
        reader, layers = self._fabrics_reader(), self._layers_of_fabric()
        compared = reader.compared([Path(path) for path in paths], layers, item.label)
        self.name = self.name or compared.made[0].name
        return compared

    def _fabrics_reader(self) -> FabricReader:
        if not isinstance(self.params, MeasureParams):
            raise TypeError(f"{type(self.params).__name__} has no parameters of measuring.")
        library = QgisCrs(self.context.transformContext())
        return FabricReader(self.params, library, self._asked_crs())

    def _layers_of_fabric(self) -> FabricLayers:
        """Parcels, streets and land that were given as layers."""
        found = []
        for kind, columns in COLUMNS.items():
            item = input_of(self.algorithm.spec, kind)
            found.append(None if item is None else self._features(item, columns))
        return FabricLayers(*found)

    def _features(
        self, item: Input, wanted: Sequence[str] | None = GIVEN_COLUMNS
    ) -> Features[QgsCoordinateReferenceSystem] | None:
        """Read a layer, or the features of it that are selected; None where none is given."""
        name = parameter_name(item.name)
        source = self.algorithm.parameterAsSource(self.parameters, name, self.context)
        if source is None:
            if item.required or is_given(self.parameters, name):
                raise QgsProcessingException(
                    self.algorithm.invalidSourceError(self.parameters, name)
                )
            return None
        known = source.fields().names()
        columns = known if wanted is None else [name for name in wanted if name in known]
        rows = self._rows(source, name, columns)
        return Features(
            _objects([geometry for geometry, _ in rows]),
            source.sourceCrs() if source.sourceCrs().isValid() else None,
            source.sourceName(),
            columns={
                column: _objects([values[i] for _, values in rows])
                for i, column in enumerate(columns)
            },
        )

    def _rows(
        self, source: QgsProcessingFeatureSource, name: str, columns: Sequence[str]
    ) -> list[tuple[shapely.Geometry | None, list[Any]]]:
        """Read geometries and some attributes of the features.

        What is invalid is treated as the user's settings say. They are followed here: where QGIS
        itself stops the reading of a layer, its C++ exception passes through the Python
        interpreter and breaks it.
        """
        request = QgsFeatureRequest().setSubsetOfAttributes(list(columns), source.fields())
        unchecked = QgsProcessingFeatureSource.Flag.FlagSkipGeometryValidityChecks
        checks = QgsFeatureRequest.InvalidGeometryCheck
        check = self._invalid_geometry_check(name)
        found = []
        for feature in source.getFeatures(request, unchecked):
            stop_if_cancelled(self.feedback)
            geometry = feature.geometry()
            if check == checks.GeometryNoCheck or geometry.isNull() or geometry.isGeosValid():
                found.append((_shapely(geometry), [_plain(feature[name]) for name in columns]))
                continue
            what = f"Feature {feature.id()} of “{source.sourceName()}” has an invalid geometry"
            if check == checks.GeometryAbortOnInvalid:
                raise BoundaryError(
                    f"{what}. Correct it, or choose another way with invalid features: in the "
                    "advanced options of the layer, or in Settings > Options > Processing."
                )
            self.feedback.pushWarning(f"{what} and was left out.")
        return found

    def _invalid_geometry_check(self, name: str) -> QgsFeatureRequest.InvalidGeometryCheck:
        given = self.parameters.get(name)
        if isinstance(given, QgsProcessingFeatureSourceDefinition):
            own = QgsProcessingFeatureSourceDefinition.Flag.FlagOverrideDefaultGeometryCheck
            if given.flags & own:
                return given.geometryCheck
        return self.context.invalidGeometryCheck()


def _label(spec: AlgorithmSpec, name: str) -> str:
    return next(item.label for item in spec.inputs if item.name == name)


def _objects(values: Sequence[Any]) -> npt.NDArray[np.object_]:
    return np.array([*values, None], dtype=object)[:-1]


def _plain(value: Any) -> Any:
    """Return an attribute's value, None where QGIS has NULL."""
    if value == NULL:
        return None
    return value.toString(Qt.DateFormat.ISODate) if isinstance(value, _TIMES) else value


def _shapely(geometry: QgsGeometry) -> shapely.Geometry | None:
    if geometry.isNull():
        return None
    if QgsWkbTypes.isCurvedType(geometry.wkbType()):
        geometry.convertToStraightSegment()
    try:
        return shapely.from_wkb(bytes(geometry.asWkb()))
    except shapely.errors.GEOSException as error:
        kind = QgsWkbTypes.displayString(geometry.wkbType())
        raise BoundaryError(
            f"A geometry of the kind {kind} cannot be read ({error}): turn it into a polygon."
        ) from error
