"""What the pictures of docs/gallery.md have in common: sheets of maps, and small PNG files."""

from __future__ import annotations

import io
import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import urban_processing as up
from urban_processing.io.frames import GeoLayout

ROOT = Path(__file__).resolve().parents[1]
SAMPLES = ROOT / "sample_data"
DATA = Path(os.environ.get("URBAN_DATA", ROOT.parent / "shared/data"))
"""Data that are not in the repository; what is made of them is left out where they are not."""

IMAGES = ROOT / "docs" / "images" / "gallery"
COLUMN, MARGIN, HEAD, FOOT = 5.6, 0.15, 0.5, 0.6
"""Width of one map, and the room beside, above and below it, in inches."""

DOTS_PER_INCH = 100
COLOURS = 256
"""Colours of a picture: few make small files."""

MOST_BYTES = 250_000


class Drawable(Protocol):
    """What a panel shows."""

    def plot(self, *, ax: Axes) -> object:
        """Draw it into axes."""
        ...


Panel = tuple[str, Drawable]


def laid_out(name: str, **parameters: object) -> GeoLayout:
    """Lay out a sample boundary."""
    return up.cogenerate(SAMPLES / f"{name}.gpkg", **parameters)


def figure(layout: GeoLayout, name: str) -> float:
    """Return a figure of the whole layout."""
    metrics = layout.metrics
    return float(metrics[metrics.part.isna() & (metrics.metric == name)].value.iloc[0])


def blank(width: float, height: float) -> Figure:
    """Return an empty white picture; sizes in inches."""
    drawn = Figure(figsize=(width, height), facecolor="white")
    FigureCanvasAgg(drawn)
    return drawn


def sheet(panels: Sequence[Panel], *, columns: int, ratio: float) -> Figure:
    """Draw maps side by side; `ratio` is the height of a map over its width."""
    rows = -(-len(panels) // columns)
    height = HEAD + COLUMN * ratio + FOOT
    size = columns * COLUMN, rows * height
    drawn = blank(*size)
    for k, (title, layout) in enumerate(panels):
        left, top = (k % columns) * COLUMN, size[1] - (k // columns) * height
        ax = drawn.add_axes(
            (
                (left + MARGIN) / size[0],
                (top - HEAD - COLUMN * ratio) / size[1],
                (COLUMN - 2 * MARGIN) / size[0],
                COLUMN * ratio / size[1],
            )
        )
        layout.plot(ax=ax)
        place = (left + MARGIN) / size[0], (top - 0.12) / size[1]
        drawn.text(*place, title, va="top", size=11)
    return drawn


def write(drawn: Figure, path: Path) -> None:
    """Write a picture as a small PNG."""
    full = io.BytesIO()
    drawn.savefig(full, format="png", dpi=DOTS_PER_INCH)
    few = (
        Image.open(full)
        .convert("RGB")
        .quantize(COLOURS, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    )
    few.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        warnings.warn(f"{path.name} has {path.stat().st_size:,} bytes.", stacklevel=2)
