"""Write and execute the notebook that compares a layout with OpenStreetMap.

Run from the folder of the repository, with nbclient and ipykernel installed::

    .venv/bin/python docs/notebook.py
"""

from __future__ import annotations

from pathlib import Path

import nbformat
from nbclient import NotebookClient

NOTEBOOK = Path(__file__).with_name("compare.ipynb")

CELLS = (
    (
        "markdown",
        """\
# A layout for Mauren, and the Mauren that is there

Parcels and streets are laid out on the boundary of a municipality in Liechtenstein, measured, and
compared with the streets that OpenStreetMap had there in 2013. Everything comes from the folder
`sample_data`: no network is needed.""",
    ),
    (
        "code",
        """\
import geopandas as gpd
import matplotlib.pyplot as plt

import urban_processing as up

land = gpd.read_file("../sample_data/mauren.gpkg")
layout = up.cogenerate(land, parcels=520, seed=0)
layout""",
    ),
    ("code", 'layout.plot(title="Mauren, laid out anew")'),
    (
        "markdown",
        "`measure` gives some hundred figures. Parcels, streets and blocks are GeoDataFrames with "
        "their own.",
    ),
    (
        "code",
        """\
measured = up.measure(layout)
names = [
    "parcels", "quads_pct", "irregularity_mean", "frontage_mean_m", "land_use_streets_pct",
    "blocks_per_km2", "street_km_per_km2", "intersections_per_km2", "orientation_order",
    "meshedness", "parcel_detour",
]
measured.metrics.set_index("metric").loc[names, ["value", "unit"]].round(3)""",
    ),
    (
        "code",
        """\
shape = ["area_m2", "frontage_m", "irregularity", "neighbours"]
measured.parcels.groupby("sides")[shape].mean().round(3)""",
    ),
    (
        "markdown",
        "Now side by side with what is there; `osm=True` in place of `osm_file` would fetch it. "
        "Dual carriageways, roundabouts and slip roads become single lines and junctions.",
    ),
    (
        "code",
        """\
streets = "../sample_data/osm_liechtenstein.osm.bz2"
found = up.compare(layout, names=["layout"], osm_file=streets)

figure, axes = plt.subplots(1, 2, figsize=(11, 6), sharex=True, sharey=True)
for axis, (name, side) in zip(axes, found.sides.items(), strict=True):
    side.blocks.plot("area_m2", ax=axis, cmap="YlGnBu", vmin=0, vmax=200_000, alpha=0.6)
    side.streets.plot(ax=axis, color="black", linewidth=0.7)
    axis.set_title(f"{name}: {side.metric('street_km_per_km2'):.1f} km of streets for each km²")
    axis.set_axis_off()
figure.text(0.51, 0.02, "© OpenStreetMap contributors, ODbL 1.0", fontsize=8)
figure.tight_layout()""",
    ),
    (
        "markdown",
        "Each row says by how much the layout differs from what is there, and who is better by "
        "what is commonly wanted. Figures of parcels are left out: OpenStreetMap has none.",
    ),
    (
        "code",
        """\
rows = found.comparison.set_index("metric").dropna(subset=["value", "reference_value"])
rows[["value", "reference_value", "unit", "difference", "better"]].round(3)""",
    ),
    (
        "markdown",
        "Distributions: how far values are to be moved in the mean to make one the other "
        "(`wasserstein`), with its interval, and how far samples of these sizes are apart by "
        "chance.",
    ),
    (
        "code",
        """\
distances = found.distances.dropna(subset=["wasserstein"]).set_index("distribution")
distances[
    ["median_side", "median_reference", "unit", "wasserstein", "wasserstein_low",
     "wasserstein_high", "wasserstein_noise", "more_than_noise"]
].round(1)""",
    ),
    (
        "markdown",
        "The report has all this and more on one page of HTML: maps, distributions, the "
        "certificate of the layout, and a glossary with the definition and source of every figure.",
    ),
    ("code", 'found.report("mauren.html", overwrite=True)'),
)


def notebook() -> nbformat.NotebookNode:
    """Return the notebook, not yet executed."""
    make = {"markdown": nbformat.v4.new_markdown_cell, "code": nbformat.v4.new_code_cell}
    return nbformat.v4.new_notebook(
        cells=[make[kind](text, id=f"cell-{k}") for k, (kind, text) in enumerate(CELLS)],
        metadata={
            "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}
        },
    )


def executed(made: nbformat.NotebookNode, folder: Path) -> nbformat.NotebookNode:
    """Run a notebook in a folder; what differs from run to run is taken off."""
    NotebookClient(made, timeout=300, resources={"metadata": {"path": str(folder)}}).execute()
    for cell in made.cells:
        cell.metadata.pop("execution", None)
    return made


def main() -> None:
    """Execute the notebook where it lies and write it."""
    nbformat.write(executed(notebook(), NOTEBOOK.parent), NOTEBOOK)


if __name__ == "__main__":
    main()
