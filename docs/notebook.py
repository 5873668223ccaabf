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
    """\
# A layout for Mauren, and the Mauren that is there

Parcels and streets are laid out on the boundary of a municipality in Liechtenstein, measured, and
compared with the streets that OpenStreetMap had there in 2013. Everything comes from the folder
`sample_data`: no network is needed.""",
    """\
import geopandas as gpd
import urban_processing as up

land = gpd.read_file("../sample_data/mauren.gpkg")
land.to_crs(land.estimate_utm_crs()).area / 1e4  # hectares""",
    """\
`osm=True` instead of `osm_file=…` fetches the streets from OpenStreetMap. Here the extract is at
hand. First the streets alone: how dense is what is there?""",
    """\
streets = "../sample_data/osm_liechtenstein.osm.bz2"
layout = up.cogenerate(land, parcels=900, pattern="loop", seed=0)
layout""",
    """\
layout.plot(title="Mauren, laid out anew");""",
    """\
`measure` gives some hundred figures; `parcels`, `streets` and `blocks` are GeoDataFrames.""",
    """\
measured = up.measure(layout)
names = ["parcels", "quads_pct", "irregularity_mean", "frontage_mean_m", "blocks_per_km2",
         "street_km_per_km2", "intersections_per_km2", "dead_ends_per_km2", "orientation_order",
         "meshedness", "parcel_detour"]
table = measured.metrics.set_index("metric")
table.loc[names, ["value", "unit"]].round(3)""",
    """\
measured.parcels.groupby("sides")[["area_m2", "frontage_m", "irregularity"]].mean().round(3)""",
    """\
Now side by side. Each row says by how much the layout differs from what is there, and who is
better where everybody would say the same.""",
    """\
found = up.compare(layout, osm_file=streets, names=["layout"])
rows = found.comparison.set_index("metric")
rows[["value", "reference_value", "unit", "difference", "better"]].dropna(
    subset=["value", "reference_value"]
).round(3)""",
    """\
Distributions, with the distance that chance alone would make of samples of these sizes.""",
    """\
found.distances.dropna(subset=["wasserstein"]).set_index("distribution")[
    ["n_side", "n_reference", "median_side", "median_reference", "wasserstein",
     "wasserstein_low", "wasserstein_high", "wasserstein_noise", "more_than_noise"]
].round(2)""",
    """\
import matplotlib.pyplot as plt

figure, axes = plt.subplots(1, 2, figsize=(11, 6), sharex=True, sharey=True)
for axis, (name, side) in zip(axes, found.sides.items()):
    side.boundary.boundary.plot(ax=axis, color="0.6", linewidth=0.8)
    side.streets.plot(ax=axis, color="black", linewidth=0.8)
    axis.set_title(f"{name}: {side.metric('street_km_per_km2'):.1f} km of streets for each km²")
    axis.set_axis_off()
figure.text(0.01, 0.01, "Right: © OpenStreetMap contributors, ODbL 1.0", fontsize=8)
figure.tight_layout()""",
    """\
The report has all this and more on one page of HTML: maps, distributions, the certificate, and a
glossary with the definition and source of every figure.""",
    """\
found.report("mauren.html", overwrite=True).stat().st_size < 5e6""",
)


def notebook() -> nbformat.NotebookNode:
    """Return the notebook, not yet executed."""
    cells = []
    for number, text in enumerate(CELLS):
        prose = text[0] in "#`" or text.split()[0] in ("Now", "Distributions,", "The")
        make = nbformat.v4.new_markdown_cell if prose else nbformat.v4.new_code_cell
        cells.append(make(text, id=f"cell-{number}"))
    return nbformat.v4.new_notebook(
        cells=cells,
        metadata={
            "kernelspec": {"name": "python3", "display_name": "Python 3", "language": "python"}
        },
    )


def main() -> None:
    """Execute the notebook where it lies and write it."""
    made = notebook()
    NotebookClient(made, timeout=300, resources={"metadata": {"path": NOTEBOOK.parent}}).execute()
    nbformat.write(made, NOTEBOOK)


if __name__ == "__main__":
    main()
