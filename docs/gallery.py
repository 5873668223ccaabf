"""The pictures of docs/gallery.md: ``python docs/gallery.py [NAME ...]``.

Each picture is one function in `PICTURES`, made with the public API from `sample_data/`. Without
names all are made, into docs/images/gallery.
"""

from __future__ import annotations

import argparse
import io
import warnings
from collections.abc import Callable, Sequence
from pathlib import Path

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image

import urban_processing as up
from urban_processing.io.frames import GeoLayout

ROOT = Path(__file__).resolve().parents[1]
IMAGES = ROOT / "docs" / "images" / "gallery"
COLUMN, MARGIN, HEAD, FOOT = 5.6, 0.15, 0.5, 0.6
"""Width of one map, and the room beside, above and below it, in inches."""

DOTS_PER_INCH = 100
COLOURS = 96
"""Colours of a picture: few make small files."""

MOST_BYTES = 250_000

Panel = tuple[str, GeoLayout]


def laid_out(name: str, **parameters: object) -> GeoLayout:
    """Lay out a sample boundary."""
    return up.cogenerate(ROOT / "sample_data" / f"{name}.gpkg", **parameters)


def figure(layout: GeoLayout, name: str) -> float:
    """Return a figure of the whole layout."""
    metrics = layout.metrics
    return float(metrics[metrics.part.isna() & (metrics.metric == name)].value.iloc[0])


def sheet(panels: Sequence[Panel], *, columns: int, ratio: float) -> Figure:
    """Draw maps side by side; `ratio` is the height of a map over its width."""
    rows = -(-len(panels) // columns)
    height = HEAD + COLUMN * ratio + FOOT
    size = columns * COLUMN, rows * height
    drawn = Figure(figsize=size, facecolor="white")
    FigureCanvasAgg(drawn)
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


def six_lands() -> Figure:
    """Six lands (Fig. 11)."""
    names = ("rect", "triangle", "ellipse", "wyoming", "sant_adria", "wandsworth")
    panels = []
    for name in names:
        layout = laid_out(name, parcels=250)
        text = f"{name}: {figure(layout, 'quads_pct'):.1f} % with four sides, I = "
        panels.append((text + f"{figure(layout, 'irregularity_mean'):.3f}", layout))
    return sheet(panels, columns=3, ratio=0.75)


def three_sizes() -> Figure:
    """One land in about 102, 539 and 1,273 parcels (Fig. 12)."""
    panels = []
    for parcels in (102, 539, 1273):
        layout = laid_out("irregular_64ha", parcels=parcels)
        title = f"{figure(layout, 'parcels'):.0f} parcels, {figure(layout, 'streets'):.0f} streets"
        panels.append((title, layout))
    return sheet(panels, columns=3, ratio=0.9)


def three_weights() -> Figure:
    """Weights of the choice of cuts (Fig. 13)."""
    weights = {
        "size, λ = 0.8, 0.1, 0.1": (0.8, 0.1, 0.1),
        "regularity, λ = 0.1, 0.8, 0.1": (0.1, 0.8, 0.1),
        "street access, λ = 0.1, 0.1, 0.8": (0.1, 0.1, 0.8),
    }
    panels = []
    for title, (size, shape, access) in weights.items():
        layout = laid_out(
            "irregular_64ha",
            parcels=150,
            weight_size=size,
            weight_regularity=shape,
            weight_access=access,
        )
        mean = figure(layout, "irregularity_mean")
        panels.append((f"{title}: I = {mean:.3f}", layout))
    return sheet(panels, columns=3, ratio=0.9)


def three_patterns() -> Figure:
    """Patterns of streets (Fig. 14)."""
    panels = []
    for pattern in ("loop", "cul-de-sac", "tree"):
        layout = laid_out("irregular_64ha", parcels=200, pattern=pattern)
        panels.append((f"{pattern}: {figure(layout, 'street_ends'):.0f} street ends", layout))
    return sheet(panels, columns=3, ratio=0.9)


def two_orientations() -> Figure:
    """Long sides of parcels east-west and north-south (Fig. 16)."""
    panels = [
        (title, laid_out("irregular_64ha", parcels=200, orientation=angle, weight_orientation=1.0))
        for title, angle in (("east-west", 0.0), ("north-south", 90.0))
    ]
    return sheet(panels, columns=2, ratio=0.9)


def dimensions() -> Figure:
    """Goals for width to depth, least frontage and longest block."""
    goals: dict[str, dict[str, object]] = {
        "no goals": {},
        "width : depth 0.5": {"width_depth": 0.5},
        "frontage of 40 m, hard": {"least_frontage": 40.0, "hard_frontage": True},
        "blocks of 260 m, hard": {"max_block_length": 260.0, "hard_block_length": True},
    }
    panels = []
    for title, wanted in goals.items():
        layout = laid_out("irregular_64ha", parcels=200, **wanted)
        values = (
            f"w:d {figure(layout, 'width_depth_median'):.2f}, "
            f"frontage ≥ {figure(layout, 'frontage_min_m'):.0f} m, "
            f"blocks ≤ {figure(layout, 'block_length_max_m'):.0f} m"
        )
        panels.append((f"{title}: {values}", layout))
    return sheet(panels, columns=2, ratio=0.9)


PICTURES: dict[str, Callable[[], Figure]] = {
    "lands": six_lands,
    "sizes": three_sizes,
    "weights": three_weights,
    "patterns": three_patterns,
    "orientation": two_orientations,
    "dimensions": dimensions,
}
"""Name of a picture's file, and the function that makes it."""


def write(drawn: Figure, path: Path) -> None:
    """Write a picture as a small PNG."""
    full = io.BytesIO()
    drawn.savefig(full, format="png", dpi=DOTS_PER_INCH)
    few = Image.open(full).convert("RGB").quantize(COLOURS, dither=Image.Dither.NONE)
    few.save(path, optimize=True)
    if path.stat().st_size > MOST_BYTES:
        warnings.warn(f"{path.name} has {path.stat().st_size:,} bytes.", stacklevel=2)


def main() -> None:
    """Make the pictures that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PICTURES))
    names = parser.parse_args().names or list(PICTURES)
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in names:
        write(PICTURES[name](), IMAGES / f"{name}.png")
        print(f"{name}: {PICTURES[name].__doc__}")


if __name__ == "__main__":
    main()
