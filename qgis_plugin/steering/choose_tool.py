"""The tool that shows the candidates of a parcel, and chooses one."""

from __future__ import annotations

from collections.abc import Callable

from qgis.core import (
    QgsPointXY,
)
from qgis.gui import (
    QgsMapCanvas,
    QgsMapMouseEvent,
)
from qgis.PyQt.QtCore import Qt
from qgis.PyQt.QtGui import QKeyEvent

from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.model import Hovered
from qgis_plugin.steering.overlay import CandidateOverlay
from qgis_plugin.steering.tools import SteeringTool, geometry, remove_item


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
