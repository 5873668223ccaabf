"""The pictures of docs/gallery.md: ``python docs/gallery.py [NAME ...]``.

Each picture is one function in `PICTURES`, made with the public API from `sample_data/`. Without
names all are made, into docs/images/gallery; those of data that are not there are left out.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from functools import cache, partial

import gallery_parcels
import gallery_real
import gallery_steering
import geopandas as gpd
from gallery_drawing import COLUMN, IMAGES, SAMPLES, Panel, blank, figure, laid_out, sheet, write
from matplotlib.figure import Figure
from shapely import LineString, Point

import urban_processing as up
from urban_processing.io.frames import GeoLayers


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
    """Patterns of streets, on a rim that is street, street in part, and none (Fig. 14)."""
    west = gpd.GeoSeries([in_land([(-0.02, 1.0), (-0.02, 0.3), (0.2, -0.1)])], crs=land().crs)
    rims: dict[str, dict[str, object]] = {
        "loop": {},
        "cul-de-sac": {"rim_lines": west.buffer(170).intersection(land().boundary.iloc[0])},
        "tree": {"rim": "none"},
    }
    panels = []
    for pattern, rim in rims.items():
        layout = laid_out("irregular_64ha", parcels=200, pattern=pattern, **rim)
        panels.append((f"{pattern}: {figure(layout, 'street_ends'):.0f} street ends", layout))
    return sheet(panels, columns=3, ratio=0.9)


def optimization() -> Figure:
    """A layout before and after the optimization (Fig. 10)."""
    panels = []
    for title, optimize in (("before", False), ("after", True)):
        layout = laid_out("irregular_64ha", parcels=90, optimize=optimize)
        values = (
            f"I = {figure(layout, 'irregularity_mean'):.4f}, "
            f"junctions off 90° by {figure(layout, 'junction_deviation_deg'):.1f}°"
        )
        panels.append((f"{title}: {values}", layout))
    return sheet(panels, columns=2, ratio=0.9)


def given_things() -> Figure:
    """Streets that are given (Fig. 15b and 19), a lake, a lakeside road, locked land."""
    streets = frame(
        in_land([(-0.1, 0.35), (0.45, 0.27), (1.1, 0.4)]), in_land([(0.3, 1.1), (0.34, 0.55)])
    )
    lake = frame(in_land([(0.43, 0.45), (0.6, 0.5)]).buffer(70))
    estate = frame(in_land([(0.2, 0.75), (0.3, 0.72)]).buffer(60, cap_style="flat"))
    given: dict[str, dict[str, object]] = {
        "two given streets": {"streets": streets},
        "a lake": {"obstacles": lake},
        "a lakeside road": {"obstacles": lake, "obstacle_rim": "street"},
        "streets, a lake and an estate": {
            "streets": streets,
            "obstacles": lake,
            "locked": estate,
        },
    }
    panels = []
    for title, things in given.items():
        layout = laid_out("irregular_64ha", parcels=200, **things)
        panels.append((f"{title}: I = {figure(layout, 'irregularity_mean'):.3f}", layout))
    return sheet(panels, columns=2, ratio=0.9)


def rights_of_way() -> Figure:
    """Rights-of-way and net parcels: corners, turning heads, a given street of 24 m."""
    streets = frame(in_land([(-0.1, 0.35), (0.45, 0.27), (1.1, 0.4)]), width_m=[24.0])
    layout = laid_out("irregular_64ha", parcels=200, pattern="cul-de-sac", streets=streets)
    drawn = blank(2 * COLUMN, COLUMN)
    windows = {"the whole": (-0.02, -0.02, 1.02, 1.02), "a part of it": (0.15, 0.05, 0.5, 0.4)}
    for k, (title, (x0, y0, x1, y1)) in enumerate(windows.items()):
        ax = drawn.add_axes((k / 2 + 0.01, 0.01, 0.48, 0.92))
        layout.frame("right_of_way").plot(ax=ax, color="#cfcbbd")
        layout.frame("net_parcels").plot(ax=ax, color="#f4f2ea", edgecolor="#8d8a80", linewidth=0.6)
        layout.streets.plot(ax=ax, color="#b08a2c", linewidth=0.6, linestyle="--")
        (left, low), (right, high) = in_land([(x0, y0), (x1, y1)]).coords
        ax.set(xlim=(left, right), ylim=(low, high), aspect="equal")
        ax.axis("off")
        net = figure(layout, "right_of_way_pct")
        ax.set_title(f"{title}: {net:.0f} % right-of-way" if k == 0 else title, loc="left", size=11)
    return drawn


@cache
def land() -> gpd.GeoSeries:
    """The land of most pictures."""
    return gpd.read_file(SAMPLES / "irregular_64ha.gpkg").geometry


def in_land(places: Sequence[tuple[float, float]]) -> LineString:
    """A line through places given as shares of the land's width and height."""
    x0, y0, x1, y1 = land().total_bounds
    return LineString([(x0 + a * (x1 - x0), y0 + b * (y1 - y0)) for a, b in places])


def frame(*geometry: object, **columns: object) -> gpd.GeoDataFrame:
    """Geometries as a layer in the CRS of the land."""
    return gpd.GeoDataFrame(columns, geometry=list(geometry), crs=land().crs)


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


STREETS = ("aleppo", "auckland", "salt_lake_city", "schaan", "wuhan")
"""Sample networks of streets."""


@cache
def blocks_of(name: str) -> GeoLayers:
    """Blocks between the streets of a sample."""
    return up.find_blocks(SAMPLES / f"streets_{name}.gpkg")


def strategies(name: str) -> Figure:
    """Blocks of a real network of streets in every strategy (Vanegas 2012, section 4)."""
    ways: dict[str, dict[str, object]] = {
        "skeleton": {},
        "skeleton with an open patio": {"offset": 32},
        "hybrid": {"strategy": "hybrid", "offset": 32},
        "obb": {"strategy": "obb"},
        "obb without access": {"strategy": "obb", "street_access": 0},
        "streamline": {"strategy": "streamline"},
    }
    panels: list[Panel] = []
    for title, way in ways.items():
        made = up.subdivide(blocks_of(name), min_area=400, **way)
        lots = made.parcels[made.parcels.land_use != "patio"]
        four = (lots.sides == 4).mean()
        panels.append((f"{title}: {len(lots):,} parcels, {four:.0%} with four sides", made))
    x0, y0, x1, y1 = blocks_of(name).blocks.total_bounds
    return sheet(panels, columns=3, ratio=(y1 - y0) / (x1 - x0))


def last_levels() -> Figure:
    """Co-generation whose last level each strategy makes."""
    panels: list[Panel] = []
    for strategy in ("streamline", "skeleton", "obb", "hybrid"):
        layout = laid_out("irregular_64ha", min_area=1500, strategy=strategy)
        mean = figure(layout, "irregularity_mean")
        count = figure(layout, "parcels")
        panels.append((f"{strategy}: {count:.0f} parcels, I = {mean:.3f}", layout))
    return sheet(panels, columns=2, ratio=0.9)


CHANGES = {
    "kept": "#eceade",
    "moved": "#b9d4e8",
    "split": "#f3c98b",
    "new": "#ef9f7d",
}
"""Colours of what became of parcels."""


def edits() -> Figure:
    """Parcels that stay themselves while streets are edited (Vanegas 2012, Fig. 7)."""
    x0, y0 = 500_000.0, 5_250_000.0
    streets = [LineString([(x0 + 150 * i, y0), (x0 + 150 * i, y0 + 330)]) for i in range(4)]
    streets += [LineString([(x0, y0 + 110 * j), (x0 + 450, y0 + 110 * j)]) for j in range(4)]
    bent = LineString([(x0, y0 + 110), (x0 + 225, y0 + 135), (x0 + 450, y0 + 110)])
    new = LineString([(x0 + 225, y0 + 220), (x0 + 225, y0 + 330)])
    wider = [12.0] * 5 + [26.0] + [12.0] * 2
    states = {
        "before": (streets, [12.0] * 8),
        "a street bent": ([*streets[:5], bent, *streets[6:]], [12.0] * 8),
        "a street widened": (streets, wider),
        "a street added": ([*streets, new], [12.0] * 9),
    }
    drawn = blank(2 * COLUMN, 1.65 * COLUMN)
    before, house = None, None
    for k, (title, (lines, widths)) in enumerate(states.items()):
        layer = gpd.GeoDataFrame({"width_m": widths}, geometry=lines, crs="EPSG:32632")
        made = up.subdivide(up.find_blocks(layer), min_area=350, previous=before)
        before = made if before is None else before
        ax = drawn.add_axes(((k % 2) / 2 + 0.01, 0.51 - (k // 2) / 2, 0.48, 0.45))
        parcels, label = made.parcels, title
        colour = CHANGES["kept"]
        if "changes" in made.made.names:
            log = made.changes[made.changes.change.isin(CHANGES)]
            change = log.set_index("new_id").change
            parcels = parcels.assign(change=parcels.parcel_id.map(change))
            colour = parcels.change.map(CHANGES)
            counted = parcels.change.value_counts()
            label += ": " + ", ".join(f"{n} {name}" for name, n in counted.items())
        parcels.plot(ax=ax, color=colour, edgecolor="#77736a", linewidth=0.5)
        if house is None:
            at = Point(x0 + 180, y0 + 140)
            house = int(parcels.parcel_id[parcels.contains(at)].iloc[0])
        parcels[parcels.parcel_id == house].plot(ax=ax, color="#2b5f9e")
        ax.axis("off")
        ax.set_title(label, loc="left", size=11)
    return drawn


PICTURES: dict[str, Callable[[], Figure]] = {
    "lands": six_lands,
    "sizes": three_sizes,
    "weights": three_weights,
    "patterns": three_patterns,
    "optimization": optimization,
    "given": given_things,
    "rights_of_way": rights_of_way,
    "orientation": two_orientations,
    "dimensions": dimensions,
    **{f"strategies_{name}": partial(strategies, name) for name in STREETS},
    "last_levels": last_levels,
    "edits": edits,
    **gallery_steering.PICTURES,
    **gallery_real.PICTURES,
    **gallery_parcels.PICTURES,
}
"""Name of a picture's file, and the function that makes it."""


def main() -> None:
    """Make the pictures that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=", ".join(PICTURES))
    names = parser.parse_args().names or list(PICTURES)
    IMAGES.mkdir(parents=True, exist_ok=True)
    for name in names:
        write(PICTURES[name](), IMAGES / f"{name}.png")
        print(name)


if __name__ == "__main__":
    main()
