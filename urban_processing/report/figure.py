"""Figures in the shape of the land, written to files that are the same for the same map."""

from __future__ import annotations

import io
from pathlib import Path
from typing import TYPE_CHECKING, Any

import matplotlib as mpl
import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.path import Path as Outline

from urban_processing.errors import OutputError
from urban_processing.paths import map_problems
from urban_processing.report.legend import root_figure
from urban_processing.report.palette import INK, Scale, text_points

if TYPE_CHECKING:
    from matplotlib.axes import Axes

Extent = tuple[float, float, float, float]
"""West, south, east and north of a map."""

PAD = 0.012
"""Space around the land, relative to its longer side."""

DOTS_PER_INCH = 200

_REPRODUCIBLE: dict[Any, Any] = {"svg.hashsalt": "urban_processing", "svg.fonttype": "path"}
_NO_DATES: dict[str, dict[str, Any]] = {
    ".png": {"Software": None},
    ".svg": {"Date": None},
    ".pdf": {"CreationDate": None, "ModDate": None},
}


class MapFigure(Figure):
    """A figure that notebooks show without a plotting backend."""

    def _repr_png_(self) -> bytes:
        buffer = io.BytesIO()
        self.savefig(buffer, format="png", dpi=DOTS_PER_INCH / 2)
        return buffer.getvalue()


def checked(path: Path) -> Path:
    """Return the path of a map if it can be written there; raises `OutputError` if not."""
    problems = map_problems(path)
    if problems:
        raise OutputError(problems)
    return path


def save(figure: Figure, path: Path) -> None:
    """Write a figure; raises `OutputError` if that fails."""
    suffix = path.suffix.lower()
    drawn = io.BytesIO()
    with mpl.rc_context(_REPRODUCIBLE):
        figure.savefig(drawn, format=suffix[1:], dpi=DOTS_PER_INCH, metadata=_NO_DATES[suffix])
    try:
        path.write_bytes(drawn.getvalue())
    except OSError as error:
        raise OutputError(f"The map {path} cannot be written: {error.strerror}.") from error


def new_axes(extent: Extent, *, title: str, longer: float) -> Axes:
    """Make a figure in the shape of the land, with strips for the title and the legend.

    `longer` is the length of its longer side in inches.
    """
    x0, y0, x1, y1 = extent
    factor = longer / max(x1 - x0, y1 - y0)
    text = text_points(longer) / 8
    margin, head, foot = 0.2, 0.4 * text if title else 0.0, 0.42 * text
    width = max(factor * (x1 - x0), 5.5) + 2 * margin
    height = factor * (y1 - y0) + 2 * margin + head + foot
    figure = MapFigure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(figure)
    ax = figure.add_axes(
        (
            margin / width,
            (foot + margin) / height,
            1 - 2 * margin / width,
            1 - (2 * margin + head + foot) / height,
        )
    )
    if title:
        figure.text(
            margin / width,
            1 - 0.16 / height,
            title,
            va="top",
            size=13 * text,
            weight="bold",
            color=INK,
        )
    return ax


def extent_of(geometry: npt.NDArray[np.object_]) -> Extent:
    """Return the bounds of some geometries."""
    x0, y0, x1, y1 = shapely.total_bounds(geometry)
    return float(x0), float(y0), float(x1), float(y1)


def frame_land(ax: Axes, extent: Extent) -> None:
    """Show an extent with some space around, at equal aspect and without axes."""
    x0, y0, x1, y1 = extent
    ax.set_aspect("equal")
    pad = PAD * max(x1 - x0, y1 - y0)
    ax.set_xlim(x0 - pad, x1 + pad)
    ax.set_ylim(y0 - pad, y1 + pad)
    ax.axis("off")


def scale_of(ax: Axes, parcel_area: npt.NDArray[np.float64]) -> Scale:
    """Points on paper for each metre on the ground, at equal aspect, and the parcels' side."""
    box = ax.get_window_extent()
    width, height = box.width * 72 / root_figure(ax).dpi, box.height * 72 / root_figure(ax).dpi
    left, right = ax.get_xlim()
    bottom, top = ax.get_ylim()
    points = min(width / (right - left), height / (top - bottom))
    side = float(np.sqrt(np.median(parcel_area)))
    return Scale(points, side, text_points(max(width, height) / 72))


def outline(polygon: shapely.Polygon) -> Outline:
    """Return the outline of a polygon with its holes."""
    rings = [polygon.exterior, *polygon.interiors]
    paths = [Outline(shapely.get_coordinates(ring), closed=True) for ring in rings]
    return paths[0] if len(paths) == 1 else Outline.make_compound_path(*paths)
