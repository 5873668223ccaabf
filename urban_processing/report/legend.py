"""What stands below a map: scale bar, legend and colour bar."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib.axes import Axes
from matplotlib.collections import Collection
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, Rectangle
from matplotlib.patheffects import Normal, withStroke
from matplotlib.ticker import LogLocator, NullLocator, StrMethodFormatter

from urban_processing.errors import ParameterError
from urban_processing.mesh.corners import IRREGULAR
from urban_processing.report.palette import (
    FAINT,
    FIXED_CASING,
    FIXED_STREET,
    INK,
    IRREGULAR_RAMP,
    KEPT,
    OBSTACLE,
    PARCEL,
    SURFACE,
    TRIANGLE,
    Scale,
    is_kept,
)
from urban_processing.tables import Table

LEGEND_SHARE = 0.74
"""Share of the width of the map that the legend may take; the scale bar has the rest."""

LETTER_WIDTH, LETTERS_PER_SWATCH = 0.55, 5
"""Mean width of a letter in sizes of the type; letters' worth of a swatch and the space beside."""

MOST_USES = 3
"""So many land uses are named in a legend; more are counted."""

POINTS_PER_INCH = 72.0


def root_figure(ax: Axes) -> Figure:
    """Return the figure that axes belong to.

    Raises
    ------
    ParameterError
        If they were taken out of their figure.
    """
    figure = ax.get_figure(root=True)
    if figure is None:
        raise ParameterError("ax belongs to no figure.")
    return figure


def draw_scale_bar(ax: Axes, scale: Scale) -> None:
    """Draw a bar of a round length below the left corner of the map."""
    left, right = ax.get_xlim()
    length = _round_length(0.22 * (right - left))
    label = f"{length / 1000:g} km" if length >= 1000 else f"{length:g} m"
    share, inch = length / (right - left), 1.0 / _height_inches(ax)
    below = -0.02 * scale.text * inch
    for start, colour in ((0.0, INK), (share / 2, "white")):
        ax.add_patch(
            Rectangle(
                (start, below),
                share / 2,
                0.05 * inch,
                facecolor=colour,
                edgecolor=INK,
                linewidth=0.7,
                transform=ax.transAxes,
                clip_on=False,
            )
        )
    ax.text(
        share / 2,
        below - 0.05 * inch,
        label,
        transform=ax.transAxes,
        ha="center",
        va="top",
        size=scale.text,
        color=INK,
    )


def _round_length(length: float) -> float:
    power = 10.0 ** np.floor(np.log10(length))
    return float(max(step for step in (1.0, 2.0, 5.0) if step * power <= length) * power)


def _height_inches(ax: Axes) -> float:
    return float(ax.get_window_extent().height / root_figure(ax).dpi)


def legend_entries(
    tables: dict[str, Table], colour_by: str | None, colours: tuple[str, str]
) -> list[Patch | Line2D]:
    """Return what the map shows, with numbers; `colours` are those of streets."""
    n_ends = int((tables["junctions"]["kind"] == "end").sum())
    street, casing = colours
    entries: list[Patch | Line2D] = []
    if colour_by is None:
        entries += parcel_entries(tables["parcels"])
    if "right_of_way" in tables:
        entries.append(swatch(SURFACE, "Right-of-way"))
    cased = [withStroke(linewidth=4.4, foreground=casing), Normal()]
    entries.append(Line2D([], [], color=street, lw=3, label="Street", path_effects=cased))
    given = ~np.isnan(tables["streets"]["fixed_id"])
    if given.any() and colour_by is None:
        lined = [withStroke(linewidth=4.4, foreground=FIXED_CASING), Normal()]
        entries.append(
            Line2D([], [], color=FIXED_STREET, lw=3, label="Given street", path_effects=lined)
        )
    if "obstacles" in tables:
        entries.append(swatch(OBSTACLE, "Obstacle"))
    n_entries = int((tables["junctions"]["kind"] == "entry").sum())
    if n_entries:
        mark = Line2D([], [], color="white", marker="^", markeredgecolor=INK, ls="", ms=6)
        mark.set_label(f"{n_entries:,} {'entry' if n_entries == 1 else 'entries'}")
        entries.append(mark)
    if n_ends:
        dot = Line2D([], [], color=street, marker="o", markeredgecolor=casing, ls="", ms=5)
        dot.set_label(_counted(n_ends, "street end"))
        entries.append(dot)
    return entries


def parcel_entries(parcels: Table) -> list[Patch]:
    """Return the entries for parcels in the colours of `parcel_colours`."""
    kept = is_kept(parcels)
    triangle = (parcels["sides"] == 3) & ~kept
    irregular = (parcels["irregularity"] > IRREGULAR) & ~triangle & ~kept
    entries = [swatch(PARCEL, _counted(len(parcels) - int(kept.sum()), "parcel"))]
    if kept.any():
        entries.append(swatch(KEPT, _kept_in_words(parcels["land_use"][kept])))
    if irregular.any():
        entries.append(swatch(IRREGULAR_RAMP(0.6), f"{int(irregular.sum()):,} irregular"))
    if triangle.any():
        entries.append(swatch(TRIANGLE, _counted(int(triangle.sum()), "triangle")))
    return entries


def _kept_in_words(uses: npt.NDArray[np.object_]) -> str:
    names = sorted(set(uses.tolist()))
    return ", ".join(names) if len(names) <= MOST_USES else f"{len(names)} other uses"


def _counted(number: int, noun: str) -> str:
    return f"{number:,} {noun}" if number == 1 else f"{number:,} {noun}s"


def draw_legend(ax: Axes, entries: list[Patch | Line2D], scale: Scale) -> None:
    """Draw the entries below the right corner of the map, in as few lines as fit beside the bar."""
    width = ax.get_window_extent().width / root_figure(ax).dpi * POINTS_PER_INCH
    letters = sum(len(str(entry.get_label())) + LETTERS_PER_SWATCH for entry in entries)
    lines = math.ceil(letters * LETTER_WIDTH * scale.text / (LEGEND_SHARE * width))
    ax.legend(
        handles=entries,
        loc="upper right",
        bbox_to_anchor=(1.0, -0.005 * scale.text / _height_inches(ax)),
        ncols=math.ceil(len(entries) / lines),
        frameon=False,
        fontsize=scale.text,
        labelcolor=INK,
        handlelength=1.3,
        columnspacing=1.4,
        borderaxespad=0.0,
    )


def swatch(colour: Any, label: str) -> Patch:
    """Return an entry for areas of one colour."""
    return Patch(facecolor=colour, edgecolor=FAINT, linewidth=0.6, label=label)


def draw_colour_bar(ax: Axes, areas: Collection, scale: Scale, *, label: str) -> None:
    """Draw the ramp of the values that areas are coloured by below the map."""
    height = _height_inches(ax)
    inset = ax.inset_axes((0.38, -0.033 * scale.text / height, 0.3, 0.1 / height))
    bar = root_figure(ax).colorbar(areas, cax=inset, orientation="horizontal")
    bar.outline.set_linewidth(0.4)
    if isinstance(areas.norm, LogNorm):
        inset.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        inset.xaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
        inset.xaxis.set_minor_locator(NullLocator())
    inset.tick_params(labelsize=0.85 * scale.text, length=2, colors=INK)
    inset.set_title(label, size=scale.text, color=INK, pad=3)
