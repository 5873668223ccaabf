"""Candidate cuts drawn over the map, each with its rank and score."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from qgis.core import QgsCoordinateTransform, QgsGeometry, QgsPointXY
from qgis.gui import QgsMapCanvas, QgsMapCanvasItem
from qgis.PyQt.QtCore import QPointF, QRectF, Qt
from qgis.PyQt.QtGui import QBrush, QColor, QFont, QFontMetricsF, QPainter, QPainterPath, QPen

from qgis_plugin.steering.model import Option
from qgis_plugin.steering.style import CANDIDATE_COLOURS

_PLACES = tuple(i / 20 for i in range(2, 19))
"""Where along a line its badge may stand."""

_PADDING = 4.0
_ROOMY = 120.0
"""Pixels that lines are long at least to carry scores as well as ranks."""


@dataclass(frozen=True)
class DrawnOption:
    """A candidate with its line in the CRS of the map."""

    option: Option
    line: QgsGeometry

    @property
    def colour(self) -> QColor:
        """Colour of its rank."""
        return candidate_colour(self.option.rank)


def candidate_colour(rank: int) -> QColor:
    """Colour of the candidates of a rank."""
    return QColor(CANDIDATE_COLOURS[(rank - 1) % len(CANDIDATE_COLOURS)])


class CandidateOverlay(QgsMapCanvasItem):
    """The candidates of one parcel; the one next to the cursor stands out.

    Parameters
    ----------
    canvas
        The map, which owns the item.
    """

    def __init__(self, canvas: QgsMapCanvas) -> None:
        super().__init__(canvas)
        self._canvas = canvas
        self._drawn: tuple[DrawnOption, ...] = ()
        self.highlighted = 0
        self.setZValue(50)

    @property
    def ranks(self) -> tuple[int, ...]:
        """Ranks of the candidates that are shown."""
        return tuple(drawn.option.rank for drawn in self._drawn)

    def show_options(self, options: tuple[Option, ...], transform: QgsCoordinateTransform) -> None:
        """Show candidates, whose lines are transformed to the CRS of the map."""
        drawn = []
        for option in options:
            line = QgsGeometry()
            line.fromWkb(option.line)
            line.transform(transform)
            drawn.append(DrawnOption(option, line))
        self._drawn, self.highlighted = tuple(drawn), 0
        self.updatePosition()

    def clear(self) -> None:
        """Show nothing."""
        self._drawn, self.highlighted = (), 0
        self.updatePosition()

    def highlight(self, rank: int) -> None:
        """Have one candidate stand out; none for 0."""
        if rank != self.highlighted:
            self.highlighted = rank
            self.update()

    def nearest(self, place: QgsPointXY) -> int:
        """Return the rank of the candidate next to a place of the map; 0 where there is none."""
        here = QgsGeometry.fromPointXY(place)
        near = ((drawn.line.distance(here), drawn.option.rank) for drawn in self._drawn)
        return min(near, default=(0.0, 0))[1]

    def line_of(self, rank: int) -> QgsGeometry | None:
        """Return the line of a candidate on the map."""
        return next((d.line for d in self._drawn if d.option.rank == rank), None)

    def updatePosition(self) -> None:
        """Cover the map: QGIS calls this where its extent changes."""
        self.prepareGeometryChange()
        self.setPos(0, 0)
        self.update()

    def boundingRect(self) -> QRectF:
        """Return what the item covers: the map."""
        return QRectF(0, 0, self._canvas.width(), self._canvas.height())

    def paint(self, painter: QPainter, option: Any = None, widget: Any = None) -> None:
        """Draw lines, then badges over all of them."""
        del option, widget
        painter.setRenderHint(QPainter.RenderHint.Antialiasing)
        paths = [self._path(drawn.line) for drawn in self._drawn]
        for drawn, path in zip(self._drawn, paths, strict=True):
            self._paint_line(painter, drawn, path)
        font = QFont(painter.font())
        font.setPointSizeF(9.5)
        font.setBold(True)
        painter.setFont(font)
        roomy = min((path.length() for path in paths), default=0.0) >= _ROOMY
        taken: list[QRectF] = []
        for drawn, path in zip(self._drawn, paths, strict=True):
            label = self._label(drawn, roomy=roomy)
            size = QFontMetricsF(font).boundingRect(label).size()
            badge = _place(path, size.width() + 3 * _PADDING, size.height() + _PADDING, taken)
            taken.append(badge)
            self._paint_badge(painter, drawn, badge, label)

    def _paint_line(self, painter: QPainter, drawn: DrawnOption, path: QPainterPath) -> None:
        rank = drawn.option.rank
        strong = rank == self.highlighted
        width = 6.0 if strong else 4.0 if rank == 1 else 2.5
        style = Qt.PenStyle.SolidLine if strong or rank == 1 else Qt.PenStyle.DashLine
        painter.setBrush(QBrush(Qt.BrushStyle.NoBrush))
        painter.setPen(_pen(QColor(255, 255, 255, 220), width + 3, Qt.PenStyle.SolidLine))
        painter.drawPath(path)
        painter.setPen(_pen(drawn.colour, width, style))
        painter.drawPath(path)

    def _label(self, drawn: DrawnOption, *, roomy: bool) -> str:
        """What stands on a badge: without the score where there is little room."""
        option = drawn.option
        if not roomy and option.rank != self.highlighted:
            return str(option.rank)
        return f"{option.rank} · {option.score:.2f}"

    def _paint_badge(
        self, painter: QPainter, drawn: DrawnOption, badge: QRectF, label: str
    ) -> None:
        strong = drawn.option.rank == self.highlighted
        radius = badge.height() / 2
        painter.setPen(QPen(drawn.colour, 1.6))
        painter.setBrush(QBrush(drawn.colour if strong else QColor(255, 255, 255, 240)))
        painter.drawRoundedRect(badge, radius, radius)
        painter.setPen(QPen(QColor("white") if strong else drawn.colour.darker(125)))
        painter.drawText(badge, Qt.AlignmentFlag.AlignCenter, label)

    def _path(self, line: QgsGeometry) -> QPainterPath:
        path = QPainterPath()
        for i, vertex in enumerate(line.vertices()):
            at = self.toCanvasCoordinates(QgsPointXY(vertex))
            (path.lineTo if i else path.moveTo)(QPointF(at))
        return path


def _pen(colour: QColor, width: float, style: Qt.PenStyle) -> QPen:
    cap, join = Qt.PenCapStyle.FlatCap, Qt.PenJoinStyle.RoundJoin
    return QPen(QBrush(colour), width, style, cap, join)


def _place(path: QPainterPath, width: float, height: float, taken: list[QRectF]) -> QRectF:
    """Return where on a line a badge covers least of the other badges, the middle before all."""
    best, least = QRectF(), float("inf")
    for share in sorted(_PLACES, key=lambda share: abs(share - 0.5)):
        centre = path.pointAtPercent(share)
        badge = QRectF(centre.x() - width / 2, centre.y() - height / 2, width, height)
        covered = sum(_area(badge.intersected(other.adjusted(-3, -3, 3, 3))) for other in taken)
        if covered < least:
            best, least = badge, covered
    return best


def _area(rectangle: QRectF) -> float:
    return float(rectangle.width() * rectangle.height())
