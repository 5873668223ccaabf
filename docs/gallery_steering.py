"""A layout steered level by level, for docs/gallery.md (Chen 2024, Fig. 15).

The edits are those of ``sample_data/steering.json``; each stage is drawn after some of them.
"""

from __future__ import annotations

from collections.abc import Callable

from gallery_drawing import SAMPLES, sheet
from matplotlib.axes import Axes
from matplotlib.figure import Figure

import urban_processing as up
from urban_processing.io.frames import GeoLayout

STAGES = {
    0: "(a) the land",
    2: "(b) two streets drawn",
    3: "(c) level 1",
    5: "(d) another cut chosen in the north-west",
    7: "(f) level 3",
    9: "(g) a cut undone, its parcel kept as park",
    11: "(i) level 5",
    12: "(j) a street added in the south-west",
}
"""Title of the picture after so many edits; the letters are those of the paper's figure."""

PARCEL, PARK, LINE, STREET, DRAWN = "#f6f4ee", "#b9d6a0", "#aaa396", "#4a463f", "#e07b1f"


def steering() -> Figure:
    """Stages of a layout that is steered, streets that the planner drew in orange."""
    session = up.steer(SAMPLES / "irregular_64ha.gpkg", replay=SAMPLES / "steering.json")
    last = len(session.edits)
    while session.can_undo:
        session.undo()
    panels = []
    for done in range(last + 1):
        if done:
            session.redo()
        if done in STAGES:
            panels.append((STAGES[done], _Stage(session.view)))
    finished = f"(l) finished: {len(session.parcels)} parcels"
    return sheet([*panels, (finished, _Stage(session.view))], columns=3, ratio=0.9)


class _Stage:
    """A layout in the making, drawn without judging its parcels."""

    def __init__(self, view: GeoLayout) -> None:
        self.parcels, self.streets = view.parcels, view.streets

    def plot(self, *, ax: Axes) -> None:
        """Draw it."""
        colours = [PARK if locked else PARCEL for locked in self.parcels.locked]
        self.parcels.plot(ax=ax, color=colours, edgecolor=LINE, linewidth=0.7)
        drawn = self.streets.fixed_id.notna()
        self.streets[~drawn].plot(ax=ax, color=STREET, linewidth=2.4)
        if drawn.any():
            self.streets[drawn].plot(ax=ax, color=DRAWN, linewidth=3.0)
        ax.set_aspect("equal")
        ax.axis("off")


PICTURES: dict[str, Callable[[], Figure]] = {"steering": steering}
"""Name of a picture's file, and the function that makes it."""
