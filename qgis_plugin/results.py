"""Tables of a layout to the sinks of QGIS."""

from __future__ import annotations

import itertools
from collections.abc import Iterator

import numpy as np
import numpy.typing as npt
import shapely
from qgis.core import (
    QgsFeature,
    QgsFeatureSink,
    QgsFields,
    QgsGeometry,
    QgsProcessingException,
    QgsWkbTypes,
)

from qgis_plugin import compat
from qgis_plugin.crs_text import crs_of
from qgis_plugin.definitions import SinkName
from qgis_plugin.destinations import Destinations
from qgis_plugin.styling import ResultGroup
from urban_processing.layout_file.geopackage import field_values
from urban_processing.schema import GeometryType, Layer
from urban_processing.tables import Table

_TYPES = {
    GeometryType.NONE: QgsWkbTypes.Type.NoGeometry,
    GeometryType.POINT: QgsWkbTypes.Type.Point,
    GeometryType.LINE: QgsWkbTypes.Type.LineString,
    GeometryType.POLYGON: QgsWkbTypes.Type.Polygon,
    GeometryType.ANY: QgsWkbTypes.Type.Point,
}


_AT_ONCE = 1000
"""Number of features that are handed to a sink at once, so that memory stays bounded."""


def write_sink(
    sink: SinkName,
    table: Table | None,
    destinations: Destinations,
    *,
    crs: str,
    group: ResultGroup,
) -> str:
    """Write a table to its sink and return the layer's id.

    Parameters
    ----------
    sink
        The sink; asked for by the user.
    table
        Its rows; None where the layout has no such layer, which gives a layer without rows.
    destinations
        Where it goes.
    crs
        CRS of the geometries as text.
    group
        Where the layer will stand, and in what style.
    """
    algorithm = destinations.algorithm
    layer, name = sink.layer, sink.parameter
    geometry = _geometry(layer, table)
    several = geometry is not None and shapely.get_num_geometries(geometry).max(initial=0) > 1
    kind = _TYPES[layer.geometry]
    fields = QgsFields()
    for column in layer.columns:
        fields.append(compat.field(column))
    made, layer_id = algorithm.parameterAsSink(
        destinations.parameters,
        name,
        destinations.context,
        fields,
        QgsWkbTypes.multiType(kind) if several else kind,
        crs_of(crs),
    )
    if made is None:
        raise QgsProcessingException(algorithm.invalidSinkError(destinations.parameters, name))
    if table is not None:
        features = _features(layer, table, geometry, fields, several=bool(several))
        while some := list(itertools.islice(features, _AT_ONCE)):
            if not made.addFeatures(some, QgsFeatureSink.Flag.FastInsert):
                raise QgsProcessingException(
                    f"{layer.title} could not be written: {made.lastError()}"
                )
    if destinations.context.willLoadLayerOnCompletion(layer_id):
        group.will_load(layer, layer_id, destinations.context, algorithm.provider())
    return str(layer_id)


def _geometry(layer: Layer, table: Table | None) -> npt.NDArray[np.object_] | None:
    """Geometries of a layer that has them; a place inside, where areas and places mix."""
    if table is None or table.geometry is None:
        return None
    if layer.geometry is GeometryType.ANY:
        return np.asarray(shapely.point_on_surface(table.geometry))
    return table.geometry


def _features(
    layer: Layer,
    table: Table,
    geometry: npt.NDArray[np.object_] | None,
    fields: QgsFields,
    *,
    several: bool,
) -> Iterator[QgsFeature]:
    wkb = [None] * len(table) if geometry is None else shapely.to_wkb(geometry).tolist()
    for row, shape in zip(zip(*field_values(layer, table), strict=True), wkb, strict=True):
        feature = QgsFeature(fields)
        feature.setAttributes(list(row))
        if shape is not None:
            made = QgsGeometry()
            made.fromWkb(shape)
            if several:
                made.convertToMultiType()
            feature.setGeometry(made)
        yield feature
