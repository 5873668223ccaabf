"""The tools of the steering panel: what each is called, says, and does."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from qgis.gui import QgsMapCanvas

from qgis_plugin.steering.choose_tool import ChooseTool
from qgis_plugin.steering.control import Steering
from qgis_plugin.steering.drawing_tools import DrawTool, MergeTool
from qgis_plugin.steering.tools import PointTool, SteeringTool, StreetTool

CHOOSE, CUT, UNDO_CUT = "choose", "cut", "undo_cut"
LOCK, UNLOCK, MERGE = "lock", "unlock", "merge"
ADD_STREET, REMOVE_STREET = "add_street", "remove_street"


@dataclass(frozen=True)
class ToolButton:
    """A tool as the panel offers it; texts are translated where they are shown."""

    name: str
    label: str
    tip: str
    hint: str
    icon: str


TOOLS = (
    ToolButton(
        CHOOSE,
        "Choose cut",
        "Show the best ways of cutting a parcel, and choose one of them.",
        "Rest on a parcel to see how it may be cut. Click a line, or type its number.",
        "mActionSelect",
    ),
    ToolButton(
        CUT,
        "Draw cut",
        "Cut a parcel along a line of your own.",
        "Draw a line across a parcel: click its points, right-click to end. Esc starts over.",
        "mActionSplitFeatures",
    ),
    ToolButton(
        UNDO_CUT,
        "Undo cut",
        "Join the two halves that a parcel is one of.",
        "Click a parcel: it and its other half become one again.",
        "mActionRollbackEdits",
    ),
    ToolButton(
        LOCK,
        "Park",
        "Keep a parcel as it is: as a park, or for another use.",
        "Choose a use below, then click the parcel that is to be kept as it is.",
        "locked",
    ),
    ToolButton(
        UNLOCK,
        "Unlock",
        "Let a kept parcel be cut again.",
        "Click a kept parcel to let it be cut again.",
        "unlocked",
    ),
    ToolButton(
        MERGE,
        "Merge",
        "Join parcels to one, which is then kept as it is.",
        "Click the parcels to join; a second click takes one out. Right-click to join. "
        "Esc starts over.",
        "mActionMergeFeatures",
    ),
    ToolButton(
        ADD_STREET,
        "Draw street",
        "Add a street along a line of your own, or along boundaries of parcels.",
        "Draw a street: click its points, right-click to end. Esc starts over.",
        "mActionCaptureLine",
    ),
    ToolButton(
        REMOVE_STREET,
        "Remove street",
        "Take a street away, where all parcels stay reached.",
        "Click the street to take away, from junction to junction.",
        "mActionDeleteSelectedFeatures",
    ),
)


@dataclass(frozen=True)
class Options:
    """What the panel's options say at the moment a tool is used."""

    land_use: Callable[[], str]
    follow: Callable[[], bool]
    width: Callable[[], float | None]
    highlighted: Callable[[int], None]


def map_tools(
    canvas: QgsMapCanvas, steering: Steering, options: Options
) -> dict[str, SteeringTool]:
    """Return the tools by name."""
    return {
        CHOOSE: ChooseTool(canvas, steering, options.highlighted),
        CUT: DrawTool(canvas, steering, steering.cut),
        UNDO_CUT: PointTool(canvas, steering, lambda place, _: steering.undo_cut(place)),
        LOCK: PointTool(
            canvas, steering, lambda place, _: steering.lock(place, options.land_use())
        ),
        UNLOCK: PointTool(canvas, steering, lambda place, _: steering.unlock(place)),
        MERGE: MergeTool(canvas, steering),
        ADD_STREET: DrawTool(
            canvas,
            steering,
            lambda line: steering.add_street(line, follow=options.follow(), width=options.width()),
        ),
        REMOVE_STREET: StreetTool(canvas, steering, steering.remove_street),
    }
