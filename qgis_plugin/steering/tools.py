"""Tools that work on the map: point at a parcel, choose a cut, draw a line."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from qgis.core import (
    QgsCoordinateTransform,
    QgsCsException,
    QgsGeometry,
    QgsPointXY,
    QgsProject,
    QgsWkbTypes,
)
from qgis.gui import (
    QgsMapCanvas,
    QgsMapCanvasItem,
    QgsMapMouseEvent,
    QgsMapTool,
    QgsRubberBand,
)
from qgis.PyQt import sip
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtGui import QColor, QKeyEvent

from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.model import Hovered, Place

HOVER_MS = 80
"""Milliseconds that the cursor rests before it is asked what is under it."""

REACH_PIXELS = 12
OUTLINE, _FILL = QColor(20, 60, 120, 230), QColor(60, 120, 200, 45)
DRAWN = QColor(200, 30, 40, 220)


class SteeringTool(QgsMapTool):
    """What all tools share: coordinates, and the parcel under the cursor.

    Parameters
    ----------
    canvas
        The map.
    steering
        The session.
    """

    with_options = False
    """Whether the candidates of the parcel under the cursor are asked for."""

    hovers = True
    """Whether the parcel under the cursor is shown."""

    def __init__(self, canvas: QgsMapCanvas, steering: Steering) -> None:
        super().__init__(canvas)
        self.map = canvas
        self.steering = steering
        self.setCursor(Qt.CursorShape.CrossCursor)
        self.outline = QgsRubberBand(canvas, QgsWkbTypes.GeometryType.PolygonGeometry)
        self.outline.setStrokeColor(OUTLINE)
        self.outline.setFillColor(_FILL)
        self.outline.setWidth(2)
        self.under: Hovered | None = None
        self._at: Place | None = None
        self._timer = QTimer(self)
        self._timer.setSingleShot(True)
        self._timer.setInterval(HOVER_MS)
        self._timer.timeout.connect(self._ask)
        canvas.destinationCrsChanged.connect(self.reset)

    def activate(self) -> None:
        """Begin to listen."""
        super().activate()
        self.steering.hovered.connect(self.show_hovered)
        self.steering.viewed.connect(self._viewed)

    def deactivate(self) -> None:
        """Stop listening, and leave nothing on the map."""
        if self.isActive():
            self.steering.hovered.disconnect(self.show_hovered)
            self.steering.viewed.disconnect(self._viewed)
        self.reset()
        super().deactivate()

    def dispose(self) -> None:
        """Take away what the tool has on the map, for good."""
        if self.isActive():
            self.map.unsetMapTool(self)
        self.map.destinationCrsChanged.disconnect(self.reset)
        remove_item(self.map, self.outline)
        self.deleteLater()

    def reset(self) -> None:
        """Forget what was pointed at or drawn."""
        self._timer.stop()
        self._at = None
        self.show_hovered(None)

    def canvasMoveEvent(self, event: QgsMapMouseEvent) -> None:
        """Ask what is under the cursor, once it rests."""
        if self.hovers:
            self._at = self.place(event.mapPoint())
            self._timer.start()

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Cancel with Esc."""
        if event.key() == Qt.Key.Key_Escape:
            self.reset()
            event.accept()

    def show_hovered(self, hovered: Hovered | None) -> None:
        """Outline the parcel under the cursor."""
        self.under = hovered
        self.outline.reset(QgsWkbTypes.GeometryType.PolygonGeometry)
        if hovered is not None:
            self.outline.setToGeometry(geometry(hovered.outline), self.steering.crs)

    def to_map(self) -> QgsCoordinateTransform:
        """Return the way from the session's coordinates to those of the map."""
        crs = self.map.mapSettings().destinationCrs()
        return QgsCoordinateTransform(self.steering.crs, crs, QgsProject.instance())

    def place(self, point: QgsPointXY) -> Place | None:
        """Return the session's coordinates of a place of the map; None where there are none."""
        crs = self.map.mapSettings().destinationCrs()
        way = QgsCoordinateTransform(crs, self.steering.crs, QgsProject.instance())
        try:
            at = way.transform(point)
        except QgsCsException:
            return None
        return (at.x(), at.y())

    def reach(self, point: QgsPointXY) -> float:
        """Return the metres of the session that some pixels around a place stand for."""
        beside = QgsPointXY(point.x() + REACH_PIXELS * self.map.mapUnitsPerPixel(), point.y())
        a, b = self.place(point), self.place(beside)
        return QgsPointXY(*a).distance(QgsPointXY(*b)) if a and b else 0.0

    def _ask(self) -> None:
        if self._at is not None:
            self.steering.hover(self._at, with_options=self.with_options)

    def _viewed(self, view: Any) -> None:
        """After an edit what is under the cursor may be something else."""
        del view
        self.show_hovered(None)
        if self._at is not None:
            self._timer.start()


class PointTool(SteeringTool):
    """Does something where the user clicks.

    Parameters
    ----------
    act
        Called with the place, and with the reach of a click in metres.
    """

    def __init__(
        self,
        canvas: QgsMapCanvas,
        steering: Steering,
        act: Callable[[Place, float], None],
    ) -> None:
        super().__init__(canvas, steering)
        self.act = act

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Act where the left button was clicked."""
        place = self.place(event.mapPoint())
        if event.button() == Qt.MouseButton.LeftButton and place is not None:
            self.act(place, self.reach(event.mapPoint()))


class StreetTool(PointTool):
    """Does something with the street that the user clicks."""

    hovers = False

    def __init__(
        self,
        canvas: QgsMapCanvas,
        steering: Steering,
        act: Callable[[Place, float], None],
    ) -> None:
        super().__init__(canvas, steering, act)
        self.line = QgsRubberBand(canvas, QgsWkbTypes.GeometryType.LineGeometry)
        self.line.setColor(DRAWN)
        self.line.setWidth(5)

    def canvasMoveEvent(self, event: QgsMapMouseEvent) -> None:
        """Show the street next to the cursor."""
        self.line.reset(QgsWkbTypes.GeometryType.LineGeometry)
        place, reach = self.place(event.mapPoint()), self.reach(event.mapPoint())
        if place is None:
            return
        street = self.steering.layers.streets.nearest(QgsPointXY(*place), reach)
        if street is not None:
            self.line.setToGeometry(street, self.steering.crs)

    def reset(self) -> None:
        """Forget what was pointed at."""
        super().reset()
        self.line.reset(QgsWkbTypes.GeometryType.LineGeometry)

    def dispose(self) -> None:
        """Take away what the tool has on the map, for good."""
        remove_item(self.map, self.line)
        super().dispose()


def geometry(wkb: bytes) -> QgsGeometry:
    """Return a geometry of QGIS."""
    made = QgsGeometry()
    made.fromWkb(wkb)
    return made


def remove_item(canvas: QgsMapCanvas, item: QgsMapCanvasItem) -> None:
    """Take an item off the map, now: left to Python, it might die on another thread."""
    canvas.scene().removeItem(item)
    sip.delete(item)
