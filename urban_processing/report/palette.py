"""Colours and sizes of maps."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
from matplotlib.colors import LinearSegmentedColormap, to_rgb

from urban_processing.layout import PARCEL_USE, REMNANT_USE
from urban_processing.mesh.corners import IRREGULAR
from urban_processing.tables import Table

STRONGLY_IRREGULAR = 0.5
"""Irregularity from which the tint has its full strength."""

FloatArray = npt.NDArray[np.float64]

INK, FAINT = "#4a463f", "#8c8579"
PARCEL, OUTLINE = "#f6f4ee", "#aaa396"
TRIANGLE = "#b6a0d6"
SURFACE = "#d9d5cb"
BLOCK, PATIO = "#ece7da", "#d5e3c6"
KEPT = "#b9d6a0"
IRREGULAR_RAMP = LinearSegmentedColormap.from_list("irregular", ["#f9dcd0", "#ee8f76", "#d0342c"])
VALUE_RAMP = LinearSegmentedColormap.from_list(
    "value", ["#f7f3dc", "#b9dcc0", "#63b3bd", "#2f7aa8", "#2b4a86"]
)
STREET, CASING = "#ffcc46", "#8a6b1f"
FIXED_STREET, FIXED_CASING = "#9dbad2", "#4c6a84"
OBSTACLE = "#d3e0e4"
PLAIN_STREET, PLAIN_CASING = "#ffffff", "#8c8579"


WIDEST_STREET = 5.0
"""Width of a street in points that is not exceeded unless it is true to scale."""


@dataclass(frozen=True)
class Scale:
    """Sizes on paper.

    Parameters
    ----------
    points_per_metre
        Of paper and of ground.
    side
        Typical side of a parcel in metres.
    text
        Size of letters in points.
    """

    points_per_metre: float
    side: float
    text: float

    @property
    def parcel_points(self) -> float:
        """Side of a parcel in points."""
        return self.side * self.points_per_metre

    @property
    def outline(self) -> float:
        """Line width of parcels in points."""
        return float(np.clip(0.025 * self.parcel_points, 0.12, 0.6))

    @property
    def casing(self) -> float:
        """Width of the casing on each side of a street in points."""
        return float(np.clip(0.035 * self.parcel_points, 0.2, 0.7))

    def street(self, width_m: FloatArray) -> FloatArray:
        """Line widths in points: true to scale within what reads well beside parcels."""
        shown = np.clip(width_m, 0.11 * self.side, 0.2 * self.side)
        # classes stay apart where all true widths are out of range
        shown = shown * np.clip(width_m / np.median(width_m), 0.8, 1.25) ** 0.5
        widest = np.maximum(WIDEST_STREET, width_m * self.points_per_metre)
        return np.asarray(np.clip(shown * self.points_per_metre, 0.45, widest))


def text_points(longer: float) -> float:
    """Size of letters on a figure whose longer side has so many inches."""
    return float(np.clip(0.75 * longer, 8.0, 13.0))


def parcel_colours(parcels: Table) -> FloatArray:
    """(F, 3) fill of parcels: light, red by irregularity, violet for triangles.

    Those that are kept for another use are green.
    """
    colours = np.tile(to_rgb(PARCEL), (len(parcels), 1))
    irregularity = parcels["irregularity"]
    irregular = irregularity > IRREGULAR
    strength = (irregularity[irregular] - IRREGULAR) / (STRONGLY_IRREGULAR - IRREGULAR)
    colours[irregular] = IRREGULAR_RAMP(np.clip(strength, 0, 1))[:, :3]
    colours[parcels["sides"] == 3] = to_rgb(TRIANGLE)
    colours[is_kept(parcels)] = to_rgb(KEPT)
    return colours


def is_kept(parcels: Table) -> npt.NDArray[np.bool_]:
    """(F,) parcels that are locked for a use of their own."""
    if "locked" not in parcels.columns:
        return np.zeros(len(parcels), dtype=bool)
    plain = np.isin(parcels["land_use"].astype(str), (PARCEL_USE, REMNANT_USE))
    return np.asarray(parcels["locked"].astype(bool) & ~plain)
