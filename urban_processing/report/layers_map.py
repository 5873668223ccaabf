"""Maps of blocks and of the parcels in them."""

from __future__ import annotations

from os import PathLike
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.collections import PathCollection
from matplotlib.colors import LogNorm, to_rgb
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from urban_processing.calibration.layers import CALIBRATION_KIND
from urban_processing.errors import ParameterError
from urban_processing.fabric.layers import MEASURED_KIND
from urban_processing.metrics.subdivisions import PATIO_USE
from urban_processing.report.figure import (
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
    parcel_entries,
    root_figure,
    swatch,
)
from urban_processing.report.map import draw_streets
from urban_processing.report.palette import (
    BLOCK,
    CASING,
    FAINT,
    INK,
    OUTLINE,
    PARCEL,
    PATIO,
    STREET,
    SURFACE,
    VALUE_RAMP,
    Scale,
    parcel_colours,
)
from urban_processing.schema import TRUE_AREA
from urban_processing.tables import LayerSet, Table

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PARCEL_ORDER = 1.2
"""Parcels lie above the right-of-way and below the outlines of blocks."""

_GROUND = ("blocks", "parcels")
"""Layers of areas that a map may stand on, the first one there gives its extent."""


def plot_layers(
    made: LayerSet,
    path: str | PathLike[str] | None = None,
    *,
    ax: Axes | None = None,
    title: str = "",
) -> Figure:
    """Draw a map of blocks, and of the parcels in them; of what was measured, streets too.

    Parcels are coloured as in `urban_processing.report.map.plot_layout`, those of a calibration
    by their areas.

    Parameters
    ----------
    made
        Layers of which one is called blocks or parcels.
    path
        File to write: ``.png``, ``.svg`` or ``.pdf``. The same layers give the same SVG.
    ax
        Axes to draw into, by default a new figure in the shape of the land.
    title
        Heading, none by default.

    Raises
    ------
    OutputError
        If `path` has another suffix or cannot be written.
    ParameterError
        If there is neither a block nor a parcel to be drawn.
    """
    target = None if path is None else checked(Path(path))
    tables = {layer.name: table for layer, table in made.tables.items() if len(table)}
    ground = next((tables[name] for name in _GROUND if name in tables), None)
    if ground is None:
        raise ParameterError(f"There is nothing to draw in {made.kind}: no block and no parcel.")
    extent = extent_of(ground.shapes)
    if ax is None:
        ax = new_axes(extent, title=title, longer=_longer_side(tables))
    frame_land(ax, extent)
    scale = scale_of(ax, tables.get("parcels", ground)["area_m2"])
    _draw(ax, tables, scale, streets=made.kind == MEASURED_KIND)
    if made.kind == CALIBRATION_KIND and "parcels" in tables:
        _colour_by_area(ax, tables["parcels"], scale)
    figure = root_figure(ax)
    if target is not None:
        save(figure, target)
    return figure


def _longer_side(tables: dict[str, Table]) -> float:
    """Longer side of a figure in inches in which blocks and parcels can be told apart."""
    n = max(4 * len(tables.get("blocks", ())), len(tables.get("parcels", ())))
    return float(np.clip(0.2 * n**0.5 + 5.5, 7.0, 22.0))


def _draw(ax: Axes, tables: dict[str, Table], scale: Scale, *, streets: bool) -> None:
    """Draw the layers; `streets` above all others, right-of-way over what parcels have of it."""
    entries: list[Any] = []
    if "right_of_way" in tables:
        _areas(
            ax, tables["right_of_way"], SURFACE, zorder=_PARCEL_ORDER + (0.1 if streets else -0.2)
        )
        entries.append(swatch(SURFACE, "Right-of-way"))
    if "blocks" in tables and not (streets and "parcels" in tables):
        fill = "none" if "parcels" in tables else BLOCK
        _areas(ax, tables["blocks"], fill, edge=INK, width=2.0 * scale.outline, zorder=1.5)
        if "parcels" not in tables:
            n = len(tables["blocks"])
            entries.append(swatch(BLOCK, f"{n:,} block{'s' if n > 1 else ''}"))
    if "parcels" in tables:
        parcels = tables["parcels"]
        _areas(
            ax, parcels, _colours(parcels), edge=OUTLINE, width=scale.outline, zorder=_PARCEL_ORDER
        )
        entries += _parcel_entries(parcels)
    if streets and "boundary" in tables:
        _areas(ax, tables["boundary"], "none", edge=FAINT, width=1.8 * scale.outline, zorder=1.5)
    if streets and "streets" in tables:
        draw_streets(ax, tables["streets"], tables["junctions"], scale, (STREET, CASING))
        entries.append(
            swatch(STREET, f"{tables['streets']['length_m'].sum() / 1000:,.1f} km of streets")
        )
    draw_scale_bar(ax, scale)
    draw_legend(ax, entries, scale)


def _colour_by_area(ax: Axes, parcels: Table, scale: Scale) -> None:
    """Colour the parcels by their areas, on a scale that shows small and large ones."""
    low, high = np.percentile(parcels["area_m2"], [2, 98])
    areas = next(each for each in ax.collections if each.get_zorder() == _PARCEL_ORDER)
    areas.set_array(parcels["area_m2"])
    areas.set_cmap(VALUE_RAMP)
    areas.set_norm(LogNorm(0.999 * low, 1.001 * high))
    draw_colour_bar(ax, areas, scale, label=TRUE_AREA.label)


def _areas(
    ax: Axes, table: Table, fill: Any, *, edge: str = "none", width: float = 0.0, zorder: float
) -> None:
    ax.add_collection(
        PathCollection(
            [outline(polygon) for polygon in table.shapes],
            facecolors=fill,
            edgecolors=edge,
            linewidths=width,
            joinstyle="round",
            zorder=zorder,
        )
    )


def _colours(parcels: Table) -> Any:
    """Fill of each parcel, as far as its columns tell."""
    if "irregularity" not in parcels.columns:
        return PARCEL
    colours = parcel_colours(parcels)
    colours[parcels["land_use"] == PATIO_USE] = to_rgb(PATIO)
    return colours


def _parcel_entries(parcels: Table) -> list[Patch]:
    if "irregularity" not in parcels.columns:
        return [swatch(PARCEL, f"{len(parcels):,} parcels")]
    patio = parcels["land_use"] == PATIO_USE
    entries = parcel_entries(Table({k: v[~patio] for k, v in parcels.columns.items()}))
    if patio.any():
        n = int(patio.sum())
        entries.append(swatch(PATIO, f"{n:,} patio{'s' if n > 1 else ''}"))
    return entries
