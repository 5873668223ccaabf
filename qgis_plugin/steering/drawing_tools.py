"""Tools of several clicks: parcels to join, and lines."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsPointXY,
    QgsWkbTypes,
)
from qgis.gui import (
    QgsMapCanvas,
    QgsMapMouseEvent,
    QgsRubberBand,
    QgsVertexMarker,
)
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QColor, QKeyEvent

from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.model import Hovered, Place
from qgis_plugin.steering.tools import DRAWN, OUTLINE, SteeringTool, geometry, remove_item

_CHOSEN = QColor(240, 150, 30, 90)
_FINISHING = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


class MergeTool(SteeringTool):
    """Collects parcels by clicks; a right click or Enter joins them."""

    def __init__(self, canvas: QgsMapCanvas, steering: Steering) -> None:
        super().__init__(canvas, steering)
        self.chosen: dict[int, Hovered] = {}
        self.marks = QgsRubberBand(canvas, QgsWkbTypes.GeometryType.PolygonGeometry)
        self.marks.setStrokeColor(OUTLINE)
        self.marks.setFillColor(_CHOSEN)
        self.marks.setWidth(2)

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Take a parcel in or out; join with the right button."""
        if event.button() == Qt.MouseButton.RightButton:
            self.finish()
            return
        clicked = self.place(event.mapPoint())
        if clicked is not None:
            self.steering.pick(clicked, self._toggle)

    def _toggle(self, picked: Hovered | None) -> None:
        """Mark a parcel that was clicked, or take its mark away."""
        if picked is not None:
            if self.chosen.pop(picked.parcel, None) is None:
                self.chosen[picked.parcel] = picked
            self._mark()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Join with Enter."""
        if event.key() in _FINISHING:
            self.finish()
            event.accept()
        else:
            super().keyPressEvent(event)

    def finish(self) -> None:
        """Join what was clicked."""
        if self.chosen:
            self.steering.merge(tuple(self.chosen))
            self.reset()

    def reset(self) -> None:
        """Forget what was clicked."""
        self.chosen.clear()
        self._mark()
        super().reset()

    def dispose(self) -> None:
        """Take away what the tool has on the map, for good."""
        super().dispose()
        remove_item(self.map, self.marks)

    def _mark(self) -> None:
        self.marks.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        for parcel in self.chosen.values():
            self.marks.addGeometry(geometry(parcel.outline), self.steering.crs)


class DrawTool(SteeringTool):
    """Draws a line by clicks; a right click or Enter ends it, Backspace takes a point back.

    Parameters
    ----------
    finished
        Called with the points in the session's coordinates.
    """

    hovers = False

    def __init__(
        self,
        canvas: QgsMapCanvas,
        steering: Steering,
        finished: Callable[[list[Place]], None],
    ) -> None:
        super().__init__(canvas, steering)
        self.finished = finished
        self.points: list[QgsPointXY] = []
        self.line = QgsRubberBand(canvas, QgsWkbTypes.GeometryType.LineGeometry)
        self.line.setColor(DRAWN)
        self.line.setWidth(3)
        self.mark = QgsVertexMarker(canvas)
        self.mark.setIconType(QgsVertexMarker.IconType.ICON_BOX)
        self.mark.setColor(DRAWN)
        self.mark.setIconSize(12)
        self.mark.setPenWidth(2)
        self.mark.setVisible(False)

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Set a point; end with the right button."""
        if event.button() == Qt.MouseButton.RightButton:
            self.finish()
        elif event.button() == Qt.MouseButton.LeftButton:
            self.points.append(self._snapped(event))
            self._draw()

    def canvasMoveEvent(self, event: QgsMapMouseEvent) -> None:
        """Draw on to the cursor."""
        at = self._snapped(event)
        if self.points:
            self._draw(at)
        self.mark.setCenter(at)
        self.mark.setVisible(at != event.originalMapPoint())

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """End with Enter, go back with Backspace."""
        if event.key() in _FINISHING:
            self.finish()
            event.accept()
        elif event.key() in (Qt.Key.Key_Backspace, Qt.Key.Key_Delete):
            del self.points[-1:]
            self._draw()
            event.accept()
        else:
            super().keyPressEvent(event)

    def finish(self) -> None:
        """Hand over the line."""
        places = [self.place(point) for point in self.points]
        known = [place for place in places if place is not None]
        self.reset()
        if len(known) >= 2:
            self.finished(known)

    def reset(self) -> None:
        """Forget what was drawn."""
        self.points = []
        self._draw()
        self.mark.setVisible(False)
        super().reset()

    def dispose(self) -> None:
        """Take away what the tool has on the map, for good."""
        super().dispose()
        for item in (self.line, self.mark):
            remove_item(self.map, item)

    def _snapped(self, event: QgsMapMouseEvent) -> QgsPointXY:
        """Where QGIS snaps to, or else the corner or boundary of a parcel next to the cursor."""
        point = event.snapPoint()
        if event.isSnapped():
            return point
        place = self.place(point)
        if place is None:
            return point
        near = self.steering.layers.parcels.snapped(QgsPointXY(*place), self.reach(point))
        return point if near is None else self.to_map().transform(near)

    def _draw(self, *further: QgsPointXY) -> None:
        self.line.reset(QgsWkbTypes.GeometryType.LineGeometry)
        for point in (*self.points, *further):
            self.line.addPoint(point)
