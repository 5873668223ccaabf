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
    QgsVertexMarker,
)
from qgis.PyQt import sip
from qgis.PyQt.QtCore import Qt, QTimer
from qgis.PyQt.QtGui import QColor, QKeyEvent

from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.model import Hovered, Place
from qgis_plugin.steering.overlay import CandidateOverlay

HOVER_MS = 80
"""Milliseconds that the cursor rests before it is asked what is under it."""

REACH_PIXELS = 12
_OUTLINE, _FILL = QColor(20, 60, 120, 230), QColor(60, 120, 200, 45)
_CHOSEN = QColor(240, 150, 30, 90)
_DRAWN = QColor(200, 30, 40, 220)
_FINISHING = (Qt.Key.Key_Return, Qt.Key.Key_Enter)


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
        self.outline.setStrokeColor(_OUTLINE)
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
        self.line.setColor(_DRAWN)
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


class ChooseTool(SteeringTool):
    """Shows the candidates of the parcel under the cursor; a click or a number chooses one."""

    with_options = True

    def __init__(
        self,
        canvas: QgsMapCanvas,
        steering: Steering,
        highlighted: Callable[[int], None],
    ) -> None:
        super().__init__(canvas, steering)
        self.overlay = CandidateOverlay(canvas)
        self.highlighted = highlighted

    def show_hovered(self, hovered: Hovered | None) -> None:
        """Draw the candidates of the parcel under the cursor."""
        super().show_hovered(hovered)
        if hovered is None:
            self.overlay.clear()
        else:
            self.overlay.show_options(hovered.options, self.to_map())

    def canvasMoveEvent(self, event: QgsMapMouseEvent) -> None:
        """Have the candidate next to the cursor stand out, and look at another parcel."""
        super().canvasMoveEvent(event)
        if self._is_under(event.mapPoint()):
            self._timer.stop()  # what is shown is what would be asked for
            self.highlight(self.overlay.nearest(event.mapPoint()))

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Choose the candidate next to the click."""
        if event.button() == Qt.MouseButton.LeftButton and self._is_under(event.mapPoint()):
            self.choose(self.overlay.nearest(event.mapPoint()))

    def keyPressEvent(self, event: QKeyEvent) -> None:
        """Choose by number."""
        text = event.text()
        if text.isdigit() and int(text) in self.overlay.ranks:
            self.choose(int(text))
            event.accept()
        else:
            super().keyPressEvent(event)

    def highlight(self, rank: int) -> None:
        """Have a candidate stand out on the map and in the list."""
        self.overlay.highlight(rank)
        self.highlighted(rank)

    def choose(self, rank: int) -> None:
        """Cut the parcel under the cursor by a candidate."""
        if self.under is not None and rank:
            self.steering.choose(self.under.parcel, rank)

    def dispose(self) -> None:
        """Take away what the tool has on the map, for good."""
        super().dispose()
        remove_item(self.map, self.overlay)

    def _is_under(self, point: QgsPointXY) -> bool:
        place = self.place(point)
        if self.under is None or place is None:
            return False
        return bool(geometry(self.under.outline).contains(QgsPointXY(*place)))


class MergeTool(SteeringTool):
    """Collects parcels by clicks; a right click or Enter joins them."""

    def __init__(self, canvas: QgsMapCanvas, steering: Steering) -> None:
        super().__init__(canvas, steering)
        self.chosen: dict[int, Hovered] = {}
        self._clicked: Place | None = None
        self.marks = QgsRubberBand(canvas, QgsWkbTypes.GeometryType.PolygonGeometry)
        self.marks.setStrokeColor(_OUTLINE)
        self.marks.setFillColor(_CHOSEN)
        self.marks.setWidth(2)

    def canvasReleaseEvent(self, event: QgsMapMouseEvent) -> None:
        """Take a parcel in or out; join with the right button."""
        if event.button() == Qt.MouseButton.RightButton:
            self.finish()
            return
        self._clicked = self.place(event.mapPoint())
        if self._clicked is not None:
            self.steering.hover(self._clicked, with_options=False)

    def show_hovered(self, hovered: Hovered | None) -> None:
        """Outline the parcel under the cursor, and mark it if it was clicked."""
        super().show_hovered(hovered)
        if hovered is None or self._clicked is None:
            return
        if geometry(hovered.outline).contains(QgsPointXY(*self._clicked)):
            if self.chosen.pop(hovered.parcel, None) is None:
                self.chosen[hovered.parcel] = hovered
            self._clicked = None
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
        self._clicked = None
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
        self.line.setColor(_DRAWN)
        self.line.setWidth(3)
        self.mark = QgsVertexMarker(canvas)
        self.mark.setIconType(QgsVertexMarker.IconType.ICON_BOX)
        self.mark.setColor(_DRAWN)
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


def geometry(wkb: bytes) -> QgsGeometry:
    """Return a geometry of QGIS."""
    made = QgsGeometry()
    made.fromWkb(wkb)
    return made


def remove_item(canvas: QgsMapCanvas, item: QgsMapCanvasItem) -> None:
    """Take an item off the map, now: left to Python, it might die on another thread."""
    canvas.scene().removeItem(item)
    sip.delete(item)
