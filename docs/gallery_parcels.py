"""Real parcels beside those of `subdivide`: pictures and a table for docs/gallery.md.

``python docs/gallery_parcels.py`` prints the table. Parcels of two cities are calibrated, and their
blocks subdivided by the bounds that come of it (Vanegas 2012, section 6). The data are not in the
repository.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import numpy as np
import numpy.typing as npt
from gallery_drawing import DATA, blank
from geopandas import GeoDataFrame
from matplotlib.cm import ScalarMappable
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure

import urban_processing as up
from urban_processing.io.frames import GeoLayers
from urban_processing.metrics.comparison import DistributionDistance, Side, compare
from urban_processing.metrics.distributions import Sample

FOLDER = DATA / "test_only/parcels"


@dataclass(frozen=True)
class City:
    """Observed parcels.

    Parameters
    ----------
    title
        What it is called.
    file
        The parcels.
    centre, half
        Middle and half width of the map, in metres.
    """

    title: str
    file: Path
    centre: tuple[float, float]
    half: float


CITIES = {
    "philadelphia": City(
        "Philadelphia (Fishtown)",
        FOLDER / "philadelphia_fishtown_us.gpkg",
        (489_350.0, 4_424_850.0),
        260.0,
    ),
    "eatonville": City(
        "Eatonville", FOLDER / "eatonville_wa_us.gpkg", (555_900.0, 5_190_300.0), 420.0
    ),
}

THERE = {name: city for name, city in CITIES.items() if city.file.is_file()}

OBSERVED = "observed"
STRATEGIES = ("skeleton", "obb")
COLOURS = {OBSERVED: "#c0392b", "skeleton": "#2f7aa8", "obb": "#5f8f35"}

MEASURES = {
    "parcel_area_m2": "Area, m²",
    "parcel_width_m": "Width, m",
    "parcel_aspect": "Length over width",
    "parcel_neighbours": "Neighbours",
}
"""Distributions of Vanegas's figures 10 to 12. Width and length are those of the smallest rotated
rectangle, as where nothing is known of streets."""


@cache
def calibrated(name: str) -> GeoLayers:
    """Return the blocks of a city with their bounds, and its parcels."""
    return up.calibrate(CITIES[name].file, layer="parcels")


@cache
def sides(name: str) -> dict[str, GeoDataFrame]:
    """Return the parcels that are there, and those that were made."""
    found = calibrated(name)
    made = {strategy: up.subdivide(found, strategy=strategy).parcels for strategy in STRATEGIES}
    return {OBSERVED: found.parcels[found.parcels.block_id.notna()], **made}


@cache
def samples(name: str) -> dict[str, dict[str, npt.NDArray[np.float64]]]:
    """Return the values of each distribution of each side."""
    out = {}
    for side, parcels in sides(name).items():
        neighbours = up.measure(parcels=parcels.geometry).frame("parcels").neighbours
        out[side] = {
            "parcel_area_m2": parcels.area_m2.to_numpy(),
            "parcel_width_m": parcels.box_width_m.to_numpy(),
            "parcel_aspect": (parcels.box_length_m / parcels.box_width_m).to_numpy(),
            "parcel_neighbours": neighbours.to_numpy(dtype=np.float64),
        }
    return out


@cache
def distances(name: str) -> tuple[DistributionDistance, ...]:
    """Return how far the distributions of what was made are from those of what is there."""
    compared = [
        Side(side, {}, {key: Sample(values) for key, values in sample.items()})
        for side, sample in samples(name).items()
    ]
    return compare(compared, reference=OBSERVED).distances


def picture(name: str) -> Figure:
    """Maps of a part of a city, coloured by aspect, and the distributions of the whole."""
    city, found = CITIES[name], calibrated(name)
    drawn = blank(15.0, 8.2)
    colours = ScalarMappable(LogNorm(1.0, 6.0), "RdYlGn_r")
    (x, y), half = city.centre, city.half
    for k, (side, parcels) in enumerate(sides(name).items()):
        ax = drawn.add_axes((0.005 + 0.32 * k, 0.37, 0.312, 0.58))
        shown = parcels.cx[x - half : x + half, y - half : y + half]
        aspect = shown.box_length_m / shown.box_width_m
        colour = colours.to_rgba(aspect.to_numpy())
        shown.plot(ax=ax, color=colour, edgecolor="#57524a", linewidth=0.4)
        found.blocks.boundary.plot(ax=ax, color="#1f1d1a", linewidth=0.9)
        ax.set(xlim=(x - half, x + half), ylim=(y - half, y + half), aspect="equal")
        ax.set(xticks=[], yticks=[], xlabel="", ylabel="")
        median = float(np.median(parcels.area_m2))
        text = f"{city.title}, {side}: {len(parcels):,} parcels, median {median:,.0f} m²"
        ax.set_title(text, loc="left", size=10)
    bar = drawn.add_axes((0.9625, 0.45, 0.008, 0.4))
    drawn.colorbar(colours, cax=bar, label="Length over width", ticks=[1, 2, 3, 4, 6], format="%g")
    bar.minorticks_off()
    for k, (key, label) in enumerate(MEASURES.items()):
        ax = drawn.add_axes((0.04 + 0.245 * k, 0.065, 0.2, 0.235))
        histogram(ax, name, key)
        ax.set_title(label, loc="left", size=10)
        if k == 0:
            ax.legend(frameon=False, fontsize=9)
            ax.set_ylabel("share of parcels")
    return drawn


def histogram(ax: object, name: str, key: str) -> None:
    """Draw one distribution of all sides."""
    values = {side: sample[key] for side, sample in samples(name).items()}
    low, high = np.percentile(values[OBSERVED], [0.5, 98])
    if key == "parcel_neighbours":
        bins = np.arange(-0.5, 9.5)
    elif key == "parcel_area_m2":
        bins = np.geomspace(low, high, 40)
        ax.set_xscale("log")
    else:
        bins = np.linspace(low, high, 40)
    for side, sample in values.items():
        share = np.full(len(sample), 1 / len(sample))
        ax.hist(sample, bins, weights=share, histtype="step", color=COLOURS[side], label=side)
    ax.spines[["top", "right"]].set_visible(False)
    ax.tick_params(labelsize=8)


PICTURES: dict[str, Callable[[], Figure]] = {
    f"parcels_{name}": partial(picture, name) for name in THERE
}


def table(names: Sequence[str]) -> str:
    """Counts, medians and distances of cities as Markdown."""
    head = [f"{CITIES[name].title}, {side}" for name in names for side in sides(name)]
    counts = [f"{len(parcels):,}" for name in names for parcels in sides(name).values()]
    lines = [
        "| | " + " | ".join(head) + " |",
        "| --- |" + " ---: |" * len(head),
        "| parcels | " + " | ".join(counts) + " |",
    ]
    for key, label in MEASURES.items():
        cells = []
        for name in names:
            cells.append(number(float(np.median(samples(name)[OBSERVED][key]))))
            for d in distances(name):
                if d.distribution.name == key:
                    span = f"{number(d.wasserstein_low)} to {number(d.wasserstein_high)}"
                    noise = number(d.wasserstein_noise)
                    far = f"{number(d.wasserstein)} ({span}; {noise})"
                    cells.append(f"{number(d.median_side)}, W {far}")
        lines.append(f"| {label}, median | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def number(value: float) -> str:
    """Return a number with about three digits."""
    return f"{value:,.0f}" if value >= 100 else f"{value:.3g}"


def main() -> None:
    """Print the table."""
    print(table(list(THERE)))


if __name__ == "__main__":
    main()
