"""Real places beside co-generated ones: pictures and tables for docs/gallery.md.

``python docs/gallery_real.py`` prints the tables. The number of parcels is chosen so that there
are about as many blocks as there really are; all else is by default.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path

import geopandas as gpd
from gallery_drawing import DATA, SAMPLES, blank
from matplotlib.colors import LogNorm
from matplotlib.figure import Figure
from shapely import Polygon

import urban_processing as up
from urban_processing.io.measured import GeoComparison, GeoFabric

LIECHTENSTEIN = SAMPLES / "osm_liechtenstein.osm.bz2"


@dataclass(frozen=True)
class Place:
    """A land, and the streets that OpenStreetMap has in it.

    Parameters
    ----------
    title
        What it is called.
    osm_file
        Extract of OpenStreetMap.
    outline, crs
        Corners of the land and their CRS, where it is not a sample.
    """

    title: str
    osm_file: Path = LIECHTENSTEIN
    outline: tuple[tuple[float, float], ...] = ()
    crs: str = ""

    @property
    def land(self) -> gpd.GeoSeries:
        """The land."""
        if not self.outline:
            return gpd.read_file(SAMPLES / f"{self.title.lower()}.gpkg").geometry
        return gpd.GeoSeries([Polygon(self.outline)], crs=self.crs)


def box(x0: float, y0: float, x1: float, y1: float) -> tuple[tuple[float, float], ...]:
    """Return the corners of a box."""
    return (x0, y0), (x1, y0), (x1, y1), (x0, y1)


PLACES = {
    "schellenberg": Place("Schellenberg"),
    "mauren": Place("Mauren"),
    "ruggell": Place("Ruggell"),
    "eschen": Place("Eschen"),
    "helsinki": Place(
        "Helsinki",
        DATA / "redistributable/osm/helsinki_centre_highways.osm.bz2",
        box(385_480, 6_671_520, 386_380, 6_672_300),
        "EPSG:32635",
    ),
    "kotka": Place(
        "Kotka",
        DATA / "redistributable/osm/kotka_suburb_highways.osm.bz2",
        box(496_400, 6_709_550, 498_150, 6_711_200),
        "EPSG:32635",
    ),
    "west_oakland": Place(
        "West Oakland",
        DATA / "test_only/osm/west_oakland_highways.osm.gz",
        (
            (561_330, 4_184_760),
            (562_430, 4_184_400),
            (562_440, 4_185_740),
            (562_130, 4_186_060),
            (561_330, 4_184_960),
        ),
        "EPSG:32610",
    ),
}
"""Places, those first whose data are in the repository."""

THERE = {name: place for name, place in PLACES.items() if place.osm_file.is_file()}

GENERATED, REAL = "co-generated", "OpenStreetMap"

METRICS = {
    "blocks": "{:.0f}",
    "blocks_per_km2": "{:.1f}",
    "block_area_median_m2": "{:,.0f}",
    "block_length_median_m": "{:.0f}",
    "street_km_per_km2": "{:.1f}",
    "intersections_per_km2": "{:.0f}",
    "intersections_3_pct": "{:.0f}",
    "intersections_4_pct": "{:.0f}",
    "dead_ends_per_km2": "{:.1f}",
    "segment_length_mean_m": "{:.0f}",
    "circuity": "{:.3f}",
    "orientation_order": "{:.2f}",
    "meshedness": "{:.2f}",
    "network_detour": "{:.2f}",
}
"""Metrics in the table, and how their values are written."""

DISTANCES = ("block_area_m2", "segment_length_m", "segment_bearing_deg")

ALIKE, MOST_TRIES = 0.05, 8
"""Counts of blocks this close, in proportion, are alike; how often a layout is made for that."""

PARCELS_PER_BLOCK = 8.0


@cache
def compared(name: str) -> tuple[GeoComparison, int]:
    """Return a place beside a layout of about as many blocks, and the parcels asked for."""
    place = PLACES[name]
    tried: dict[int, GeoComparison] = {}
    per_block = PARCELS_PER_BLOCK
    wanted: float | None = None
    while len(tried) < MOST_TRIES:
        parcels = 100 if wanted is None else round(wanted * per_block)
        if parcels in tried:
            break
        layout = up.cogenerate(place.land, parcels=parcels)
        found = up.compare(layout, names=[GENERATED], osm_file=place.osm_file)
        real, made = blocks(found)
        tried[parcels] = found
        if abs(made - real) <= ALIKE * real:
            break
        wanted, per_block = real, parcels / made
    best = min(tried, key=lambda n: (abs(blocks(tried[n])[0] - blocks(tried[n])[1]), n))
    return tried[best], best


def blocks(found: GeoComparison) -> tuple[float, float]:
    """Return the numbers of blocks that are there, and that were made."""
    return found.sides[REAL].metric("blocks"), found.sides[GENERATED].metric("blocks")


def picture(name: str) -> Figure:
    """The streets that are there, and those that were made, at the same scale."""
    found, _ = compared(name)
    x0, y0, x1, y1 = found.sides[GENERATED].frame("boundary").total_bounds
    width = 5.6 if y1 - y0 > 0.8 * (x1 - x0) else 7.0
    height = width * (y1 - y0) / (x1 - x0)
    drawn = blank(2 * width, height + 0.75)
    norm = LogNorm(*norm_of(found.sides[REAL]))
    for k, (side, title) in enumerate(((REAL, "OpenStreetMap"), (GENERATED, "co-generated"))):
        fabric = found.sides[side]
        ax = drawn.add_axes((k / 2 + 0.01, 0.01, 0.48, height / (height + 0.75)))
        draw(fabric, ax, norm)
        pad = 0.01 * (x1 - x0)
        ax.set(xlim=(x0 - pad, x1 + pad), ylim=(y0 - pad, y1 + pad), aspect="equal")
        text = f"{PLACES[name].title}, {title}: {fabric.metric('blocks'):.0f} blocks, "
        text += f"{fabric.metric('street_km_per_km2'):.1f} km of street per km²"
        drawn.text(k / 2 + 0.012, 1 - 0.12 / (height + 0.75), text, va="top", size=10)
    notice = "Streets on the left © OpenStreetMap contributors, ODbL 1.0."
    drawn.text(0.012, 1 - 0.42 / (height + 0.75), notice, va="top", size=9, color="#5f5b52")
    return drawn


def norm_of(fabric: GeoFabric) -> tuple[float, float]:
    """Return the areas between which blocks change their colour."""
    area = fabric.frame("blocks").area_m2
    return float(area.quantile(0.05)), float(area.quantile(0.95))


def draw(fabric: GeoFabric, ax: object, norm: LogNorm) -> None:
    """Draw blocks, coloured by their area, and streets."""
    fabric.frame("blocks").plot(
        ax=ax, column="area_m2", cmap="YlGnBu_r", norm=norm, alpha=0.5, edgecolor="none"
    )
    fabric.frame("boundary").boundary.plot(ax=ax, color="#9a958a", linewidth=0.6)
    streets = fabric.frame("streets")
    streets.plot(ax=ax, color="#3b3832", linewidth=0.9)
    ax.axis("off")


PICTURES: dict[str, Callable[[], Figure]] = {
    f"real_{name}": partial(picture, name) for name in THERE
}


def metric_table(names: Sequence[str]) -> str:
    """Metrics of places as Markdown: what is there / what was made, the better one in bold."""
    head = "| | " + " | ".join(PLACES[name].title for name in names) + " |"
    lines = [head, "| --- |" + " ---: |" * len(names)]
    rows = {name: {r.name: r for r in compared(name)[0].compared.comparison.rows} for name in names}
    for metric, form in METRICS.items():
        unit = rows[names[0]][metric].unit
        cells = []
        for name in names:
            row = rows[name][metric]
            order = compared(name)[0].compared.comparison.names
            cells.append(
                " / ".join(
                    f"**{form.format(row.values[k])}**"
                    if row.better == k
                    else form.format(row.values[k])
                    for k in (order.index(REAL), order.index(GENERATED))
                )
            )
        lines.append(f"| `{metric}`{unit and ', ' + unit} | " + " | ".join(cells) + " |")
    lines.append("| the same without rim streets | " + " | ".join(map(detours, names)) + " |")
    return "\n".join(lines)


def detours(name: str) -> str:
    """Detours of both sides where the rim of the layout is no street, the better one in bold."""
    found = compared(name)[0]
    made = found.sides[GENERATED]
    streets = made.frame("streets")
    inner = up.measure(streets=streets[streets["class"] != "rim"], land=made.frame("boundary"))
    values = [side.metric("network_detour") for side in (found.sides[REAL], inner)]
    cells = [f"{value:.2f}" for value in values]
    return " / ".join(
        f"**{c}**" if v == min(values) else c for c, v in zip(cells, values, strict=True)
    )


def distance_table(names: Sequence[str]) -> str:
    """Wasserstein distances of places as Markdown, with their intervals and noise."""
    head = "| | " + " | ".join(PLACES[name].title for name in names) + " |"
    lines = [head, "| --- |" + " ---: |" * len(names)]
    for distribution in DISTANCES:
        cells = []
        for name in names:
            found = compared(name)[0].compared.comparison.distances
            (d,) = [d for d in found if d.distribution.name == distribution]
            form = "{:,.0f}" if d.wasserstein >= 100 else "{:.1f}"
            values = (
                d.wasserstein,
                d.wasserstein_low,
                d.wasserstein_high,
                d.wasserstein_noise,
            )
            far, low, high, noise = (form.format(v) for v in values)
            cells.append(f"{far} ({low} to {high}; {noise})")
        spec = d.distribution
        unit = spec.unit and f", {spec.unit}"
        lines.append(f"| `{spec.name}`{unit} | " + " | ".join(cells) + " |")
    return "\n".join(lines)


def main() -> None:
    """Print the tables."""
    names = list(THERE)
    asked = [f"{PLACES[name].title} {compared(name)[1]:,}" for name in names]
    print("Parcels asked for:", ", ".join(asked), "\n")
    print(metric_table(names), "\n")
    print(distance_table(names))


if __name__ == "__main__":
    main()
