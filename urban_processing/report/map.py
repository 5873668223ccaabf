"""Maps of layouts as PNG, SVG or PDF."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import shapely
from matplotlib.collections import LineCollection, PathCollection
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from urban_processing.errors import ParameterError
from urban_processing.layout import Layout
from urban_processing.metrics.tables import layout_tables
from urban_processing.report.figure import (
    Extent,
    checked,
    extent_of,
    frame_land,
    new_axes,
    outline,
    save,
    scale_of,
)
from urban_processing.report.legend import (
    draw_colour_bar,
    draw_legend,
    draw_scale_bar,
    legend_entries,
    root_figure,
)
from urban_processing.report.palette import (
    CASING,
    FAINT,
    FIXED_CASING,
    FIXED_STREET,
    INK,
    OBSTACLE,
    OUTLINE,
    PLAIN_CASING,
    PLAIN_STREET,
    STREET,
    SURFACE,
    VALUE_RAMP,
    Scale,
    parcel_colours,
)
from urban_processing.schema import PARCELS, ColumnType
from urban_processing.tables import Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

    from urban_processing.metrics import MeasuredLayout


def plot_layout(
    layout: MeasuredLayout | Layout,
    path: str | PathLike[str] | None = None,
    *,
    ax: Axes | None = None,
    colour_by: str | None = None,
    title: str = "",
    size: float | None = None,
) -> Figure:
    """Draw the map of a layout: parcels, streets with casing, scale bar and legend.

    Irregular parcels (irregularity above 0.1) are red, the more so the more irregular they
    are, and triangles violet, as in Chen 2024, Fig. 17. Street widths are true to scale where
    that reads well. No plotting state of the caller is touched.

    Parameters
    ----------
    layout
        The layout.
    path
        File to write: ``.png``, ``.svg`` or ``.pdf``. The same layout gives the same SVG.
    ax
        Axes to draw into, by default a new figure in the shape of the land.
    colour_by
        Column of numbers of the parcels to colour by, such as ``area_m2`` or ``frontage_m``.
    title
        Heading, none by default.
    size
        Longer side of the figure in inches, by default more the more parcels there are.

    Returns
    -------
    matplotlib.figure.Figure
        The figure.

    Raises
    ------
    OutputError
        If `path` has another suffix or cannot be written.
    ParameterError
        If `colour_by` is no column of numbers.
    """
    _check_colour_by(colour_by)
    target = None if path is None else checked(Path(path))
    tables = layout_tables(layout) if isinstance(layout, Layout) else layout.tables
    if ax is None:
        longer = _longer_side(tables) if size is None else size
        ax = new_axes(_extent(tables), title=title, longer=longer)
    figure = root_figure(ax)
    _draw(ax, tables, colour_by)
    if target is not None:
        save(figure, target)
    return figure


def _check_colour_by(name: str | None) -> None:
    numbers = [c.name for c in PARCELS.columns if c.dtype is not ColumnType.TEXT]
    if name is not None and name not in numbers:
        raise ParameterError(f"colour-by must be one of {', '.join(numbers)}; got {name!r}.")


def _longer_side(tables: dict[str, Table]) -> float:
    """Longer side of a figure in inches in which parcels can be told apart."""
    x0, y0, x1, y1 = _extent(tables)
    land = float(tables["boundary"]["area_m2"].sum())
    spread = min((x1 - x0) * (y1 - y0) / land, 6.0)
    return float(np.clip(0.15 * (len(tables["parcels"]) * spread) ** 0.5 + 5.5, 7.0, 22.0))


def _draw(ax: Axes, tables: dict[str, Table], colour_by: str | None) -> None:
    frame_land(ax, _extent(tables))
    scale = scale_of(ax, tables["parcels"]["area_m2"])
    _draw_parcels(ax, tables["parcels"], scale, colour_by)
    if "right_of_way" in tables:
        _draw_right_of_way(ax, tables["right_of_way"])
    if "obstacles" in tables:
        _draw_obstacles(ax, tables["obstacles"])
    _draw_rim(ax, tables["boundary"], scale)
    colours = (STREET, CASING) if colour_by is None else (PLAIN_STREET, PLAIN_CASING)
    draw_streets(ax, tables["streets"], tables["junctions"], scale, colours)
    draw_scale_bar(ax, scale)
    draw_legend(ax, legend_entries(tables, colour_by, colours), scale)
    if colour_by is not None:
        label = PARCELS.column(colour_by).label
        draw_colour_bar(ax, ax.collections[0], scale, label=label)


def _extent(tables: dict[str, Table]) -> Extent:
    return extent_of(tables["boundary"].shapes)


def _draw_rim(ax: Axes, boundary: Table, scale: Scale) -> None:
    """Draw the land's outline and its holes, where no street covers them."""
    outlines = [outline(polygon) for polygon in _polygons(boundary)]
    ax.add_collection(
        PathCollection(
            outlines,
            facecolors="none",
            edgecolors=FAINT,
            linewidths=1.8 * scale.outline,
            joinstyle="round",
            zorder=1.5,
        )
    )


def _draw_right_of_way(ax: Axes, right_of_way: Table) -> None:
    """Draw the land that streets take, true to scale, below the streets themselves."""
    ax.add_collection(
        PathCollection(
            [outline(polygon) for polygon in right_of_way.shapes],
            facecolors=SURFACE,
            edgecolors="none",
            zorder=1.3,
        )
    )


def _polygons(table: Table) -> npt.NDArray[np.object_]:
    parts = shapely.get_parts(table.shapes)
    return np.asarray(parts, dtype=object)


def _draw_parcels(ax: Axes, parcels: Table, scale: Scale, colour_by: str | None) -> None:
    collection = PathCollection(
        [outline(polygon) for polygon in parcels.shapes],
        facecolors=parcel_colours(parcels),
        edgecolors=OUTLINE,
        linewidths=scale.outline,
        joinstyle="round",
        zorder=1,
    )
    if colour_by is not None:
        collection.set_array(np.asarray(parcels[colour_by], dtype=np.float64))
        collection.set_cmap(VALUE_RAMP)
        collection.set_norm(_value_range(parcels[colour_by]))
    ax.add_collection(collection)


def _value_range(values: npt.NDArray[Any]) -> Normalize:
    """Range of colours that single extreme values do not flatten."""
    known = np.asarray(values, dtype=np.float64)
    known = known[np.isfinite(known)]
    if len(known) == 0:
        return Normalize(0.0, 1.0)
    low, high = np.percentile(known, [1, 99])
    return Normalize(low, high if high > low else low + 1.0)


def _known_widths(width: npt.NDArray[np.float64], otherwise: float) -> npt.NDArray[np.float64]:
    known = width > 0
    usual = float(np.median(width[known])) if known.any() else otherwise
    return np.where(known, width, usual)


def draw_streets(
    ax: Axes, streets: Table, junctions: Table, scale: Scale, colours: tuple[str, str]
) -> None:
    """Draw streets, all casings below all fills, so that crossings are open.

    Those of unknown width are as wide as the others.
    """
    lines = [shapely.get_coordinates(line) for line in streets.shapes]
    if not lines:
        return
    width = scale.street(_known_widths(streets["width_m"], 0.15 * scale.side))
    ends = shapely.get_coordinates(junctions.shapes[junctions["kind"] == "end"])
    entries = shapely.get_coordinates(junctions.shapes[junctions["kind"] == "entry"])
    given = np.zeros(len(lines), dtype=bool)
    if "fixed_id" in streets.columns:
        given = ~np.isnan(streets["fixed_id"])
    for fill, margin, zorder in ((False, 2 * scale.casing, 2), (True, 0.0, 3)):
        colour = colours[0 if fill else 1]
        fixed = (FIXED_STREET if fill else FIXED_CASING) if colours[0] == STREET else colour
        ax.add_collection(
            LineCollection(
                lines,
                colors=[fixed if is_given else colour for is_given in given.tolist()],
                linewidths=width + margin,
                capstyle="round",
                joinstyle="round",
                zorder=zorder,
            )
        )
        size = 2.0 * float(np.median(width)) + margin
        ax.scatter(ends[:, 0], ends[:, 1], s=size**2, c=colour, linewidths=0, zorder=zorder)
    size = 2.2 * float(np.median(width)) + 2 * scale.casing
    ax.scatter(
        entries[:, 0],
        entries[:, 1],
        s=size**2,
        c="white",
        edgecolors=INK,
        linewidths=2 * scale.casing,
        marker="^",
        zorder=4,
        clip_on=False,
    )


def _draw_obstacles(ax: Axes, obstacles: Table) -> None:
    ax.add_collection(
        PathCollection(
            [outline(polygon) for polygon in _polygons(obstacles)],
            facecolors=OBSTACLE,
            edgecolors="none",
            zorder=0.5,
        )
    )
