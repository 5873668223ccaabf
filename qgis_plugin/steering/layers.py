"""The two layers that show a session, kept up to date feature by feature."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Hashable, Iterable, Iterator, Mapping
from math import inf
from typing import Any, TypeVar

from qgis.core import (
    QgsFeature,
    QgsFeatureRequest,
    QgsFeatureSink,
    QgsFields,
    QgsGeometry,
    QgsLayerTreeGroup,
    QgsPointXY,
    QgsProject,
    QgsRectangle,
    QgsVectorLayer,
)
from qgis.PyQt.QtCore import QObject, pyqtSignal

from qgis_plugin.crs_text import crs_of
from qgis_plugin.steering.fields import parcel_columns, parcel_fields, street_columns, street_fields
from qgis_plugin.steering.model import Difference
from qgis_plugin.steering.style import style_parcels, style_streets
from qgis_plugin.texts import tr
from urban_processing.schema import Column

_AT_ONCE = 400
"""Number of features that are changed before the window gets its turn."""

T = TypeVar("T")


class SteeringLayers(QObject):
    """Parcels and streets of a session in the project's layer tree."""

    hand_edited = pyqtSignal()
    """Somebody edits one of the layers, or does so no more."""

    gone = pyqtSignal()
    """Somebody took one of the layers out of the project."""

    def __init__(self) -> None:
        super().__init__()
        self.parcels = _ShownLayer(self, "Polygon", parcel_fields(), parcel_columns())
        self.streets = _ShownLayer(self, "LineString", street_fields(), street_columns())
        self._both = (self.parcels, self.streets)

    @property
    def are_there(self) -> bool:
        """Whether both layers are in the project."""
        return all(shown.layer is not None for shown in self._both)

    @property
    def are_edited(self) -> bool:
        """Whether somebody edits the layers, or has edited them since the session was shown."""
        return any(shown.is_edited for shown in self._both)

    def make(self, crs: str) -> None:
        """Put empty layers into the project, instead of those that are left of others."""
        self.remove()
        group = QgsProject.instance().layerTreeRoot().insertGroup(0, tr("Steering"))
        self.streets.make(tr("Streets (steering)"), crs, group, style_streets)
        self.parcels.make(tr("Parcels (steering)"), crs, group, style_parcels)
        for expanded in (False, True):  # the tree's view has closed it, without telling it
            group.setExpanded(expanded)

    def remove(self) -> None:
        """Take the layers out of the project, and their group if nothing else is in it."""
        for shown in self._both:
            shown.remove()

    def changes(self, difference: Difference) -> Iterator[None]:
        """Change the features that differ, some at a time: the window lives between them."""
        whole = difference.whole
        yield from self.parcels.changes(difference.parcels_gone, difference.parcels, whole=whole)
        yield from self.streets.changes(difference.streets_gone, difference.streets, whole=whole)
        for shown in self._both:
            shown.redraw()

    def set_read_only(self, read_only: bool) -> None:
        """Let nobody edit the layers while they are about to change, or let them again."""
        for shown in self._both:
            shown.set_read_only(read_only)

    def undo_hand_edits(self) -> None:
        """Leave the layers' edit mode without keeping anything."""
        for shown in self._both:
            shown.roll_back()

    def drawn(self) -> tuple[list[bytes], list[bytes]]:
        """Return the geometries of parcels and streets as they were edited, as WKB."""
        return self.parcels.drawn(), self.streets.drawn()


class _ShownLayer:
    """One of the layers, and which feature shows what."""

    def __init__(
        self, owner: SteeringLayers, kind: str, fields: QgsFields, columns: Iterable[Column]
    ) -> None:
        self._owner = owner
        self._kind = kind
        self._fields = fields
        self._columns = tuple(columns)
        self._ids: dict[Hashable, int] = {}
        self._touched = False
        self.layer: QgsVectorLayer | None = None

    @property
    def is_edited(self) -> bool:
        return self.layer is not None and (self._touched or self.layer.isEditable())

    def make(
        self, title: str, crs: str, group: QgsLayerTreeGroup, style: Callable[[Any], None]
    ) -> None:
        layer = QgsVectorLayer(self._kind, title, "memory")
        layer.setCrs(crs_of(crs))
        layer.dataProvider().addAttributes(self._fields.toList())
        layer.updateFields()
        layer.dataProvider().createSpatialIndex()
        for column in self._columns:
            layer.setFieldAlias(layer.fields().lookupField(column.name), column.label)
        style(layer)
        self.layer, self._ids, self._touched = layer, {}, False
        QgsProject.instance().addMapLayer(layer, False)
        group.addLayer(layer)
        layer.willBeDeleted.connect(self._forget)
        for signal in (layer.editingStarted, layer.editingStopped):
            signal.connect(self._owner.hand_edited)
        for signal in (
            layer.committedFeaturesAdded,
            layer.committedFeaturesRemoved,
            layer.committedGeometriesChanges,
        ):
            signal.connect(self._touch)

    def remove(self) -> None:
        layer = self.layer
        if layer is None:
            return
        layer.willBeDeleted.disconnect(self._forget)
        self._drop()
        node = QgsProject.instance().layerTreeRoot().findLayer(layer.id())
        group = None if node is None else node.parent()
        layer.rollBack()
        QgsProject.instance().removeMapLayer(layer.id())
        if group is not None and group.parent() is not None and not group.children():
            group.parent().removeChildNode(group)

    def changes(
        self, gone: Iterable[Hashable], come: Mapping[Any, QgsFeature], *, whole: bool
    ) -> Iterator[None]:
        if whole:
            self._empty()
        else:
            for keys in _portions(gone):
                self._delete(keys)
                yield
        for items in _portions(come.items()):
            self._add(dict(items))
            yield

    def redraw(self) -> None:
        if self.layer is not None:
            self.layer.updateExtents()
            self.layer.triggerRepaint()

    def _empty(self) -> None:
        if self.layer is not None:
            self.layer.dataProvider().truncate()
        self._ids, self._touched = {}, False

    def _delete(self, keys: Iterable[Hashable]) -> None:
        ids = [self._ids.pop(key) for key in keys if key in self._ids]
        if self.layer is not None and ids:
            self.layer.dataProvider().deleteFeatures(ids)

    def _add(self, features: Mapping[Any, QgsFeature]) -> None:
        if self.layer is None:
            return
        provider = self.layer.dataProvider()
        done, added = provider.addFeatures(list(features.values()), QgsFeatureSink.Flag.FastInsert)
        if not done:
            raise OSError(f"The layer {self.layer.name()} could not be changed.")
        self._ids.update(zip(features, (feature.id() for feature in added), strict=True))

    def set_read_only(self, read_only: bool) -> None:
        if self.layer is not None and not self.layer.isEditable():
            self.layer.setReadOnly(read_only)

    def roll_back(self) -> None:
        if self.layer is not None and self.layer.isEditable():
            self.layer.rollBack()

    def drawn(self) -> list[bytes]:
        if self.layer is None:
            return []
        request = QgsFeatureRequest().setNoAttributes()
        shapes = (feature.geometry() for feature in self.layer.getFeatures(request))
        return [bytes(shape.asWkb()) for shape in shapes if not shape.isNull()]

    def nearest(self, place: QgsPointXY, reach: float) -> QgsGeometry | None:
        """Return the geometry that is nearest to a place, no farther than `reach`."""
        here = QgsGeometry.fromPointXY(place)
        found = self._around(place, reach)
        near = [(shape.distance(here), i) for i, shape in enumerate(found)]
        best = min(near, default=(reach, -1))
        return found[best[1]] if best[1] >= 0 and best[0] <= reach else None

    def snapped(self, place: QgsPointXY, reach: float) -> QgsPointXY | None:
        """Return the corner that is nearest to a place, else the nearest place of a boundary.

        None where neither lies within `reach`.
        """
        corners, sides = [], []
        for shape in self._around(place, reach):
            corner, *_, squared = shape.closestVertex(place)
            corners.append((squared, corner.x(), corner.y()))
            squared, side, *_ = shape.closestSegmentWithContext(place)
            sides.append((squared, side.x(), side.y()))
        for found in (corners, sides):
            squared, x, y = min(found, default=(inf, 0.0, 0.0))
            if squared <= reach**2:
                return QgsPointXY(x, y)
        return None

    def _around(self, place: QgsPointXY, reach: float) -> list[QgsGeometry]:
        if self.layer is None:
            return []
        around = QgsRectangle.fromCenterAndSize(place, 2 * reach, 2 * reach)
        request = QgsFeatureRequest().setFilterRect(around).setNoAttributes()
        return [feature.geometry() for feature in self.layer.getFeatures(request)]

    def _touch(self) -> None:
        self._touched = True
        self._owner.hand_edited.emit()

    def _forget(self) -> None:
        self._drop()
        self._owner.gone.emit()

    def _drop(self) -> None:
        self.layer, self._ids, self._touched = None, {}, False


def _portions(items: Iterable[T]) -> Iterator[list[T]]:
    left = iter(items)
    while some := list(itertools.islice(left, _AT_ONCE)):
        yield some
