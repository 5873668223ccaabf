"""A small writer of drawings in SVG: shapes in whole units, as short as they can be said."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt
import shapely

Geometries = npt.NDArray[np.object_]
FloatArray = npt.NDArray[np.float64]

PARCEL_UNITS = 40.0
"""Units of a drawing along the side of a typical shape."""

FEWEST, MOST = 1000.0, 6000.0
"""Units along the longer side of a drawing."""

TOLERANCE = 0.4
"""Units that a line may be off when it is simplified."""


@dataclass(frozen=True)
class Canvas:
    """Where ground lies on a drawing; y points down there.

    Parameters
    ----------
    left, top
        Map coordinates of the upper left corner.
    factor
        Units of the drawing for each metre.
    width, height
        Size of the drawing in units.
    """

    left: float
    top: float
    factor: float
    width: int
    height: int

    def units(self, xy: FloatArray) -> npt.NDArray[np.int64]:
        """(n, 2) whole units of (n, 2) map coordinates."""
        moved = (xy - (self.left, self.top)) * (self.factor, -self.factor)
        return np.rint(moved).astype(np.int64)


@dataclass(frozen=True)
class Stage:
    """Size and scale of the drawings that are to be held against each other.

    Parameters
    ----------
    width_m, height_m
        Ground that each shows, in metres.
    factor
        Units for each metre.
    """

    width_m: float
    height_m: float
    factor: float

    def canvas(self, extent: tuple[float, float, float, float]) -> Canvas:
        """Return the drawing with an extent in its middle."""
        x0, y0, x1, y1 = extent
        return Canvas(
            (x0 + x1 - self.width_m) / 2,
            (y0 + y1 + self.height_m) / 2,
            self.factor,
            round(self.width_m * self.factor),
            round(self.height_m * self.factor),
        )


def stage_of(extents: Sequence[tuple[float, float, float, float]], side: float) -> Stage:
    """Return a stage that each extent fits into.

    Parameters
    ----------
    extents
        West, south, east and north of each drawing.
    side
        Typical side of a shape in metres: the smaller it is, the finer the drawing.
    """
    boxes = np.array(extents, dtype=np.float64)
    width = max(float((boxes[:, 2] - boxes[:, 0]).max()), 1.0)
    height = max(float((boxes[:, 3] - boxes[:, 1]).max()), 1.0)
    longer = max(width, height)
    pad = float(np.clip(0.5 * side, 0.02 * longer, 0.15 * longer))  # streets on the rim have width
    units = float(np.clip(PARCEL_UNITS * longer / max(side, 1e-3 * longer), FEWEST, MOST))
    return Stage(width + pad, height + pad, units / (longer + pad))


def area_paths(polygons: Geometries, canvas: Canvas) -> list[str]:
    """Return the path of each polygon, holes and all; empty where nothing is to be seen."""
    simple = shapely.simplify(polygons, TOLERANCE / canvas.factor)
    parts, of_part = shapely.get_parts(simple, return_index=True)
    rings, of_ring = shapely.get_rings(parts, return_index=True)
    return _paths(rings, of_part[of_ring], len(polygons), canvas, closed=True)


def line_paths(lines: Geometries, canvas: Canvas) -> list[str]:
    """Return the path of each line."""
    simple = shapely.simplify(lines, TOLERANCE / canvas.factor)
    parts, of = shapely.get_parts(simple, return_index=True)
    return _paths(parts, of, len(lines), canvas, closed=False)


def _paths(
    lines: Geometries, of: npt.NDArray[np.int64], n: int, canvas: Canvas, *, closed: bool
) -> list[str]:
    """(n,) paths; line i belongs to path ``of[i]``."""
    xy, index = shapely.get_coordinates(lines, return_index=True)
    units = canvas.units(xy)
    begin = np.searchsorted(index, np.arange(len(lines) + 1)).tolist()
    out = [""] * n
    for i, path in enumerate(of.tolist()):
        out[path] += _path(units[begin[i] : begin[i + 1]], closed=closed)
    return out


def _path(points: npt.NDArray[np.int64], *, closed: bool) -> str:
    """Return one line as a path, points that fall together left out."""
    steps = np.diff(points, axis=0)
    steps = steps[steps.any(axis=1)]
    if closed:
        steps = steps[:-1]
    if len(steps) < 1 + closed:
        return ""
    start = _joined(points[0].tolist())
    return f"M{start}l{_joined(steps.ravel().tolist())}{'z' if closed else ''}"


def _joined(numbers: Iterable[int]) -> str:
    """Return numbers with spaces only where there is no minus sign.

    >>> _joined([3, -4, 5, 0])
    '3-4 5 0'
    """
    return " ".join(map(str, numbers)).replace(" -", "-")
